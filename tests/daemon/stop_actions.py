"""What happens at the end of a test: by hand, by a command, by a coil of the module; and that a test that goes on
measuring touches nothing."""
import pathlib
import sqlite3

from daemon_support import Daemon, Simulator, configuration, database, run, scratch, wait_until

# One channel, wide tolerance, so that the declaration comes soon: these tests are about what follows it.
SOON = {"test": {"name": "soon"}, "identification": {"tolerance_C": 2.0, "every_s": 300.0}, "required": ["T2"]}


def events(folder):
    with database(folder) as stored:
        return [(row["kind"], row["message"]) for row in stored.execute("SELECT kind, message FROM events ORDER BY id")]


def end_of(folder):
    with database(folder) as stored:
        return stored.execute("SELECT state, stop_reason FROM tests").fetchone()


def a_command_is_told_what_ended():
    with scratch() as folder, Simulator("--lockstep", "15") as sim:
        told = pathlib.Path(folder) / "told"
        script = f'echo "$THERMBAL_TEST_ID|$THERMBAL_TEST_NAME|$THERMBAL_REASON" > {told}'
        config = configuration(folder, {"transport": "tcp", "host": "::1", "port": sim.port},
                               stop={"action": "command", "command": ["/bin/sh", "-c", script]}, **SOON)
        with Daemon(folder, config, "--lockstep", "--exit-when-ended") as daemon:
            assert daemon.wait_ended(240) == 0, daemon.log_text()
        wait_until(told.exists, "the command's file", 10)
        assert told.read_text().startswith("1|soon|every required channel is declared"), told.read_text()
        assert end_of(folder)[0] == "stopped"
        kinds = [kind for kind, _ in events(folder)]
        assert kinds.index("declared") < kinds.index("all_declared") < kinds.index("stopped"), kinds


def a_broken_sensor_that_alone_holds_the_test_is_said():
    with scratch() as folder, Simulator("--lockstep", "15", "--fault", "open:T3@600") as sim:
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                               **(SOON | {"required": ["T2", "T3"]}))
        with Daemon(folder, config, "--lockstep") as daemon:
            daemon.wait_for("status", lambda s: "T3 is dead" in s.get("test", {}).get("reason", ""), "a dead sensor", 60)
            held = wait_until(lambda: [m for kind, m in events(folder) if kind == "held"], "the event", 240)
            daemon.wait_for("status", lambda s: s["state"] == "running", "a test that goes on", 10)
        assert held == ["every other required channel is declared; T3 is dead: mend the sensor, make the channel not "
                        "required, or stop by hand"], held


def a_coil_of_the_module_is_cleared():
    with scratch() as folder:
        with Simulator("--lockstep", "15") as sim:
            config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                                   stop={"action": "write_coil", "line": "module", "unit_id": 1, "address": 0, "value": 0},
                                   **SOON)
            with Daemon(folder, config, "--lockstep") as daemon:
                daemon.wait_for("status", lambda s: s["state"] == "stopped", "the end of the test", 240)
                wait_until(lambda: any(kind == "stop_carried_out" for kind, _ in events(folder)), "the written coil", 20)
            written = [line for line in sim.lines() if line.startswith("wrote")]
        assert len(written) == 1 and written[0].startswith("wrote unit 1 coil 0 = 0"), written


def a_stop_that_fails_is_said():
    with scratch() as folder, Simulator("--lockstep", "15") as sim:
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                               stop={"action": "write_register", "line": "module", "unit_id": 1, "address": 900, "value": 1},
                               **SOON)
        with Daemon(folder, config, "--lockstep") as daemon:
            daemon.wait_for("status", lambda s: s["state"] == "stopped", "the end of the test", 240)
            failed = wait_until(lambda: [m for kind, m in events(folder) if kind == "stop_failed"], "the failure", 20)
        assert "holding register 900 of unit 1" in failed[0] and "by hand" in failed[0], failed


def keep_measuring_declares_and_goes_on():
    with scratch() as folder, Simulator("--lockstep", "15") as sim:
        options = {**SOON, "test": {"keep_measuring": True, "max_duration_min": 150.0}}
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                               stop={"action": "write_coil", "line": "module", "unit_id": 1, "address": 0, "value": 0},
                               **options)
        with Daemon(folder, config, "--lockstep") as daemon:
            status = daemon.wait_for("status", lambda s: s["state"] == "declared", "the declaration", 240)
            scans = status["test"]["scans"]
            daemon.wait_for("status", lambda s: s["test"]["scans"] > scans + 20, "scans after the declaration", 60)
            assert daemon.call("status")["state"] == "declared"
            wait_until(lambda: end_of(folder)[0] == "stopped", "the longest duration", 120)
        assert "max_duration_min" in end_of(folder)[1]
        written = [line for line in sim.lines() if line.startswith("wrote")]
        assert len(written) == 1, "the machine is stopped, but not before"


def by_hand_and_only_when_there_is_a_test():
    with scratch() as folder, Simulator("--time-scale", "300") as sim:
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port}, test={"start": "manual"})
        with Daemon(folder, config, "--time-scale", "300") as daemon:
            daemon.wait_for("channels", lambda c: c["channels"][4]["quality"] == "good", "a live value without a test")
            try:
                daemon.call("stop_test")
                raise AssertionError("stopped a test that does not run")
            except RuntimeError as refused:
                assert "no test is running" in str(refused)
            assert daemon.call("start_test", name="by hand")["test"] == 1
            daemon.wait_for("status", lambda s: s["test"]["scans"] >= 3, "scans")
            for method, more in (("annotate", {"message": "loose"}), ("curve", {}), ("samples", {})):
                assert "there is no T99" in daemon.answer(method, channel="T99", **more), method
            assert daemon.call("stop_test", reason="coolant\nleak", abort=True)["state"] == "aborted"
            assert "aborted: coolant leak\n" in daemon.log_text(), "one event, one line"
        assert tuple(end_of(folder)) == ("aborted", "coolant\nleak")


def the_longest_duration_aborts():
    with scratch() as folder, Simulator("--lockstep", "15") as sim:
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                               test={"max_duration_min": 5.0}, identification={"every_s": 3600.0})
        with Daemon(folder, config, "--lockstep", "--exit-when-ended") as daemon:
            assert daemon.wait_ended(60) == 0
        state, reason = end_of(folder)
        assert state == "aborted" and "max_duration_min" in reason, (state, reason)
        with sqlite3.connect(f"file:{folder}/test.db?mode=ro", uri=True) as stored:
            assert stored.execute("SELECT max(time_s) FROM scans").fetchone()[0] == 315.0


if __name__ == "__main__":
    run([by_hand_and_only_when_there_is_a_test, the_longest_duration_aborts, a_command_is_told_what_ended,
         a_broken_sensor_that_alone_holds_the_test_is_said, a_coil_of_the_module_is_cleared, a_stop_that_fails_is_said, keep_measuring_declares_and_goes_on])

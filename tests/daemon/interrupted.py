"""What a daemon finds when it starts in the middle of a test: another set-up, a module that stood still, days without it, a
clock that is decades off, a machine that was being stopped."""
import contextlib
import pathlib
import signal
import sqlite3
import subprocess
import time

from daemon_support import (DAEMON, SOURCE, Daemon, Simulator, configuration, database, run, scratch, wait_until)
from modules import line_of, qualities, tell

SCALE = "150"  # a scan each 100 ms
LATER = {"every_s": 3600.0}


def killed_after(daemon, scans):
    daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] >= scans, f"{scans} scans")
    daemon.process.send_signal(signal.SIGKILL)
    daemon.process.wait()


def thermbald(*arguments):
    return subprocess.run([DAEMON, "--profiles", str(SOURCE / "config/profiles"), *arguments], capture_output=True,
                          text=True, timeout=60, check=False)


def rewritten(config, before, after):
    path = pathlib.Path(config)
    text = path.read_text(encoding="utf-8")
    assert before in text, before
    path.write_text(text.replace(before, after), encoding="utf-8")


def test_of(folder, number=1):
    with database(folder) as stored:
        return tuple(stored.execute("SELECT state, stop_reason FROM tests WHERE id = ?", (number,)).fetchone())


def another_set_up_is_refused_and_nothing_is_stored_under_a_wrong_name():
    changes = {
        'name = "T2"\nunit = "u0"\ninput = 2\n': ('name = "T2"\nunit = "u0"\ninput = 3\n', "channel 2 was T2"),
        'name = "T5"\n': ('name = "T55"\n', "channel 5 was T5"),
        "[test]\n": ("[test]\nperiod_s = 30.0\n", "test.period_s was 15 and is 30"),
    }
    with scratch() as folder, Simulator("--time-scale", SCALE) as sim:
        config = configuration(folder, line_of(sim), identification=LATER)
        begun = pathlib.Path(config).read_text(encoding="utf-8")
        with Daemon(folder, config, "--time-scale", SCALE) as daemon:
            killed_after(daemon, 5)
        with database(folder) as stored:
            scans = stored.execute("SELECT count(*) FROM scans").fetchone()[0]
        for before, (after, said) in changes.items():
            rewritten(config, before, after)
            if "input = 3" in after:  # an input is read once
                rewritten(config, 'name = "T3"\nunit = "u0"\ninput = 3\n', 'name = "T3"\nunit = "u0"\ninput = 2\n')
            done = thermbald("--config", config, "--time-scale", SCALE)
            assert done.returncode == 2 and said in done.stderr and "--abort-test" in done.stderr, (done.returncode, done.stderr)
            pathlib.Path(config).write_text(begun, encoding="utf-8")
        with database(folder) as stored:
            assert stored.execute("SELECT count(*) FROM scans").fetchone()[0] == scans
        # What says nothing of the samples may change.
        rewritten(config, 'name = "T5"\n', 'name = "T5"\nrequired = false\nplace = "bed"\n')
        with Daemon(folder, config, "--time-scale", SCALE) as daemon:
            status = daemon.wait_for("status", lambda s: s["test"]["scans"] > scans, "the test to go on")
            assert status["test"]["id"] == 1, status
            daemon.process.send_signal(signal.SIGKILL)
            daemon.process.wait()
        done = thermbald("--config", config, "--abort-test")
        assert (done.returncode, done.stdout) == (0, 'test 1 "thermal balance" is aborted\n'), (done.stdout, done.stderr)
        assert test_of(folder)[0] == "aborted"
        assert thermbald("--config", config, "--abort-test").stdout.endswith("no test is open\n")


def a_frozen_module_stays_frozen():
    with scratch() as folder, Simulator("--time-scale", SCALE, "--control", f"{folder}/sim.sock") as sim:
        config = configuration(folder, line_of(sim), identification=LATER)
        with Daemon(folder, config, "--time-scale", SCALE) as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 30, "scans to learn from")
            tell(f"{folder}/sim.sock", "fault frozen:1")
            wait_until(lambda: qualities(daemon, {"T1", "T16"}) == {"stuck"}, "stuck channels")
            killed_after(daemon, 1)
        with Daemon(folder, config, "--time-scale", SCALE) as daemon:
            wait_until(lambda: "scans are stored" in daemon.log_text(), "the test to go on")
            with database(folder) as stored:
                before = stored.execute("SELECT max(scan) FROM scans WHERE status = 'ok'").fetchone()[0]
            daemon.wait_for("status", lambda s: s["test"]["scans"] > before + 10, "further scans")
            tell(f"{folder}/sim.sock", "clear frozen")
            wait_until(lambda: "thawed" in daemon.log_text(), "the thaw")
            wait_until(lambda: qualities(daemon, {"T1", "T16"}) == {"good"}, "good channels")
        with database(folder) as stored:
            first = stored.execute("SELECT min(scan) FROM samples WHERE quality = 'stuck'").fetchone()[0]
            frozen = stored.execute("SELECT raw, quality FROM samples WHERE channel = 3 AND scan >= ? AND raw IS NOT NULL "
                                    "ORDER BY scan", (first,)).fetchall()
        words = [row["raw"] for row in frozen]
        unchanged = next(i for i, word in enumerate(words) if word != words[0])
        assert unchanged > 15 and {row["quality"] for row in frozen[:unchanged]} == {"stuck"}, [tuple(row) for row in frozen]


def moved_back(folder, seconds):
    """The test began so much earlier, on another boot."""
    with contextlib.closing(sqlite3.connect(f"{folder}/test.db")) as stored, stored:
        stored.execute("UPDATE tests SET started_wall_ns = started_wall_ns - ?, boot_id = 'another'", (seconds * 10**9,))


def hours_without_a_daemon_are_missed_scans_and_soon_written():
    with scratch() as folder, Simulator() as sim:
        config = configuration(folder, line_of(sim), identification=LATER)
        with Daemon(folder, config) as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] >= 1, "a scan")
            daemon.process.send_signal(signal.SIGHUP)  # a terminal that closes
            wait_until(lambda: "measuring goes on" in daemon.log_text(), "the signal")
            killed_after(daemon, 1)
        moved_back(folder, 8 * 3600)
        began = time.monotonic()
        with Daemon(folder, config) as daemon:
            daemon.wait_for("status", lambda s: s["test"]["scans"] >= 1920, "eight hours of scans", 60)
            took_s = time.monotonic() - began
            assert daemon.call("status")["test"]["id"] == 1
        with database(folder) as stored:
            scans = [tuple(row) for row in stored.execute("SELECT scan, status FROM scans ORDER BY scan")]
        assert [scan for scan, _ in scans] == list(range(len(scans)))
        assert sum(status == "missed" for _, status in scans) >= 1918
        print(f"     {len(scans)} scans after {took_s:.1f} s")


def a_clock_that_says_decades_ends_the_test_at_once():
    with scratch() as folder, Simulator() as sim:
        config = configuration(folder, line_of(sim), test={"start": "manual"}, identification=LATER)
        with Daemon(folder, config) as daemon:
            wait_until(lambda: daemon.try_call("start_test") is not None, "a test")
            killed_after(daemon, 1)
        moved_back(folder, 26 * 365 * 86400)
        with Daemon(folder, config) as daemon:
            status = daemon.wait_for("status", lambda s: s["state"] == "aborted", "the end of the test", 10)
            assert "too long to go on" in status["test"]["reason"], status
            assert daemon.memory_bytes() < 100e6
            daemon.wait_for("channels", lambda c: c["channels"][4]["quality"] == "good", "a live value", 40)
            assert daemon.call("start_test")["test"] == 2


def stopping(folder, sim, script):
    return configuration(folder, line_of(sim), required=["T2"], identification={"tolerance_C": 2.0, "every_s": 300.0},
                         stop={"action": "command", "command": ["/bin/sh", "-c", script], "timeout_s": 60.0})


def a_stop_that_was_under_way_is_begun_again_until_it_succeeds():
    with scratch() as folder, Simulator("--lockstep", "15") as sim:
        tries, told = pathlib.Path(folder) / "tries", pathlib.Path(folder) / "told"
        # The first one hangs, as a gateway does that is being switched on; two fail.
        config = stopping(folder, sim, f"""echo x >> {tries}
            case $(wc -l < {tries}) in 1) exec sleep 30;; 2|3) exit 1;; esac
            echo "$THERMBAL_REASON" > {told}""")
        with Daemon(folder, config, "--lockstep") as daemon:
            wait_until(tries.exists, "the stop command", 240)
            assert daemon.call("status")["state"] == "declared"
            daemon.process.send_signal(signal.SIGKILL)
            daemon.process.wait()
        assert test_of(folder)[0] == "declared", "the machine has not stopped"
        with Daemon(folder, config, "--lockstep", "--exit-when-ended") as daemon:
            assert daemon.wait_ended(60) == 0, daemon.log_text()
        with database(folder) as stored:
            kinds = [row["kind"] for row in stored.execute("SELECT kind FROM events ORDER BY id")]
        assert tries.read_text() == "x\n" * 4
        assert "stop_failed" not in kinds and kinds.index("stop_carried_out") < kinds.index("stopped"), kinds
        state, reason = test_of(folder)
        assert state == "stopped" and reason.startswith("every required channel is declared"), (state, reason)
        assert told.read_text().strip() == reason


if __name__ == "__main__":
    run([another_set_up_is_refused_and_nothing_is_stored_under_a_wrong_name, a_frozen_module_stays_frozen,
         hours_without_a_daemon_are_missed_scans_and_soon_written, a_clock_that_says_decades_ends_the_test_at_once,
         a_stop_that_was_under_way_is_begun_again_until_it_succeeds])

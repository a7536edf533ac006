"""kill -9 in the middle of a test, and the daemon goes on with it: every committed scan is there, the gap is marked,
the grid is the old one."""
import re
import signal
import time

from daemon_support import Daemon, Simulator, configuration, database, run, scratch

SCALE = 300  # a scan each 50 ms
PERIOD_NS = 15 * 10**9


def start(folder, port, epoch_ns):
    config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": port},
                           identification={"every_s": 3600.0})
    return Daemon(folder, config, "--time-scale", str(SCALE), "--time-epoch-ns", str(epoch_ns))


def goes_on_with_the_same_test():
    epoch_ns = time.monotonic_ns()
    with scratch() as folder, Simulator("--time-scale", str(SCALE), "--time-epoch-ns", str(epoch_ns)) as sim:
        acknowledged = []
        for life in range(4):
            with start(folder, sim.port, epoch_ns) as daemon:
                def enough(status):
                    test = status["test"]
                    return test is not None and test["scans"] >= (acknowledged[-1] if acknowledged else 0) + 15
                status = daemon.wait_for("status", enough, f"scans in life {life + 1}")
                assert status["state"] == "running", status
                assert status["test"]["id"] == 1, status
                daemon.process.send_signal(signal.SIGKILL)
                daemon.process.wait()
                acknowledged.append(status["test"]["scans"])
            time.sleep(0.4)  # eight scans without a daemon
        with database(folder) as stored:
            scans = stored.execute("SELECT scan, status, scheduled_ns, started_ns FROM scans ORDER BY scan").fetchall()
            samples = stored.execute("SELECT scan, quality, raw, value_C FROM samples ORDER BY scan").fetchall()
            events = [row["kind"] for row in stored.execute("SELECT kind FROM events ORDER BY id")]
        assert [row["scan"] for row in scans] == list(range(len(scans))), "a scan is lost or doubled"
        assert len(scans) >= acknowledged[-1], (len(scans), acknowledged)
        missed = {row["scan"] for row in scans if row["status"] == "missed"}
        assert len(missed) >= 3 * 6, f"the gaps of three restarts are not marked: {sorted(missed)}"
        assert {row["scheduled_ns"] - row["scan"] * PERIOD_NS for row in scans} == {scans[0]["scheduled_ns"]}, \
            "the grid moved"
        for row in samples:
            if row["scan"] in missed:
                assert row["quality"] == "gap" and row["raw"] is None and row["value_C"] is None, dict(row)
            else:
                assert row["quality"] == "good" and row["value_C"] is not None, dict(row)
        assert events.count("resumed") == 3, events


def a_test_that_has_ended_is_not_taken_up_again():
    with scratch() as folder, Simulator("--time-scale", str(SCALE)) as sim:
        with start(folder, sim.port, 0) as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] >= 3, "scans")
            assert daemon.call("stop_test", reason="enough")["state"] == "stopped"
        with start(folder, sim.port, 0) as daemon:
            status = daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] >= 3, "a new test")
            assert status["test"]["id"] == 2, status
        with database(folder) as stored:
            state, reason = stored.execute("SELECT state, stop_reason FROM tests WHERE id = 1").fetchone()
        assert (state, reason) == ("stopped", "enough"), (state, reason)
        assert re.search(r"stopped: enough", daemon.log_text()) is not None


if __name__ == "__main__":
    run([goes_on_with_the_same_test, a_test_that_has_ended_is_not_taken_up_again])

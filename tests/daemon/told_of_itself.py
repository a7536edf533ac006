"""What the daemon says of itself is its own: trouble of an ended test is not the next one's, memory of who started it not its."""
import signal
import time

from daemon_support import Daemon, Simulator, configuration, database, run, scratch, wait_until

SCALE = "60"  # a scan each 250 ms


def kinds(folder, test):
    with database(folder) as stored:
        return [kind for (kind,) in stored.execute(
            "SELECT kind FROM events WHERE test_id = ? AND kind IN ('scans_late', 'scans_missed', 'on_time') ORDER BY id", (test,))]


def the_next_test_begins_on_time():
    with scratch() as folder, Simulator("--time-scale", SCALE) as sim:
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                               identification={"every_s": 3600.0})
        with Daemon(folder, config, "--time-scale", SCALE) as daemon:
            first = daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 4, "some scans")["test"]["id"]
            daemon.process.send_signal(signal.SIGSTOP)
            time.sleep(1.5)
            daemon.process.send_signal(signal.SIGCONT)
            wait_until(lambda: "scans_missed" in kinds(folder, first), "missed scans")
            daemon.call("stop_test", reason="held up")
            second = daemon.call("start_test", name="next")["test"]
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["id"] == second and s["test"]["scans"] > 8, "more scans")
        assert kinds(folder, second)[:1] != ["on_time"], "it had no trouble that could be over"


def memory_of_who_started_it_is_not_told_as_its_own():
    large = bytearray(300_000_000)
    with scratch() as folder, Simulator("--time-scale", SCALE) as sim:
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                               identification={"every_s": 3600.0})
        with Daemon(folder, config, "--time-scale", SCALE) as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 2, "some scans")
            highest = daemon.call("health")["max_rss_bytes"]
    assert 5e6 < highest < 0.5 * len(large), highest


if __name__ == "__main__":
    run([the_next_test_begins_on_time, memory_of_who_started_it_is_not_told_as_its_own])

"""What a test leaves for the next one on the machine: one that ended before its channels were declared leaves nothing."""
from daemon_support import Daemon, Simulator, configuration, database, run, scratch


def lessons_after(method, **params):
    with scratch() as folder, Simulator("--lockstep", "15") as sim:
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                               test={"name": "interrupted", "machine": "M"}, identification={"every_s": 600})
        with Daemon(folder, config, "--lockstep") as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 250, "an hour of scans", 100)
            daemon.call(method, **params)
        with database(folder) as stored:
            return stored.execute("SELECT (SELECT state FROM tests), count(*) FROM archive").fetchone()


def stopped_by_hand():
    assert tuple(lessons_after("stop_test")) == ("stopped", 0)


def aborted():
    assert tuple(lessons_after("stop_test", abort=True)) == ("aborted", 0)


if __name__ == "__main__":
    run([stopped_by_hand, aborted])

"""What a test leaves for the next one on the machine: all that it knew where every required channel was declared, nothing where
it was ended before."""
from daemon_support import Daemon, Simulator, configuration, database, run, scratch


def lessons_after(end_of):
    """State and number of lessons of a test on four channels, once `end_of` has seen to its end."""
    with scratch() as folder, Simulator("--lockstep", "15") as sim:
        config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port}, units=((1, 4),),
                               required=["T3"], test={"machine": "M"}, identification={"every_s": 600})
        with Daemon(folder, config, "--lockstep", "--exit-when-ended") as daemon:
            end_of(daemon)
            daemon.wait_ended(200)
        with database(folder) as stored:
            return tuple(stored.execute("SELECT (SELECT state FROM tests), count(*) FROM archive").fetchone())


def after_an_hour(daemon, **how):
    daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 250, "an hour of scans", 100)
    daemon.call("stop_test", **how)


def declared():
    assert lessons_after(lambda daemon: None) == ("stopped", 1)


def stopped_by_hand():
    assert lessons_after(after_an_hour) == ("stopped", 0)


def aborted():
    assert lessons_after(lambda daemon: after_an_hour(daemon, abort=True)) == ("aborted", 0)


if __name__ == "__main__":
    run([declared, stopped_by_hand, aborted])

"""The disk takes nothing for a while: a full file system, a lock of another program. The daemon goes on reading, says so
once, and writes everything as soon as it can. A database that turns out to be damaged while a test runs is set aside at once, and
the test goes on in a new one."""
import glob
import os
import pathlib
import sqlite3
import subprocess
import tempfile

from daemon_support import Daemon, Simulator, configuration, control, database, run, scratch, wait_until

SCALE = "150"  # a scan each 100 ms


def start(folder, sim):
    config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port}, identification={"every_s": 3600.0})
    return Daemon(folder, config, "--time-scale", SCALE)


def unstored(daemon, least):
    return daemon.wait_for("health", lambda h: h["unstored_scans"] >= least, f"{least} scans in memory")


def everything_is_stored(daemon, folder, kinds):
    daemon.wait_for("health", lambda h: h["unstored_scans"] == 0 and not h["storage_problem"], "everything written")
    scans = daemon.call("status")["test"]["scans"]
    health = daemon.call("health")
    assert health["lost_scans"] == 0 and health["refused_writes"] == 0, health
    with database(folder) as stored:
        rows = [row[0] for row in stored.execute("SELECT scan FROM scans ORDER BY scan")]
        told = [row[0] for row in stored.execute("SELECT kind FROM events WHERE kind LIKE 'storage%' ORDER BY id")]
        good = stored.execute("SELECT count(*) FROM samples WHERE quality = 'good' AND scan < ?", (scans,)).fetchone()[0]
        kept = stored.execute("SELECT count(*) FROM scans WHERE status <> 'missed' AND scan < ?", (scans,)).fetchone()[0]
    assert rows == list(range(len(rows))) and len(rows) >= scans, (len(rows), scans)
    assert good == 16 * kept, (good, kept)
    assert told == kinds, told


def a_lock_of_another_program():
    with scratch() as folder, Simulator("--time-scale", SCALE) as sim, start(folder, sim) as daemon:
        daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 5, "scans")
        other = sqlite3.connect(f"{folder}/test.db", isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        health = unstored(daemon, 5)
        assert "another program holds a lock" in health["storage_problem"], health
        other.execute("ROLLBACK")
        other.close()
        everything_is_stored(daemon, folder, ["storage_away", "storage_back"])


def a_full_file_system():
    with tempfile.TemporaryDirectory(prefix="thermbal-") as mount_point:
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", mount_point], capture_output=True).returncode != 0:
            print("     not as this user: no tmpfs to fill")
            return
        try:
            with Simulator("--time-scale", SCALE) as sim, start(mount_point, sim) as daemon:
                daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 5, "scans")
                filler = pathlib.Path(mount_point) / "filler"
                with open(filler, "wb", buffering=0) as file:
                    try:
                        while file.write(b"x" * 4096):
                            pass
                    except OSError:
                        pass
                health = unstored(daemon, 5)
                assert "full" in health["storage_problem"], health
                filler.unlink()
                everything_is_stored(daemon, mount_point, ["storage_away", "storage_back"])
        finally:
            wait_until(lambda: subprocess.run(["umount", mount_point], capture_output=True).returncode == 0, "umount", 10)


def weigh(path, mebibytes):
    """More than is looked through before the first scan."""
    with sqlite3.connect(path) as stored:
        for _ in range(mebibytes):
            stored.execute("INSERT INTO events (wall_ns, kind, message) VALUES (0, 'annotation', ?)", ("x" * 2**20,))
    stored.close()


def spoil_the_weight(path):
    with open(path, "r+b") as file:
        text = file.read()
        place = text.rindex(b"x" * 4000)
        file.seek(place - place % 4096 - 40 * 4096)
        file.write(b"Z" * 4096)


def a_damage_that_is_found_while_the_test_runs():
    with scratch() as folder, Simulator("--time-scale", SCALE) as sim:
        with start(folder, sim) as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 20, "scans")
        weigh(f"{folder}/test.db", 8)
        spoil_the_weight(f"{folder}/test.db")
        with start(folder, sim) as daemon:
            wait_until(lambda: "database_set_aside" in daemon.log_text(), "the damage to be found")
            status = daemon.call("status")
            assert status["state"] == "running" and status["test"]["id"] == 1, status
            daemon.wait_for("status", lambda s: s["test"]["scans"] > status["test"]["scans"] + 5, "the test to go on")
        assert glob.glob(f"{folder}/test.db.damaged-*"), os.listdir(folder)
        control("verify", "--database", f"{folder}/test.db")
        with database(folder) as stored:
            rows = [row[0] for row in stored.execute("SELECT scan FROM scans ORDER BY scan")]
            kept = stored.execute("SELECT count(*) FROM scans WHERE scan < 20 AND status <> 'missed'").fetchone()[0]
            good = stored.execute("SELECT count(*) FROM samples WHERE scan < 20 AND quality = 'good'").fetchone()[0]
            kinds = [row[0] for row in stored.execute("SELECT kind FROM events ORDER BY id")]
        assert rows == list(range(len(rows))) and len(rows) > 25, rows
        assert kept > 15 and good == 16 * kept, (good, kept)
        assert "started" in kinds and "resumed" in kinds, kinds


if __name__ == "__main__":
    run([a_lock_of_another_program, a_full_file_system, a_damage_that_is_found_while_the_test_runs])

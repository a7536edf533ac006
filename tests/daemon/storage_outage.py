"""The disk takes nothing for a while: a full file system, a lock of another program. The daemon goes on reading, says so
once, and writes everything as soon as it can."""
import pathlib
import sqlite3
import subprocess
import tempfile

from daemon_support import Daemon, Simulator, configuration, database, run, scratch, wait_until

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


if __name__ == "__main__":
    run([a_lock_of_another_program, a_full_file_system])

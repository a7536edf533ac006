"""24 h of a test in accelerated time: no scan missed that was not injected, memory flat, no descriptor leaked."""
from daemon_support import Daemon, Simulator, configuration, database, run, scratch

SCANS = 24 * 240
SILENT = range(2000, 2008)  # injected: the module says nothing for two minutes


def a_day():
    silence = f"silence@{SILENT.start * 15}-{SILENT.stop * 15}"
    with scratch() as folder, Simulator("--lockstep", "15", "--fault", silence) as sim:
        line = {"transport": "tcp", "host": "127.0.0.1", "port": sim.port, "response_timeout_ms": 50}
        config = configuration(folder, line, test={"max_duration_min": 24 * 60.0, "keep_measuring": True}, identification={"every_s": 3600.0})
        with Daemon(folder, config, "--lockstep", "--exit-when-ended") as daemon:
            daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > SCANS // 4, "a quarter", 300)
            memory, descriptors = daemon.memory_bytes(), daemon.descriptors()
            daemon.wait_for("status", lambda s: s["test"]["scans"] > SCANS * 7 // 8, "seven eighths", 300)
            grown, leaked = daemon.memory_bytes() - memory, daemon.descriptors() - descriptors
            assert daemon.wait_ended(120) == 0
        print(f"     memory {memory / 2**20:.1f} MiB at 6 h, {grown / 2**20:+.1f} MiB at 21 h; descriptors {leaked:+d}")
        # What must grow is the window: 16 channels x 8 bytes x 3600 scans are 0.44 MiB; doubling vectors may take twice.
        assert grown < 4 * 2**20 and leaked <= 1, (grown, leaked)
        with database(folder) as stored:
            scans = stored.execute("SELECT scan, status FROM scans ORDER BY scan").fetchall()
            silent = stored.execute("SELECT DISTINCT scan FROM samples WHERE quality = 'communication' ORDER BY scan").fetchall()
            good = stored.execute("SELECT count(*) FROM samples WHERE quality = 'good'").fetchone()[0]
        assert [row["scan"] for row in scans] == list(range(SCANS + 2)), len(scans)
        assert all(row["status"] != "missed" for row in scans)
        assert [row["scan"] for row in silent] == list(SILENT), [row["scan"] for row in silent]
        assert good == 16 * (len(scans) - len(SILENT)), good


if __name__ == "__main__":
    run([a_day])

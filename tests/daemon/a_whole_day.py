"""24 h of a test in accelerated time: no scan missed that was not injected, memory flat, no descriptor leaked, and the log tells an
outage once and the daemon's own figures every hour."""
import re

from daemon_support import Daemon, Simulator, configuration, database, run, scratch

SCANS = 24 * 240
SILENT = range(2000, 2008)  # injected: the module says nothing for two minutes


def numbers(pattern, lines):
    return [int(number) for line in lines for number in re.findall(pattern, line)]


def check_log(log, scans):
    """What the daemon measured of itself, against what was injected."""
    told = [line for line in log if "health:" in line]
    of_the_daemon = [line for line in told if "commit" in line]
    of_the_unit = [line for line in told if "unit u0" in line]
    assert 24 <= len(of_the_daemon) <= 25 and len(of_the_daemon) == len(of_the_unit), told
    ok_late_missed = numbers(r"(\d+) (?:ok|late|missed)", of_the_daemon[-1:])
    assert sum(ok_late_missed) == scans and ok_late_missed[2] == 0, (of_the_daemon[-1], scans)
    assert "WAL" in of_the_daemon[-1] and "database" in of_the_daemon[-1], of_the_daemon[-1]
    # The line may have read once more before it heard that the test has ended.
    answers = sum(numbers(r"(?:to \d+ ms|longer) (\d+)", of_the_unit[-1:]))
    assert answers - (scans - len(SILENT)) in (0, 1), of_the_unit[-1]
    assert numbers(r"timeouts (\d+)", of_the_unit[-1:]) == [len(SILENT)], of_the_unit[-1]
    assert numbers(r"without an answer (\d+)", of_the_unit[-1:]) == [len(SILENT)], of_the_unit[-1]
    assert sum("line_trouble" in line for line in log) == 1, "an outage is told once"


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
            log = daemon.log_path.read_text(encoding="utf-8").splitlines()
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
        check_log(log, len(scans))


if __name__ == "__main__":
    run([a_day])

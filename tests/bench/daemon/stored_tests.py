"""How long requests take while a test runs in a database that holds many tests before it.

  THERMBAL_BIN_DIR=build/bin THERMBAL_SOURCE_DIR=. python3 tests/bench/daemon/stored_tests.py [--tests 10000]"""
import argparse
import pathlib
import sqlite3
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "daemon"))
from daemon_support import Daemon, Simulator, configuration, scratch  # noqa: E402

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--tests", type=int, default=10000)
parser.add_argument("--scans", type=int, default=5, help="of each stored test")
args = parser.parse_args()
SCALE = 60.0


def copy_rows(database, table, column, source, test):
    """The first rows of a table that belong to test `source`, once more for `test`."""
    names = [row[1] for row in database.execute(f"PRAGMA table_info({table})")]
    values = ", ".join(str(test) if name == column else name for name in names)
    condition = f" AND scan < {args.scans}" if table in ("scans", "samples") else ""
    database.execute(f"INSERT INTO {table} ({', '.join(names)}) SELECT {values} FROM {table} "
                     f"WHERE {column} = {source}{condition}")


def multiply(path):
    """Copies of the one test that is stored, and as many entries of the archive."""
    with sqlite3.connect(path) as database:
        source = database.execute("SELECT max(id) FROM tests").fetchone()[0]
        for test in range(source + 1, source + args.tests):
            for table, column in (("tests", "id"), ("channels", "test_id"), ("scans", "test_id"), ("samples", "test_id")):
                copy_rows(database, table, column, source, test)
            database.execute("INSERT INTO archive (machine, test_id, created_wall_ns, spectrum) "
                             "SELECT machine, id, 0, '{}' FROM tests WHERE id = ?", (test,))
        # An entry that is not a spectrum is none: it only weighs.
        database.execute("UPDATE archive SET machine = 'another machine'")
    database.close()


def timed(daemon, method, **params):
    times_ms = []
    for _ in range(30):
        started = time.perf_counter()
        daemon.call(method, **params)
        times_ms.append(1000 * (time.perf_counter() - started))
    print(f"{method:14} median {sorted(times_ms)[15]:7.2f} ms, highest {max(times_ms):7.2f} ms", flush=True)


with scratch() as folder, Simulator("--time-scale", str(SCALE)) as sim:
    config = configuration(folder, {"transport": "tcp", "host": "127.0.0.1", "port": sim.port},
                           identification={"every_s": 60.0})
    with Daemon(folder, config, "--time-scale", str(SCALE)) as daemon:
        daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > args.scans, "the test to copy", 60)
        daemon.call("stop_test")
    multiply(f"{folder}/test.db")
    size = pathlib.Path(f"{folder}/test.db").stat().st_size
    with sqlite3.connect(f"file:{folder}/test.db?mode=ro", uri=True) as database:
        print(f"{database.execute('SELECT count(*) FROM tests').fetchone()[0]} tests, {size / 2**20:.0f} MiB")
    started = time.perf_counter()
    with Daemon(folder, config, "--time-scale", str(SCALE)) as daemon:
        daemon.wait_for("status", lambda s: True, "an answer", 60)
        print(f"answers {time.perf_counter() - started:.2f} s after its start")
        daemon.wait_for("status", lambda s: s["test"] and s["test"]["scans"] > 100, "100 scans of the next test", 120)
        for method, params in (("status", {}), ("channels", {}), ("samples", {}), ("predictions", {}), ("events", {}),
                               ("health", {})):
            timed(daemon, method, **params)

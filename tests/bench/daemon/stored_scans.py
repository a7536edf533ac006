"""Databases that would take days to measure: tests copied many times, an open test made longer."""
import contextlib
import csv
import sqlite3
import subprocess
import time

import numpy


@contextlib.contextmanager
def writing(path):
    with contextlib.closing(sqlite3.connect(path)) as database:
        yield database
        database.commit()


def copy_rows(database, table, column, source, test, condition):
    """The rows of a table that belong to test `source`, once more for `test`."""
    names = [row[1] for row in database.execute(f"PRAGMA table_info({table})")]
    values = ", ".join(str(test) if name == column else name for name in names)
    database.execute(f"INSERT INTO {table} ({', '.join(names)}) SELECT {values} FROM {table} "
                     f"WHERE {column} = {source}{condition}")


def copy_newest_test(path, copies, scans):
    """So many copies of the newest test, which has ended, with its first scans, and as many entries of the archive."""
    with writing(path) as database:
        source = database.execute("SELECT max(id) FROM tests").fetchone()[0]
        for test in range(source + 1, source + 1 + copies):
            for table, column in (("tests", "id"), ("channels", "test_id"), ("scans", "test_id"), ("samples", "test_id")):
                condition = f" AND scan < {scans}" if table in ("scans", "samples") else ""
                copy_rows(database, table, column, source, test, condition)
            database.execute("INSERT INTO archive (machine, test_id, created_wall_ns, spectrum) "
                             "SELECT machine, id, 0, '{}' FROM tests WHERE id = ?", (test,))
        # An entry that is not a spectrum is none: it only weighs.
        database.execute("UPDATE archive SET machine = 'another machine'")


def warm_up(simulator, minutes, period_s, channels):
    """Readings of thermbal-sim's plant, a row each period_s: 0.05 C of noise, steps of 0.1 C. From the 17th channel on its sensors
    begin again, as with --units 16,16."""
    recorded = subprocess.run([simulator, "--csv", "/dev/stdout", "--duration-min", str(minutes + 1), "--noise-C", "0",
                               "--round-C", "0"], check=True, capture_output=True, text=True).stdout
    rows = numpy.array(list(csv.reader(line for line in recorded.splitlines() if line[0].isdigit())), dtype=float)
    times_s = numpy.arange(0.0, 60.0 * minutes, period_s)
    noise = numpy.random.default_rng(1)
    columns = [numpy.interp(times_s, rows[:, 0], rows[:, 1 + channel]) for channel in range(16)]
    readings = [columns[channel % 16] + noise.normal(0.0, 0.05, len(times_s)) for channel in range(channels)]
    return numpy.round(numpy.array(readings).T, 1)


def lengthen_open_test(path, simulator, minutes):
    """Gives the open test of a database the scans of so many minutes instead of those it has, as if another boot had measured them
    up to now."""
    with writing(path) as database:
        test, period_s = database.execute("SELECT id, period_s FROM tests WHERE state = 'running'").fetchone()
        channels = database.execute("SELECT count(*) FROM channels WHERE test_id = ?", (test,)).fetchone()[0]
        for table in ("samples", "identifications", "scans"):
            database.execute(f"DELETE FROM {table} WHERE test_id = ?", (test,))
        readings_C = warm_up(simulator, minutes, period_s, channels)
        period_ns = round(1e9 * period_s)
        started_ns = time.time_ns() - len(readings_C) * period_ns
        database.execute("UPDATE tests SET boot_id = 'another', started_wall_ns = ? WHERE id = ?", (started_ns, test))
        database.executemany(
            "INSERT INTO scans (test_id, scan, status, time_s, scheduled_ns, started_ns, finished_ns, wall_ns) "
            "VALUES (?, ?, 'ok', ?, ?, ?, ?, ?)",
            ((test, k, k * period_s, k * period_ns, k * period_ns, k * period_ns, started_ns + k * period_ns)
             for k in range(len(readings_C))))
        database.executemany(
            "INSERT INTO samples (test_id, scan, channel, raw, value_C, quality) VALUES (?, ?, ?, ?, ?, 'good')",
            ((test, k, channel, round(10 * value_C), value_C)
             for k, row_C in enumerate(readings_C) for channel, value_C in enumerate(row_C.tolist())))

#!/usr/bin/python3
"""A month in accelerated time: thermbald and thermbal-sim as they are shipped, a random mixture of all faults, the daemon killed or
ended and started again at random moments, its wall clock set forward and back, a new test every half day. Memory, descriptors,
WAL and database over the time, as figures and as a plot.

    THERMBAL_BIN_DIR=build/release/bin THERMBAL_SOURCE_DIR=. tests/faults/month.py [--days 30] [--plot month.svg]

A scan that is due every 15 s is due every 15 s / --speed here (0.25 s, less does not fit the line's timeouts; 30 days take 12 h).
--speed 300 --period-s 75 --identify-every-h 24 takes 2.4 h. Ends with 1 when a value that is stored as good is none that the
module measured during that scan, a scan has no row, or something has grown that should not.
"""
import argparse
import json
import os
import pathlib
import random
import signal
import statistics
import struct
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.environ["THERMBAL_SOURCE_DIR"], "tests", "daemon"))
from daemon_support import BIN, DAEMON, SOURCE, Daemon, Simulator, configuration, database, scratch  # noqa: E402
from day import during, measured, scenario  # noqa: E402

DAY_S = 86400.0
TIMEOUT_S = 0.01


class SteppedDaemon(Daemon):
    """With a wall clock of its own, and started again in the same folder as often as it takes."""

    def __init__(self, folder, config, library):
        self.folder, self.config, self.library = folder, config, library
        self.log_path = pathlib.Path(folder) / "daemon.log"
        self.log = open(self.log_path, "ab")
        self.offset = pathlib.Path(folder) / "clock_step"
        self.step_to(0)
        self.start()

    def step_to(self, offset_ns):
        with open(self.offset, "r+b" if self.offset.exists() else "wb") as file:
            file.write(struct.pack("=q", offset_ns))

    def start(self):
        self.process = subprocess.Popen(
            [DAEMON, "--config", self.config, "--profiles", str(SOURCE / "config/profiles")], stdin=subprocess.DEVNULL,
            stdout=self.log, stderr=self.log,
            env={**os.environ, "LD_PRELOAD": str(self.library), "THERMBAL_CLOCK_STEP": str(self.offset)})

    def end(self, how):
        self.process.send_signal(how)
        self.process.wait(timeout=60)


def bytes_of(path):
    try:
        return os.path.getsize(path)
    except OSError:
        return 0


def look(daemon, folder, day):
    return {"day": day, "memory_MiB": daemon.memory_bytes() / 2**20, "descriptors": daemon.descriptors(),
            "wal_MiB": bytes_of(f"{folder}/test.db-wal") / 2**20, "database_MiB": bytes_of(f"{folder}/test.db") / 2**20}


def live(daemon, folder, days, speed, seed):
    """Everything that happens to the daemon; what was seen meanwhile."""
    rng, begin, seen = random.Random(seed), time.monotonic(), []
    happened = {"killed": 0, "ended": 0, "clock_steps": 0, "tests": 1}
    due = {"restart": rng.expovariate(1 / 0.15), "step": rng.expovariate(1 / 0.25), "test": 0.5}
    while (day := (time.monotonic() - begin) * speed / DAY_S) < days:
        if day >= due["restart"]:
            how = rng.choice((signal.SIGKILL, signal.SIGTERM))
            daemon.end(how)
            happened["killed" if how == signal.SIGKILL else "ended"] += 1
            time.sleep(rng.uniform(0.0, 2.0))
            daemon.start()
            daemon.wait_for("status", lambda s: True, "the daemon after a restart", 300)
            due["restart"] = day + rng.expovariate(1 / 0.15)
        if day >= due["step"]:
            daemon.step_to(round(rng.choice((-1, 1)) * 10 ** rng.uniform(0, 4) * 1e9))
            happened["clock_steps"] += 1
            due["step"] = day + rng.expovariate(1 / 0.25)
        if day >= due["test"]:
            daemon.call("stop_test")
            daemon.call("start_test", name=f"day {day:.1f}")
            happened["tests"] += 1
            due["test"] = day + 0.5
        if daemon.process.poll() is not None:
            raise AssertionError(f"the daemon ended by itself: {daemon.log_text()}")
        seen.append(look(daemon, folder, day))
        time.sleep(0.5)
    return seen, happened


def check_scans(folder, reads, epoch_ns, speed):
    figures = {"scans": 0, "missed": 0, "good_values": 0, "wrong_values": 0, "tests_with_a_gap": 0}
    with database(folder) as stored:
        for (test,) in stored.execute("SELECT id FROM tests ORDER BY id").fetchall():
            scans = stored.execute("SELECT scan, started_ns, finished_ns FROM scans WHERE test_id = ? ORDER BY scan", (test,)).fetchall()
            figures["tests_with_a_gap"] += [row["scan"] for row in scans] != list(range(len(scans)))
            times = {row["scan"]: (row["started_ns"], row["finished_ns"]) for row in scans if row["started_ns"] is not None}
            figures["scans"] += len(scans)
            figures["missed"] += len(scans) - len(times)
            for scan, channel, raw in stored.execute(
                    "SELECT scan, channel, raw FROM samples WHERE test_id = ? AND quality = 'good'", (test,)):
                from_s, to_s = ((ns - epoch_ns) * 1e-9 * speed for ns in times[scan])
                words = during(reads, 1 + channel // 8, from_s - 1e-3 * speed, to_s)
                figures["good_values"] += 1
                figures["wrong_values"] += not any(read[channel % 8] == raw for read in words)
    return figures


def growth(seen):
    """Between the first and the last third: what must not grow with the months. A fresh process is smaller than one at work,
    so that medians are compared."""
    third = max(1, len(seen) // 3)
    early, late = seen[:third], seen[-third:]
    return {key: statistics.median(one[key] for one in late) - statistics.median(one[key] for one in early)
            for key in ("memory_MiB", "descriptors", "wal_MiB")}


def plot(path, seen, period_s):
    """Four curves over the days, as SVG."""
    width, height, left = 720, 130, 70
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width + left + 20}" height="{4 * height + 40}" '
             'font-family="sans-serif" font-size="11">', '<rect width="100%" height="100%" fill="white"/>']
    days = max(one["day"] for one in seen)
    step = max(1, len(seen) // 500)
    for number, (key, name) in enumerate((("memory_MiB", "memory, MiB"), ("descriptors", "descriptors"),
                                          ("wal_MiB", "WAL, MiB"), ("database_MiB", "database, MiB"))):
        top, most = number * height + 15, max(max(one[key] for one in seen), 1e-9)
        points = " ".join(f"{left + one['day'] / days * width:.1f},{top + (1 - one[key] / most) * (height - 30):.1f}"
                          for one in seen[::step])
        parts += [f'<text x="4" y="{top + 10}">{name}</text>', f'<text x="4" y="{top + 24}">0 to {most:.1f}</text>',
                  f'<path d="M{left},{top} V{top + height - 30} H{left + width}" fill="none" stroke="#999"/>',
                  f'<polyline points="{points}" fill="none" stroke="#1f5fa8" stroke-width="1"/>']
    parts.append(f'<text x="{left}" y="{4 * height + 20}">0 to {days:.1f} days, one scan every {period_s:g} s</text></svg>')
    pathlib.Path(path).write_text("\n".join(parts), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--days", type=float, default=30.0)
    parser.add_argument("--speed", type=float, default=60.0, help="15 s of the month in 15 s / SPEED")
    parser.add_argument("--period-s", type=float, default=15.0, help="from scan to scan, of the month")
    parser.add_argument("--identify-every-h", type=float, default=1.0, help="of the month; at high speed one takes longer than that")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plot", default="month.svg")
    parser.add_argument("--library", default=str(BIN.parent / "tests" / "libclock_step.so"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    epoch_ns = time.monotonic_ns()
    with scratch() as folder:
        scenario(f"{folder}/month.toml", "tcp", arguments.days * 24.0, TIMEOUT_S, arguments.seed)
        with Simulator("--units", "8,8", "--scenario", f"{folder}/month.toml", "--log-truth", f"{folder}/truth.csv", "--noise-C",
                       "2.0", "--time-scale", str(arguments.speed), "--time-epoch-ns", str(epoch_ns)) as sim:
            line = {"transport": "tcp", "host": "127.0.0.1", "port": sim.port, "connect_timeout_ms": 10,
                    "response_timeout_ms": TIMEOUT_S * 1e3, "reconnect_pause_ms": 5}
            config = configuration(folder, line, units=((1, 8), (2, 8)), profile="generic-8x-int16",
                                   test={"period_s": arguments.period_s / arguments.speed},
                                   identification={"every_s": arguments.identify_every_h * 3600.0 / arguments.speed, "workers": 1})
            with SteppedDaemon(folder, config, arguments.library) as daemon:
                seen, happened = live(daemon, folder, arguments.days, arguments.speed, arguments.seed)
            sim.stop()
        figures = check_scans(folder, measured(f"{folder}/truth.csv"), epoch_ns, arguments.speed)
    plot(arguments.plot, seen, arguments.period_s)
    grown = growth(seen)
    most = {key: round(max(one[key] for one in seen), 2) for key in seen[0]}
    print(json.dumps({"happened": happened, "checked": figures, "most": most,
                      "grown": {key: round(value, 2) for key, value in grown.items()}}, indent=1))
    bad = (figures["wrong_values"] or figures["tests_with_a_gap"] or grown["memory_MiB"] > 8 or grown["descriptors"] > 1
           or most["wal_MiB"] > 16)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

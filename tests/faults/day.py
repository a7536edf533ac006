#!/usr/bin/python3
"""A day with everything that goes wrong: thermbald and thermbal-sim as they are shipped, a random mixture of all faults
from a scenario file, time running so many times as fast. Every value that is stored as good is the word that the module
measured during that scan, no scan is missing or more than a period late, and the scans between two faults are whole.

    THERMBAL_BIN_DIR=build/release/bin THERMBAL_SOURCE_DIR=. tests/faults/day.py [tcp|rtu] [--hours 24] [--scale 100]
"""
import argparse
import bisect
import csv
import json
import os
import random
import sys
import time

sys.path.insert(0, os.path.join(os.environ["THERMBAL_SOURCE_DIR"], "tests", "daemon"))
from daemon_support import Daemon, Simulator, configuration, database, scratch  # noqa: E402

PERIOD_S = 15.0
PERIOD_NS = 15 * 10**9
REPLY_FAULTS = ["silence", "late", "truncated", "trickle", "duplicate", "wrong-unit", "wrong-function", "wrong-length",
                "wrong-count", "echo", "unsolicited", "noise", "exception", "hangup"]
OF_THE_LINE = {"tcp": ["wrong-tid", "refuse", "half-open", "one-client"], "rtu": ["wrong-crc", "half-open", "unplug"]}
SENSOR_FAULTS = ["open", "short", "code"]


def random_fault(rng, line, timeout_s):
    """KIND[=VALUE] and its target, as a table of the scenario says them."""
    kind = rng.choice(REPLY_FAULTS + OF_THE_LINE[line] + SENSOR_FAULTS)
    fault = {"kind": kind}
    if kind == "code":
        fault["value"] = rng.choice([0x7FFF, -32768, 8501, -2001])
    elif kind in ("late", "duplicate", "unsolicited", "one-client"):
        fault["value"] = round(rng.uniform(0.0, 3.0) * timeout_s, 4)
    elif kind == "trickle":
        fault["value"] = round(rng.uniform(0.01, 0.1) * timeout_s, 5)
    elif kind == "noise":
        fault["value"] = rng.randint(1, 300)
    elif kind == "exception":
        fault["value"] = rng.choice([1, 2, 3, 4, 5, 6, 10, 11])
    if rng.random() < 0.6:
        if kind in SENSOR_FAULTS:
            fault["channel"] = f"T{rng.randint(1, 16)}"
        elif kind in REPLY_FAULTS + ["wrong-tid", "wrong-crc"]:
            fault["unit"] = rng.randint(1, 2)
    return fault


def scenario(path, line, hours, timeout_s, seed):
    """Writes the scenario; the intervals in which anything is disturbed."""
    rng = random.Random(seed)
    at_s, intervals = 10 * PERIOD_S, []
    with open(path, "w", encoding="utf-8") as file:
        while at_s < hours * 3600 - 60 * PERIOD_S:
            end_s = at_s
            for _ in range(rng.randint(1, 3)):
                fault = random_fault(rng, line, timeout_s)
                begins_s, lasts_s = at_s + rng.uniform(0, 20), rng.uniform(5, 120)
                end_s = max(end_s, begins_s + lasts_s)
                file.write("[[fault]]\n")
                for key, value in fault.items():
                    file.write(f"{key} = {json.dumps(value)}\n")
                file.write(f"at_s = {begins_s:.3f}\nfor_s = {lasts_s:.3f}\n\n")
            intervals.append((at_s, end_s))
            at_s = end_s + rng.uniform(2, 12) * PERIOD_S
    return intervals


def measured(log_path):
    """What the module was asked and measured: (time_s, unit) in order, and the words of each read of 8 registers."""
    reads = {1: ([], []), 2: ([], [])}
    with open(log_path, encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            words = [int(word, 16) for word in row["words"].split()]
            if len(words) == 8:
                times, lists = reads[int(row["unit"])]
                times.append(float(row["time_s"]))
                lists.append(words)
    return reads


def during(reads, unit, from_s, to_s):
    times, words = reads[unit]
    return words[bisect.bisect_left(times, from_s):bisect.bisect_right(times, to_s)]


def check(stored, reads, intervals, scale, effect_s):
    """Figures; raises nothing, so that all of them are seen."""
    figures = {"scans": 0, "good_values": 0, "wrong_values": 0, "missed_scans": 0, "late_scans": 0,
               "undisturbed_scans": 0, "undisturbed_not_whole": 0}
    scans = stored.execute("SELECT scan, status, scheduled_ns, started_ns, finished_ns FROM scans ORDER BY scan").fetchall()
    samples = {}
    for row in stored.execute("SELECT scan, channel, raw, quality FROM samples ORDER BY scan, channel"):
        samples.setdefault(row["scan"], []).append((row["channel"], row["raw"], row["quality"]))
    for scan in scans:
        figures["scans"] += 1
        if scan["started_ns"] is None:
            figures["missed_scans"] += 1
            continue
        from_s, to_s = scan["started_ns"] * 1e-9, scan["finished_ns"] * 1e-9
        if scan["finished_ns"] - scan["scheduled_ns"] > PERIOD_NS:
            figures["late_scans"] += 1
        good = 0
        for channel, raw, quality in samples[scan["scan"]]:
            if quality != "good":
                continue
            good += 1
            words = during(reads, 1 + channel // 8, from_s - 1e-3 * scale, to_s)
            if not any(read[channel % 8] == raw for read in words):
                figures["wrong_values"] += 1
        figures["good_values"] += good
        if not any(begin - PERIOD_S < from_s < end + effect_s + 0.02 * scale for begin, end in intervals):
            figures["undisturbed_scans"] += 1
            figures["undisturbed_not_whole"] += good != 16
    numbers = [scan["scan"] for scan in scans]
    figures["gaps_in_the_grid"] = int(numbers != list(range(len(numbers))))
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("line", choices=["tcp", "rtu"])
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--scale", type=float, default=100.0, help="accelerated seconds a second")
    parser.add_argument("--timeout-ms", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    timeout_s, epoch = arguments.timeout_ms / 1000.0, time.monotonic_ns()
    with scratch() as folder:
        intervals = scenario(f"{folder}/day.toml", arguments.line, arguments.hours, timeout_s, arguments.seed)
        # Without noise in the plant and with a fast drift of the room, so that its words change at every scan.
        flags = ["--units", "8,8", "--scenario", f"{folder}/day.toml", "--log-truth", f"{folder}/truth.csv",
                 "--time-scale", str(arguments.scale), "--time-epoch-ns", str(epoch), "--noise-C", "2.0"]
        timing = {"response_timeout_ms": arguments.timeout_ms, "reconnect_pause_ms": 5}
        if arguments.line == "tcp":
            simulator = Simulator(*flags)
            line = {"transport": "tcp", "host": "127.0.0.1", "port": simulator.port, "connect_timeout_ms": 10, **timing}
        else:
            simulator = Simulator("--rtu", "--link", f"{folder}/module", *flags)
            line = {"transport": "rtu", "device": f"{folder}/module", "baud": 115200, "quiet_ms": 2, **timing}
        config = configuration(folder, line, units=((1, 8), (2, 8)), profile="generic-8x-int16",
                               identification={"every_s": 3600.0, "workers": 1})
        with simulator, Daemon(folder, config, "--time-scale", str(arguments.scale), "--time-epoch-ns", str(epoch)) as daemon:
            seconds = arguments.hours * 3600.0 / arguments.scale
            time.sleep(seconds)
            assert daemon.process.poll() is None, daemon.log_text()
        simulator.stop()
        with database(folder) as stored:
            effect_s = 5.0 * timeout_s * arguments.scale
            figures = check(stored, measured(f"{folder}/truth.csv"), intervals, arguments.scale, effect_s)
    figures["disturbances"] = len(intervals)
    print(arguments.line, figures)
    return 1 if figures["wrong_values"] or figures["gaps_in_the_grid"] or figures["scans"] == 0 else 0


if __name__ == "__main__":
    sys.exit(main())

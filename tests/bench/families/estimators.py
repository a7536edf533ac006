#!/usr/bin/python3
"""Every estimator of `thermbalctl compare` on runs whose truth is known: error, wrong answers and coverage by window.
Usage: estimators.py CORPUS --thermbalctl BIN [--estimator NAME]... [--window-min M]... [--limit-runs N] [--channel T5]...
Windows are multiples of their greatest common divisor; the truth is that of the window's room and regime, and only live
channels count whose window ends 20 min or more after the last change of inputs."""
import argparse
import json
import math
import subprocess
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

from truth import runs_of

AFTER_CHANGE_MIN = 20.0


def compared(csv, options, truth):
    """`compare`'s document on a copy of the recording up to the last window: it sees no truth and no end."""
    command = [options.thermbalctl, "compare", str(csv), "--json", "--every-min", str(math.gcd(*options.window_min))]
    for estimator in options.estimator:
        command += ["--estimator", estimator]
    for channel in options.channel or truth.raw["channels"]:
        if channel in truth.raw["channels"]:
            command += ["--channel", channel]
    done = subprocess.run(command, capture_output=True, text=True, timeout=options.timeout_s)
    if done.returncode:
        raise SystemExit(f"{csv}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def up_to(csv, last_min, folder):
    """The recording up to the last window that is asked for."""
    lines = Path(csv).read_text().splitlines(keepends=True)
    header = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    rows = [line for line in lines[header + 1:] if float(line.split(",")[0]) <= last_min * 60.0 + 1e-9]
    copy = Path(folder) / Path(csv).name
    copy.write_text("".join(lines[:header + 1] + rows))
    return copy


def rows_of(document, truth, options):
    """(window, estimator, error, tolerance, held or None, guards passed or None) of every answer that counts."""
    changes = [change["at_min"] for change in truth.raw["regime_changes"]]
    for channel in document["channels"]:
        name = channel["channel"]
        if truth.channels[name]["state"] != "live":
            continue
        for window in channel["windows"]:
            at = window["window_end_min"]
            if at not in options.window_min or any(0 <= at - change < AFTER_CHANGE_MIN for change in changes):
                continue
            settles_C = truth.settle_C(name, at)
            for estimator, answer in window["estimators"].items():
                value_C, low_C, high_C = (answer["steady_state" + end] for end in ("_C", "_low_C", "_high_C"))
                held = None if low_C is None or high_C is None else low_C <= settles_C <= high_C
                yield (at, estimator, None if value_C is None else value_C - settles_C, truth.tolerance_C(name, at), held)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--thermbalctl", required=True)
    parser.add_argument("--estimator", action="append", default=[])
    parser.add_argument("--window-min", type=int, action="append", default=[])
    parser.add_argument("--channel", action="append", default=[])
    parser.add_argument("--group", action="append", default=[])
    parser.add_argument("--limit-runs", type=int)
    parser.add_argument("--timeout-s", type=float, default=900.0)
    options = parser.parse_args()
    options.window_min = options.window_min or [50, 70, 90, 110, 140]
    rows = defaultdict(list)
    runs = [r for r in runs_of(options.corpus) if not options.group or r[1].group in options.group][: options.limit_runs]
    with tempfile.TemporaryDirectory() as folder:
        for csv, truth in runs:
            document = compared(up_to(csv, max(options.window_min), folder), options, truth)
            for at, estimator, *figures in rows_of(document, truth, options):
                rows[estimator, at].append(figures)
    print(f"{len(runs)} runs; error against the truth of the window, C\n")
    print("| estimator | window, min | answers | median abs. error | RMS, each cut at 3 C | wrong | 90 % interval held |")
    print("|---|---|---|---|---|---|---|")
    for (estimator, at), figures in rows.items():
        errors = np.array([error for error, _, _ in figures if error is not None])
        wrong = np.mean([error is not None and abs(error) > allowed for error, allowed, _ in figures])
        held = [h for _, _, h in figures if h is not None]
        print(f"| {estimator} | {at:.0f} | {len(errors)} of {len(figures)} | {np.median(np.abs(errors)):.3f} | "
              f"{np.sqrt(np.mean(np.minimum(np.abs(errors), 3.0) ** 2)):.2f} | {100 * wrong:.0f} % | "
              f"{f'{np.mean(held):.2f}' if held else '-'} |")


if __name__ == "__main__":
    main()

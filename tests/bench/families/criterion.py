#!/usr/bin/python3
"""Operating characteristic of the RMSE-against-n criterion: how often the clear minimum is there while the literal SVR's
prediction is off, and how often while it is right, by window, on runs whose truth is known.
Usage: criterion.py CORPUS --thermbalctl BIN [--every-min M] [--last-min M] [--channel T5]... [--limit-runs N] [--jobs N] [--rows FILE]
Off: by more than --off-C, or no prediction at all (the free run does not settle). "stays": the minimum is clear at this
window and at the one before. Live channels only, no window within 20 min after a change of inputs."""
import argparse
import json
import tempfile
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from estimators import AFTER_CHANGE_MIN, compared, up_to
from truth import runs_of, wilson


def judged(csv, truth, options, folder):
    """(window, clear, stays, off) of every channel and window of a run."""
    changes = [change["at_min"] for change in truth.raw["regime_changes"]]
    rows = []
    for channel in compared(up_to(csv, options.last_min, folder), options, truth)["channels"]:
        name, before = channel["channel"], False
        if truth.channels[name]["state"] != "live":
            continue
        for window in channel["windows"]:
            at, svr = window["window_end_min"], window["estimators"]["svr"]
            clear = any(guard["name"] == "clear_minimum" and guard["passed"] for guard in svr["guards"])
            value_C = svr["steady_state_C"]
            off = value_C is None or abs(value_C - truth.settle_C(name, at)) > options.off_C
            if not any(0 <= at - change < AFTER_CHANGE_MIN for change in changes) and at >= options.first_min:
                rows.append((at, clear, clear and before, off))
            before = clear
    return rows


def kept_rows(path):
    """Judged windows by run, from an earlier call."""
    return dict(json.loads(line) for line in path.read_text().splitlines()) if path and path.exists() else {}


def share(hits, of):
    if of == 0:
        return "-"
    low, high = wilson(hits, of)
    return f"{100 * hits / of:.0f} % ({100 * low:.0f}-{100 * high:.0f})"


def table_row(name, rows):
    off = [r for r in rows if r[3]]
    right = [r for r in rows if not r[3]]
    clear = [r for r in rows if r[1]]
    stays = [r for r in rows if r[2]]
    return (f"| {name} | {len(rows)} | {share(len(off), len(rows))} | {share(sum(r[1] for r in off), len(off))} | "
            f"{share(sum(r[1] for r in right), len(right))} | {share(sum(r[3] for r in clear), len(clear))} | "
            f"{share(sum(r[3] for r in stays), len(stays))} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--thermbalctl", required=True)
    parser.add_argument("--every-min", type=int, default=10)
    parser.add_argument("--first-min", type=float, default=30.0)
    parser.add_argument("--last-min", type=float, default=240.0)
    parser.add_argument("--off-C", type=float, default=0.3, dest="off_C")
    parser.add_argument("--channel", action="append", default=[])
    parser.add_argument("--limit-runs", type=int)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--timeout-s", type=float, default=900.0)
    parser.add_argument("--rows", type=Path, help="keep what is judged, a line of JSON a run; runs in it are not run again")
    options = parser.parse_args()
    options.channel = options.channel or ["T5"]
    options.estimator, options.window_min = ["svr"], [options.every_min]
    judged_runs = kept_rows(options.rows)
    runs = [run for run in runs_of(options.corpus)[: options.limit_runs] if Path(run[0]).name not in judged_runs]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.jobs) as pool:
        waiting = {pool.submit(judged, *run, options, folder): Path(run[0]).name for run in runs}
        for done in as_completed(waiting):
            judged_runs[waiting[done]] = done.result()
            if options.rows:
                with options.rows.open("a") as kept:
                    kept.write(json.dumps([waiting[done], done.result()]) + "\n")
    rows = [row for found in judged_runs.values() for row in found]
    by_band = defaultdict(list)
    for row in rows:
        by_band[30 * int((row[0] - 1) // 30)].append(row)
    print(f"{len(judged_runs)} runs, channels {', '.join(options.channel)}, a window every {options.every_min} min; "
          f"off: by more than {options.off_C} C\n")
    print("| window, min | windows | SVR off | clear while off | clear while right | off while clear | off while it stays |")
    print("|---|---|---|---|---|---|---|")
    for start, band in sorted(by_band.items()):
        print(table_row(f"{start} to {start + 30}", band))
    print(table_row("all", rows))


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""Writes runs with known truth: NNN.csv (INTERFACES.md, recorded test) and NNN.truth.json, under neutral names.

  make_corpus.py --out DIR --runs 60 --seed 1              every group of runs, in random order
  make_corpus.py --out DIR --archive 3 --tests 6 --seed 1  tests of the same machines at several speeds, for an archive
"""
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import argparse
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from recording import TIMES
from runs import archive_runs, machine_run, modes_run

GROUPS = {
    "linear": 2,
    "nonlinear_friction": 3,
    "ambient_ramp": 2,
    "ambient_day": 2,
    "hvac": 2,
    "slow_machine": 2,
    "coarse_rounding": 2,
    "gaps_spikes": 2,
    "warm_start": 2,
    "speed_step": 2,
    "stop_restart": 2,
    "door_jump": 2,
    "faulty_sensor": 2,
    "barely_warming": 1,
    "chiller": 2,
    "paper": 3,
    "modes_1": 1,
    "modes_2": 1,
    "modes_3": 1,
    "modes_4": 1,
}


def write_run(folder, number, run, seed):
    data, rpm, dropped, truth = run
    decimals = 2 if truth["rounding_C"] < 0.05 or truth["group"] == "gaps_spikes" else 1
    name = f"{number:03d}"
    with open(folder / f"{name}.csv", "w", encoding="ascii") as out:
        out.write(
            "time_s,"
            + ",".join(f"T{c + 1}" for c in range(16))
            + (",spindle_rpm" if rpm is not None else "")
            + "\n"
        )
        for i, t in enumerate(TIMES):
            if not dropped[i]:
                cells = ["" if np.isnan(v) else f"{v:.{decimals}f}" for v in data[i]]
                out.write(
                    f"{t:.0f}," + ",".join(cells) + (f",{rpm[i]:.0f}" if rpm is not None else "") + "\n"
                )
    with open(folder / f"{name}.truth.json", "w", encoding="ascii") as out:
        json.dump({"file": f"{name}.csv", "seed": seed, **truth}, out)


def planned_groups(runs, rng, only):
    """Every group before any comes again, in random order."""
    names = [g for g in GROUPS if not only or g in only]
    left = {g: GROUPS[g] for g in names}
    plan = []
    while len(plan) < runs:
        if not any(left.values()):
            left = {g: GROUPS[g] for g in names}
        for g in names:
            if left[g] and len(plan) < runs:
                plan.append(g)
                left[g] -= 1
    return [plan[i] for i in rng.permutation(runs)]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for NNN.csv and NNN.truth.json")
    parser.add_argument("--runs", type=int, default=60)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument(
        "--first",
        type=int,
        default=1,
        metavar="NNN",
        help="begin at this number (the runs do not depend on each other)",
    )
    parser.add_argument(
        "--group", action="append", default=[], choices=sorted(GROUPS), help="only these groups"
    )
    parser.add_argument(
        "--archive", type=int, metavar="MACHINES", help="an archive set instead: tests of the same machines"
    )
    parser.add_argument("--tests", type=int, default=6, help="tests a machine of the archive set")
    parser.add_argument("--verbose", action="store_true")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    if args.archive:
        for m in range(args.archive):
            rng = np.random.default_rng([args.seed, 7, m])
            for k, run in enumerate(archive_runs(rng, args.tests)):
                run[3]["machine"], run[3]["test"] = m + 1, k + 1
                write_run(args.out, m * args.tests + k + 1, run, args.seed)
        return
    for number, group in enumerate(
        planned_groups(args.runs, np.random.default_rng([args.seed, 0]), args.group), 1
    ):
        if number < args.first:
            continue
        rng = np.random.default_rng([args.seed, 1, number])
        run = modes_run(rng, group) if group.startswith("modes") else machine_run(rng, group)
        write_run(args.out, number, run, args.seed)
        if args.verbose:
            info = run[3]["regimes"][-1]["information"]
            print(
                number,
                group,
                info["order"],
                info["time_constants_min"],
                info["misfit_over_noise"],
                "T5 limit",
                run[3]["channels"]["T5"]["information_limit_min"],
                flush=True,
            )


if __name__ == "__main__":
    main()

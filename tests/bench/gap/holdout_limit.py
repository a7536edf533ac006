#!/usr/bin/python3
"""How much of the held-out gap can be closed at all: on runs in which nothing is missing the calibrated model still misses the held-out
run, by what one run does not tell of the machine's own numbers. A model explained to the end misses it by as much; put in the place of
each case's remaining gap, those misses say what share of it would be closed then.

holdout_limit.py --free TRUTH.json:RESULTS ... --cases TRUTH.json:RESULTS ...
RESULTS as confusion.py leaves them; --free: sets with effect-free cases, the others in them are left out.
"""
import argparse
import json
import pathlib
import statistics

import scoring

STRONG = 12
LOWEST = -1.0  # as Score.holdout_gap counts a gap that has grown


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--free", nargs="+", required=True)
    parser.add_argument("--cases", nargs="+", required=True)
    return parser.parse_args()


def pairs(sets):
    for one in sets:
        truth, results = map(pathlib.Path, one.split(":"))
        for name, known in json.loads(truth.read_text()).items():
            kept = results / f"{name}.json"
            answer = json.loads(kept.read_text()) if kept.exists() else {}
            if answer.get("gap", {}).get("holdout_before_rmse_C") is not None:
                yield answer, known


def before_above_floor_C(answer, truth):
    return answer["gap"]["holdout_before_rmse_C"] - truth["holdout_floor_C"]


def main():
    given = arguments()
    missed_C = [before_above_floor_C(a, t) for a, t in pairs(given.free) if not t["effects"]]
    print(f"{len(missed_C)} runs in which nothing is missing: held-out gap above the floor, mean {statistics.mean(missed_C):.4f} C, "
          f"median {statistics.median(missed_C):.4f}, nine in ten below {sorted(missed_C)[int(0.9 * len(missed_C))]:.4f}")
    closed, reachable = [], []
    for answer, truth in pairs(given.cases):
        in_catalogue = truth["effects"] and all(e["inside_catalogue"] for e in truth["effects"])
        share = scoring.gap_closed(answer, truth) if in_catalogue and truth["strength"] >= STRONG else None
        if share is None:
            continue
        gap_C = before_above_floor_C(answer, truth)
        closed.append(max(share, LOWEST))
        reachable.append(statistics.mean(max(1 - missed / gap_C, LOWEST) for missed in missed_C))
    for what, shares in (("closed", closed), ("with what is missed where nothing is missing", reachable)):
        print(f"{what}: {len(shares)} cases, mean {statistics.mean(shares):.3f}, median {statistics.median(shares):.3f}")


if __name__ == "__main__":
    main()

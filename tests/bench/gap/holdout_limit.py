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


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--free", nargs="+", required=True)
    parser.add_argument("--cases", nargs="+", required=True)
    return parser.parse_args()


def score(sets):
    pairs = []
    for one in sets:
        truth, results = map(pathlib.Path, one.split(":"))
        pairs += [(json.loads(kept.read_text()), known) for name, known in json.loads(truth.read_text()).items()
                  if (kept := results / f"{name}.json").exists()]
    return scoring.Score(pairs)


def main():
    given = arguments()
    missed_C = [gap_C for a, t in score(given.free).none if (gap_C := scoring.holdout_gap_C(a, t)) is not None]
    print(f"{len(missed_C)} runs in which nothing is missing: held-out gap above the floor, mean {statistics.mean(missed_C):.4f} C, "
          f"median {statistics.median(missed_C):.4f}, nine in ten below {sorted(missed_C)[int(0.9 * len(missed_C))]:.4f}")
    cases = score(given.cases).with_holdout_gap()
    closed = [share for share, _ in cases]
    reachable = [statistics.mean(scoring.counted(1 - missed / gap_C) for missed in missed_C) for _, gap_C in cases]
    for what, shares in (("closed", closed), ("with what is missed where nothing is missing", reachable)):
        print(f"{what}: {len(shares)} cases, mean {statistics.mean(shares):.3f}, median {statistics.median(shares):.3f}")


if __name__ == "__main__":
    main()

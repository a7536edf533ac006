#!/usr/bin/python3
"""The figures of the gap workflow and its confusion matrix, on cases of tests/truth/gap/make_cases.py.

confusion.py --cases DIR --truth FILE.json --results DIR    diagnoses what RESULTS does not hold yet, then opens the truth
THERMBAL_BIN_DIR says where thermbalctl is (build/release/bin).
"""
import argparse
import json
import pathlib

import diagnoses
import scoring


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=pathlib.Path, required=True)
    parser.add_argument("--truth", type=pathlib.Path, required=True)
    parser.add_argument("--results", type=pathlib.Path, required=True)
    parser.add_argument("--at-once", type=int, default=1)
    parser.add_argument("--no-holdout", action="store_true")
    parser.add_argument("--each", action="store_true", help="a line a case")
    return parser.parse_args()


def print_figures(score):
    print("| figure | must | got | 95 % | cases |\n|---|---|---|---|---|")
    for name, must, value, count in score.figures():
        is_share = name.startswith(("right", "true", "effect-free", "outside", "place", "both"))
        interval = "{:.2f}-{:.2f}".format(*scoring.wilson(value, count)) if is_share and count else ""
        print(f"| {name} | {must} | {value:.3f} | {interval} | {count} |")


def print_confusion(score):
    print("\n| truth | named first |\n|---|---|")
    for truth, found in sorted(score.confusion().items()):
        print(f"| {truth} | " + ", ".join(f"{kind} {n}" for kind, n in found.most_common()) + " |")


def line(name, answer, truth):
    what = " + ".join(f"{e['kind']}@{e['at']}" + (f" {e['onset_s']:.0f}s" if "onset_s" in e else "") for e in truth["effects"])
    got = " + ".join(f"{e['kind']}@{e['at']} p={e['probability']:.2f} {e['from_s']:.0f}s {e['parameters']}"
                     for e in scoring.named(answer))
    gap = answer.get("gap", {})
    right = scoring.first_kind(answer) in {e["kind"] for e in truth["effects"]} or (not truth["effects"] and not got)
    return (f"{'ok ' if right else 'BAD'} {name} x{truth['strength']:.0f} [{what or 'none'}] -> {answer.get('verdict')} [{got}] "
            f"gap {gap.get('before_rmse_C', 0):.3f}->{gap.get('after_rmse_C', 0):.3f} floor {truth['run_floor_C']:.3f} "
            f"holdout {gap.get('holdout_before_rmse_C') or 0:.3f}->{gap.get('holdout_after_rmse_C') or 0:.3f} "
            f"floor {truth['holdout_floor_C']:.3f} {answer['seconds']:.1f}s {answer.get('error', '')}")


def main():
    given = arguments()
    answers = diagnoses.all_of(given.cases, given.results, given.at_once, not given.no_holdout)
    truths = json.loads(given.truth.read_text())
    score = scoring.Score([(answers[name], truths[name]) for name in sorted(answers)])
    if given.each:
        print("\n".join(line(name, answers[name], truths[name]) for name in sorted(answers)))
    print_figures(score)
    print_confusion(score)


if __name__ == "__main__":
    main()

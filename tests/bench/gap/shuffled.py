#!/usr/bin/python3
"""The scorer against shuffled truth: if it still finds the diagnoses right, it is the scorer that is wrong.

shuffled.py --cases DIR --truth FILE.json --results DIR     exits 1 when the shuffled score is above chance
"""
import json
import sys

import numpy as np

import diagnoses
import scoring
from confusion import arguments


def main():
    given = arguments()
    answers = diagnoses.all_of(given.cases, given.results, given.at_once, not given.no_holdout)
    truths = json.loads(given.truth.read_text())
    names = [n for n in sorted(answers) if len(truths[n]["effects"]) == 1 and truths[n]["effects"][0]["inside_catalogue"]]
    honest, count = scoring.Score([(answers[n], truths[n]) for n in names]).right_first(0)
    rng = np.random.default_rng(1)
    rates = []
    for _ in range(200):
        mixed = rng.permutation(names)
        rates.append(scoring.Score([(answers[n], truths[m]) for n, m in zip(names, mixed)]).right_first(0)[0])
    kinds = [truths[n]["effects"][0]["kind"] for n in names]
    said = [scoring.first_kind(answers[n]) for n in names]
    chance = sum(said.count(k) * kinds.count(k) for k in set(kinds)) / len(names) ** 2
    print(f"{count} cases: right {honest:.3f}, with shuffled truth {np.mean(rates):.3f}, chance {chance:.3f}")
    sys.exit(1 if abs(np.mean(rates) - chance) > 0.03 else 0)


if __name__ == "__main__":
    main()

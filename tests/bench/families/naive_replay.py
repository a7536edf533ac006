#!/usr/bin/python3
"""The naive reference, answering like `thermbalctl replay`: one exponential a channel, its Laplace interval as it comes
out, declared as soon as that is inside the tolerance three times. It exists to show that the scorer catches what is wrong:

  score.py CORPUS_DIR --thermbalctl "/usr/bin/python3 tests/bench/families/naive_replay.py"
"""
import argparse
import csv
import json
import sys

import numpy as np


def best_exponential(t_min, y):
    """Steady state, its sd and the time constant (min): variable projection over a grid of time constants."""
    taus = np.geomspace(2.0, 400.0, 60)
    costs, fits = [], []
    for tau in taus:
        X = np.column_stack([np.ones_like(t_min), np.exp(-t_min / tau)])
        coefficients, *_ = np.linalg.lstsq(X, y, rcond=None)
        costs.append(((y - X @ coefficients) ** 2).sum())
        fits.append(coefficients)
    i = int(np.argmin(costs))
    tau, (steady, amplitude) = taus[i], fits[i]
    E = np.exp(-t_min / tau)
    X = np.column_stack([np.ones_like(t_min), E, amplitude * E * t_min / tau])
    s2 = costs[i] / max(len(y) - 3, 1)
    sd = np.sqrt(s2 * np.linalg.pinv(X.T @ X)[0, 0])
    return steady, sd, tau, amplitude


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("command", choices=["replay"])
    parser.add_argument("file")
    parser.add_argument("--tolerance-C", type=float, default=0.2, dest="tolerance_C")
    parser.add_argument("--every-min", type=float, default=2.0)
    parser.add_argument("--ambient", default="T1")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    with open(args.file, encoding="ascii") as source:
        table = list(csv.DictReader(source))
    t = np.array([float(row["time_s"]) for row in table]) / 60.0
    channels, stop = [], 0.0
    for name in (n for n in table[0] if n.startswith("T") and n != args.ambient):
        y = np.array([float(row[name]) if row[name] else np.nan for row in table])
        good, inside, answer = ~np.isnan(y), 0, None
        for window in np.arange(20.0, t[-1] + 1e-9, max(args.every_min, 4.0)):
            use = good & (t <= window)
            if use.sum() < 40:
                continue
            steady, sd, tau, amplitude = best_exponential(t[use][::4], y[use][::4])
            inside = inside + 1 if 1.645 * sd <= args.tolerance_C else 0
            answer = {
                "channel": name,
                "declared": inside >= 3,
                "steady_state_C": steady,
                "steady_state_low_C": steady - 1.645 * sd,
                "steady_state_high_C": steady + 1.645 * sd,
                "equilibrium_time_min": 3.0 * tau,
                "reason": "declared" if inside >= 3 else "the interval is too wide",
            }
            if inside >= 3:
                answer["declared_at_min"] = window
                break
        channels.append(answer or {"channel": name, "declared": False, "reason": "no samples"})
        stop = (
            None
            if stop is None or not channels[-1]["declared"]
            else max(stop, channels[-1]["declared_at_min"])
        )
    json.dump({"test_stopped_at_min": stop, "channels": channels}, sys.stdout)


if __name__ == "__main__":
    main()

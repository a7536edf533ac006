#!/usr/bin/python3
"""Scores an estimator's own output, before any declaration: coverage, error and width by window and by group.

  score_estimates.py CORPUS_DIR ESTIMATES.jsonl        (or - for standard input)

Every line one JSON object: {"file": "012.csv", "window_min": 70, "channel": "T5", "steady_state_C": 26.7, "low": 26.5,
"high": 26.9}; low and high bound the central 90 % interval. Only live and barely warming channels count, and only windows
that lie within one regime or begin after its change ("from_min" in the line may say where the window begins).
"""
import argparse
import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from truth import runs_of, wilson


def rows_of(lines, truths):
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            e = json.loads(line)
            truth = truths[Path(e["file"]).name]
            channel = truth.channels[e["channel"]]
            window, steady = float(e["window_min"]), float(e["steady_state_C"])
            low, high = float(e["low"]), float(e["high"])
        except (ValueError, KeyError, TypeError) as error:
            raise SystemExit(
                f"line {number}: {error!r}; expected file, window_min, channel, steady_state_C, low, high"
            )
        if channel["state"] in ("stuck", "dead"):
            continue
        begin = float(e.get("from_min", 0.0))
        if any(begin < c["at_min"] <= window and c["kind"] != "room" for c in truth.raw["regime_changes"]):
            continue
        settle = truth.settle_C(e["channel"], window)
        yield {
            "file": truth.file,
            "group": truth.group,
            "window": window,
            "channel": e["channel"],
            "error": steady - settle,
            "held": low <= settle <= high,
            "half": 0.5 * (high - low),
            "tolerance": truth.tolerance_C(e["channel"], window),
        }


def line_of(rows):
    error = np.array([r["error"] for r in rows])
    half = np.array([r["half"] for r in rows])
    held = sum(r["held"] for r in rows)
    narrow = [r for r in rows if r["half"] <= 0.2]
    wrong = sum(abs(r["error"]) > r["tolerance"] for r in narrow)
    low, high = wilson(held, len(rows))
    return (
        f"{len(rows):6} {held / len(rows):6.3f} [{low:.2f},{high:.2f}] {np.median(np.abs(error)):8.3f} {np.sqrt(np.mean(error ** 2)):8.3f} "
        f"{np.mean(error):+8.3f} {np.quantile(np.abs(error), 0.95):8.3f} {np.median(half):8.3f} {len(narrow):6} {wrong:6}"
    )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("corpus", type=Path)
    parser.add_argument("estimates")
    parser.add_argument("--worst", type=int, default=15)
    args = parser.parse_args()
    truths = {truth.file: truth for _, truth in runs_of(args.corpus)}
    source = sys.stdin if args.estimates == "-" else open(args.estimates, encoding="utf-8")
    rows = list(rows_of(source, truths))
    if not rows:
        raise SystemExit("no line could be scored")
    head = f"{'n':>6} {'held':>6} {'95 % of it':11} {'med|e|':>8} {'rms':>8} {'bias':>8} {'p95|e|':>8} {'half':>8} {'<=0.2':>6} {'wrong':>6}"
    print(
        "held: the 90 % interval holds the truth; half: its half width, median; <=0.2: so narrow; wrong: of these, over max(0.3 C, 5 %)"
    )
    for title, key in (("by window, min", "window"), ("by group", "group")):
        print(f"\n{title:22}{head}")
        sets = defaultdict(list)
        for r in rows:
            sets[r[key]].append(r)
        for name in sorted(sets):
            print(f"{str(name):22}{line_of(sets[name])}")
    print(f"\n{'all':22}{line_of(rows)}\n\nworst, interval against error:")
    rows.sort(key=lambda r: -abs(r["error"]) / max(r["half"], 1e-3))
    for r in rows[: args.worst]:
        print(
            f"  {r['file']} {r['channel']:4} {r['group']:20} window {r['window']:6.1f} error {r['error']:+.3f} half width {r['half']:.3f}"
        )


if __name__ == "__main__":
    main()

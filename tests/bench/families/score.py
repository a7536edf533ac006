#!/usr/bin/python3
"""Scores `thermbalctl replay` on runs whose truth is known and prints the table of what was asked for.

  score.py CORPUS_DIR --thermbalctl build/bin/thermbalctl [--jobs 2] [--json OUT.json]

The runs come from tests/truth/make_corpus.py. Every figure is causal: the truth of a declaration is the truth at the
moment of it (the room and the regime of then), and a declaration counts with the information limit of its regime.
"""
import argparse
import json
import math
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from truth import WHOLE_TEST_MIN, runs_of, wilson

AFTER_CHANGE_MIN = 10.0


# -- running --------------------------------------------------------------------------------------------------------


def replay(csv, args):
    """The replay's JSON, or {"failure": why}. It sees a copy of the CSV alone, never the truth beside it."""
    with tempfile.TemporaryDirectory() as alone:
        copy = shutil.copy(csv, Path(alone) / "test.csv")
        command = [
            *shlex.split(args.thermbalctl),
            "replay",
            str(copy),
            "--tolerance-C",
            str(args.tolerance_C),
            "--every-min",
            str(args.every_min),
            "--json",
            *args.replay_arg,
        ]
        began = time.monotonic()
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=args.timeout_s)
        except subprocess.TimeoutExpired:
            return {"failure": f"no answer in {args.timeout_s} s"}
        except OSError as error:
            raise SystemExit(f"{command[0]}: cannot be run ({error.strerror}); give --thermbalctl PATH")
        if done.returncode != 0:
            return {"failure": f"exit status {done.returncode}: {done.stderr.strip()[:300]}"}
        try:
            answer = json.loads(done.stdout)
            if not isinstance(answer.get("channels"), list):
                raise ValueError("no list of channels")
        except ValueError as error:
            return {"failure": f"standard output is not the JSON of INTERFACES: {error}"}
        answer["took_s"] = time.monotonic() - began
        return answer


def answers_of(runs, args):
    if args.from_replays:
        return [json.loads((args.from_replays / f"{csv.stem}.replay.json").read_text()) for csv, _ in runs]
    done = [0]

    def one(run):
        answer = replay(run[0], args)
        if args.save_replays:
            args.save_replays.mkdir(parents=True, exist_ok=True)
            (args.save_replays / f"{run[0].stem}.replay.json").write_text(json.dumps(answer))
        done[0] += 1
        if args.progress:
            print(
                f"{done[0]}/{len(runs)} {run[0].name} {answer.get('failure', '')}",
                file=sys.stderr,
                flush=True,
            )
        return answer

    with ThreadPoolExecutor(args.jobs) as pool:
        return list(pool.map(one, runs))


# -- judging one channel --------------------------------------------------------------------------------------------


def number(value):
    return float(value) if isinstance(value, (int, float)) and math.isfinite(value) else None


def judge(truth, name, said, stopped_at):
    """One channel's row: what was said against what is true."""
    c = truth.channels[name]
    row = {
        "file": truth.file,
        "group": truth.group,
        "channel": name,
        "state": c["state"],
        "declarable": c["declarable"],
        "declared": bool(said and said.get("declared")),
        "rise_C": c["rise_C"],
        "reason": (said or {}).get("reason"),
    }
    end = stopped_at if stopped_at is not None else WHOLE_TEST_MIN
    at = number(said.get("declared_at_min")) if row["declared"] else end
    row["complaint"] = complaint(row["declared"], said, at)
    if row["declared"] and at is None:
        at = WHOLE_TEST_MIN
    settle = truth.settle_C(name, at)
    row |= {"at_min": at, "settle_C": settle, "tolerance_C": truth.tolerance_C(name, at)}
    steady, low, high = (
        number((said or {}).get(k)) for k in ("steady_state_C", "steady_state_low_C", "steady_state_high_C")
    )
    row["error_C"] = None if steady is None else steady - settle
    row["half_width_C"] = None if low is None or high is None else 0.5 * (high - low)
    row["held"] = None if low is None or high is None else low <= settle <= high
    # A declaration without a number is no right one.
    row["wrong"] = row["declared"] and (steady is None or abs(row["error_C"]) > row["tolerance_C"])
    limit = truth.limit_min(name, at)
    row["limit_min"] = limit
    row["ratio"] = at / limit if row["declared"] and limit else None
    eq, said_eq = c["equilibrium_time_min"], number((said or {}).get("equilibrium_time_min"))
    if row["declared"] and eq and truth.raw["room_quiet"] and c["state"] == "live":
        row["equilibrium_error"] = None if said_eq is None else (said_eq - eq) / eq
        row["equilibrium_missing"] = said_eq is None
    changes_of(row, truth, name, at, stopped_at)
    return row


def complaint(declared, said, at):
    """What is inconsistent in an answer, whatever the truth."""
    if said is None:
        return "the channel is missing in the answer"
    steady, low, high = (
        number(said.get(k)) for k in ("steady_state_C", "steady_state_low_C", "steady_state_high_C")
    )
    if declared and at is None:
        return "declared, without declared_at_min"
    if declared and None in (steady, low, high):
        return "declared, without a steady state and its interval"
    if None not in (steady, low, high) and not low <= steady <= high:
        return "the steady state lies outside its own interval"
    return None


def changes_of(row, truth, name, at, stopped_at):
    row["after_change"] = row["left_standing"] = False
    if not row["declared"]:
        return
    end = stopped_at if stopped_at is not None else WHOLE_TEST_MIN
    for change in truth.raw["regime_changes"]:
        if change["at_min"] <= at < change["at_min"] + AFTER_CHANGE_MIN:
            row["after_change"] = True
    # The settle temperatures of both regimes in the same room: only what the change itself moved counts.
    then, last = truth.regime_at(at), truth.regime_at(end)
    moved = abs(truth.settle_C(name, end, then) - truth.settle_C(name, end, last))
    row["left_standing"] = then != last and moved > 0.3


def judge_run(truth, answer):
    said = {c.get("channel"): c for c in answer.get("channels", []) if isinstance(c, dict)}
    stopped_at = number(answer.get("test_stopped_at_min"))
    rows = [judge(truth, name, said.get(name), stopped_at) for name in truth.channels]
    return {
        "file": truth.file,
        "group": truth.group,
        "failure": answer.get("failure"),
        "stopped_at_min": stopped_at,
        "condition": truth.raw.get("condition"),
        "took_s": answer.get("took_s"),
        "rows": rows,
    }


# -- figures --------------------------------------------------------------------------------------------------------


def share(hits, of):
    low, high = wilson(hits, of)
    return {"hits": int(hits), "of": int(of), "share": hits / of if of else None, "low": low, "high": high}


def quantile(values, q):
    return float(np.quantile(values, q)) if len(values) else None


def figures(runs):
    rows = [r for run in runs for r in run["rows"]]
    declared = [r for r in rows if r["declared"]]
    errors = [r["error_C"] for r in declared if r["error_C"] is not None]
    declarable = [r for r in rows if r["declarable"]]
    right = [r for r in declarable if r["declared"] and not r["wrong"] and r["at_min"] < WHOLE_TEST_MIN]
    ratios = [r["ratio"] for r in right if r["ratio"]]
    never = [
        r["ratio"] if r["declared"] and not r["wrong"] and r["ratio"] else math.inf
        for r in declarable
        if r["limit_min"]
    ]
    middle = sorted(never)[len(never) // 2] if never else math.inf
    open_rows = [
        r
        for r in rows
        if not r["declared"] and r["held"] is not None and r["state"] in ("live", "barely_warming")
    ]
    eq = [abs(r["equilibrium_error"]) for r in declared if r.get("equilibrium_error") is not None]
    stops = [
        (run["stopped_at_min"] if run["stopped_at_min"] is not None else WHOLE_TEST_MIN) / WHOLE_TEST_MIN
        for run in runs
    ]
    return {
        "runs": len(runs),
        "channels": len(rows),
        "declarable": len(declarable),
        "declared": len(declared),
        "wrong": share(sum(r["wrong"] for r in declared), len(declared)),
        "held": share(sum(r["held"] is True for r in declared), len(declared)),
        "held_undeclared": share(sum(r["held"] for r in open_rows), len(open_rows)),
        "half_width_C": quantile([r["half_width_C"] for r in declared if r["half_width_C"] is not None], 0.5),
        "ratio_median": quantile(ratios, 0.5),
        "ratio_p90": quantile(ratios, 0.9),
        "ratio_median_undeclared_never": middle if math.isfinite(middle) else None,
        "rightly_declared": share(len(right), len(declarable)),
        "stop_share_mean": float(np.mean(stops)) if stops else None,
        "stopped": share(sum(run["stopped_at_min"] is not None for run in runs), len(runs)),
        "rms_error_C": float(np.sqrt(np.mean(np.square(errors)))) if errors else None,
        "bias_C": float(np.mean(errors)) if errors else None,
        "equilibrium_error_median": quantile(eq, 0.5),
        "equilibrium_error_p90": quantile(eq, 0.9),
        "after_change": sum(r["after_change"] for r in declared),
        "left_standing": sum(r["left_standing"] for r in declared),
        "faulty_declared": sum(r["declared"] and r["state"] in ("stuck", "dead") for r in rows),
        "failures": sum(run["failure"] is not None for run in runs),
        "complaints": sum(r["complaint"] is not None for r in rows),
        "took_s_mean": quantile([run["took_s"] for run in runs if run["took_s"]], 0.5),
    }


def paper_rows(runs):
    out = []
    for run in runs:
        if run["group"] == "paper":
            row = next(r for r in run["rows"] if r["channel"] == "T5")
            out.append({"file": run["file"], "condition": run["condition"], **row})
    return sorted(out, key=lambda r: (r["condition"], r["file"]))


# -- what a person reads --------------------------------------------------------------------------------------------


def text(value, form="{:.3f}"):
    return (
        "-"
        if value is None or (isinstance(value, float) and not math.isfinite(value))
        else form.format(value)
    )


def verdict(value, must, aim, below=True):
    if value is None:
        return "no figure"
    better = (lambda limit: value <= limit) if below else (lambda limit: value >= limit)
    return "aim" if better(aim) else "must" if better(must) else "MISSED"


def held_verdict(value, must, aim):
    if value is None:
        return "no figure"
    return "aim" if aim[0] <= value <= aim[1] else "must" if must[0] <= value <= must[1] else "MISSED"


def table(total, groups, paper, args):
    wrong, held = total["wrong"]["share"], total["held"]["share"]
    held_groups = {g: f["held"] for g, f in groups.items() if f["held"]["of"]}
    worst = min(
        held_groups.items(),
        key=lambda kv: kv[1]["share"],
        default=(None, {"share": None, "hits": 0, "of": 0}),
    )
    changes = total["after_change"] + total["left_standing"]
    lines = [
        (
            "declared, error over max(0.3 C, 5 %)",
            f"{text(None if wrong is None else 100 * wrong, '{:.2f}')} % "
            f"({total['wrong']['hits']} of {total['wrong']['of']})",
            "< 1 %",
            "0",
            "no figure" if wrong is None else "aim" if wrong == 0 else "must" if wrong < 0.01 else "MISSED",
        ),
        (
            "90 % intervals hold the truth, all",
            f"{text(held)} [{text(total['held']['low'])}, {text(total['held']['high'])}]",
            "0.85-0.97",
            "0.88-0.95",
            held_verdict(held, (0.85, 0.97), (0.88, 0.95)),
        ),
        (
            "  ... worst group",
            f"{text(worst[1]['share'])} ({worst[0]}, {worst[1]['hits']} of {worst[1]['of']})",
            ">= 0.80",
            ">= 0.85",
            verdict(worst[1]["share"], 0.80, 0.85, below=False),
        ),
        (
            "declared at / information limit, median",
            f"{text(total['ratio_median'])} (p90 {text(total['ratio_p90'])}, undeclared as never "
            f"{text(total['ratio_median_undeclared_never'])})",
            "<= 1.2",
            "<= 0.9",
            verdict(total["ratio_median"], 1.2, 0.9),
        ),
        (
            "declarable channels declared rightly",
            f"{text(total['rightly_declared']['share'])} ({total['rightly_declared']['hits']} of "
            f"{total['rightly_declared']['of']})",
            ">= 0.95",
            ">= 0.98",
            verdict(total["rightly_declared"]["share"], 0.95, 0.98, below=False),
        ),
        (
            "test stopped at, share of 400 min, mean",
            text(total["stop_share_mean"]),
            "<= 0.45",
            "<= 0.35",
            verdict(total["stop_share_mean"], 0.45, 0.35),
        ),
        (
            "RMS error of declared",
            f"{text(total['rms_error_C'])} C (bias {text(total['bias_C'], '{:+.3f}')})",
            "<= 0.15",
            "<= 0.08",
            verdict(total["rms_error_C"], 0.15, 0.08),
        ),
        (
            "within 10 min after a change / left standing",
            f"{total['after_change']} / {total['left_standing']}",
            "0",
            "0",
            "aim" if changes == 0 else "MISSED",
        ),
    ]
    for row in paper:
        error, eq = row["error_C"], row.get("equilibrium_error")
        if not row["declared"]:
            figure, grade = f"not declared: {row['reason']}", "MISSED"
        else:
            figure = f"at {row['at_min']:.1f} min, {text(error, '{:+.3f}')} C, 95 % time {text(eq and 100 * eq, '{:+.1f}')} %"
            ok = (
                lambda t, e, q: row["at_min"] <= t
                and error is not None
                and abs(error) <= e
                and eq is not None
                and abs(eq) <= q
            )
            grade = "aim" if ok(75, 0.1, 0.04) else "must" if ok(110, 0.15, 0.05) else "MISSED"
        lines.append(
            (f"T5, {row['condition']} ({row['file']})", figure, "110, 0.15, 5 %", "75, 0.1, 4 %", grade)
        )
    widths = [max(len(line[i]) for line in lines) for i in range(5)]
    out = [
        f"{total['runs']} runs, {total['channels']} channels, {total['declarable']} declarable, {total['declared']} declared"
        + (f", {total['failures']} RUNS FAILED" if total["failures"] else "")
        + (f", {total['complaints']} inconsistent answers" if total["complaints"] else ""),
        "",
    ]
    heads = ("figure", "here", "must", "aim", "reached")
    widths = [max(w, len(h)) for w, h in zip(widths, heads)]
    for line in (heads, *lines):
        out.append("  ".join(cell.ljust(w) for cell, w in zip(line, widths)).rstrip())
    out += [
        "",
        f"also: undeclared channels' latest intervals hold {text(total['held_undeclared']['share'])} of {total['held_undeclared']['of']}; "
        f"half width at the declaration, median {text(total['half_width_C'])} C; 95 % time error median "
        f"{text(total['equilibrium_error_median'])}, p90 {text(total['equilibrium_error_p90'])}; stuck or dead channels declared "
        f"{total['faulty_declared']}; one replay {text(total['took_s_mean'], '{:.1f}')} s",
        "",
    ]
    out.append(
        f"{'group':20}{'runs':>5}{'decl-able':>10}{'declared':>9}{'wrong':>6}{'held':>7}{'und.held':>9}{'ratio':>7}{'rightly':>8}"
        f"{'stop':>6}{'rms C':>7}{'changes':>8}"
    )
    for group, f in sorted(groups.items()):
        out.append(
            f"{group:20}{f['runs']:5}{f['declarable']:10}{f['declared']:9}{f['wrong']['hits']:6}{text(f['held']['share'], '{:.2f}'):>7}"
            f"{text(f['held_undeclared']['share'], '{:.2f}'):>9}{text(f['ratio_median'], '{:.2f}'):>7}"
            f"{text(f['rightly_declared']['share'], '{:.2f}'):>8}{text(f['stop_share_mean'], '{:.2f}'):>6}{text(f['rms_error_C']):>7}"
            f"{f['after_change'] + f['left_standing']:8}"
        )
    return out


def worst_cases(runs, count):
    rows = [r for run in runs for r in run["rows"] if r["declared"] and r["error_C"] is not None]
    rows.sort(key=lambda r: -abs(r["error_C"]) / r["tolerance_C"])
    out = [f"worst declarations (of {len(rows)}):"]
    for r in rows[:count]:
        out.append(
            f"  {r['file']} {r['channel']:4}{r['group']:20} at {r['at_min']:6.1f} min (limit {text(r['limit_min'], '{:.0f}')}) "
            f"error {r['error_C']:+.3f} C of {r['tolerance_C']:.2f} allowed, half width {text(r['half_width_C'])}, rise {r['rise_C']:+.2f}"
            + (" AFTER A CHANGE" if r["after_change"] else "")
            + (" LEFT STANDING" if r["left_standing"] else "")
            + (f" ({r['state']})" if r["state"] != "live" else "")
        )
    silent = defaultdict(list)
    for run in runs:
        for r in run["rows"]:
            if r["declarable"] and not r["declared"]:
                silent[(r["file"], r["group"], r["reason"])].append(r["channel"])
    if silent:
        out.append("declarable, and not declared:")
        for (file, group, reason), channels in sorted(silent.items(), key=lambda kv: -len(kv[1]))[:count]:
            out.append(
                f"  {file} {group:20} {len(channels):2} channels ({' '.join(channels[:6])}{' ...' if len(channels) > 6 else ''}): {reason}"
            )
    for run in runs:
        if run["failure"]:
            out.append(f"FAILED {run['file']}: {run['failure']}")
        for r in run["rows"]:
            if r["complaint"] and not run["failure"]:
                out.append(f"INCONSISTENT {r['file']} {r['channel']}: {r['complaint']}")
    return out


def compared(runs, baseline):
    """Declaration times against those of another scoring of the same files (with an archive against none)."""
    other = {(r["file"], r["channel"]): r for run in baseline["runs"] for r in run["rows"]}
    pairs = [
        (r["at_min"], other[key]["at_min"])
        for run in runs
        for r in run["rows"]
        if (key := (r["file"], r["channel"])) in other
        and r["declared"]
        and other[key]["declared"]
        and r["declarable"]
    ]
    ratios = [a / b for a, b in pairs]
    return {"pairs": len(pairs), "median_ratio": quantile(ratios, 0.5), "p90_ratio": quantile(ratios, 0.9)}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("corpus", type=Path)
    parser.add_argument(
        "--thermbalctl", default="thermbalctl", help="the program (words are split: 'python3 fake.py')"
    )
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--tolerance-C", type=float, default=0.2, dest="tolerance_C")
    parser.add_argument("--every-min", type=float, default=2.0)
    parser.add_argument(
        "--replay-arg",
        action="append",
        default=[],
        help="a further argument of replay, e.g. --replay-arg=--archive=X.db",
    )
    parser.add_argument("--group", action="append", default=[], help="only runs of this group")
    parser.add_argument("--limit-runs", type=int, help="only the first N runs")
    parser.add_argument("--timeout-s", type=float, default=900.0)
    parser.add_argument("--worst", type=int, default=15)
    parser.add_argument("--json", type=Path, help="all figures and every channel's row")
    parser.add_argument("--save-replays", type=Path, help="keep the raw answers in this folder")
    parser.add_argument("--from-replays", type=Path, help="score kept answers instead of running anything")
    parser.add_argument(
        "--baseline",
        type=Path,
        help="a JSON of another scoring of the same files: prints declaration times against it",
    )
    parser.add_argument("--progress", action="store_true")
    args = parser.parse_args()
    chosen = [run for run in runs_of(args.corpus) if not args.group or run[1].group in args.group][
        : args.limit_runs
    ]
    runs = [judge_run(truth, answer) for (_, truth), answer in zip(chosen, answers_of(chosen, args))]
    by_group = defaultdict(list)
    for run in runs:
        by_group[run["group"]].append(run)
    total, groups, paper = figures(runs), {g: figures(r) for g, r in by_group.items()}, paper_rows(runs)
    print("\n".join(table(total, groups, paper, args)))
    print()
    print("\n".join(worst_cases(runs, args.worst)))
    result = {"total": total, "groups": groups, "paper": paper, "runs": runs}
    if args.baseline:
        result["against_baseline"] = compared(runs, json.loads(args.baseline.read_text()))
        print("declaration times against the baseline:", result["against_baseline"])
    if args.json:
        args.json.write_text(json.dumps(result, indent=1))
    return 1 if total["failures"] else 0


if __name__ == "__main__":
    sys.exit(main())

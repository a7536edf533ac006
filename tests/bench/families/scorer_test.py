#!/usr/bin/python3
"""The scorer catches what is wrong: answers made from the truth pass, and every way of spoiling them shows in its figure."""
import json
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import score
from truth import runs_of

FAILURES = []


def check(what, holds, figure):
    print(f"{'ok  ' if holds else 'FAIL'} {what}: {figure}")
    if not holds:
        FAILURES.append(what)


def perfect(truth):
    """Every live channel declared at its information limit, exactly right; what is faulty, not at all."""
    channels, latest = [], 0.0
    for name, c in truth.channels.items():
        if c["state"] in ("stuck", "dead") or not c["information_limit_min"]:
            channels.append({"channel": name, "declared": False, "reason": c["state"]})
            continue
        at = c["information_limit_min"]
        settle = truth.settle_C(name, at)
        latest = max(latest, at)
        channels.append(
            {
                "channel": name,
                "declared": True,
                "declared_at_min": at,
                "steady_state_C": settle,
                "steady_state_low_C": settle - 0.1,
                "steady_state_high_C": settle + 0.1,
                "equilibrium_time_min": c["equilibrium_time_min"],
                "reason": "declared",
            }
        )
    return {"test_stopped_at_min": latest, "channels": channels}


def scored(truths, spoil=None):
    runs = []
    for truth in truths:
        answer = perfect(truth)
        for channel in answer["channels"]:
            if spoil:
                spoil(truth, channel, answer)
        runs.append(score.judge_run(truth, answer))
    return score.figures(runs)


def spoiled_answers(truths):
    good = scored(truths)
    check(
        "answers made from the truth: none wrong, all held, at the limit, no error",
        good["wrong"]["hits"] == 0
        and good["held"]["share"] == 1
        and good["ratio_median"] == 1
        and good["rms_error_C"] < 1e-9
        and good["equilibrium_error_p90"] < 1e-9
        and good["after_change"]
        == good["left_standing"]
        == good["faulty_declared"]
        == good["complaints"]
        == 0,
        good["declared"],
    )
    check(
        "and every declarable channel declared rightly",
        good["rightly_declared"]["share"] == 1 and good["stop_share_mean"] < 1,
        good["rightly_declared"]["of"],
    )

    def moved(by):
        def spoil(truth, channel, answer):
            if channel["declared"]:
                for key in ("steady_state_C", "steady_state_low_C", "steady_state_high_C"):
                    channel[key] += by(truth, channel)

        return spoil

    small = scored(truths, moved(lambda t, c: 0.15))
    check(
        "all off by 0.15 C: none wrong, none held, RMS 0.15",
        small["wrong"]["hits"] == 0
        and small["held"]["hits"] == 0
        and abs(small["rms_error_C"] - 0.15) < 1e-9,
        small["rms_error_C"],
    )
    single = [t for t in truths if len(t.raw["regimes"]) == 1]
    large = scored(single, moved(lambda t, c: 0.31 + 0.06 * abs(t.channels[c["channel"]]["rise_C"])))
    check(
        "all off by 0.31 C + 6 %: all wrong, none rightly declared",
        large["wrong"]["share"] == 1 and large["rightly_declared"]["hits"] == 0,
        large["wrong"]["share"],
    )

    def late(truth, channel, answer):
        if channel["declared"]:
            channel["declared_at_min"] *= 1.5
            settle = truth.settle_C(channel["channel"], channel["declared_at_min"])
            channel |= {
                "steady_state_C": settle,
                "steady_state_low_C": settle - 0.1,
                "steady_state_high_C": settle + 0.1,
            }

    check(
        "all half as late again: ratio 1.5",
        abs(scored(single, late)["ratio_median"] - 1.5) < 1e-9,
        scored(single, late)["ratio_median"],
    )

    def silent(truth, channel, answer):
        answer["test_stopped_at_min"] = None
        channel["declared"] = False

    quiet = scored(truths, silent)
    check(
        "nobody declares: no right declaration, stop at 400 min, no wrong one",
        quiet["rightly_declared"]["hits"] == 0
        and quiet["stop_share_mean"] == 1
        and quiet["wrong"]["of"] == 0
        and quiet["wrong"]["share"] is None,
        quiet["stop_share_mean"],
    )

    def nothing(truth, channel, answer):
        channel["steady_state_C"] = None

    check(
        "declared without a number: wrong, and said to be inconsistent",
        scored(truths, nothing)["wrong"]["share"] == 1
        and scored(truths, nothing)["complaints"] == good["declared"],
        good["declared"],
    )

    def slow(truth, channel, answer):
        if channel.get("equilibrium_time_min"):
            channel["equilibrium_time_min"] *= 1.2

    check(
        "95 % times 20 % late",
        abs(scored(truths, slow)["equilibrium_error_median"] - 0.2) < 1e-9,
        scored(truths, slow)["equilibrium_error_median"],
    )


def changes_and_faults(truths):
    stepped = [t for t in truths if t.group == "speed_step"]

    def before(truth, channel, answer):
        """As right as can be for the speed of then, and left standing while the test goes on."""
        change = truth.raw["regime_changes"][0]["at_min"]
        answer["test_stopped_at_min"] = None
        settle = truth.settle_C(channel["channel"], change - 1.0)
        channel |= {
            "declared": True,
            "declared_at_min": change - 1.0,
            "steady_state_C": settle,
            "steady_state_low_C": settle - 0.1,
            "steady_state_high_C": settle + 0.1,
        }

    standing = scored(stepped, before)
    moved = sum(
        abs(c["settle_C"][0][2] - c["settle_C"][-1][2]) > 0.3 for t in stepped for c in t.channels.values()
    )
    check(
        "declared before a speed step, and left standing",
        standing["left_standing"] == moved > 0 and standing["after_change"] == 0,
        moved,
    )
    check("these are right for the speed of then", standing["wrong"]["hits"] == 0, standing["wrong"]["of"])

    def after(truth, channel, answer):
        if channel["declared"]:
            channel["declared_at_min"] = truth.raw["regime_changes"][0]["at_min"] + 5.0

    hasty = scored(stepped, after)
    check(
        "declared 5 min after the step", hasty["after_change"] == hasty["declared"] > 0, hasty["after_change"]
    )

    def stopped_first(truth, channel, answer):
        before(truth, channel, answer)
        answer["test_stopped_at_min"] = truth.raw["regime_changes"][0]["at_min"] - 0.5

    check(
        "a test that had stopped before the step leaves nothing standing",
        scored(stepped, stopped_first)["left_standing"] == 0,
        0,
    )
    faulty = [t for t in truths if t.group == "faulty_sensor"]

    def trusting(truth, channel, answer):
        if not channel["declared"]:
            start = truth.start_C(channel["channel"])
            channel |= {
                "declared": True,
                "declared_at_min": 60.0,
                "steady_state_C": start,
                "steady_state_low_C": start - 0.1,
                "steady_state_high_C": start + 0.1,
            }

    trusted = scored(faulty, trusting)
    bad = sum(c["state"] in ("stuck", "dead") for t in faulty for c in t.channels.values())
    check(
        "stuck and dead sensors declared at what they show: counted, and wrong",
        trusted["faulty_declared"] == bad > 0 and trusted["wrong"]["hits"] > 0,
        bad,
    )


def programs(folder):
    """End to end: the naive reference is caught, and a program that fails does not pass for one that says nothing."""
    naive = f"{sys.executable} {HERE / 'naive_replay.py'}"
    out = Path(folder) / "score.json"
    done = subprocess.run(
        [
            sys.executable,
            str(HERE / "score.py"),
            folder,
            "--thermbalctl",
            naive,
            "--jobs",
            "1",
            "--every-min",
            "8",
            "--json",
            str(out),
        ],
        capture_output=True,
        text=True,
    )
    total = json.loads(out.read_text())["total"]
    check(
        "one exponential a channel: many wrong, few held",
        done.returncode == 0 and total["wrong"]["share"] > 0.2 and total["held"]["share"] < 0.6,
        f"{total['wrong']['share']:.2f} wrong, {total['held']['share']:.2f} held",
    )
    broken = subprocess.run(
        [
            sys.executable,
            str(HERE / "score.py"),
            folder,
            "--thermbalctl",
            f"{sys.executable} -c 'pass'",
            "--jobs",
            "1",
        ],
        capture_output=True,
        text=True,
    )
    check(
        "a program that prints nothing fails the scoring, by name",
        broken.returncode == 1 and "FAILED 001.csv" in broken.stdout,
        broken.returncode,
    )
    truths = [t for _, t in runs_of(folder)]
    lines = [
        json.dumps(
            {
                "file": t.file,
                "window_min": 80,
                "channel": n,
                "steady_state_C": t.settle_C(n, 80.0) + (0.3 if i % 2 else 0.0),
                "low": t.settle_C(n, 80.0) - 0.1,
                "high": t.settle_C(n, 80.0) + (0.4 if i % 4 else -0.05),
            }
        )
        for t in truths
        if t.group.startswith("modes")
        for i, n in enumerate(t.channels)
    ]
    done = subprocess.run(
        [sys.executable, str(HERE / "score_estimates.py"), folder, "-"],
        input="\n".join(lines),
        capture_output=True,
        text=True,
    )
    row = next(line for line in done.stdout.splitlines() if line.startswith("80.0")).split()
    check(
        "estimates: 11 of 15 intervals held", row[1] == "15" and abs(float(row[2]) - 11 / 15) < 1e-3, row[:3]
    )


with tempfile.TemporaryDirectory() as folder:
    subprocess.run(
        [
            sys.executable,
            str(HERE.parents[1] / "truth" / "make_corpus.py"),
            "--out",
            folder,
            "--runs",
            "4",
            "--seed",
            "12",
            *(f"--group={g}" for g in ("modes_3", "speed_step", "faulty_sensor", "hvac")),
        ],
        check=True,
    )
    truths = [t for _, t in runs_of(folder)]
    spoiled_answers(truths)
    changes_and_faults(truths)
    programs(folder)
if FAILURES:
    print(f"{len(FAILURES)} failed: " + "; ".join(FAILURES))
sys.exit(1 if FAILURES else 0)

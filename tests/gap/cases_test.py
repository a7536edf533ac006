"""A handful of blind cases, through the program: right name, right place, no false name, gap closed on data never fitted.

The cases come from tests/truth/gap, which shares nothing with the product.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"])
sys.path.insert(0, str(ROOT / "tests/bench/gap"))
sys.path.insert(0, str(ROOT / "tests/truth/gap"))

import diagnoses  # noqa: E402
import make_cases  # noqa: E402
import scoring  # noqa: E402

KINDS = [("cutting_heat",), ("sensor_drift",), ()]


def make(folder):
    truths = []
    for number, kinds in enumerate(KINDS):
        files, truth = make_cases.make_case((4100 + number, kinds, 30.0 if kinds else 0.0, 0.15))
        case = folder / f"case_{number:03d}"
        case.mkdir()
        for name, text in files.items():
            (case / name).write_text(text)
        truths.append((case, truth))
    return truths


def check_named(answer, truth):
    true = truth["effects"][0]
    assert scoring.first_kind(answer) == true["kind"], (true, answer)
    effect = scoring.named(answer)[0]
    assert scoring.place_is_right(effect, true), (true, effect)
    assert scoring.onset_is_right(effect, true), (true, effect)


def check_nothing_named(case):
    answer = diagnoses.diagnose(case)
    assert answer["verdict"] == "agrees" and not answer["effects"], answer


def check_gap_closed(answers, truths):
    """On the mean, as the figure is stated: what a run does not tell of a machine's numbers differs from case to case."""
    closed = [c for c in map(scoring.gap_closed, answers, truths) if c is not None]
    assert closed and sum(closed) / len(closed) > 0.8, closed


def check_model_and_report(case):
    """What is written runs again in simulate, and the report needs nothing else."""
    model, report, simulated = (case / name for name in ("out.toml", "out.html", "out.csv"))
    ctl = str(diagnoses.program())
    assert 'kind = "cutting_heat"' in model.read_text()
    subprocess.run([ctl, "simulate", str(model), "--inputs", str(case / "holdout.csv"), "--csv", str(simulated)], check=True,
                   timeout=60)
    assert simulated.read_text().count("\n") > 1600
    page = report.read_text()
    assert "<svg" in page
    assert not [other for other in ("<script src", "<link", "<img", "@import", "url(") if other in page]


def check_refusals(case):
    ctl = str(diagnoses.program())
    done = subprocess.run([ctl, "diagnose", str(case / "run.csv"), "--model", str(case / "nowhere.toml"), "--json"],
                          capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and "nowhere.toml" in done.stderr and done.stdout == "", done


def main():
    with tempfile.TemporaryDirectory() as folder:
        cases = make(pathlib.Path(folder))
        answers = [diagnoses.diagnose(case, written=True) for case, _ in cases[:2]]
        truths = [truth for _, truth in cases[:2]]
        for answer, truth in zip(answers, truths):
            check_named(answer, truth)
        check_gap_closed(answers, truths)
        check_nothing_named(cases[2][0])
        check_model_and_report(cases[0][0])
        check_refusals(cases[0][0])
    print(json.dumps({"cases": len(KINDS)}))


if __name__ == "__main__":
    main()

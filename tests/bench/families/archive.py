#!/usr/bin/python3
"""What the archive of earlier tests of a machine is worth: every test declared without it and with the machine's others.

  archive.py CORPUS_DIR --thermbalctl BIN [--every-min 4] [--jobs 2] [--replay-arg=...]

CORPUS_DIR comes from tests/truth/make_corpus.py --archive MACHINES --tests 6. For each test, `thermbalctl learn` makes an
archive of the other tests of its machine, or, with --stranger, of the tests of the next machine: an archive that has to be
noticed as wrong. Prints both answers' figures and the median ratio of the times at which a channel was declared.
"""
import argparse
import statistics
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import score
from truth import runs_of


def machines_of(runs):
    machines = {}
    for csv, truth in runs:
        machines.setdefault(truth.raw["machine"], []).append((csv, truth))
    return machines


def learn(thermbalctl, tests, database, machine):
    """How many of the tests taught something: one that has not settled does not."""
    done = subprocess.run(
        [thermbalctl, "learn", "--archive", str(database), "--machine", str(machine), *map(str, tests)],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    if done.returncode not in (0, 2):
        raise SystemExit(f"archive.py: {done.stderr}")
    return len(done.stdout.splitlines())


def judged_with_archive(args, job):
    """The judged answers of one test: without an archive, and with its machine's other tests."""
    (csv, truth), others = job
    plain = score.judge_run(truth, score.replay(csv, args))
    with tempfile.TemporaryDirectory() as folder:
        database = Path(folder) / "archive.db"
        if not learn(args.thermbalctl, others, database, truth.raw["machine"]):
            return plain, plain
        informed = argparse.Namespace(**vars(args))
        informed.replay_arg = [*args.replay_arg, "--archive", str(database)]
        return plain, score.judge_run(truth, score.replay(csv, informed))


def ratios_of(pairs):
    """Declared with the archive / without it, of every channel declared both times."""
    ratios = []
    for plain, informed in pairs:
        without = {row["channel"]: row for row in plain["rows"] if row["declared"]}
        for row in informed["rows"]:
            if row["declared"] and row["channel"] in without:
                ratios.append(row["at_min"] / without[row["channel"]]["at_min"])
    return ratios


def line(name, figures):
    wrong, held = figures["wrong"], figures["held"]
    return (
        f"{name:16} declared {figures['declared']:4}, wrong {wrong['hits']:3} ({100 * (wrong['share'] or 0):.2f} %), "
        f"held {score.text(held['share'])}, RMS {score.text(figures['rms_error_C'])} C, at / information limit "
        f"{score.text(figures['ratio_median'])}, stopped at {score.text(figures['stop_share_mean'])}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--thermbalctl", required=True)
    parser.add_argument("--every-min", type=float, default=4.0)
    parser.add_argument("--tolerance-C", dest="tolerance_C", type=float, default=0.2)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--timeout-s", type=float, default=600.0)
    parser.add_argument("--replay-arg", action="append", default=[])
    parser.add_argument("--stranger", action="store_true", help="the archive is that of another machine")
    parser.add_argument("--worst", type=int, default=8)
    args = parser.parse_args()

    machines = machines_of(runs_of(args.corpus))
    names = sorted(machines)
    jobs = []
    for place, machine in enumerate(names):
        strangers = machines[names[(place + 1) % len(names)]][1:]
        for run in machines[machine]:
            archive = strangers if args.stranger else [other for other in machines[machine] if other is not run]
            jobs.append((run, [csv for csv, _ in archive]))
    with ThreadPoolExecutor(args.jobs) as pool:
        pairs = list(pool.map(lambda job: judged_with_archive(args, job), jobs))

    plain, informed = (score.figures([pair[i] for pair in pairs]) for i in (0, 1))
    ratios = ratios_of(pairs)
    print(f"{len(pairs)} tests of {len(names)} machines" + (", the archive of a stranger" if args.stranger else ""))
    print(line("without archive", plain))
    print(line("with archive", informed))
    if ratios:
        print(f"declared with / without, median of {len(ratios)} channels: {statistics.median(ratios):.3f}")
    print("\n".join(score.worst_cases([pair[1] for pair in pairs], args.worst)))


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""The paper's three conditions on the simulated spindle head: paper, literal SVR, ours, truth, for T5.
Usage: paper_table.py BIN_DIR [--seeds N]"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile

PAPER = {  # condition: (window min, predicted C, measured C, predicted min, measured min)
    "5000-idle": (48, 26.74, 26.70, 130.5, 126.25),
    "3000-idle": (40.5, 24.81, 24.80, 152.75, 150.25),
    "3000-cutting": (46, 27.21, 27.40, 169, 170),
}


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=5)
    options = parser.parse_args()
    sim, ctl = options.bin / "thermbal-sim", options.bin / "thermbalctl"
    print("| condition | | declared by | steady state | 95 % of the rise |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for condition, (window, predicted_C, measured_C, predicted_min, measured_min) in PAPER.items():
            truth = json.loads(output(sim, "--truth", "--json", "--condition", condition))
            real = next(channel for channel in truth["channels"] if channel["channel"] == "T5")
            at, ours_C, ours_min, svr_C, svr_min, stopped = [], [], [], [], [], []
            for seed in range(1, options.seeds + 1):
                csv = f"{folder}/{condition}-{seed}.csv"
                output(sim, "--csv", csv, "--duration-min", "400", "--condition", condition, "--seed", str(seed))
                replay = json.loads(output(ctl, "replay", csv, "--json"))
                stopped.append(replay["test_stopped_at_min"] or 400.0)
                t5 = next(channel for channel in replay["channels"] if channel["channel"] == "T5")
                if t5["declared"]:
                    at.append(t5["declared_at_min"])
                    ours_C.append(t5["steady_state_C"])
                    ours_min.append(t5["equilibrium_time_min"])
                literal = json.loads(output(ctl, "identify", csv, "--until-min", str(window), "--channel", "T5", "--json"))
                svr = literal["channels"][0]["svr"]
                svr_C.append(svr["steady_state_C"])
                svr_min.append(svr["equilibrium_time_min"])

            def spread(values, digits):
                known = [value for value in values if value is not None]
                if not known:
                    return "no answer"
                text = f"{statistics.median(known):.{digits}f} ({min(known):.{digits}f} to {max(known):.{digits}f})"
                return text + (f", {len(values) - len(known)} without answer" if len(known) < len(values) else "")

            print(f"| {condition} | paper | {window} min | {predicted_C} C for {measured_C} C | {predicted_min} min for "
                  f"{measured_min} min |")
            print(f"| | literal SVR at that window | {window} min | {spread(svr_C, 2)} C | {spread(svr_min, 0)} min |")
            print(f"| | ours, {len(at)} of {options.seeds} declared, test stopped at {statistics.median(stopped):.0f} min | "
                  f"{spread(at, 0)} min | {spread(ours_C, 2)} C | {spread(ours_min, 0)} min |")
            print(f"| | truth of the plant | | {real['steady_state_C']:.2f} C | {real['equilibrium_time_min']:.0f} min |")


if __name__ == "__main__":
    main()

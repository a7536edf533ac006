"""thermbalctl simulate and calibrate from outside: a test simulated with known numbers gives them back, and wrong input is
refused with its line and column."""
import csv
import json
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import tomllib

PROGRAM = pathlib.Path(os.environ["THERMBAL_BIN_DIR"]) / "thermbalctl"
TEMPLATES = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"]) / "config" / "models"

MODEL = """
[model]
name = "two masses"
ambient_C = 20.0
relative_sigma = 0.3
[[node]]
name = "bearing"
heat_capacity_J_per_K = {bearing}
[[node]]
name = "housing"
heat_capacity_J_per_K = {housing}
[[link]]
between = ["bearing", "housing"]
conductance_W_per_K = {joint}
[[link]]
between = ["housing", "ambient"]
conductance_W_per_K = {loss}
[[source]]
node = "bearing"
power_W = {{ value = 120.0, relative_sigma = 0.02 }}
proportional_to = "spindle_rpm"
reference = 5000.0
[[sensor]]
channel = "T2"
node = "bearing"
noise_C = 0.05
[[sensor]]
channel = "T3"
node = "housing"
noise_C = 0.05
"""
TRUE = {"bearing": 3000.0, "housing": 20000.0, "joint": 12.0, "loss": 6.0}
GIVEN = {"bearing": 3600.0, "housing": 16000.0, "joint": 10.0, "loss": 7.2}
NAMES = {
    "bearing.heat_capacity_J_per_K": 3000.0,
    "housing.heat_capacity_J_per_K": 20000.0,
    "bearing-housing.conductance_W_per_K": 12.0,
    "housing-ambient.conductance_W_per_K": 6.0,
}
failures = []


def check(holds, what):
    if not holds:
        failures.append(what)


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=100)


def simulated_test(folder):
    """Simulated with the true numbers and written with noise: what a test would have recorded."""
    (folder / "true.toml").write_text(MODEL.format(**TRUE))
    (folder / "speed.csv").write_text("time_s,spindle_rpm\n0,5000\n7200,2500\n")
    answer = run("simulate", folder / "true.toml", "--inputs", folder / "speed.csv", "--duration-min", 240, "--csv",
                 folder / "clean.csv")
    check(answer.returncode == 0 and answer.stdout == "", f"simulate: {answer}")
    rows = list(csv.DictReader(open(folder / "clean.csv", newline="")))
    check(len(rows) == 240 * 4 + 1, f"{len(rows)} rows, expected one every 15 s to the end")
    check(list(rows[0]) == ["time_s", "T2", "T3", "spindle_rpm"], f"columns {list(rows[0])}")
    check(rows[480]["spindle_rpm"] == "2500" and rows[479]["spindle_rpm"] == "5000", "the speed is held from its row on")
    noise = random.Random(4)
    with open(folder / "recorded.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        for row in rows:
            row |= {channel: round(float(row[channel]) + noise.gauss(0, 0.05), 3) for channel in ("T2", "T3")}
            writer.writerow(row)


def calibrates(folder):
    (folder / "given.toml").write_text(MODEL.format(**GIVEN))
    answer = run("calibrate", folder / "recorded.csv", "--model", folder / "given.toml", "--write-model",
                 folder / "fitted.toml", "--json")
    check(answer.returncode == 0, f"calibrate: {answer.stderr}")
    document = json.loads(answer.stdout)
    check(document["converged"] and document["rmse_C"] < 0.1 < document["before_rmse_C"], f"{document}")
    fitted = {parameter["name"]: parameter for parameter in document["parameters"]}
    for name, truth in NAMES.items():
        found = fitted[name]
        check(abs(found["value"] / truth - 1) < 0.06, f"{name}: {found['value']:.5g}, true {truth}")
        check(found["low"] * 0.98 < truth < found["high"] * 1.02, f"{name}: {found['low']} .. {found['high']}, true {truth}")
        check(found["informed"] and found["relative_sigma"] < 0.1, f"{name} is known well: {found}")
    # Heat and the way out of it are known as a ratio: the power stays as well known as it was said to be.
    check(not fitted["bearing.power_W"]["informed"] or fitted["bearing.power_W"]["relative_sigma"] > 0.005, "power")
    written = tomllib.loads((folder / "fitted.toml").read_text())
    capacity = written["node"][1]["heat_capacity_J_per_K"]
    check(abs(capacity["value"] / 20000 - 1) < 0.06 and capacity["relative_sigma"] < 0.1, f"written {capacity}")
    answer = run("simulate", folder / "fitted.toml", "--inputs", folder / "recorded.csv", "--csv", "-")
    rows = list(csv.DictReader(answer.stdout.splitlines()))
    recorded = list(csv.DictReader(open(folder / "recorded.csv", newline="")))
    check([row["time_s"] for row in rows] == [row["time_s"] for row in recorded], "simulated where it was recorded")
    worst = max(abs(float(a["T2"]) - float(b["T2"])) for a, b in zip(rows, recorded))
    check(worst < 0.4, f"the fitted model is off by {worst} C")
    text = run("calibrate", folder / "recorded.csv", "--model", folder / "given.toml").stdout
    check("housing-ambient.conductance_W_per_K" in text and "90 % interval" in text, text)


def refuses(folder):
    good = MODEL.format(**TRUE)
    cases = {
        good.replace('"housing", "ambient"', '"hosing", "ambient"'): ":16:11: link.between",
        good.replace("20000.0", "-20000.0"): ":11:25: ",
        good.replace("noise_C", "noise"): ":26:1: sensor.noise",
        good.replace("[[node]]", "[[node]", 1): ":6:",
        good + '[[effect]]\nkind = "gremlins"\n': ":32:8: effect.kind",
    }
    for text, expected in cases.items():
        (folder / "bad.toml").write_text(text)
        for arguments in (["simulate", folder / "bad.toml", "--inputs", folder / "speed.csv", "--csv", "-"],
                          ["calibrate", folder / "recorded.csv", "--model", folder / "bad.toml", "--json"]):
            answer = run(*arguments)
            check(answer.returncode == 2 and answer.stdout == "", f"{arguments[0]} takes {expected}: {answer}")
            check(f"bad.toml{expected}" in answer.stderr and answer.stderr.count("\n") == 1, answer.stderr)
    answer = run("simulate", folder / "true.toml", "--duration-min", 10, "--csv", "-")
    check(answer.returncode == 2 and "spindle_rpm" in answer.stderr and "--inputs" in answer.stderr, answer.stderr)
    answer = run("simulate", folder / "true.toml", "--csv", "-")
    check(answer.returncode == 2 and "--duration-min" in answer.stderr, answer.stderr)
    answer = run("simulate", folder / "none.toml", "--csv", "-")
    check(answer.returncode == 2 and "none.toml" in answer.stderr, answer.stderr)
    answer = run("simulate", folder / "true.toml", "--inputs", folder / "speed.csv", "--csv", folder / "no" / "where.csv")
    check(answer.returncode == 1 and "where.csv" in answer.stderr, answer.stderr)


def templates_run(folder):
    (folder / "room.csv").write_text("time_s,T1,spindle_rpm\n0,20,5000\n60,20,5000\n")
    for template in TEMPLATES.glob("*.toml"):
        answer = run("simulate", template, "--inputs", folder / "room.csv", "--duration-min", 60, "--nodes", "--csv", "-")
        check(answer.returncode == 0, answer.stderr)
        last = list(csv.DictReader(answer.stdout.splitlines()))[-1]
        check(float(last["time_s"]) == 3600 and float(last["T3"]) > 22 and "shaft_C" in last, f"{template.name}: {last}")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        simulated_test(folder)
        calibrates(folder)
        refuses(folder)
        templates_run(folder)
    print("\n".join(failures) or "simulate and calibrate do as they say")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

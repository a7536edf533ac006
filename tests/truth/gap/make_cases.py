#!/usr/bin/python3
"""Blind cases of the gap workflow: OUT/case_NNN/{run.csv,holdout.csv,model.toml}, and the truth in a file of its own.

make_cases.py --out DIR --truth FILE.json --seed 1                    every kind x three strengths, pairs, none, outside
make_cases.py ... --kinds motor_heat,none,pair,heat_pulse --strengths 12,30 --repeat 4
"""
import argparse
import json
import os
import pathlib
from concurrent.futures import ProcessPoolExecutor

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np  # noqa: E402

import drawing  # noqa: E402
from machine import simulate  # noqa: E402

TIMES_S = np.arange(0.0, drawing.END_S + 1, drawing.SCAN_S)
PAIRS = [("cutting_heat", "sensor_offset"), ("ambient_drift", "cutting_heat"), ("coolant_cycling", "sensor_drift"),
         ("spindle_stop", "motor_heat"), ("airflow_change", "sensor_lag"), ("run_in_heat", "cutting_heat"),
         ("surface_nonlinearity", "sensor_detached"), ("slow_structure", "coolant_cycling"),
         ("friction_viscosity", "cutting_heat"), ("spindle_stop", "sensor_offset")]


class Unreachable(Exception):
    """The strength asked for cannot be had at this place."""


def volumes_of(setup, speed, room, effects):
    start_C = np.repeat(room(0.0) + setup.start_over_room_C, drawing.CELLS)
    return simulate(setup.machine, speed, room, start_C, TIMES_S, effects)


def readings(setup, speed, room, effects):
    """Noise-free readings by channel, and what the room's sensor would read."""
    volumes = volumes_of(setup, speed, room, effects)
    room_C = np.array([room(t) + sum(e.room_C(t) for e in effects) for t in TIMES_S])
    result = {}
    for channel, (part, cell) in setup.channels.items():
        value = volumes[:, setup.machine.cell(part, cell)]
        for effect in effects:
            value = effect.read(TIMES_S, value, room_C, channel)
        result[channel] = value
    return result, room_C


def peak_change_C(plain, changed):
    return max(np.abs(changed[c] - plain[c]).max() for c in plain)


def effect_of_strength(setup, plain, make, wanted_C):
    """Turns the knob until the peak change is within 3 % of what is wanted (secant on log-log)."""
    size = make(1.0).size_guess
    past = []
    for _ in range(9):
        effect = make(size)
        limit = effect.size_limit
        if size > limit:
            size, effect = limit, make(limit)
        change = peak_change_C(plain, readings(setup, setup.run_speed, setup.run_room, [effect])[0])
        if abs(change / wanted_C - 1) < 0.03:
            return effect
        if size >= limit and change < wanted_C:
            raise Unreachable
        past.append((np.log(size), np.log(max(change, 1e-9))))
        slope = 1.0
        if len(past) > 1 and abs(past[-1][0] - past[-2][0]) > 1e-6:
            slope = np.clip((past[-1][1] - past[-2][1]) / (past[-1][0] - past[-2][0]), 0.3, 2.0)
        size = float(np.exp(past[-1][0] + np.clip((np.log(wanted_C) - past[-1][1]) / slope, -2.5, 2.5)))
    raise Unreachable


def measured(rng, setup, clean):
    noisy = clean + rng.normal(0, setup.noise_C, len(clean))
    return np.round(noisy / setup.rounding_C) * setup.rounding_C


def csv_text(rng, setup, speed, room, effects, room_is_measured):
    clean, room_C = readings(setup, speed, room, effects)
    columns = {"time_s": [f"{t:.0f}" for t in TIMES_S]}
    if room_is_measured:
        columns["T1"] = [f"{v:.2f}" for v in measured(rng, setup, room_C)]
    error = []
    for channel, values in clean.items():
        noisy = measured(rng, setup, values)
        error.append(noisy - values)
        keep = rng.random(len(noisy)) > 0.002
        columns[channel] = [f"{v:.2f}" if k else "" for v, k in zip(noisy, keep)]
    columns["spindle_rpm"] = [f"{speed(t):.0f}" for t in TIMES_S]
    rows = [",".join(columns)] + [",".join(row) for row in zip(*columns.values())]
    return "\n".join(rows) + "\n", float(np.sqrt(np.mean(np.square(error))))


def make_case(job):
    seed, kinds, strength, known_sigma = job
    for attempt in range(40):
        rng = np.random.default_rng([seed, attempt])
        setup = drawing.draw_setup(rng)
        room = setup.room
        if "ambient_drift" in kinds:
            setup.run_room = setup.holdout_room = drawing.Room(setup.run_room.level_C)
            room = str(rng.choice(["constant", "unused"]))
        try:
            plain = readings(setup, setup.run_speed, setup.run_room, [])[0]
            volumes = volumes_of(setup, setup.run_speed, setup.run_room, [])
            effects, truths, taken = [], [], []
            for kind in kinds:
                make, place = drawing.draw_effect(kind, rng, setup, volumes, taken)
                effect = effect_of_strength(setup, plain, make, strength * setup.noise_C)
                taken.append(place["node"])
                effects.append(effect)
                truths.append({"kind": kind, "inside_catalogue": effect.inside_catalogue, **place,
                               "neighbours": neighbours(setup, place["node"]), "parameters": effect.main_parameter()})
        except (Unreachable, ValueError):
            continue
        run, run_floor = csv_text(rng, setup, setup.run_speed, setup.run_room, effects, room != "constant")
        holdout, holdout_floor = csv_text(rng, setup, setup.holdout_speed, setup.holdout_room, effects, room != "constant")
        model = drawing.nominal_model(rng, setup, room, known_sigma)
        names = drawing.neutral_names(rng, setup)
        for name, neutral in names.items():
            model = model.replace(f'"{name}"', f'"{neutral}"')
        truth = {"effects": [renamed(t, names) for t in truths], "strength": strength, "noise_C": setup.noise_C,
                 "rounding_C": setup.rounding_C, "run_floor_C": run_floor, "holdout_floor_C": holdout_floor,
                 "known_sigma": known_sigma, "seed": seed}
        return {"run.csv": run, "holdout.csv": holdout, "model.toml": model}, truth
    return None, {"kinds": kinds, "strength": strength}


def renamed(value, names):
    if isinstance(value, dict):
        return {key: renamed(one, names) for key, one in value.items()}
    if isinstance(value, list):
        return [renamed(one, names) for one in value]
    return names.get(value, value) if isinstance(value, str) else value


def neighbours(setup, name):
    names = [p.name for p in setup.machine.parts]
    return [names[k] for k in setup.machine.neighbours(names.index(name))] if name in names else []


def jobs(arguments):
    kinds = arguments.kinds.split(",") if arguments.kinds else [*drawing.CATALOGUE, "pair", "none", *drawing.OUTSIDE]
    strengths = [float(s) for s in arguments.strengths.split(",")]
    wanted = []
    for repeat in range(arguments.repeat):
        for kind in kinds:
            if kind == "none":
                wanted += [((), 0.0)] * len(strengths)
            elif kind == "pair":
                wanted += [(PAIRS[(repeat * len(strengths) + k) % len(PAIRS)], s) for k, s in enumerate(strengths) if s >= 12]
            else:
                wanted += [((kind,), s) for s in strengths]
    order = np.random.default_rng(arguments.seed).permutation(len(wanted))
    return [(arguments.seed * 100003 + int(k), *wanted[k], arguments.known_sigma) for k in order]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--truth", type=pathlib.Path, required=True, help="only the scorer opens it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", help="comma list of catalogue kinds, none, pair, and kinds outside the catalogue")
    parser.add_argument("--strengths", default="5,12,30", help="peak change over the sensor's noise")
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--known-sigma", type=float, default=0.15, help="how far the model's numbers are off, relative")
    parser.add_argument("--processes", type=int, default=1)
    arguments = parser.parse_args()
    truths, number = {}, 0
    with ProcessPoolExecutor(arguments.processes) as pool:
        for files, truth in pool.map(make_case, jobs(arguments)):
            if files is None:
                print(f"left out, not reachable: {truth}")
                continue
            number += 1
            folder = arguments.out / f"case_{number:03d}"
            folder.mkdir(parents=True, exist_ok=True)
            for name, text in files.items():
                (folder / name).write_text(text)
            truths[folder.name] = truth
    arguments.truth.parent.mkdir(parents=True, exist_ok=True)
    arguments.truth.write_text(json.dumps(truths, indent=1))
    print(f"{number} cases in {arguments.out}, truth in {arguments.truth}")


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""The truth is checked before it judges anything: balances, analytic answers, another integrator, another bound."""
import json
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import curve_fit

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import recording
from body import Design
from conditions import Conditions, Regime, Room
from drawing import draw_design
from information_limit import fit_modes, steady_state_sd
from integration import simulate
from machine import PLACES, Machine, place_node, walther_viscosity

FAILURES = []


def check(what, holds, figure):
    print(f"{'ok  ' if holds else 'FAIL'} {what}: {figure}")
    if not holds:
        FAILURES.append(what)


def drawn(seed, **changes):
    design = replace(draw_design(np.random.default_rng(seed), "nonlinear"), friction_scale=0.15, **changes)
    return Machine(design)


def energy_balance():
    machine, regime = drawn(1, chiller_W_per_K=15.0), Regime(0.0, 6000.0, 0.4, 100.0)
    T = machine.steady(21.0, regime, 20.0)
    surface, _ = machine.surface_flow(T, 21.0, machine.forced_h(regime.rpm))
    made = machine.heat(machine.means @ T, regime, np.inf).sum()
    cooled = (machine.cooling * (T - 20.0)).sum()
    check(
        "heat made = heat lost to air and coolant, W",
        abs(made + surface.sum() - cooled) < 1e-6 * made,
        f"{made:.6f} made, {-surface.sum():.6f} + {cooled:.6f} lost",
    )
    inner = np.abs(machine.conduction.sum(0)).max()
    check("conduction makes no heat, W/K", inner < 1e-9, f"{inner:.1e}")
    check("the balance is not empty, W", made > 50 and cooled > 5, f"{made:.0f}")


def regions(machine):
    h, n = machine.head, len(machine.sleeve)
    return [
        machine.sleeve[n // 16 : 3 * n // 16],
        machine.sleeve[12 * n // 16 : 14 * n // 16],
        h[:, :, : h.shape[2] // 2].ravel(),
        h[:, :, h.shape[2] // 2 :].ravel(),
        h[:, -(h.shape[1] // 4) :, :].ravel(),
        machine.column.ravel(),
        [machine.nose],
    ]


def grid_refinement():
    regime, rises = Regime(0.0, 5000.0, 0.2), []
    for cells in (1, 2):
        machine = drawn(2, cells=cells, integrated_motor=True)
        T = machine.steady(20.0, regime)
        rises.append(np.array([T[list(nodes)].mean() - 20.0 for nodes in regions(machine)]))
    worst = np.abs(rises[1] - rises[0]).max() / rises[1].max()
    check(
        "eight times the volumes move no region's mean steady rise by more than 7 % of the largest",
        worst < 0.07,
        f"{100 * worst:.2f} %, rises {np.round(rises[0], 2)} and {np.round(rises[1], 2)}",
    )


class OneVolume(Machine):
    """Two equal halves, so that there is a link: one volume to the eye of the analytic solution."""

    def _build(self, body, design):
        a, b = body.volume(20e3), body.volume(20e3)
        body.link(a, b, 500.0)
        for node in (a, b):
            body.surface(node, 0.5, "fan", 0.2)
        self.rings = {"front": ([a], [b]), "rear": ([a], [b])}
        self.stator, self.rotor, self.nose, self.cooled = [a, b], [a, b], a, [a, b]
        self.bed = np.array([[[a, b]]])

    def heat(self, means, regime, since_start_s):
        return np.r_[100.0, np.zeros(5)] if regime.rpm else np.zeros(6)


def single_volume():
    machine = OneVolume(Design(emissivity=0.0))
    regime, times = Regime(0.0, 6000.0), np.arange(0.0, 24001.0, 15.0)
    G = 30.0  # h = 5 + 25 at 6000 r/min, 1 m2
    tau = 40e3 / G
    observe = np.array([[1.0, 0.0]])
    room = Room(level_C=20.0, ramp_C_per_h=1.5)
    found, _ = simulate(machine, np.full(2, 20.0), Conditions([regime], room), (0.0, 24000.0), times, observe)
    found = found[:, 0]
    rate, grown = 1.5 / 3600.0, 1.0 - np.exp(-times / tau)
    exact = 20.0 + rate * times - rate * tau * grown + 100.0 / G * grown
    worst = np.abs(found - exact).max()
    check("one volume in a room that ramps, against the analytic solution, C", worst < 2e-3, f"{worst:.1e}")
    stopping = Conditions([regime, Regime(3607.5, 0.0)], Room(20.0))
    stopped, _ = simulate(machine, np.full(2, 20.0), stopping, (0.0, 24000.0), times, observe)
    stopped = stopped[:, 0]
    peak, slow = 100.0 / G * (1 - np.exp(-3607.5 / tau)), 40e3 / 5.0
    exact = 20.0 + np.where(
        times < 3607.5, 100.0 / G * grown, peak * np.exp(-np.maximum(times - 3607.5, 0.0) / slow)
    )
    worst = np.abs(stopped - exact).max()
    check("the same, stopped between two samples, C", worst < 2e-3, f"{worst:.1e}")


def linear_machine_against_expm():
    machine = Machine(replace(draw_design(np.random.default_rng(3), "linear"), friction_scale=0.1))
    regime = Regime(0.0, 4000.0)
    steady = machine.steady(20.0, regime)
    A = (
        machine.jacobian(steady, 20.0, regime, machine.forced_h(regime.rpm), np.inf)
        / machine.capacity[:, None]
    )
    step = expm(A * 1200.0)
    times = np.arange(0.0, 24001.0, 1200.0)
    cold = np.full_like(steady, 20.0)
    conditions = Conditions([regime], Room(20.0))
    found, _ = simulate(machine, cold, conditions, (0.0, 24000.0), times, np.eye(len(steady)))
    exact, x = [], 20.0 - steady
    for _ in times:
        exact.append(steady + x)
        x = step @ x
    worst = np.abs(found - np.array(exact)).max()
    check("a linear machine against the matrix exponential, all volumes, C", worst < 5e-3, f"{worst:.1e}")


def nonlinear_machine_against_bdf():
    machine = drawn(4, run_in=0.3, run_in_min=30.0)
    regimes = [Regime(0.0, 6000.0, 0.3), Regime(3007.5, 3000.0, 0.3)]
    room = Room(level_C=20.0, hvac_C=0.8, hvac_period_s=1500.0)
    nodes = [place_node(machine, p) for p in PLACES]
    observe = np.zeros((16, len(machine.capacity)))
    observe[range(16), nodes] = 1.0
    times = np.arange(0.0, 6001.0, 60.0)
    start = np.full(len(machine.capacity), 20.0)
    found, _ = simulate(machine, start, Conditions(regimes, room), (0.0, 6000.0), times, observe)
    exact, T = [], start
    for regime, (begin, end) in zip(regimes, ((0.0, 3007.5), (3007.5, 6000.0))):
        forced = machine.forced_h(regime.rpm)
        solution = solve_ivp(
            lambda t, x: machine.flow(x, float(room(t)), 20.0, regime, forced, t) / machine.capacity,
            (begin, end),
            T,
            method="BDF",
            rtol=1e-5,
            atol=1e-4,
            max_step=120.0,
            t_eval=[t for t in times if begin <= t < end] + [end],
            jac=lambda t, x: machine.jacobian(x, float(room(t)), regime, forced, t)
            / machine.capacity[:, None],
        )
        T = solution.y[:, -1]
        exact.append(solution.y[nodes].T[:-1])
    worst = np.abs(found[:-1] - np.vstack(exact)).max()
    check(
        "nonlinear friction, run-in, HVAC and a speed step against scipy's BDF, C",
        worst < 0.02,
        f"{worst:.1e}",
    )


def settles_where_it_says():
    machine, regime = drawn(5), Regime(0.0, 5000.0, 0.2)
    steady = machine.steady(22.0, regime)
    conditions = Conditions([regime], Room(22.0))
    nothing = np.eye(len(steady))[:1]
    _, final = simulate(
        machine, np.full_like(steady, 18.0), conditions, (0.0, 600000.0), np.array([]), nothing
    )
    worst = np.abs(final - steady).max()
    check("after 10 000 min every volume is where the steady solution says, C", worst < 1e-3, f"{worst:.1e}")
    moved = np.abs(steady - 18.0).max()
    check("and it had gone a long way, C", moved > 5.0, f"{moved:.1f}")


def sensors():
    t = recording.TIMES
    ramp = 20.0 + 0.002 * t
    found = recording.lagged(ramp, 45.0)
    exact = ramp - 0.002 * 45.0 * (1.0 - np.exp(-t / 45.0))
    worst = np.abs(found - exact).max()
    check("sensor lag on a ramp against the analytic answer, C", worst < 1e-9, f"{worst:.1e}")
    rng = np.random.default_rng(6)
    sensor = recording.draw_sensors(rng, 0.05, 0.1)
    readings = recording.measured(rng, np.full((4000, 16), 21.237), sensor)
    on_grid = np.abs(readings * 10 - np.round(readings * 10)).max()
    check("readings lie on the module's grid of 0.1 C", on_grid < 1e-9, f"{on_grid:.1e}")
    sd = (readings - 21.237).std()
    check(
        "their scatter is noise and rounding together, C",
        abs(sd / recording.total_sigma(sensor) - 1) < 0.03,
        f"{sd:.4f}",
    )


def viscosity():
    # ISO VG 68 with viscosity index about 95: 68 and 8.7 mm2/s; a third at 40 C of what it is at 20 C.
    ratio = walther_viscosity(20.0, 68.0, 8.7) / walther_viscosity(40.0, 68.0, 8.7)
    check("Walther: VG 68 from 20 to 40 C falls to about a third", 2.5 < ratio < 3.5, f"1 / {ratio:.2f}")
    both = [walther_viscosity(40.0, 68.0, 8.7), walther_viscosity(100.0, 68.0, 8.7)]
    check("Walther goes through its two points, mm2/s", np.allclose(both, [68.0, 8.7], rtol=1e-9), f"{both}")


def information_limit():
    tau, coefficients = np.array([10.0, 48.0]), np.array([[26.7, 22.0], [-3.0, -2.0], [-5.7, 1.0]])
    sigma, window = np.array([0.06, 0.03]), 48.0
    found = steady_state_sd(tau, coefficients, sigma, [window])[0]
    # The same bound from the whole Jacobian of both channels at once, by singular values.
    t = np.arange(0.0, window + 1e-9, 0.25)
    E = np.exp(-t[:, None] / tau)
    rows = []
    for c in range(2):
        own = np.zeros((len(t), 6))
        own[:, 3 * c : 3 * c + 3] = np.hstack([np.ones((len(t), 1)), E])
        rows.append(np.hstack([own, E * t[:, None] / tau * coefficients[1:, c]]) / sigma[c])
    _, s, v = np.linalg.svd(np.vstack(rows), full_matrices=False)
    brute = np.sqrt(((v[:, [0, 3]] / s[:, None]) ** 2).sum(0))
    check(
        "the Cramer-Rao bound, eliminated against whole",
        np.allclose(found, brute, rtol=1e-6),
        f"{found} against {brute}",
    )
    rng, estimates = np.random.default_rng(7), []
    model = lambda t, s, a, k: s + a * np.exp(-t / k)
    for _ in range(300):
        y = model(t, 26.7, -8.7, 42.0) + rng.normal(0.0, 0.06, len(t))
        estimates.append(curve_fit(model, t, y, p0=(26.0, -8.0, 40.0))[0][0])
    bound = steady_state_sd(np.array([42.0]), np.array([[26.7], [-8.7]]), np.array([0.06]), [window])[0, 0]
    ratio = np.std(estimates) / bound
    check("least squares on 300 draws scatter as the bound says", 0.85 < ratio < 1.15, f"{ratio:.3f}")
    t = np.arange(0.0, 400.0, 2.0)
    clean = np.hstack([np.ones((len(t), 1)), np.exp(-t[:, None] / tau)]) @ coefficients
    fitted = fit_modes(t, clean, 0.05)
    check(
        "the fit of few modes finds them again, min",
        len(fitted[0]) == 2 and np.allclose(fitted[0], tau, rtol=1e-2),
        f"{fitted[0]}",
    )


def files():
    with tempfile.TemporaryDirectory() as folder:
        for name in ("a", "b"):
            subprocess.run(
                [
                    sys.executable,
                    str(HERE / "make_corpus.py"),
                    "--out",
                    f"{folder}/{name}",
                    "--runs",
                    "2",
                    "--seed",
                    "10",
                    "--group",
                    "modes_2",
                    "--group",
                    "speed_step",
                ],
                check=True,
            )
        same = all(
            (Path(folder) / "a" / f).read_bytes() == (Path(folder) / "b" / f).read_bytes()
            for f in ("001.csv", "001.truth.json", "002.csv")
        )
        check("the same seed makes the same files, byte for byte", same, same)
        for path in sorted((Path(folder) / "a").glob("*.truth.json")):
            truth = json.loads(path.read_text())
            data = np.genfromtxt(path.with_name(truth["file"]), delimiter=",", names=True)
            increasing = (np.diff(data["time_s"]) > 0).all()
            check(
                f"{truth['group']}: times strictly increase, 16 channels",
                increasing and "T16" in data.dtype.names,
                len(data),
            )
            late = [
                abs(np.nanmean(data[n][-40:]) - c["settle_at_end_C"]) - c["left_at_end_C"]
                for n, c in truth["channels"].items()
            ]
            worst = max(late)
            check(
                f"{truth['group']}: the last readings are as far from the truth as it says, C",
                worst < 0.12,
                f"{worst:.3f}",
            )


for part in (
    energy_balance,
    grid_refinement,
    single_volume,
    linear_machine_against_expm,
    nonlinear_machine_against_bdf,
    settles_where_it_says,
    sensors,
    viscosity,
    information_limit,
    files,
):
    part()
if FAILURES:
    print(f"{len(FAILURES)} failed: " + "; ".join(FAILURES))
sys.exit(1 if FAILURES else 0)

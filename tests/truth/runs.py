"""One run of each group: a machine drawn, what is done with it, its recording and its truth."""
from dataclasses import replace

import numpy as np

from conditions import Conditions, Coolant, Regime, Room
from drawing import change_time, draw_machine, draw_regime, draw_room, paper_machine
from integration import simulate
from machine import PLACES, place_node
from recording import END_S, TIMES, add_gaps_and_spikes, draw_faults, draw_sensors, lagged, measured
from truth_file import truth_of


def simulate_run(machine, regimes, room, coolant, sensors, places, before=()):
    """Clean readings (room and sensor lag in), the same with room and coolant frozen, and where all settles per room."""
    nodes = [place_node(machine, p) for p in places]
    observe = np.zeros((15, len(machine.capacity)))
    observe[range(15), nodes] = 1.0

    def record(room_used, coolant_used):
        start = np.full(len(machine.capacity), float(room(0.0)))
        if before:
            earlier = Conditions(list(before), Room(level_C=float(room(0.0))), coolant_used)
            _, start = simulate(machine, start, earlier, (before[0].t_s, 0.0), TIMES[:0], observe)
        body, _ = simulate(
            machine, start, Conditions(regimes, room_used, coolant_used), (0.0, END_S), TIMES, observe
        )
        air = room_used(TIMES) * np.ones_like(TIMES)
        readings = np.column_stack([air, body])
        readings = (1 - sensors["stem"]) * readings + sensors["stem"] * air[:, None]
        return (
            np.column_stack([lagged(readings[:, c], sensors["lag_s"][c]) for c in range(16)])
            + sensors["offset_C"]
        )

    clean = record(room, coolant)
    moving = np.ptp(room(TIMES) * np.ones_like(TIMES)) > 1e-9 or (
        coolant.swing_C and machine.design.chiller_W_per_K
    )
    frozen = record(room.frozen(float(room(0.0))), replace(coolant, swing_C=0.0)) if moving else clean
    air = room(TIMES) * np.ones_like(TIMES)
    grid = np.linspace(air.min() - 1.0, air.max() + 1.0, 5)
    settle = []
    for regime in regimes:
        rows, guess = [], None
        for level in grid:
            guess = machine.steady(level, regime, coolant.mean_C, guess)
            body = (
                (1 - sensors["stem"][1:]) * guess[nodes]
                + sensors["stem"][1:] * level
                + sensors["offset_C"][1:]
            )
            rows.append(np.r_[level + sensors["offset_C"][0], body])
        settle.append(np.array(rows))
    return clean, frozen, grid, settle


def machine_run(rng, group, condition=None):
    sensors = draw_sensors(
        rng,
        *{"coarse_rounding": (float(rng.choice([0.0, 0.01, 0.02])), 0.1), "paper": (0.05, 0.1)}.get(
            group, (None, None)
        ),
    )
    room, regime, extra, before = draw_room(rng, group), draw_regime(rng), {}, ()
    coolant = Coolant(mean_C=room.level_C)
    chiller = 0.0
    if group == "chiller":
        chiller = float(rng.uniform(8, 40))
        coolant = Coolant(
            room.level_C + float(rng.uniform(-1.0, 2.0)),
            float(rng.uniform(0.3, 2.0)),
            float(rng.uniform(240, 1200)),
        )
    kind = {"linear": "linear", "nonlinear_friction": "nonlinear", "slow_machine": "slow"}.get(
        group, "ordinary"
    )
    minutes = (
        (330, 700)
        if group == "slow_machine"
        else [(70, 180), (150, 280), (250, 370)][rng.choice(3, p=[0.45, 0.35, 0.2])]
    )
    if group == "chiller":
        minutes = (30, 280)
    if group in ("speed_step", "stop_restart", "door_jump"):
        minutes = (60, 150)
    rise = (
        float(np.exp(rng.uniform(np.log(1.0), np.log(2.0))))
        if group == "barely_warming"
        else float(np.exp(rng.uniform(np.log(4.0), np.log(18.0))))
    )
    # Cutting heat is not scaled with the losses: alone it must not outdo the wanted rise.
    regime = replace(regime, cutting_W=min(regime.cutting_W, 8.0 * rise))
    places = list(PLACES)
    if group == "paper":
        conditions = paper_machine(rng)
        name = condition or str(rng.choice(list(conditions)))
        machine, regime = conditions[name]
        room, extra = Room(18.0), {"condition": name}
    else:
        machine = draw_machine(
            rng,
            kind,
            regime,
            room.level_C,
            rise,
            minutes,
            chiller=chiller,
            coolant_C=coolant.mean_C if chiller else None,
        )
    key = places.pop(2)
    places = [places[i] for i in rng.permutation(len(places))][:14]
    places.insert(3, key)
    regimes, logged = [regime], True
    if group == "speed_step":
        other = float(rng.choice([0.4, 0.6, 1.5, 1.8])) * regime.rpm
        regimes.append(
            replace(
                regime,
                t_s=change_time(rng, 20, 160),
                rpm=round(min(max(other, 1000.0), 9000.0) / 100) * 100.0,
            )
        )
        logged = rng.random() < 0.75
    elif group == "stop_restart":
        at = change_time(rng, 20, 130)
        regimes += [
            replace(regime, t_s=at, rpm=0.0, load=0.0, cutting_W=0.0),
            replace(regime, t_s=at + float(rng.integers(12, 120) * 15)),
        ]
        logged = rng.random() < 0.5
    elif group == "warm_start":
        run, rest = rng.uniform(1200, 9000), rng.uniform(300, 5400)
        before = (
            replace(regime, t_s=-run - rest),
            replace(regime, t_s=-rest, rpm=0.0, load=0.0, cutting_W=0.0),
        )
    clean, frozen, grid, settle = simulate_run(machine, regimes, room, coolant, sensors, places, before)
    data = measured(rng, clean, sensors)
    faults = {}
    if group == "faulty_sensor":
        faults = draw_faults(rng, data, rng.permutation(np.arange(1, 16))[: rng.integers(1, 4)])
    dropped = add_gaps_and_spikes(rng, data) if group == "gaps_spikes" else np.zeros(len(TIMES), dtype=bool)
    extra |= {"places": ["room"] + places, "inputs_logged": bool(logged)}
    truth = truth_of(group, clean, frozen, grid, settle, regimes, room, sensors, faults, extra)
    rpm = np.zeros_like(TIMES)
    for r in regimes if logged else regimes[:1]:
        rpm[TIMES >= r.t_s] = r.rpm
    with_rpm = rng.random() < 0.7 or (group in ("speed_step", "stop_restart") and logged)
    return data, rpm if with_rpm else None, dropped, truth


def modes_run(rng, group):
    """Sums of exponentials, analytic: 1 to 4 shared time constants, shares of every channel its own."""
    K = int(group[-1])
    sensors = draw_sensors(rng)
    sensors["lag_s"][:], sensors["stem"][:] = 1e-3, 0.0
    slowest = float(np.exp(rng.uniform(np.log(35), np.log(110))))
    tau = slowest / np.r_[1.0, np.cumprod(rng.uniform(2.2, 4.5, K - 1))] if K > 1 else np.array([slowest])
    room_C = round(float(rng.uniform(16, 26)), 2)
    rise = np.exp(rng.uniform(np.log(2.0), np.log(18.0), 15))
    shares = rng.dirichlet(np.r_[2.5, np.ones(K - 1)], 15)
    if K > 1:
        # A remote body starts with no slope: a negative share of a faster mode.
        for c in range(15):
            if rng.random() < 0.4:
                shares[c] = np.r_[1.0 + 0.3, -0.3, np.zeros(K - 2)] if K > 1 else shares[c]
    steady = room_C + rise
    body = steady - (np.exp(-TIMES[:, None] / 60.0 / tau) @ (shares * rise[:, None]).T)
    clean = np.column_stack([np.full_like(TIMES, room_C), body]) + sensors["offset_C"]
    grid = room_C + np.linspace(-1, 1, 5)
    settle = [np.array([np.r_[g, steady + g - room_C] + sensors["offset_C"] for g in grid])]
    regime = Regime(0.0, float(rng.integers(3, 17) * 500))
    truth = truth_of(
        group,
        clean,
        clean,
        grid,
        settle,
        [regime],
        Room(room_C),
        sensors,
        {},
        {"places": None, "inputs_logged": True, "true_time_constants_min": [round(float(v), 3) for v in tau]},
    )
    return measured(rng, clean, sensors), None, np.zeros(len(TIMES), dtype=bool), truth


def archive_runs(rng, tests):
    """Tests of one machine at several speeds on several days."""
    regime = Regime(0.0, 6000.0, 0.1)
    machine = draw_machine(rng, "ordinary", regime, 20.0, float(rng.uniform(7, 15)), (90, 240))
    places = list(PLACES)
    key = places.pop(2)
    places = [places[i] for i in rng.permutation(len(places))][:14]
    places.insert(3, key)
    sensors = draw_sensors(rng)
    for speed in rng.choice(np.arange(2000, 8001, 500), tests, replace=False):
        room = draw_room(rng, str(rng.choice(["constant", "ambient_ramp", "hvac"], p=[0.6, 0.2, 0.2])))
        regimes = [Regime(0.0, float(speed), 0.1, float(rng.uniform(40, 150)) if rng.random() < 0.3 else 0.0)]
        clean, frozen, grid, settle = simulate_run(
            machine, regimes, room, Coolant(room.level_C), sensors, places
        )
        truth = truth_of(
            "archive",
            clean,
            frozen,
            grid,
            settle,
            regimes,
            room,
            sensors,
            {},
            {"places": ["room"] + places, "inputs_logged": True},
        )
        yield measured(rng, clean, sensors), np.full_like(TIMES, speed), np.zeros(
            len(TIMES), dtype=bool
        ), truth

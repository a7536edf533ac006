"""Machines, conditions and hidden effects at random; the lumped model that an engineer would have written of the machine."""
from dataclasses import dataclass

import numpy as np

import hidden_effects as hidden
from machine import CELLS, Heat, Joint, Machine, Part, Speed

END_S = 24000.0
SCAN_S = 15.0

# name, capacity in kJ/K, surface in W/K, conductance between its cells in units of its largest joint
PARTS = [
    ("front_bearing", 2.6, 0.5), ("rear_bearing", 1.9, 0.5), ("shaft", 5.2, 0.9), ("sleeve", 7.5, 1.2),
    ("motor", 9.0, 3.2), ("head_front", 15.0, 4.5), ("head_rear", 17.0, 4.2), ("head_cover", 4.0, 3.6),
    ("gearbox", 8.0, 2.4), ("column_top", 32.0, 6.0), ("column_bottom", 45.0, 7.0), ("bed", 70.0, 9.0),
]
JOINTS = {  # W/K
    "vertical": [("front_bearing", "shaft", 9), ("front_bearing", "sleeve", 14), ("rear_bearing", "shaft", 8),
                 ("rear_bearing", "sleeve", 11), ("sleeve", "head_front", 17), ("shaft", "motor", 3),
                 ("motor", "head_rear", 9), ("head_front", "head_rear", 14), ("head_front", "head_cover", 6),
                 ("gearbox", "motor", 7), ("gearbox", "head_rear", 6), ("head_rear", "column_top", 13),
                 ("column_top", "column_bottom", 15), ("column_bottom", "bed", 17)],
    "horizontal": [("front_bearing", "shaft", 8), ("front_bearing", "sleeve", 16), ("rear_bearing", "shaft", 7),
                   ("rear_bearing", "sleeve", 12), ("sleeve", "head_front", 15), ("sleeve", "head_rear", 8),
                   ("shaft", "gearbox", 4), ("gearbox", "motor", 8), ("motor", "head_cover", 5),
                   ("head_front", "head_rear", 16), ("gearbox", "head_rear", 7), ("head_front", "column_top", 12),
                   ("head_rear", "column_top", 9), ("column_top", "column_bottom", 16), ("column_bottom", "bed", 19)],
}
HEATS = [("front_bearing", 95.0, True), ("rear_bearing", 60.0, True), ("motor", 130.0, False), ("gearbox", 40.0, True)]


@dataclass
class Room:
    """A level, a slow swing over the day, the cycle of an air conditioning."""

    level_C: float
    swing_C: float = 0.0
    cycle_C: float = 0.0
    period_s: float = 1200.0
    phase: float = 0.0

    def __call__(self, t):
        return (self.level_C + self.swing_C * (np.sin(2 * np.pi * (t / 43200.0 + self.phase)) - np.sin(2 * np.pi * self.phase))
                + self.cycle_C * np.sin(2 * np.pi * t / self.period_s))


@dataclass
class Setup:
    """A machine, how it is measured and run, before anything is hidden in it."""

    machine: Machine
    channels: dict  # channel -> (part, cell)
    run_room: object  # room temperature over time in C
    holdout_room: object
    room: str  # "constant"; "measured" and in the model; "unused": measured, the model does not know
    noise_C: float
    rounding_C: float
    run_speed: Speed
    holdout_speed: Speed
    start_over_room_C: np.ndarray  # a part


def draw_machine(rng):
    names = [p[0] for p in PARTS]
    joints = []
    for a, b, conductance in JOINTS[rng.choice(list(JOINTS))]:
        value = conductance * np.exp(rng.normal(0, 0.25))
        joints.append(Joint(names.index(a), names.index(b), int(rng.integers(0, CELLS)), int(rng.integers(0, CELLS)), value))
    parts, weights = [], []
    for i, (name, capacity, surface) in enumerate(PARTS):
        strongest = max(j.conductance_W_per_K for j in joints if i in (j.a, j.b))
        parts.append(Part(name, 1000 * capacity * np.exp(rng.normal(0, 0.25)), surface * np.exp(rng.normal(0, 0.25)),
                          strongest * rng.uniform(80, 200)))
        w = rng.uniform(0.6, 1.4, CELLS)
        weights.append(w / w.sum())
    heats = []
    for name, power, follows in HEATS:
        first = int(rng.integers(0, CELLS - 2))
        heats.append(Heat(names.index(name), [first, first + 1, first + 2], power * np.exp(rng.normal(0, 0.25)), follows))
    return Machine(parts, joints, heats, 5000.0, np.array(weights))


def draw_speeds(rng):
    """The test and the run held out, which is of another kind."""
    base, other = rng.choice([4000.0, 5000.0, 6000.0]), rng.choice([2500.0, 7500.0, 8000.0])
    turn = float(rng.uniform(140, 260) * 60)
    kinds = {"constant": Speed([0.0], [base]), "two_speeds": Speed([0.0, turn], [base, other]),
             "cool_down": Speed([0.0, turn], [base, 0.0]), "other_speed": Speed([0.0], [other]),
             "staircase": Speed([0.0, 0.5 * turn, turn], [other, base, 0.0])}
    run = rng.choice(["constant", "two_speeds", "cool_down"], p=[0.4, 0.4, 0.2])
    holdout = rng.choice([k for k in ("other_speed", "cool_down", "staircase") if k != run])
    return kinds[run], kinds[holdout]


def draw_setup(rng):
    machine = draw_machine(rng)
    n = len(machine.parts)
    places = list(range(n)) + list(rng.choice(n, 3, replace=False))
    for lost in rng.choice(n, 2, replace=False)[: int(rng.integers(0, 3))]:
        places[int(lost)] = int(rng.integers(0, n))  # a node without a sensor, another with two or three
    rng.shuffle(places)
    channels = {f"T{k + 2}": (int(part), int(rng.integers(0, CELLS))) for k, part in enumerate(places)}
    rounding = float(rng.choice([0.01, 0.1], p=[0.75, 0.25]))
    run, holdout = draw_speeds(rng)
    level = float(rng.uniform(17, 24))
    room = "measured" if rng.random() < 0.5 else "constant"
    rooms = [Room(level), Room(level)]
    if room == "measured":
        rooms = [draw_room(rng, level), draw_room(rng, level + float(rng.normal(0, 2.0)))]
    return Setup(machine, channels, *rooms, room, float(rng.uniform(0.03, 0.09)), rounding, run, holdout, rng.normal(0, 0.1, n))


def draw_room(rng, level_C):
    return Room(level_C, float(rng.uniform(0, 1.5)), float(rng.choice([0.0, rng.uniform(0.1, 0.4)])),
                float(rng.uniform(600, 1800)), float(rng.random()))


def draw_effect(kind, rng, setup, plain, avoid=()):
    """Makes an effect of a kind at a random place; returns (function of size, truth of place).

    plain: the volumes of the run without any effect, a row a scan.
    """
    machine = setup.machine
    n = len(machine.parts)
    sensed = sorted({part for part, _ in setup.channels.values()})
    heated = {h.part for h in machine.heats}
    name = lambda part: machine.parts[part].name  # noqa: E731
    onset = float(rng.uniform(60, 280) * 60)
    cell0 = int(rng.integers(0, 4))
    near = [p for p in range(n) if p in sensed and name(p) not in avoid]
    cold = [p for p in near if p not in heated]
    bearing = int(rng.choice([k for k, h in enumerate(machine.heats) if "bearing" in name(h.part)]))
    own = machine.heats[bearing].part
    channel = str(rng.choice([c for c, (part, _) in setup.channels.items() if name(part) not in avoid]))
    warm = [c for c, (part, _) in setup.channels.items() if part < 9 and name(part) not in avoid]
    at_channel = {"at": channel, "node": name(setup.channels[channel][0])}
    sign = float(rng.choice([-1.0, 1.0]))
    part = int(rng.choice(cold if kind in ("motor_heat", "cutting_heat", "heat_pulse", "heat_wave", "coolant_cycling") else near))
    at_part = {"at": name(part), "node": name(part)}
    at_source = {"at": name(own), "node": name(own)}
    E = hidden
    if kind == "ambient_drift":
        shape = str(rng.choice(["ramp", "day", "settling"]))
        return lambda s: E.AmbientDrift(machine, None, sign * s, shape, END_S), {"at": "ambient", "node": "ambient"}
    if kind == "coolant_cycling":
        if rng.random() < 0.5:
            warmest = float(plain[:, machine.cell(part, (cell0 + 1) % CELLS)].max())
            strength = float(rng.uniform(1.5, 3.0))
            return lambda s: E.CoolantThermostat(machine, part, s, cell0, warmest, strength), at_part
        period, duty, phase = rng.uniform(480, 1800), rng.uniform(0.3, 0.6), rng.random()
        return lambda s: E.CoolantCycling(machine, part, s, cell0, period, duty, phase, 25.0), at_part | {"period_s": period}
    if kind == "friction_viscosity":
        return lambda s: E.FrictionViscosity(machine, bearing, s, 68.0, 8.7, setup.run_room.level_C), at_source
    if kind == "preload_growth":
        housing = min(machine.neighbours(own), key=lambda p: name(p) != "sleeve")
        return lambda s: E.PreloadGrowth(machine, bearing, s, housing), at_source
    if kind == "run_in_heat":
        decay, stretch = rng.uniform(15, 70) * 60, rng.uniform(0.85, 1.15)
        return lambda s: E.RunInHeat(machine, bearing, s, decay, stretch), at_source
    if kind == "motor_heat":
        return lambda s: E.MotorHeat(machine, part, s, cell0), at_part
    if kind == "cutting_heat":
        return lambda s: E.CuttingHeat(machine, part, s, cell0, onset), at_part | {"onset_s": onset}
    if kind == "spindle_stop":
        turn = setup.run_speed.at_s[1] if len(setup.run_speed.at_s) > 1 else END_S
        begin = float(rng.uniform(0.25, 0.7) * min(turn, END_S))
        return lambda s: E.SpindleStop(machine, None, s, begin), {"at": "all", "node": "all", "onset_s": begin}
    if kind == "airflow_change":
        part = int(rng.choice([p for p in near if 3 < p < 11]))
        return (lambda s: E.AirflowChange(machine, part, s, onset, sign),
                {"at": name(part), "node": name(part), "onset_s": onset})
    if kind == "surface_nonlinearity":
        return lambda s: E.SurfaceNonlinearity(machine, None, s, setup.run_room.level_C), {"at": "ambient", "node": "ambient"}
    if kind == "slow_structure":
        part = int(rng.choice([p for p in near if p < 9]))
        conductance, cell = rng.uniform(3, 9), int(rng.integers(0, CELLS))
        return (lambda s: E.SlowStructure(machine, part, s, cell, conductance), {"at": name(part), "node": name(part)})
    if kind == "sensor_lag":
        return lambda s: E.SensorLag(machine, channel, s), at_channel
    if kind == "sensor_offset":
        return lambda s: E.SensorOffset(machine, channel, s, sign), at_channel
    if kind == "sensor_drift":
        return lambda s: E.SensorDrift(machine, channel, s, sign), at_channel
    if kind == "sensor_detached":
        channel = str(rng.choice(warm))
        return (lambda s: E.SensorDetached(machine, channel, s, onset),
                {"at": channel, "node": name(setup.channels[channel][0]), "onset_s": onset})
    if kind == "heat_pulse":
        length = rng.uniform(40, 100) * 60
        return lambda s: E.HeatPulse(machine, part, s, cell0, onset, length), at_part | {"onset_s": onset}
    if kind == "heat_wave":
        period = rng.uniform(80, 150) * 60
        return lambda s: E.HeatWave(machine, part, s, cell0, period), at_part
    if kind == "contact_change":
        joint = int(rng.integers(0, 8))
        a, b = machine.joints[joint].a, machine.joints[joint].b
        return (lambda s: E.ContactChange(machine, None, s, joint, onset),
                {"at": name(a), "node": name(a), "other_node": name(b), "onset_s": onset})
    if kind == "sensor_crosstalk":
        channel = str(rng.choice(warm))
        begins = np.sort(rng.uniform(30, 340, 4)) * 60
        bursts = [(b, b + rng.uniform(5, 25) * 60) for b in begins]
        return (lambda s: E.SensorCrosstalk(machine, channel, s, bursts),
                {"at": channel, "node": name(setup.channels[channel][0])})
    if kind == "speed_cooling":
        part = int(rng.choice([p for p in near if 3 < p < 9]))
        return lambda s: E.SpeedCooling(machine, part, s), {"at": name(part), "node": name(part)}
    raise ValueError(kind)


CATALOGUE = ["ambient_drift", "coolant_cycling", "friction_viscosity", "preload_growth", "run_in_heat", "motor_heat",
             "cutting_heat", "spindle_stop", "airflow_change", "surface_nonlinearity", "slow_structure", "sensor_lag",
             "sensor_offset", "sensor_drift", "sensor_detached"]
OUTSIDE = ["heat_pulse", "heat_wave", "contact_change", "sensor_crosstalk"]


def neutral_names(rng, setup):
    """What the files call the parts: no name says what a part is."""
    order = rng.permutation(len(setup.machine.parts))
    return {part.name: f"n{order[k] + 1:02d}" for k, part in enumerate(setup.machine.parts)}


def nominal_model(rng, setup, room, known_sigma, stated_sigma=0.3):
    """The lumped TOML: true capacities, joints with the way through both parts, surfaces, powers; each off by known_sigma."""
    machine = setup.machine
    off = lambda value: value * np.exp(rng.normal(0, known_sigma))  # noqa: E731
    ambient = '"T1"' if room == "measured" else f"{setup.run_room.level_C:.2f}"
    lines = ["[model]", 'name = "machine"', f"ambient_C = {ambient}",
             f"relative_sigma = {stated_sigma}", ""]
    for part in machine.parts:
        lines += ["[[node]]", f'name = "{part.name}"', f"heat_capacity_J_per_K = {off(part.capacity_J_per_K):.1f}", ""]
    for j in machine.joints:
        inner = sum(abs(c - 2.5) / machine.parts[p].inner_W_per_K / 2 for p, c in ((j.a, j.cell_a), (j.b, j.cell_b)))
        value = off(1 / (1 / j.conductance_W_per_K + inner))
        lines += ["[[link]]", f'between = ["{machine.parts[j.a].name}", "{machine.parts[j.b].name}"]',
                  f"conductance_W_per_K = {value:.3f}", ""]
    for part in machine.parts:
        lines += ["[[link]]", f'between = ["{part.name}", "ambient"]', f"conductance_W_per_K = {off(part.surface_W_per_K):.3f}", ""]
    for heat in machine.heats:
        lines += ["[[source]]", f'node = "{machine.parts[heat.part].name}"', f"power_W = {off(heat.power_W):.2f}"]
        if heat.follows_speed:
            lines += ['proportional_to = "spindle_rpm"', f"reference = {machine.reference_rpm}", f"exponent = {heat.exponent}"]
        lines.append("")
    for channel, (part, _) in setup.channels.items():
        lines += ["[[sensor]]", f'channel = "{channel}"', f'node = "{machine.parts[part].name}"', f"noise_C = {setup.noise_C:.3f}", ""]
    return "\n".join(lines)

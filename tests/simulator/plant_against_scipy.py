"""The same plant written again in numpy from its published numbers (--plant), integrated by scipy's implicit solver:
temperatures over time, steady states and 95 % times must agree with thermbal-sim's."""
import json
import os
import subprocess
import sys

sys.path.insert(0, os.path.join(os.environ["THERMBAL_SOURCE_DIR"], "tests", "peers"))
from sim_support import NOISE_FREE, PROGRAM, recorded, skip

try:
    import numpy as np
    from scipy.integrate import solve_ivp
    from scipy.optimize import fsolve
except ImportError:
    skip("python3-scipy is not installed")

KELVIN, SIGMA = 273.15, 5.670374419e-8


def document(*flags):
    return json.loads(subprocess.run([PROGRAM, *flags], check=True, capture_output=True, timeout=60).stdout)


class Oracle:
    def __init__(self, plant):
        self.plant, self.rpm, self.room = plant, plant["spindle_rpm"], plant["room_C"]
        self.names = [node["name"] for node in plant["nodes"]]
        at = {name: i for i, name in enumerate(self.names)}
        column = lambda key: np.array([node[key] for node in plant["nodes"]])
        self.capacity, self.area, self.emissivity = map(column, ("heat_capacity_J_per_K", "area_m2", "emissivity"))
        self.natural = column("natural_W_per_m2K125")
        self.moved = column("blower_W_per_m2K") + column("forced_W_per_m2K") * (
            self.rpm / plant["reference_rpm"]) ** (2 / 3)
        self.conduction = np.zeros((len(at), len(at)))
        for link in plant["links"]:
            a, b = (at[name] for name in link["between"])
            pair = np.zeros(len(at))
            pair[a], pair[b] = 1, -1
            self.conduction += link["conductance_W_per_K"] * np.outer(pair, pair)
        self.constant = np.zeros(len(at))
        for heat in plant["running_heat"] + (plant["cutting_heat"] if plant["cutting"] else []):
            self.constant[at[heat["node"]]] += heat["power_W"]
        self.bearings = [(at[b["node"]], b) for b in plant["bearings"]]
        self.sensors = [(at.get(s["node"]), s["lag_s"]) for s in plant["sensors"]]

    def friction(self, bearing, temperature):
        loglog = self.plant["walther_a"] - self.plant["walther_b"] * np.log10(temperature + KELVIN)
        viscosity = 10 ** (10**loglog) - 0.7
        viscous_Nmm = 1e-7 * bearing["f0"] * max(viscosity * self.rpm, 2000) ** (2 / 3) * bearing["mean_diameter_mm"]**3
        return (viscous_Nmm / 1000 + bearing["load_torque_Nm"]) * 2 * np.pi * self.rpm / 60

    def balance(self, nodes):
        over = nodes - self.room
        surface = (self.natural * np.abs(over) ** 0.25 + self.moved) * over
        surface += self.emissivity * SIGMA * ((nodes + KELVIN) ** 4 - (self.room + KELVIN) ** 4)
        heat = self.constant - self.conduction @ nodes - self.area * surface
        for i, bearing in self.bearings:
            heat[i] += self.friction(bearing, nodes[i])
        return heat

    def rate(self, _, state):
        nodes, felt = np.split(state, [len(self.names)])
        lagging = [((self.room if i is None else nodes[i]) - s) / lag for (i, lag), s in zip(self.sensors, felt)]
        return np.concatenate([self.balance(nodes) / self.capacity, lagging])

    def run(self, until_s):
        start = np.full(len(self.names) + len(self.sensors), self.room)
        return solve_ivp(self.rate, (0, until_s), start, method="Radau", rtol=1e-8, atol=1e-9, dense_output=True).sol

    def settled(self):
        nodes, _, found, message = fsolve(self.balance, np.full(len(self.names), self.room + 5), full_output=True)
        assert found == 1, message
        return nodes


def check(condition):
    flags = ["--condition", condition]
    oracle = Oracle(document("--plant", *flags))
    solution, settled = oracle.run(48 * 3600), oracle.settled()

    rows = recorded(*flags, "--duration-min", "400", *NOISE_FREE)
    times = np.array(rows["time_s"])
    felt = solution(times)[len(oracle.names):]
    worst = max(np.max(np.abs(felt[k] - np.array(rows[f"T{k + 1}"]))) for k in range(16))
    assert worst < 1e-4, f"{condition}: off by {worst} C"

    fine = np.arange(0, 40000, 1.0)
    felt = solution(fine)[len(oracle.names):]
    for k, channel in enumerate(document("--truth", "--json", *flags)["channels"]):
        node = oracle.sensors[k][0]
        expected = oracle.room if node is None else settled[node]
        assert abs(channel["steady_state_C"] - expected) < 1e-6, channel
        if node is None:
            assert channel["equilibrium_time_min"] is None, channel
            continue
        reached = felt[k] - oracle.room >= 0.95 * (expected - oracle.room)
        assert abs(channel["equilibrium_time_min"] - fine[np.argmax(reached)] / 60) < 0.05, channel
    print(f"{condition}: {worst:.1e} C over 400 min")


for name in ("5000-idle", "3000-idle", "3000-cutting"):
    check(name)

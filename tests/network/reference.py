"""A second implementation of the thermal network and of every effect of the catalogue, with scipy's integrators.

Shares nothing with core/network: written from INTERFACES' table and the equations in the catalogue's headers, nodes by
name, one right-hand side, implicit integration to 1e-9, events of scipy for a thermostat. A request is a model file with
a [run] table behind it; requests are separated by lines of "%%%". One line a request: every sensor at every sample.
"""
import math
import sys
import tomllib

import numpy as np
from scipy.integrate import solve_ivp


def plain(number):
    return number["value"] if isinstance(number, dict) else number


def viscous_torque(celsius):
    """(mm2/s)^(2/3) of an oil with 32 mm2/s at 40 C and 5.35 at 100 C, after ASTM D341."""
    inner = np.interp(math.log(celsius + 273.15), np.log([313.15, 373.15]), np.log10(np.log10([32.7, 6.05])))
    slope = (np.log10(np.log10(32.7)) - np.log10(np.log10(6.05))) / math.log(373.15 / 313.15)
    outside = min(0.0, math.log((celsius + 273.15) / 313.15)) + max(0.0, math.log((celsius + 273.15) / 373.15))
    return (10 ** 10 ** (inner - slope * outside) - 0.7) ** (2 / 3)


class Network:
    def __init__(self, document):
        self.run = document["run"]
        self.ambient = document["model"]["ambient_C"]
        self.effects = [{key: plain(value) for key, value in effect.items()} for effect in document.get("effect", [])]
        self.capacity = {n["name"]: plain(n["heat_capacity_J_per_K"]) for n in document["node"]}
        self.links = [(*link["between"], plain(link["conductance_W_per_K"])) for link in document["link"]]
        self.sources = document.get("source", [])
        self.sensors = document["sensor"]
        for effect in self.of("slow_structure"):
            self.capacity["mass behind"] = effect["heat_capacity_J_per_K"]
            self.links.append((effect["node"], "mass behind", effect["conductance_W_per_K"]))
        self.lags = {e["channel"]: e["time_constant_s"] for e in self.of("sensor_lag")}
        self.state = [*self.capacity, *("lag " + channel for channel in self.lags)]
        self.cooling = False

    def of(self, kind, form=None):
        return [e for e in self.effects if e["kind"] == kind and (form is None or e.get("form") == form)]

    # -- what is given in time; `inside` is a moment inside the present piece, which decides what is switched on

    def column(self, name, inside):
        rows = [v for t, v in zip(self.run["time_s"], self.run[name]) if t <= inside]
        return rows[-1]

    def room(self, t, inside):
        room = self.ambient if not isinstance(self.ambient, str) else self.column(self.ambient, inside)
        for effect in self.of("ambient_drift"):
            if effect.get("form") == "column":
                room = (1 - effect["share"]) * room + effect["share"] * self.column(effect["column"], inside)
            elif effect.get("form") == "wave":
                turn = 2 * math.pi / (effect["period_h"] * 3600)
                room += effect["amplitude_C"] * (math.sin(turn * t + effect["phase_rad"]) - math.sin(effect["phase_rad"]))
            elif inside > effect.get("onset_s", 0):
                room += effect["rate_C_per_h"] / 3600 * (t - effect.get("onset_s", 0))
        return room

    def drive(self, source, inside):
        if any(e["from_s"] <= inside < e["from_s"] + e["duration_s"] for e in self.of("spindle_stop")):
            return 0.0
        if "proportional_to" not in source:
            return 1.0
        return abs(self.column(source["proportional_to"], inside) / source["reference"]) ** plain(source.get("exponent", 1))

    def wave_on(self, effect, inside):
        cycles = (inside - effect["first_on_s"]) / effect["period_s"]
        return cycles >= 0 and cycles % 1.0 < effect["duty"]

    def pieces(self):
        """The moments between which nothing switches."""
        end = self.run["sample_s"][-1]
        moments = {0.0, end, *self.run["time_s"], *self.run["sample_s"]}
        for effect in self.effects:
            moments |= {effect[key] for key in ("onset_s", "from_s") if key in effect}
            if "duration_s" in effect:
                moments.add(effect["from_s"] + effect["duration_s"])
            if "period_s" in effect:
                for k in range(int(end / effect["period_s"]) + 2):
                    begin = effect["first_on_s"] + k * effect["period_s"]
                    moments |= {begin, begin + effect["duty"] * effect["period_s"]}
        moments = sorted(m for m in moments if 0 <= m <= end)
        return list(zip(moments, moments[1:]))

    # -- heat

    def source_power(self, source, T, t, inside):
        node, power = source["node"], plain(source["power_W"]) * self.drive(source, inside)
        for effect in self.of("friction_viscosity"):
            if effect["source"] == node and effect.get("form") == "viscous_share":
                torque = viscous_torque(T[node]) / viscous_torque(effect["reference_C"])
                power *= 1 + effect["viscous_share"] * (torque - 1)
            elif effect["source"] == node:
                power *= math.exp(-effect["beta_per_K"] * (T[node] - effect.get("reference_C", 20.0)))
        for effect in self.of("preload_growth"):
            if effect["source"] == node:
                around = [(b if a == node else a, g) for a, b, g in self.links if node in (a, b) and "ambient" not in (a, b)]
                if effect.get("form"):
                    around = [around[("to_first_neighbour", "to_second_neighbour").index(effect["form"])]]
                housing = sum(g * T[other] for other, g in around) / sum(g for _, g in around)
                power *= max(0.0, 1 + effect["growth_per_K"] * (T[node] - housing))
        for effect in self.of("run_in_heat"):
            if effect["source"] == node:
                drive = self.drive(source, inside)
                if effect.get("form") == "any_speed":
                    drive = 1.0 if drive > 0.0 else 0.0
                power += effect["power_W"] * drive * math.exp(-t / effect["time_constant_s"])
        return power

    def conductance(self, a, b, g, difference, inside):
        if "ambient" not in (a, b):
            return g
        for effect in self.of("airflow_change"):
            if effect["link"][0] in (a, b) and inside >= effect["onset_s"]:
                g *= effect["factor"]
        for effect in self.of("surface_nonlinearity"):
            g *= math.hypot(difference, 1.0) ** effect["exponent"] / effect.get("reference_difference_C", 10.0) ** effect["exponent"]
        return g

    def slope(self, t, y, inside):
        T = dict(zip(self.state, y))
        T["ambient"] = self.room(t, inside)
        heat = dict.fromkeys(T, 0.0)
        for a, b, g in self.links:
            flow = self.conductance(a, b, g, T[a] - T[b], inside) * (T[a] - T[b])
            heat[a] -= flow
            heat[b] += flow
        for source in self.sources:
            heat[source["node"]] += self.source_power(source, T, t, inside)
        for effect in self.of("motor_heat"):
            heat[effect["node"]] += effect["power_W"]
        for effect in self.of("cutting_heat"):
            heat[effect["node"]] += effect["power_W"] if inside >= effect["onset_s"] else 0.0
        for effect in self.of("coolant_cycling"):
            on = self.cooling if effect.get("form") == "thermostat" else self.wave_on(effect, inside)
            heat[effect["node"]] -= effect["power_W"] if on else 0.0
        slopes = [heat[name] / self.capacity[name] for name in self.capacity]
        for sensor in self.sensors:
            if sensor["channel"] in self.lags:
                slopes.append((self.seen(sensor, T, t, inside) - T["lag " + sensor["channel"]]) / self.lags[sensor["channel"]])
        return slopes

    # -- sensors

    def seen(self, sensor, T, t, inside):
        value = T[sensor["node"]]
        for effect in self.of("sensor_detached"):
            if effect["channel"] == sensor["channel"] and inside >= effect["onset_s"]:
                gone = 1.0 - math.exp(-(t - effect["onset_s"]) / effect["time_constant_s"]) if "time_constant_s" in effect else 1.0
                value += gone * effect["ambient_share"] * (T["ambient"] - value)
        return value

    def readings(self, t, y):
        T = dict(zip(self.state, y))
        T["ambient"] = self.room(t, t)
        values = []
        for sensor in self.sensors:
            channel = sensor["channel"]
            value = T["lag " + channel] if channel in self.lags else self.seen(sensor, T, t, t)
            value += sum(e["offset_C"] for e in self.of("sensor_offset") if e["channel"] == channel)
            value += sum(e["rate_C_per_h"] * t / 3600 for e in self.of("sensor_drift") if e["channel"] == channel)
            values.append(value)
        return values

    # -- the run

    def start(self):
        known = {}
        for sensor in self.sensors:
            first = self.run["first"].get(sensor["channel"])
            if sensor["node"] != "ambient" and first is not None:
                known[sensor["node"]] = first - sum(e["offset_C"] for e in self.of("sensor_offset") if e["channel"] == sensor["channel"])
        T = {name: known.get(name, 20.0) for name in self.capacity}
        for _ in range(2000):
            for name in T:
                around = [T[b if a == name else a] for a, b, _ in self.links if name in (a, b) and "ambient" not in (a, b)]
                if name not in known and around:
                    T[name] = sum(around) / len(around)
        nodes = {s["channel"]: s["node"] for s in self.sensors}
        return [*T.values(), *(T[nodes[channel]] for channel in self.lags)]

    def integrate(self, begin, end, y):
        thermostats = self.of("coolant_cycling", "thermostat")
        while begin < end:
            events = []
            for effect in thermostats:
                at = effect["switch_on_C"] - (effect["hysteresis_C"] if self.cooling else 0.0)
                crossing = lambda t, y, i=self.state.index(effect["node"]), at=at: y[i] - at
                crossing.terminal, crossing.direction = True, -1 if self.cooling else 1
                events.append(crossing)
            inside = 0.5 * (begin + end)
            answer = solve_ivp(lambda t, y: self.slope(t, y, inside), (begin, end), y, method="LSODA", rtol=1e-9,
                               atol=1e-9, events=events or None)
            y, begin = answer.y[:, -1], answer.t[-1]
            if answer.status == 1:
                self.cooling = not self.cooling
        return y

    def simulate(self):
        y, rows, wanted = self.start(), [], list(self.run["sample_s"])
        for effect in self.of("coolant_cycling", "thermostat"):
            self.cooling = y[self.state.index(effect["node"])] > effect["switch_on_C"]
        if wanted[0] == 0.0:
            rows.append(self.readings(0.0, y))
            wanted.pop(0)
        for begin, end in self.pieces():
            y = self.integrate(begin, end, y)
            if wanted and wanted[0] == end:
                rows.append(self.readings(end, y))
                wanted.pop(0)
        return np.array(rows)


def main():
    with open(sys.argv[1], encoding="utf-8") as requests:
        for text in requests.read().split("%%%\n"):
            print(*(repr(float(v)) for v in Network(tomllib.loads(text)).simulate().ravel()))


if __name__ == "__main__":
    main()

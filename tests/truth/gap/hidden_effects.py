"""What is hidden in a case. Each effect acts on the volumes of machine.py, in a form of its own, and has one knob.

`size` is the knob that drawing.py turns until the peak change of a reading is what the case asks for. `main_parameter`
is what the scorer compares with the diagnosis; names and units as in the catalogue.
"""
import numpy as np


class Effect:
    kind = ""
    inside_catalogue = True
    extra_cells = 0
    size_guess = 1.0
    size_limit = np.inf
    onset_s = 0.0

    def __init__(self, machine, place, size):
        self.machine, self.place, self.size = machine, place, size

    def room_C(self, t):
        return 0.0

    def power(self, power_W, source, t, T, air_C):
        return power_W

    def loss(self, loss_W, surface, over_C, t):
        return loss_W

    def add_heat(self, heat_W, t, T, rpm, air_C):
        pass

    def read(self, times_s, node_C, room_C, channel):
        return node_C

    def breaks(self, end_s):
        return []

    def begin(self):
        """Called before every run."""

    def main_parameter(self):
        return {}


class OnPart(Effect):
    """Heat enters the three volumes from `cell0` on."""

    def __init__(self, machine, place, size, cell0):
        super().__init__(machine, place, size)
        self.cells = [machine.cell(place, (cell0 + k) % 6) for k in range(3)]


class OnSource(Effect):
    """Changes the power of one source."""

    def power(self, power_W, source, t, T, air_C):
        return self.changed(power_W, t, T) if source == self.place else power_W

    def own_C(self, T):
        heat = self.machine.heats[self.place]
        return np.mean([T[self.machine.cell(heat.part, c)] for c in heat.cells])


class SetsIn(Effect):
    """Rises from nothing to all of it within `rise_s` from onset_s on."""

    rise_s = 120.0

    def risen(self, t):
        return np.clip((t - self.onset_s) / self.rise_s, 0, 1)

    def breaks(self, end_s):
        return [self.onset_s, self.onset_s + self.rise_s]


class AmbientDrift(Effect):
    kind, size_guess = "ambient_drift", 2.0

    def __init__(self, machine, place, size, shape, end_s):
        super().__init__(machine, place, size)
        self.shape, self.end_s = shape, end_s

    def room_C(self, t):
        x = t / self.end_s
        if self.shape == "ramp":
            return self.size * x
        if self.shape == "day":
            return self.size * np.sin(0.5 * np.pi * x) ** 2
        return self.size * (1 - np.exp(-2.0 * x)) / (1 - np.exp(-2.0))

    def main_parameter(self):
        return {"rate_C_per_h": self.size / (self.end_s / 3600)}


class CoolantCycling(OnPart):
    """A chiller on a timer: a square wave of a period and a duty, softened by the coolant's own delay."""

    kind, size_guess = "coolant_cycling", 60.0

    def __init__(self, machine, place, size, cell0, period_s, duty, phase, delay_s):
        super().__init__(machine, place, size, cell0)
        self.period_s, self.duty, self.phase, self.delay_s = period_s, duty, phase, delay_s

    def add_heat(self, heat_W, t, T, rpm, air_C):
        x = (t / self.period_s + self.phase) % 1.0
        edge = self.delay_s / self.period_s
        on = 1 - np.exp(-x / edge) if x < self.duty else np.exp(-(x - self.duty) / edge)
        heat_W[self.cells] -= self.size * on / 3

    def breaks(self, end_s):
        k = np.arange(-1, end_s / self.period_s + 2)
        return [t for t in np.concatenate([(k - self.phase), (k - self.phase + self.duty)]) * self.period_s if 0 < t < end_s]

    def main_parameter(self):
        return {"power_W": self.size}


class CoolantThermostat(OnPart):
    """A chiller with a two-point controller that feels one volume of the part it cools.

    `size` is by how much it keeps the part below where it would have gone; half of that is the hysteresis.
    """

    kind, size_guess = "coolant_cycling", 0.6

    def __init__(self, machine, place, size, cell0, warmest_C, strength):
        super().__init__(machine, place, size, cell0)
        self.on_C, self.off_C = warmest_C - 0.5 * size, warmest_C - size
        lossy = np.diag(machine.surface) - machine.conduction
        unit = np.zeros(len(lossy))
        unit[self.cells] = 1 / 3
        self.feels = self.cells[1]
        self.power_W = strength * size / np.linalg.solve(lossy, unit)[self.feels]
        self.is_on = False

    def begin(self):
        self.is_on = False

    def switching(self, T):
        """Falls through zero when the controller switches."""
        return T[self.feels] - self.off_C if self.is_on else self.on_C - T[self.feels]

    def switch(self):
        self.is_on = not self.is_on

    def add_heat(self, heat_W, t, T, rpm, air_C):
        if self.is_on:
            heat_W[self.cells] -= self.power_W / 3

    def main_parameter(self):
        return {"power_W": self.power_W}


class FrictionViscosity(OnSource):
    """Viscous share of the friction after Walther's equation for the lubricant, at the power 2/3."""

    kind, size_guess, size_limit = "friction_viscosity", 0.5, 1.0

    def __init__(self, machine, place, size, viscosity_40, viscosity_100, start_C):
        super().__init__(machine, place, size)
        a = np.log10(np.log10(np.array([viscosity_40, viscosity_100]) + 0.7))
        x = np.log10(np.array([313.15, 373.15]))
        self.slope = (a[0] - a[1]) / (x[1] - x[0])
        self.level = a[0] + self.slope * x[0]
        self.start_C = start_C

    def viscosity(self, C):
        return 10 ** 10 ** (self.level - self.slope * np.log10(C + 273.15)) - 0.7

    def changed(self, power_W, t, T):
        ratio = (self.viscosity(self.own_C(T)) / self.viscosity(self.start_C)) ** (2 / 3)
        return power_W * (1 - self.size + self.size * ratio)


class PreloadGrowth(OnSource):
    kind, size_guess, size_limit = "preload_growth", 0.03, 0.3

    def __init__(self, machine, place, size, housing):
        super().__init__(machine, place, size)
        self.housing = housing

    def changed(self, power_W, t, T):
        housing = np.mean(T[self.machine.cell(self.housing, 0):self.machine.cell(self.housing, 6)])
        return power_W * max(0.2, 1 + self.size * (self.own_C(T) - housing))


class RunInHeat(OnSource):
    kind, size_guess = "run_in_heat", 60.0

    def __init__(self, machine, place, size, decay_s, stretch):
        super().__init__(machine, place, size)
        self.decay_s, self.stretch = decay_s, stretch

    def changed(self, power_W, t, T):
        return power_W and power_W + self.size * np.exp(-((t / self.decay_s) ** self.stretch))

    def main_parameter(self):
        return {"power_W": self.size}


class MotorHeat(OnPart):
    kind, size_guess = "motor_heat", 40.0

    def add_heat(self, heat_W, t, T, rpm, air_C):
        heat_W[self.cells] += self.size / 3

    def main_parameter(self):
        return {"power_W": self.size}


class CuttingHeat(SetsIn, OnPart):
    kind, size_guess, rise_s = "cutting_heat", 60.0, 90.0

    def __init__(self, machine, place, size, cell0, onset_s):
        super().__init__(machine, place, size, cell0)
        self.onset_s = onset_s

    def add_heat(self, heat_W, t, T, rpm, air_C):
        heat_W[self.cells] += self.size / 3 * self.risen(t)

    def main_parameter(self):
        return {"power_W": self.size}


class SpindleStop(Effect):
    """All sources off for `size` seconds; the spindle needs some seconds to run down and up."""

    kind, size_guess, size_limit = "spindle_stop", 900.0, 7200.0

    def __init__(self, machine, place, size, onset_s):
        super().__init__(machine, place, size)
        self.onset_s = onset_s

    def power(self, power_W, source, t, T, air_C):
        down = np.clip((t - self.onset_s) / 10.0, 0, 1) - np.clip((t - self.onset_s - self.size) / 10.0, 0, 1)
        return power_W * (1 - down)

    def breaks(self, end_s):
        return [self.onset_s, self.onset_s + 10.0, self.onset_s + self.size, self.onset_s + self.size + 10.0]

    def main_parameter(self):
        return {"duration_s": self.size}


class AirflowChange(SetsIn):
    """The part's surface transfer times exp(size) from a moment on, over two minutes."""

    kind, size_guess, size_limit = "airflow_change", 0.4, 1.6

    def __init__(self, machine, place, size, onset_s, direction):
        super().__init__(machine, place, size)
        self.onset_s, self.direction = onset_s, direction
        self.cells = slice(machine.cell(place, 0), machine.cell(place, 6))

    def loss(self, loss_W, surface, over_C, t):
        loss_W = loss_W.copy()
        loss_W[self.cells] *= np.exp(self.direction * self.size * self.risen(t))
        return loss_W

    def main_parameter(self):
        return {"factor": float(np.exp(self.direction * self.size))}


class SurfaceNonlinearity(Effect):
    """Churchill and Chu's vertical plate, and grey radiation, in place of a share of the linear transfer."""

    kind, size_guess, size_limit = "surface_nonlinearity", 1.0, 6.0

    def __init__(self, machine, place, size, room_C):
        super().__init__(machine, place, size)
        self.air_K = room_C + 273.15

    def coefficient(self, over_C):
        over = np.maximum(np.abs(over_C), 1e-3)
        rayleigh = 9.81 / self.air_K * over * 0.3**3 / (1.5e-5 * 2.1e-5)
        nusselt = (0.825 + 0.387 * rayleigh ** (1 / 6) / (1 + (0.492 / 0.71) ** (9 / 16)) ** (8 / 27)) ** 2
        wall = self.air_K + over_C
        return nusselt * 0.026 / 0.3 + 0.9 * 5.67e-8 * (wall + self.air_K) * (wall**2 + self.air_K**2)

    def loss(self, loss_W, surface, over_C, t):
        excess = self.coefficient(over_C) / self.coefficient(2.0) - 1
        return loss_W * (1 + self.size * excess)


class SlowStructure(Effect):
    """A long casting behind a part: a chain of eight volumes, `size` its heat capacity in J/K."""

    kind, extra_cells, size_guess = "slow_structure", 8, 8000.0

    def __init__(self, machine, place, size, cell, conductance_W_per_K):
        super().__init__(machine, place, size)
        self.cell = machine.cell(place, cell)
        self.conductance = conductance_W_per_K
        self.first_cell = len(machine.capacity)

    def extend(self, capacity, matrix):
        n = len(matrix)
        self.first_cell = n
        wide = np.zeros((n + self.extra_cells, n + self.extra_cells))
        wide[:n, :n] = matrix
        connections = [self.cell, *range(n, n + self.extra_cells)]
        from machine import connect
        connect(wide, connections[0], connections[1], 1.2 * self.conductance)
        for a, b in zip(connections[1:], connections[2:]):
            connect(wide, a, b, 14.0 * self.conductance)
        return np.concatenate([capacity, np.full(self.extra_cells, self.size / self.extra_cells)]), wide

    def main_parameter(self):
        return {"heat_capacity_J_per_K": self.size}


class OnChannel(Effect):
    def read(self, times_s, node_C, room_C, channel):
        return self.distort(times_s, node_C, room_C) if channel == self.place else node_C


class SensorLag(OnChannel):
    kind, size_guess, size_limit = "sensor_lag", 240.0, 3000.0

    def distort(self, times_s, node_C, room_C):
        return lagged(times_s, lagged(times_s, node_C, 0.93 * self.size), 0.07 * self.size)

    def main_parameter(self):
        return {"time_constant_s": self.size}


class SignedOnChannel(OnChannel):
    def __init__(self, machine, place, size, sign):
        super().__init__(machine, place, size)
        self.sign = sign


class SensorOffset(SignedOnChannel):
    kind, size_guess = "sensor_offset", 0.5

    def distort(self, times_s, node_C, room_C):
        return node_C + self.sign * self.size

    def main_parameter(self):
        return {"offset_C": self.sign * self.size}


class SensorDrift(SignedOnChannel):
    kind, size_guess = "sensor_drift", 0.1

    def distort(self, times_s, node_C, room_C):
        hours = times_s / 3600
        return node_C + self.sign * self.size * hours * (1 + 0.03 * np.sin(hours))

    def main_parameter(self):
        return {"rate_C_per_h": self.sign * self.size}


class SensorDetached(OnChannel):
    kind, size_guess, size_limit = "sensor_detached", 0.3, 0.85

    def __init__(self, machine, place, size, onset_s):
        super().__init__(machine, place, size)
        self.onset_s = onset_s

    def distort(self, times_s, node_C, room_C):
        share = self.size * (1 - np.exp(-np.maximum(times_s - self.onset_s, 0) / 60.0))
        return (1 - share) * node_C + share * room_C

    def main_parameter(self):
        return {"air_share": self.size}


def lagged(times_s, values, time_constant_s):
    out = np.array(values, dtype=float)
    for k in range(1, len(out)):
        keep = np.exp(-(times_s[k] - times_s[k - 1]) / time_constant_s)
        out[k] = keep * out[k - 1] + (1 - keep) * values[k]
    return out


class HeatPulse(OnPart):
    """Outside the catalogue: heat that rises and falls within an hour or so."""

    kind, inside_catalogue, size_guess = "heat_pulse", False, 60.0

    def __init__(self, machine, place, size, cell0, onset_s, length_s):
        super().__init__(machine, place, size, cell0)
        self.onset_s, self.length_s = onset_s, length_s

    def add_heat(self, heat_W, t, T, rpm, air_C):
        x = (t - self.onset_s) / self.length_s
        if 0 < x < 1:
            heat_W[self.cells] += self.size / 3 * np.sin(np.pi * x) ** 2

    def breaks(self, end_s):
        return [self.onset_s, self.onset_s + self.length_s]


class HeatWave(OnPart):
    """Outside the catalogue: an auxiliary drive whose heat swells and ebbs over an hour or two."""

    kind, inside_catalogue, size_guess = "heat_wave", False, 40.0

    def __init__(self, machine, place, size, cell0, period_s):
        super().__init__(machine, place, size, cell0)
        self.period_s = period_s

    def add_heat(self, heat_W, t, T, rpm, air_C):
        heat_W[self.cells] += self.size / 3 * (1 - np.cos(2 * np.pi * t / self.period_s)) / 2


class ContactChange(SetsIn):
    """Outside the catalogue: a joint between two parts opens at some moment."""

    kind, inside_catalogue, size_guess, size_limit = "contact_change", False, 0.5, 0.95

    def __init__(self, machine, place, size, joint, onset_s):
        super().__init__(machine, place, size)
        self.onset_s, j = onset_s, machine.joints[joint]
        self.a, self.b = machine.cell(j.a, j.cell_a), machine.cell(j.b, j.cell_b)
        self.conductance = j.conductance_W_per_K

    def add_heat(self, heat_W, t, T, rpm, air_C):
        flow = self.size * self.conductance * self.risen(t) * (T[self.a] - T[self.b])
        heat_W[self.a] += flow
        heat_W[self.b] -= flow


class SensorCrosstalk(OnChannel):
    """Outside the catalogue: a multiplexer that carries a share of another channel over, in growing measure."""

    kind, inside_catalogue, size_guess, size_limit = "sensor_crosstalk", False, 0.3, 0.9

    def __init__(self, machine, place, size, bursts):
        super().__init__(machine, place, size)
        self.bursts = bursts

    def distort(self, times_s, node_C, room_C):
        share = np.zeros(len(times_s))
        for begin, end in self.bursts:
            share[(times_s > begin) & (times_s < end)] = self.size
        return node_C + share * (room_C - node_C)


class SpeedCooling(Effect):
    """Outside the catalogue: the spindle's fan cools a part in proportion to the speed's departure from the reference."""

    kind, inside_catalogue, size_guess, size_limit = "speed_cooling", False, 0.5, 3.0

    def add_heat(self, heat_W, t, T, rpm, air_C):
        cells = slice(self.machine.cell(self.place, 0), self.machine.cell(self.place, 6))
        surface = self.machine.surface[cells]
        heat_W[cells] -= self.size * abs(rpm / self.machine.reference_rpm - 1) * surface * (T[cells] - air_C)

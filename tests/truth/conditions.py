"""What is done to a machine: speed and load, coolant, the room. Times in s since the spindle's start."""
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Regime:
    """What the operator sets, from t_s on."""

    t_s: float
    rpm: float
    load: float = 0.0
    cutting_W: float = 0.0


@dataclass
class Coolant:
    mean_C: float = 20.0
    swing_C: float = 0.0
    period_s: float = 600.0

    def __call__(self, t_s):
        phase = (t_s / self.period_s) % 1.0
        return self.mean_C + self.swing_C * (4.0 * abs(phase - 0.5) - 1.0)


@dataclass
class Room:
    """Room temperature against time: a level, a ramp, a day's sine, an HVAC cycle, jumps that relax, slow wander."""

    level_C: float = 20.0
    ramp_C_per_h: float = 0.0
    day_C: float = 0.0
    day_phase: float = 0.0
    hvac_C: float = 0.0
    hvac_period_s: float = 1200.0
    hvac_phase: float = 0.0
    hvac_on_share: float = 0.5
    jumps: list = field(default_factory=list)  # (t_s, size_C, tau_s, back_s or None)
    wander: list = field(default_factory=list)  # (amplitude_C, period_s, phase)

    @property
    def breaks(self):
        return [j[0] for j in self.jumps] + [j[0] + j[3] for j in self.jumps if j[3]]

    @property
    def max_step_s(self):
        return self.hvac_period_s / 16 if self.hvac_C else 240.0

    def __call__(self, t):
        value = self.level_C + self.ramp_C_per_h * t / 3600.0
        if self.day_C:
            value = value + self.day_C * (
                np.sin(2 * np.pi * t / 86400.0 + self.day_phase) - np.sin(self.day_phase)
            )
        if self.hvac_C:
            # A thermostat's sawtooth, corners included: cooled for one share of the period, drifting up for the rest.
            phase = (t / self.hvac_period_s + self.hvac_phase) % 1.0
            share = self.hvac_on_share
            value = value + self.hvac_C * np.where(
                phase < share, 1 - 2 * phase / share, 2 * (phase - share) / (1 - share) - 1
            )
        for at, size, tau, back in self.jumps:
            value = value + np.where(t > at, size * (1 - np.exp(-np.maximum(t - at, 0.0) / tau)), 0.0)
            if back:
                value = value - np.where(
                    t > at + back, size * (1 - np.exp(-np.maximum(t - at - back, 0.0) / tau)), 0.0
                )
        for amplitude, period, phase in self.wander:
            value = value + amplitude * (np.sin(2 * np.pi * t / period + phase) - np.sin(phase))
        return value

    def frozen(self, level_C):
        return Room(level_C=level_C)


@dataclass
class Conditions:
    """All that acts on a machine: regimes sorted by time, the room, the coolant."""

    regimes: list
    room: Room
    coolant: Coolant = field(default_factory=Coolant)

    def regime_at(self, t_s):
        return [r for r in self.regimes if r.t_s <= t_s + 1e-6][-1]

    @property
    def breaks(self):
        return sorted({*(r.t_s for r in self.regimes), *self.room.breaks})

    def max_step_s(self, machine):
        cycling = self.coolant.swing_C and machine.design.chiller_W_per_K
        return min(self.room.max_step_s, self.coolant.period_s / 12 if cycling else np.inf)

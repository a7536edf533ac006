"""From clean temperatures to what a module with 16 PT100 delivers: lag, noise, rounding, faults, gaps, spikes."""
import numpy as np

PERIOD_S, END_S = 15.0, 24000.0
TIMES = np.arange(0.0, END_S + 1.0, PERIOD_S)


def draw_sensors(rng, noise=None, rounding=None):
    """One test's module and its 16 PT100."""
    rounding = float(rng.choice([0.01, 0.1])) if rounding is None else rounding
    noise = float(rng.choice([0.02, 0.03, 0.05, 0.07, 0.1])) if noise is None else noise
    return {
        "noise_C": noise,
        "rounding_C": rounding,
        "offset_C": rng.normal(0.0, 0.08, 16),
        "lag_s": np.r_[rng.uniform(30, 150), rng.uniform(10, 60, 15)],
        "stem": np.r_[0.0, rng.uniform(0.0, 0.06, 15)],
    }


def lagged(clean, lag_s, period_s=PERIOD_S):
    """lag dy/dt = x - y, exact for x linear between samples, settled at the first one."""
    y = clean.copy()
    a = np.exp(-period_s / lag_s)
    b = lag_s / period_s * (1 - a)
    for i in range(1, len(clean)):
        y[i] = a * y[i - 1] + (1 - b) * clean[i] + (b - a) * clean[i - 1]
    return y


def measured(rng, settled, sensors):
    noisy = settled + rng.normal(0.0, sensors["noise_C"], settled.shape)
    return np.round(noisy / sensors["rounding_C"]) * sensors["rounding_C"]


def total_sigma(sensors):
    return float(np.hypot(sensors["noise_C"], sensors["rounding_C"] / np.sqrt(12.0)))


def draw_faults(rng, data, channels):
    """Stuck (the last value for ever), dead (no sample any more), from the start or from some moment."""
    faults = {}
    for c in channels:
        kind = str(rng.choice(["stuck", "dead"]))
        start = 0 if rng.random() < 0.4 else int(rng.integers(40, 500))
        data[start:, c] = data[start, c] if kind == "stuck" else np.nan
        faults[f"T{c + 1}"] = {"kind": kind, "from_min": start * PERIOD_S / 60.0}
    return faults


def add_gaps_and_spikes(rng, data):
    missing_rows = np.zeros(len(data), dtype=bool)
    for _ in range(int(rng.integers(2, 7))):
        start, length = int(rng.integers(10, len(data) - 40)), int(rng.integers(2, 32))
        if rng.random() < 0.4:
            missing_rows[start : start + length] = True
        else:
            data[start : start + length, rng.permutation(16)[: rng.integers(1, 16)]] = np.nan
    data[rng.random(data.shape) < rng.uniform(0.0, 0.02)] = np.nan
    spikes = rng.random(data.shape) < rng.uniform(0.0005, 0.004)
    data[spikes] += rng.choice([-1, 1], spikes.sum()) * rng.uniform(1.0, 40.0, spikes.sum())
    data[:, :] = np.round(data, 2)
    missing_rows[0] = False
    return missing_rows

"""What is true of a run, per channel: where it settles in which room, when, and from when on one can know."""
import numpy as np

from information_limit import fit_modes, limit_min, steady_state_sd
from recording import END_S, PERIOD_S, TIMES, total_sigma

WINDOWS = np.arange(5.0, 401.0, 1.0)
BARELY_C = 0.5  # below this rise a channel says nothing that the noise could not


def room_mean_15min(air):
    total = np.r_[0.0, np.cumsum(air)]
    i = np.arange(1, len(air) + 1)
    first = np.maximum(i - 61, 0)
    return (total[i] - total[first]) / (i - first)


def first_95_min(clean, settle_C):
    """Time of 95 % of the whole rise, linear between samples; None when not reached in the recording."""
    rise = settle_C - clean[0]
    reached = np.flatnonzero((clean - clean[0]) * np.sign(rise) >= 0.95 * abs(rise))
    if abs(rise) < 1e-6 or len(reached) == 0 or reached[0] == 0:
        return None
    i = reached[0]
    part = (clean[0] + 0.95 * rise - clean[i - 1]) / (clean[i] - clean[i - 1])
    return float((TIMES[i - 1] + part * PERIOD_S) / 60.0)


def limits_of(frozen, settle_at, regimes, sigma, healthy):
    """Information limit of every channel in every regime, in min since the start, with the modes it was found on."""
    out = []
    for r, regime in enumerate(regimes):
        end = regimes[r + 1].t_s if r + 1 < len(regimes) else END_S
        rows = np.flatnonzero((TIMES >= regime.t_s) & (TIMES <= end))
        entry = {"limit_min": {}, "order": None, "time_constants_min": [], "misfit_over_noise": None}
        if len(rows) > 160:
            t = (TIMES[rows] - regime.t_s) / 60.0
            use = [c for c in range(1, 16) if c in healthy]
            fit_rows = rows[8::8]
            tau, coefficients, misfit = fit_modes(
                (TIMES[fit_rows] - regime.t_s) / 60.0, frozen[fit_rows][:, use], sigma
            )
            windows = WINDOWS[WINDOWS <= t[-1] + 1e-9]
            found = limit_min(steady_state_sd(tau, coefficients, np.full(len(use), sigma), windows), windows)
            entry = {
                "limit_min": {
                    f"T{c + 1}": None if v is None else v + regime.t_s / 60.0 for c, v in zip(use, found)
                },
                "order": len(tau),
                "time_constants_min": [round(float(v), 2) for v in tau],
                "misfit_over_noise": round(float(misfit), 3),
            }
        out.append(entry)
    return out


def truth_of(group, clean, frozen, grid, settle, regimes, room, sensors, faults, extra):
    air = room(TIMES) * np.ones_like(TIMES)
    mean = room_mean_15min(air)
    sigma = total_sigma(sensors)
    healthy = {c for c in range(1, 16) if f"T{c + 1}" not in faults}
    at_start = [np.array([np.interp(air[0], grid, s[:, c]) for c in range(16)]) for s in settle]
    at_end = np.array([np.interp(mean[-1], grid, settle[-1][:, c]) for c in range(16)])
    limits = limits_of(frozen, at_start, regimes, sigma, healthy)
    changes = [
        {
            "at_min": r.t_s / 60.0,
            "kind": "stop" if r.rpm == 0 else "speed",
            "largest_settle_change_C": round(float(np.abs(settle[i + 1] - settle[i])[:, 1:].max()), 3),
        }
        for i, r in enumerate(regimes[1:])
    ]
    changes += [
        {"at_min": b / 60.0, "kind": "room", "largest_settle_change_C": 0.0}
        for b in room.breaks
        if b <= END_S
    ]
    channels = {}
    for c in range(1, 16):
        name = f"T{c + 1}"
        rise = float(at_end[c] - clean[0, c])
        largest_move = float(np.abs(frozen[:, c] - frozen[0, c]).max())
        distance = abs(float(frozen[-1, c] - at_start[-1][c]))
        # "Settles within the test": what is left at its end is inside the tolerance on a wrong declaration, and the
        # 95 % of the rise are reached.
        settles = distance <= max(0.3, 0.05 * abs(rise))
        eq = first_95_min(frozen[:, c], at_start[-1][c]) if len(regimes) == 1 else None
        if len(regimes) == 1:
            settles = settles and eq is not None
        state = faults.get(name, {}).get("kind") or (
            "barely_warming" if max(abs(rise), largest_move) < BARELY_C else "live"
        )
        channels[name] = {
            "state": state,
            "fault_from_min": faults.get(name, {}).get("from_min"),
            "rise_C": round(rise, 4),
            "settle_at_end_C": round(float(at_end[c]), 4),
            "settle_per_room_C": round(float(np.polyfit(grid, settle[-1][:, c], 1)[0]), 4),
            "left_at_end_C": round(distance, 4),
            "equilibrium_time_min": eq,
            "declarable": bool(state == "live" and settles),
            "information_limit_min": limits[-1]["limit_min"].get(name),
            "settle_C": [[round(float(v), 4) for v in s[:, c]] for s in settle],
        }
    return {
        "group": group,
        "period_s": PERIOD_S,
        "noise_C": sensors["noise_C"],
        "rounding_C": sensors["rounding_C"],
        "regimes": [
            {
                "from_min": r.t_s / 60.0,
                "rpm": r.rpm,
                "load": r.load,
                "cutting_W": r.cutting_W,
                "information": limits[i],
            }
            for i, r in enumerate(regimes)
        ],
        "regime_changes": sorted(changes, key=lambda c: c["at_min"]),
        "room_grid_C": [round(float(v), 4) for v in grid],
        "room_quiet": bool(np.ptp(air) <= 0.3),
        "room_mean_15min_C": [round(float(v), 4) for v in mean[::4]],
        "room_mean_step_min": 1.0,
        "channels": channels,
        **extra,
    }

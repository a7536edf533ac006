"""The information limit: how well any unbiased estimator can know the steady states from a window of a recording.

Cramer-Rao bound with the order known, no prior, all channels joint: time constants shared, the steady state and the
amplitudes of every channel its own, white noise of known size. The few modes stand for the machine's many: the
smallest number whose fit to the noise-free run is good to a third of the noise.
"""
import numpy as np
from scipy.optimize import least_squares


def _basis(t_min, log_tau):
    return np.hstack([np.ones((len(t_min), 1)), np.exp(-t_min[:, None] / np.exp(log_tau))])


def apart(p):
    """Logarithms of time constants from the slowest one and the distances down to the next ones."""
    return p[0] - np.r_[0.0, np.cumsum(p[1:])]


def fit_modes(t_min, clean_C, sigma_C, most=4):
    """Shared time constants (min), coefficients [1 + K, channels] and worst rms misfit / noise. clean_C: rows are times."""
    best = None
    starts = {
        1: [[50.0]],
        2: [[60.0, 12.0]],
        3: [[80.0, 25.0, 5.0]],
        4: [[130.0, 45.0, 12.0, 3.0], [70.0, 30.0, 10.0, 4.0]],
    }
    for order in range(1, most + 1):

        def misfit(p):
            X = _basis(t_min, apart(p))
            return ((clean_C - X @ np.linalg.lstsq(X, clean_C, rcond=None)[0]) / sigma_C).ravel()

        lower = np.r_[
            np.log(2.0), np.full(order - 1, np.log(1.5))
        ]  # coalescing modes would not be modes any more
        tries = [np.r_[s[0], -np.diff(s)] for s in map(np.log, starts[order])]
        found = min(
            (
                least_squares(misfit, s, bounds=(lower, np.log(2000.0)), x_scale=0.3, max_nfev=60)
                for s in tries
            ),
            key=lambda f: f.cost,
        )
        log_tau = np.sort(apart(found.x))
        X = _basis(t_min, log_tau)
        coefficients = np.linalg.lstsq(X, clean_C, rcond=None)[0]
        worst = (np.sqrt(((clean_C - X @ coefficients) ** 2).mean(0)) / sigma_C).max()
        best = np.exp(log_tau), coefficients, worst
        if worst < 1.0 / 3.0:
            break
    return best


def steady_state_sd(tau_min, coefficients, sigma_C, windows_min, period_min=0.25):
    """Standard deviation of every channel's steady state (C), rows: windows. Infinite where the data say nothing."""
    K, channels = len(tau_min), coefficients.shape[1]
    sd = np.full((len(windows_min), channels), np.inf)
    for row, window in enumerate(windows_min):
        t = np.arange(0.0, window + 1e-9, period_min)
        if len(t) < 2 * (K + 1):
            continue
        E = np.exp(-t[:, None] / tau_min)
        D = E * (t[:, None] / tau_min)  # derivative with log tau, amplitude one
        R = np.linalg.qr(np.hstack([np.ones((len(t), 1)), E, D]), mode="r")
        R11, R12, R22 = R[: K + 1, : K + 1], R[: K + 1, K + 1 :], R[K + 1 :, K + 1 :]
        try:
            first = np.linalg.solve(R11.T, np.eye(K + 1)[0])  # e0' R11^-1
            stacked = np.vstack([R22 * coefficients[1:, c] / sigma_C[c] for c in range(channels)])
            RF = np.linalg.qr(stacked, mode="r")
            for c in range(channels):
                g = coefficients[1:, c] * (first @ R12)
                sd[row, c] = np.sqrt(sigma_C[c] ** 2 * first @ first + (np.linalg.solve(RF.T, g) ** 2).sum())
        except np.linalg.LinAlgError:
            continue
    return sd


def limit_min(sd, windows_min, tolerance_C=0.2):
    """First window from which on 1.645 sd stays inside the tolerance; None where none does."""
    inside = 1.645 * sd <= tolerance_C
    out = []
    for c in range(sd.shape[1]):
        outside = np.flatnonzero(~inside[:, c])
        first = 0 if len(outside) == 0 else outside[-1] + 1
        out.append(float(windows_min[first]) if first < len(windows_min) else None)
    return out

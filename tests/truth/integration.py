"""Time integration: SDIRK2 (Alexander 1977: L-stable, order 2) with controlled steps that stop at every switching."""
import numpy as np

GAMMA = 1.0 - np.sqrt(0.5)  # makes the method L-stable, with the same matrix for both stages
SMALLEST_STEP_S = 1.875


def simulate(machine, start_C, conditions, span_s, times_s, observe, tolerance_C=0.02, max_step_s=240.0):
    """Integrates over span_s = (begin, end); returns observe @ T at times_s (one row a time) and the last T.

    tolerance_C bounds the difference to the embedded first-order solution: the error itself is far smaller.
    """
    limit_s = min(max_step_s, conditions.max_step_s(machine))
    observed = np.full((len(times_s), observe.shape[0]), np.nan)
    edges = [span_s[0], *(b for b in conditions.breaks if span_s[0] < b < span_s[1]), span_s[1]]
    T = start_C.copy()
    for begin, end in zip(edges, edges[1:]):
        T = _Span(machine, conditions, begin, end).run(T, limit_s, tolerance_C, times_s, observe, observed)
    return observed, T


class _Span:
    """A span without a switching: one regime, a smooth room."""

    def __init__(self, machine, conditions, begin_s, end_s):
        self.machine, self.conditions, self.begin_s, self.end_s = machine, conditions, begin_s, end_s
        self.regime = conditions.regime_at(begin_s)
        self.forced = machine.forced_h(self.regime.rpm)
        self.jacobian, self.inverses = None, {}

    def rate(self, T, t):
        c = self.conditions
        flow = self.machine.flow(T, c.room(t), c.coolant(t), self.regime, self.forced, t)
        return flow / self.machine.capacity

    def run(self, T, limit_s, tolerance_C, times_s, observe, observed):
        t, h, f = self.begin_s, SMALLEST_STEP_S, self.rate(T, self.begin_s)
        while self.end_s - t > 1e-6:
            h = min(h, limit_s)
            left = self.end_s - t
            taken = min(h, left)
            solution = self.step(T, f, t, taken)
            error = np.inf if solution is None else np.abs(GAMMA * taken * (solution[2] - solution[1])).max()
            if error > 4 * tolerance_C and taken > SMALLEST_STEP_S / 16:
                h = 0.5 * taken
                continue
            if solution is None:
                raise RuntimeError("the integration does not converge")
            t_new = t + taken if left - taken > 1e-6 else self.end_s
            f_new = self.rate(solution[0], t_new)
            inside = np.flatnonzero((times_s >= t - 1e-6) & (times_s <= t_new + 1e-6))
            ends = observe @ np.column_stack([T, f, solution[0], f_new])
            observed[inside] = hermite((times_s[inside] - t) / taken, taken, *ends.T)
            T, t, f = solution[0], t_new, f_new
            if error < 0.5 * tolerance_C:
                h *= 2.0
            elif error > tolerance_C:
                h *= 0.5
        return T

    def step(self, T, f, t, h):
        """The new state and both stage rates; None when Newton does not converge even with a fresh matrix."""
        for fresh in (False, True):
            if self.jacobian is None or fresh:
                self.jacobian = self.machine.jacobian(T, self.conditions.room(t), self.regime, self.forced, t)
                self.inverses = {}
            solution = self._sdirk2(T, f, t, h, self._inverse(h))
            if solution is not None:
                return solution
        return None

    def _inverse(self, h):
        key = round(h, 6)
        if key not in self.inverses:
            if len(self.inverses) > 8:
                self.inverses.clear()
            self.inverses[key] = np.linalg.inv(np.diag(self.machine.capacity / (GAMMA * h)) - self.jacobian)
        return self.inverses[key]

    def _sdirk2(self, T, f, t, h, inverse):
        capacity, gh = self.machine.capacity, GAMMA * h
        stages, base, k = [], T, f
        for c in (GAMMA, 1.0):
            x = base + gh * k
            for _ in range(8):
                step = inverse @ (capacity / gh * (base + gh * self.rate(x, t + c * h) - x))
                x = x + step
                if np.abs(step).max() < 2e-5:
                    break
            else:
                return None
            k = (x - base) / gh
            stages.append(k)
            base = T + (1 - GAMMA) * h * k
        return x, stages[0], stages[1]


def hermite(s, h, y0, d0, y1, d1):
    """Cubic through values and slopes at both ends of a step of length h, at shares s of it."""
    s = s[:, None]
    return (
        (1 + 2 * s) * (1 - s) ** 2 * y0
        + s * (1 - s) ** 2 * h * d0
        + s**2 * (3 - 2 * s) * y1
        + s**2 * (s - 1) * h * d1
    )

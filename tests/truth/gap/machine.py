"""A machine tool of a dozen parts, each a chain of finite volumes, with hidden effects acting on single volumes.

Shares nothing with the product: other discretisation (six volumes a part instead of one), another integrator (scipy's BDF),
other functional forms of the effects.
"""
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

CELLS = 6


@dataclass
class Part:
    name: str
    capacity_J_per_K: float
    surface_W_per_K: float
    inner_W_per_K: float  # between one cell and the next


@dataclass
class Joint:
    a: int
    b: int
    cell_a: int
    cell_b: int
    conductance_W_per_K: float


@dataclass
class Heat:
    part: int
    cells: list
    power_W: float
    follows_speed: bool
    exponent: float = 1.0


@dataclass
class Machine:
    parts: list
    joints: list
    heats: list
    reference_rpm: float
    weights: np.ndarray = field(default=None)  # share of a part's capacity in each of its cells

    def __post_init__(self):
        n = len(self.parts) * CELLS
        self.capacity = np.concatenate([p.capacity_J_per_K * w for p, w in zip(self.parts, self.weights)])
        self.surface = np.concatenate([p.surface_W_per_K * w for p, w in zip(self.parts, self.weights)])
        conduction = np.zeros((n, n))
        for i, part in enumerate(self.parts):
            for k in range(CELLS - 1):
                connect(conduction, i * CELLS + k, i * CELLS + k + 1, part.inner_W_per_K)
        for j in self.joints:
            connect(conduction, j.a * CELLS + j.cell_a, j.b * CELLS + j.cell_b, j.conductance_W_per_K)
        self.conduction = conduction

    def cell(self, part, k):
        return part * CELLS + k

    def neighbours(self, part):
        return sorted({j.b if j.a == part else j.a for j in self.joints if part in (j.a, j.b)})


def connect(matrix, i, j, conductance):
    matrix[i, i] -= conductance
    matrix[j, j] -= conductance
    matrix[i, j] += conductance
    matrix[j, i] += conductance


def simulate(machine, speed, room, start_C, times_s, effects):
    """Temperatures of all volumes (columns; those that effects add come last) at times_s.

    speed(t) in rpm and room(t) in C; `effects` are objects of hidden_effects.Effect.
    """
    extra = [e for e in effects if e.extra_cells]
    n = len(machine.capacity)
    capacity, matrix = machine.capacity, machine.conduction
    for effect in extra:
        capacity, matrix = effect.extend(capacity, matrix)
    first = np.concatenate([start_C, np.full(len(capacity) - n, np.nan)])
    for effect in extra:
        first[effect.first_cell:effect.first_cell + effect.extra_cells] = start_C[effect.cell]
    surface = np.concatenate([machine.surface, np.zeros(len(capacity) - n)])

    def rate(t, T):
        air = room(t) + sum(e.room_C(t) for e in effects)
        over = T - air
        loss = surface * over
        heat = np.zeros(len(T))
        for k, source in enumerate(machine.heats):
            power = source_power(machine, source, speed(t))
            for effect in effects:
                power = effect.power(power, k, t, T, air)
            heat[[machine.cell(source.part, c) for c in source.cells]] += power / len(source.cells)
        for effect in effects:
            loss = effect.loss(loss, surface, over, t)
            effect.add_heat(heat, t, T, speed(t), air)
        return (matrix @ T - loss + heat) / capacity

    jacobian = (matrix - np.diag(surface)) / capacity[:, None]
    breaks = sorted({t for t in (*speed.breaks, *(b for e in effects for b in e.breaks(times_s[-1])))
                     if times_s[0] < t < times_s[-1]})
    edges = [times_s[0], *breaks, times_s[-1]]
    controllers = [e for e in effects if hasattr(e, "switching")]
    for effect in effects:
        effect.begin()
    result = np.full((len(times_s), len(capacity)), np.nan)
    state = first
    for begin, end in zip(edges, edges[1:]):
        while begin < end:
            state, begin = advance(rate, jacobian, controllers, begin, end, state, times_s, result)
    return result


def advance(rate, jacobian, controllers, begin, end, state, times_s, result):
    """Integrates to `end`, or to where a controller switches; fills the rows of `result` on the way."""
    for controller in controllers:
        if controller.switching(state) < 0:
            controller.switch()
    inside = np.flatnonzero((times_s >= begin) & (times_s <= end))
    at = np.unique(np.append(times_s[inside], end))
    events = [terminal(c) for c in controllers]
    # a hair inside, so that a switching at `begin` has happened and the one at `end` has not
    solution = solve_ivp(lambda t, T: rate(min(max(t, begin + 1e-6), end - 1e-6), T), (begin, end), state, method="BDF",
                         t_eval=at, jac=jacobian, rtol=1e-5, atol=2e-4, first_step=min(2.0, (end - begin) / 2),
                         max_step=60.0 if controllers else 600.0, events=events or None)
    if not solution.success:
        raise RuntimeError(solution.message)
    reached = inside[: np.searchsorted(times_s[inside], solution.t[-1], side="right")] if len(solution.t) else inside[:0]
    if len(reached):
        result[reached] = solution.y.T[np.searchsorted(solution.t, times_s[reached])]
    for k, controller in enumerate(controllers):
        if len(solution.t_events[k]):
            controller.switch()
            return solution.y_events[k][-1], solution.t_events[k][-1]
    return solution.y[:, -1], end


def terminal(controller):
    def event(t, T):
        return controller.switching(T)

    event.terminal, event.direction = True, -1
    return event


def source_power(machine, source, rpm):
    if not source.follows_speed:
        return source.power_W
    return source.power_W * (rpm / machine.reference_rpm) ** source.exponent if rpm > 0 else 0.0


@dataclass
class Speed:
    """Steps: rpm[k] from at_s[k] on."""

    at_s: list
    rpm: list

    def __call__(self, t):
        return self.rpm[max(np.searchsorted(self.at_s, t, side="right") - 1, 0)]

    @property
    def breaks(self):
        return self.at_s[1:]

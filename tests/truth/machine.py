"""A spindle-head machine tool as a finite-volume body: the known truth that estimators are judged on.

Some hundreds of volumes: the spindle axisymmetric (shaft, bearing rings, rotor and stator, sleeve; r-z), headstock,
column and bed as three-dimensional boxes, sheet covers, a motor. Temperatures in C, time in s, heat in W.
Independent of the product: no file of core/ is read, imported or mirrored here. Equations and sources: README.md.
"""
from dataclasses import replace

import numpy as np
from scipy import sparse

from body import Body, Geometry

SIGMA = 5.670374e-8


def walther_viscosity(T_C, nu40, nu100):
    """Kinematic viscosity in mm2/s: log10 log10 (nu + 0.7) = A - B log10 T (ASTM D341)."""
    z40, z100 = np.log10(np.log10(nu40 + 0.7)), np.log10(np.log10(nu100 + 0.7))
    slope = (z40 - z100) / np.log10(373.15 / 313.15)
    z = z40 - slope * np.log10((np.clip(T_C, -20.0, 150.0) + 273.15) / 313.15)
    return 10.0 ** (10.0**z) - 0.7


class Machine(Geometry):
    def __init__(self, design):
        self.design = design
        body = Body()
        self._build(body, design)
        self.capacity = np.array(body.capacity)
        n = len(self.capacity)
        a, b, g = (np.array(v) for v in zip(*body.links))
        a, b = a.astype(int), b.astype(int)
        # Row sums are exactly the negative off-diagonals: what leaves one volume enters its neighbour.
        conduction = sparse.coo_matrix((np.r_[g, g], (np.r_[a, b], np.r_[b, a])), shape=(n, n)).tocsr()
        self.conduction = (conduction - sparse.diags(np.asarray(conduction.sum(1)).ravel())).tocsr()
        self._dense = self.conduction.toarray()
        self._surfaces(body.surfaces)
        self._heat_maps(n)

    def _surfaces(self, surfaces):
        node, area, kind, length, depth = zip(*surfaces)
        kind, length = np.array(kind), np.array(length)
        self.s_node, self.s_area, self.s_depth = np.array(node), np.array(area), np.array(depth)
        # Simplified laminar free convection of air; turbulent for the big walls (Incropera, McAdams).
        tall = (kind == "vertical") & (length >= 0.45)
        self.s_c = np.select(
            [tall, kind == "vertical", kind == "up", kind == "down"],
            [
                1.31 * np.ones_like(length),
                1.42 * length**-0.25,
                1.32 * length**-0.25,
                0.59 * length**-0.25,
            ],
            0.0,
        )
        self.s_n = np.where(tall, 1.0 / 3.0, 0.25)
        self.s_rotating, self.s_fan, self.s_length = kind == "rotating", kind == "fan", length
        n = len(self.capacity)
        self.s_map = sparse.coo_matrix(
            (np.ones(len(node)), (self.s_node, np.arange(len(node)))), shape=(n, len(node))
        ).tocsr()

    def _heat_maps(self, n):
        """Mean temperatures that the heat depends on (W) and where the heat goes (D)."""
        groups = [*self.rings["front"], *self.rings["rear"], self.stator]
        self.means = np.zeros((5, n))
        for row, nodes in enumerate(groups):
            self.means[row, nodes] = 1.0 / len(nodes)
        where = [
            self.rings["front"][0] + self.rings["front"][1],
            self.rings["rear"][0] + self.rings["rear"][1],
            self.stator,
            self.rotor,
            [self.nose],
            list(self.bed[:, -1, -2:].ravel()),
        ]
        self.deposit = np.zeros((n, len(where)))
        for column, nodes in enumerate(where):
            self.deposit[nodes, column] = 1.0 / len(nodes)
        self.cooling = np.zeros(n)
        self.cooling[self.cooled] = self.design.chiller_W_per_K / len(self.cooled)

    def forced_h(self, rpm):
        omega = rpm * 2 * np.pi / 60
        # Rotating cylinder, Nu = 0.133 Re^(2/3) Pr^(1/3), Re = omega D^2 / nu.
        rotating = (
            0.133
            * (omega * self.s_length**2 / 1.6e-5 + 1.0) ** (2 / 3)
            * 0.71 ** (1 / 3)
            * 0.026
            / self.s_length
        )
        return np.select(
            [self.s_rotating, self.s_fan],
            [np.maximum(rotating, 4.0), 5.0 + 25.0 * (rpm / 6000) ** 0.7],
            self.design.air_speed_h,
        )

    def surface_flow(self, T, room_C, forced):
        """Heat into every surface (W) and its derivative with the surface's temperature (W/K)."""
        d = self.design
        Ts = T[self.s_node]
        if d.linear:
            h = 1.2 * self.s_c + forced + 4 * d.emissivity * SIGMA * 295.0**3
            h = h / (1 + h * self.s_depth)
            return self.s_area * h * (room_C - Ts), self.s_area * h
        diff = np.sqrt((Ts - room_C) ** 2 + 0.04)
        natural = self.s_c * diff**self.s_n
        h = np.cbrt(natural**3 + forced**3)
        slope = (natural / h) ** 2 * natural * self.s_n
        Tk, Tak = Ts + 273.15, room_C + 273.15
        radiated = d.emissivity * SIGMA * (Tk**4 - Tak**4)
        area = self.s_area / (1 + self.s_depth * (h + 4 * d.emissivity * SIGMA * Tk**3))
        return area * (h * (room_C - Ts) - radiated), area * (h + slope + 4 * d.emissivity * SIGMA * Tk**3)

    def heat(self, means, regime, since_start_s):
        """Heat of the six places (W): front bearings, rear bearings, stator, rotor, tool side, bed."""
        d = self.design
        omega = regime.rpm * 2 * np.pi / 60
        out = np.zeros(6)
        T_in, T_out, T_motor = means[[0, 2]], means[[1, 3]], means[4]
        oil = np.full(2, 30.0) if d.linear else 0.5 * (T_in + T_out)
        nu_n = np.maximum(walther_viscosity(oil, d.nu40_mm2_s, d.nu100_mm2_s) * regime.rpm, 2000.0)
        viscous = 1e-7 * d.f0 * nu_n ** (2 / 3) * d.dm_mm**3 * 1e-3
        growth = 0.0 if d.linear else d.preload_growth_per_K * (T_in - T_out)
        preload = d.preload_N * (0.2 + np.logaddexp(0.0, 4.0 * (0.8 + growth)) / 4.0)
        load = d.f1 * (preload + 0.3 * regime.cutting_W) * d.dm_mm * 1e-3
        run_in = 1.0 + d.run_in * np.exp(-max(since_start_s, 0.0) / (60.0 * d.run_in_min))
        torque = (viscous * run_in + load) * np.array([3.0, 2.0 * d.rear_share])
        out[:2] = d.friction_scale * torque * omega
        if regime.rpm > 0:
            copper = (
                d.motor_copper_W
                * (0.08 + regime.load**2)
                * (1.0 if d.linear else 1.0 + 0.0039 * (T_motor - 20.0))
            )
            iron = d.motor_iron_W * (regime.rpm / 6000.0) ** 1.5
            out[2] = d.friction_scale * (copper + 0.6 * iron)
            out[3] = d.friction_scale * 0.4 * iron
            out[4] = regime.cutting_W
            out[5] = d.hydraulic_W
        return out

    def flow(self, T, room_C, coolant_C, regime, forced, since_start_s):
        """Net heat into every volume, W."""
        surface, _ = self.surface_flow(T, room_C, forced)
        return (
            self.conduction @ T
            + self.s_map @ surface
            + self.deposit @ self.heat(self.means @ T, regime, since_start_s)
            + self.cooling * (coolant_C - T)
        )

    def jacobian(self, T, room_C, regime, forced, since_start_s):
        _, slope = self.surface_flow(T, room_C, forced)
        J = self._dense.copy()
        J[np.diag_indices_from(J)] -= self.s_map @ slope + self.cooling
        means = self.means @ T
        base = self.heat(means, regime, since_start_s)
        sensitivity = np.empty((6, 5))
        for j in range(5):
            moved = means.copy()
            moved[j] += 1e-3
            sensitivity[:, j] = (self.heat(moved, regime, since_start_s) - base) / 1e-3
        return J + self.deposit @ sensitivity @ self.means

    def steady(self, room_C, regime, coolant_C=None, guess=None):
        """Where everything settles in an unchanging room (Newton on the whole nonlinear balance)."""
        coolant_C = room_C if coolant_C is None else coolant_C
        T = np.full(len(self.capacity), room_C + 5.0) if guess is None else guess.copy()
        forced = self.forced_h(regime.rpm)
        for _ in range(60):
            residual = self.flow(T, room_C, coolant_C, regime, forced, np.inf)
            step = np.linalg.solve(self.jacobian(T, room_C, regime, forced, np.inf), -residual)
            T = T + step * min(1.0, 15.0 / max(np.abs(step).max(), 1e-12))
            if np.abs(step).max() < 1e-9:
                return T
        raise RuntimeError("the steady state was not found: thermal runaway of the drawn bearing?")

    def modes(self, room_C, regime, T):
        """Time constants (s) and step shares of the body linearised at T: x(t) - x_ss = sum_k shapes[:, k] exp(-t/tau_k)
        for a start at `room_C` everywhere."""
        J = self.jacobian(T, room_C, regime, self.forced_h(regime.rpm), np.inf) / self.capacity[:, None]
        rates, vectors = np.linalg.eig(J)
        coefficients = np.linalg.solve(vectors, (room_C - T).astype(complex))
        order = np.argsort(-rates.real)
        return -1.0 / rates.real[order], (vectors * coefficients).real[:, order]


def with_design(machine, **changes):
    return Machine(replace(machine.design, **changes))


PLACES = (
    "sleeve_front",
    "sleeve_rear",
    "head_bearing",
    "head_front_low",
    "head_left",
    "head_right",
    "head_top",
    "head_rear",
    "head_middle",
    "cover_left",
    "cover_right",
    "motor",
    "column_top",
    "column_middle",
    "bed",
    "nose_ring",
)


def place_node(machine, place):
    h, c, b = machine.head, machine.column, machine.bed
    nx, ny, nz = h.shape
    nodes = {
        "sleeve_front": machine.sleeve[2 * len(machine.sleeve) // 16],
        "sleeve_rear": machine.sleeve[-(3 * len(machine.sleeve) // 16)],
        "head_bearing": h[nx // 2, ny - 1, nz // 8],
        "head_front_low": h[nx // 2, 0, 0],
        "head_left": h[0, ny // 2, nz // 3],
        "head_right": h[-1, ny // 2, 2 * nz // 3],
        "head_top": h[nx // 2, -1, nz // 2],
        "head_rear": h[nx // 2, ny // 2, -1],
        "head_middle": h[nx // 2, ny // 2, nz // 2],
        "cover_left": machine.covers["x-"][1],
        "cover_right": machine.covers["x+"][2],
        "motor": machine.motor_case[0],
        "column_top": c[c.shape[0] // 2, -1, 0],
        "column_middle": c[0, c.shape[1] // 2, 1],
        "bed": b[0, -1, -1],
        "nose_ring": machine.inner_sleeve[0],
    }
    return int(nodes[place])

"""A spindle-head machine tool as a finite-volume body: the known truth that estimators are judged on.

Some hundreds of volumes: the spindle axisymmetric (shaft, bearing rings, rotor and stator, sleeve; r-z), headstock,
column and bed as three-dimensional boxes, sheet covers, a motor. Temperatures in C, time in s, heat in W.
Independent of the product: no file of core/ is read, imported or mirrored here. Equations and sources: README.md.
"""
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import sparse

SIGMA = 5.670374e-8
GAMMA = 1.0 - np.sqrt(0.5)  # SDIRK2 of Alexander (1977): L-stable, order 2, one matrix for both stages

CAST_IRON = dict(k=48.0, rho=7200.0, c=500.0)
STEEL = dict(k=44.0, rho=7850.0, c=470.0)


class Body:
    """Volumes, links between them and surfaces to the air, collected piece by piece."""

    def __init__(self):
        self.capacity, self.links, self.surfaces = [], [], []

    def volume(self, capacity_J_per_K):
        self.capacity.append(capacity_J_per_K)
        return len(self.capacity) - 1

    def link(self, a, b, conductance_W_per_K):
        if conductance_W_per_K > 0.0:
            self.links.append((a, b, conductance_W_per_K))

    def surface(self, node, area_m2, kind, length_m, depth_m2K_per_W=0.0):
        """depth: the resistance of the half volume between the node and its surface."""
        if area_m2 > 0.0:
            self.surfaces.append((node, area_m2, kind, length_m, depth_m2K_per_W))

    def box(self, size_m, cells, solid, material, exposed):
        """A ribbed casting as a box: `solid` of its volume is metal. `exposed` maps a face name (x-, x+, ...) to the
        fraction of it that sees the air. Returns the node numbers as an array [ix, iy, iz]."""
        n = np.array(cells)
        d = np.array(size_m) / n
        nodes = np.empty(cells, dtype=int)
        for index in np.ndindex(*cells):
            nodes[index] = self.volume(solid * material["rho"] * material["c"] * d.prod())
        # Walls along the heat's way carry it; ribs across it do not: 0.75 of the solid share.
        k = 0.75 * solid * material["k"] if solid < 1.0 else material["k"]
        for axis in range(3):
            area = d.prod() / d[axis]
            lower = np.take(nodes, range(n[axis] - 1), axis).ravel()
            upper = np.take(nodes, range(1, n[axis]), axis).ravel()
            for a, b in zip(lower, upper):
                self.link(a, b, k * area / d[axis])
            for end, name in ((0, "-"), (n[axis] - 1, "+")):
                face = "xyz"[axis] + name
                kind = {"y-": "down", "y+": "up"}.get(face, "vertical")
                for node in np.take(nodes, end, axis).ravel():
                    self.surface(node, area * exposed.get(face, 0.0), kind, min(size_m), 0.5 * d[axis] / k)
        return nodes


@dataclass(frozen=True)
class Design:
    """One machine: sizes in m, conductances in W/(m2 K), drawn by draw_design()."""
    head_m: tuple = (0.42, 0.40, 0.70)
    head_solid: float = 0.30
    column_m: tuple = (0.55, 1.3, 0.45)
    column_solid: float = 0.15
    bed_m: tuple = (0.9, 0.45, 1.2)
    bed_solid: float = 0.15
    shaft_r_m: tuple = (0.018, 0.042)
    ring_m: float = 0.012
    sleeve_m: float = 0.025
    sleeve_contact: float = 1500.0
    guide_contact: float = 900.0
    guide_share: float = 0.12
    bolted_contact: float = 2500.0
    ring_conductance_W_per_K: float = 6.0
    cover_gap: float = 5.0
    covered: float = 0.6
    integrated_motor: bool = True
    flange_W_per_K: float = 6.0
    air_speed_h: float = 3.0
    emissivity: float = 0.8
    dm_mm: float = 95.0
    f0: float = 1.0
    f1: float = 0.0006
    preload_N: float = 500.0
    preload_growth_per_K: float = 0.03
    nu40_mm2_s: float = 25.0
    nu100_mm2_s: float = 4.6
    rear_share: float = 0.6
    motor_iron_W: float = 60.0
    motor_copper_W: float = 120.0
    friction_scale: float = 1.0
    chiller_W_per_K: float = 0.0
    hydraulic_W: float = 40.0  # pump and lubrication unit on the bed, on while the machine runs
    run_in: float = 0.0
    run_in_min: float = 40.0
    linear: bool = False
    cells: int = 1  # refinement of every direction


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


def walther_viscosity(T_C, nu40, nu100):
    """Kinematic viscosity in mm2/s: log10 log10 (nu + 0.7) = A - B log10 T (ASTM D341)."""
    z40, z100 = np.log10(np.log10(nu40 + 0.7)), np.log10(np.log10(nu100 + 0.7))
    slope = (z40 - z100) / np.log10(373.15 / 313.15)
    z = z40 - slope * np.log10((np.clip(T_C, -20.0, 150.0) + 273.15) / 313.15)
    return 10.0 ** (10.0 ** z) - 0.7


class Machine:
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

    # -- geometry ---------------------------------------------------------------------------------------------------

    def _build(self, body, d):
        r = d.cells
        bare = 1.0 - d.covered
        head = body.box(d.head_m, (4 * r, 4 * r, 8 * r), d.head_solid, CAST_IRON,
                        {"x-": bare, "x+": bare, "y+": 1.0, "y-": 0.2, "z-": 0.8, "z+": 0.6})
        column = body.box(d.column_m, (3 * r, 8 * r, 3 * r), d.column_solid, CAST_IRON,
                          {"x-": 1.0, "x+": 1.0, "z-": 1.0, "z+": 0.8, "y+": 1.0})
        bed = body.box(d.bed_m, (3 * r, 3 * r, 4 * r), d.bed_solid, CAST_IRON,
                       {"x-": 1.0, "x+": 1.0, "z-": 1.0, "z+": 1.0, "y+": 0.5})
        self._join(body, head[:, 0, :], column[:, -(2 * r):, 0],
                   d.guide_contact * d.guide_share * d.head_m[0] * d.head_m[2])
        self._join(body, column[:, 0, :], bed[:, -1, -(2 * r):],
                   d.bolted_contact * 0.2 * d.column_m[0] * d.column_m[2])
        self._spindle(body, d, head)
        self.covers = {}
        for face, nodes in (("x-", head[0]), ("x+", head[-1])):
            area = d.covered * d.head_m[1] * d.head_m[2]
            self.covers[face] = self._cover(body, d, nodes, area)
        self.head, self.column, self.bed = head, column, bed

    @staticmethod
    def _join(body, first, second, conductance):
        """Two faces in contact, spread evenly over the cells of both."""
        first, second = first.ravel(), second.ravel()
        for a in first:
            for b in second:
                body.link(a, b, conductance / (len(first) * len(second)))

    @staticmethod
    def _cover(body, d, nodes, area):
        parts = [part.ravel() for half in np.array_split(nodes, 2, 0) for part in np.array_split(half, 2, 1)]
        sheet = []
        for part in parts:
            node = body.volume(0.0018 * STEEL["rho"] * STEEL["c"] * area / 4)
            for cell in part:
                body.link(node, cell, d.cover_gap * area / 4 / len(part))
            body.surface(node, area / 4, "vertical", 0.4)
            sheet.append(node)
        body.link(sheet[0], sheet[1], STEEL["k"] * 0.0018)
        body.link(sheet[2], sheet[3], STEEL["k"] * 0.0018)
        return sheet

    def _spindle(self, body, d, head):
        """Shaft in two layers, rings or rotor/stator between shaft and sleeve, the sleeve in two layers."""
        nz = 16 * d.cells
        dz = d.head_m[2] / nz
        zone = ["plain"] * nz
        for i in range(nz):
            z = (i + 0.5) / nz
            if 1 / 16 < z < 3 / 16:
                zone[i] = "front"
            elif 12 / 16 < z < 14 / 16:
                zone[i] = "rear"
            elif d.integrated_motor and 6 / 16 < z < 10 / 16:
                zone[i] = "motor"
        r_in, r_shaft = d.shaft_r_m
        r_ring, r_bore = r_shaft + d.ring_m, r_shaft + 2 * d.ring_m
        edges = {"shaft0": (r_in, 0.5 * (r_in + r_shaft)), "shaft1": (0.5 * (r_in + r_shaft), r_shaft),
                 "inner": (r_shaft, r_ring), "outer": (r_ring, r_bore),
                 "sleeve0": (r_bore, r_bore + 0.5 * d.sleeve_m), "sleeve1": (r_bore + 0.5 * d.sleeve_m, r_bore + d.sleeve_m)}
        cells = {name: [None] * nz for name in edges}
        for name, (r0, r1) in edges.items():
            section = np.pi * (r1 ** 2 - r0 ** 2)
            for i in range(nz):
                if name in ("inner", "outer") and zone[i] == "plain":
                    continue
                cells[name][i] = body.volume(section * dz * STEEL["rho"] * STEEL["c"])
                if i and cells[name][i - 1] is not None:
                    body.link(cells[name][i - 1], cells[name][i], STEEL["k"] * section / dz)

        def ring_to_ring(i, first, second, contact):
            """Radial conduction between the mid radii of two layers, with a contact between them."""
            (a0, a1), (b0, b1) = edges[first], edges[second]
            resistance = np.log(0.5 * (b0 + b1) / (0.5 * (a0 + a1))) / (2 * np.pi * STEEL["k"] * dz)
            if contact is not None:
                resistance += 1.0 / (contact * 2 * np.pi * b0 * dz)
            body.link(cells[first][i], cells[second][i], 1.0 / resistance)

        count = {name: max(1, zone.count(name)) for name in ("front", "rear", "motor")}
        for i in range(nz):
            ring_to_ring(i, "shaft0", "shaft1", None)
            ring_to_ring(i, "sleeve0", "sleeve1", None)
            if zone[i] == "plain":
                body.link(cells["shaft1"][i], cells["sleeve0"][i], 12.0 * 2 * np.pi * r_shaft * dz)
                continue
            ring_to_ring(i, "shaft1", "inner", 4000.0)
            ring_to_ring(i, "outer", "sleeve0", 3000.0)
            gap = 80.0 * 2 * np.pi * r_ring * dz if zone[i] == "motor" else d.ring_conductance_W_per_K / count[zone[i]]
            body.link(cells["inner"][i], cells["outer"][i], gap)
        bore = self._bore_cells(head)
        for i in range(nz):
            slice_cells = bore[min(int((i + 0.5) / nz * head.shape[2]), head.shape[2] - 1)]
            g = d.sleeve_contact * 2 * np.pi * (r_bore + d.sleeve_m) * dz
            for cell in slice_cells:
                body.link(cells["sleeve1"][i], cell, g / len(slice_cells))
        self.rings = {name: ([cells["inner"][i] for i in range(nz) if zone[i] == name],
                             [cells["outer"][i] for i in range(nz) if zone[i] == name]) for name in ("front", "rear")}
        nose = body.volume(np.pi * (1.6 * r_shaft) ** 2 * 0.07 * STEEL["rho"] * STEEL["c"])
        body.link(nose, cells["shaft0"][0], STEEL["k"] * np.pi * r_shaft ** 2 / 0.05)
        body.link(nose, cells["shaft1"][0], STEEL["k"] * np.pi * r_shaft ** 2 / 0.05)
        body.surface(nose, 2 * np.pi * 1.6 * r_shaft * 0.09, "rotating", 3.2 * r_shaft)
        body.surface(cells["shaft0"][-1], 2 * np.pi * r_shaft * 0.12, "rotating", 2 * r_shaft)
        self.nose, self.sleeve, self.inner_sleeve = nose, cells["sleeve1"], cells["sleeve0"]
        self.cooled = [cells["sleeve1"][i] for i in range(nz) if 3 / 16 < (i + 0.5) / nz < 12 / 16]
        if d.integrated_motor:
            self.rotor = [cells["inner"][i] for i in range(nz) if zone[i] == "motor"]
            self.stator = [cells["outer"][i] for i in range(nz) if zone[i] == "motor"]
            self.motor_case = self.stator
        else:
            # A flanged motor: 0.2 x 0.2 x 0.3 m, finned, its fan as fast as the spindle.
            motor = body.box((0.2, 0.2, 0.3), (2, 2, 3), 0.85, STEEL, {})
            for node in motor.ravel():
                body.surface(node, 0.55 / motor.size, "fan", 0.2)
            self._join(body, motor[:, :, 0], head[:, :, -1], d.flange_W_per_K)
            self.rotor = list(motor[:, :, 1].ravel())
            self.stator, self.motor_case = self.rotor, list(motor[:, :, 2].ravel())

    @staticmethod
    def _bore_cells(head):
        nx, ny, nz = head.shape
        return [head[nx // 4:nx - nx // 4, ny // 4:ny - ny // 4, iz].ravel() for iz in range(nz)]

    # -- surfaces and heat ------------------------------------------------------------------------------------------

    def _surfaces(self, surfaces):
        node, area, kind, length, depth = zip(*surfaces)
        kind, length = np.array(kind), np.array(length)
        self.s_node, self.s_area, self.s_depth = np.array(node), np.array(area), np.array(depth)
        # Simplified laminar free convection of air; turbulent for the big walls (Incropera, McAdams).
        tall = (kind == "vertical") & (length >= 0.45)
        self.s_c = np.select([tall, kind == "vertical", kind == "up", kind == "down"],
                             [1.31 * np.ones_like(length), 1.42 * length ** -0.25, 1.32 * length ** -0.25,
                              0.59 * length ** -0.25], 0.0)
        self.s_n = np.where(tall, 1.0 / 3.0, 0.25)
        self.s_rotating, self.s_fan, self.s_length = kind == "rotating", kind == "fan", length
        n = len(self.capacity)
        self.s_map = sparse.coo_matrix((np.ones(len(node)), (self.s_node, np.arange(len(node)))), shape=(n, len(node))).tocsr()

    def _heat_maps(self, n):
        """Mean temperatures that the heat depends on (W) and where the heat goes (D)."""
        groups = [*self.rings["front"], *self.rings["rear"], self.stator]
        self.means = np.zeros((5, n))
        for row, nodes in enumerate(groups):
            self.means[row, nodes] = 1.0 / len(nodes)
        where = [self.rings["front"][0] + self.rings["front"][1], self.rings["rear"][0] + self.rings["rear"][1],
                 self.stator, self.rotor, [self.nose], list(self.bed[:, -1, -2:].ravel())]
        self.deposit = np.zeros((n, len(where)))
        for column, nodes in enumerate(where):
            self.deposit[nodes, column] = 1.0 / len(nodes)
        self.cooling = np.zeros(n)
        self.cooling[self.cooled] = self.design.chiller_W_per_K / len(self.cooled)

    def forced_h(self, rpm):
        omega = rpm * 2 * np.pi / 60
        # Rotating cylinder, Nu = 0.133 Re^(2/3) Pr^(1/3), Re = omega D^2 / nu.
        rotating = 0.133 * (omega * self.s_length ** 2 / 1.6e-5 + 1.0) ** (2 / 3) * 0.71 ** (1 / 3) * 0.026 / self.s_length
        return np.select([self.s_rotating, self.s_fan], [np.maximum(rotating, 4.0), 5.0 + 25.0 * (rpm / 6000) ** 0.7],
                         self.design.air_speed_h)

    def surface_flow(self, T, room_C, forced):
        """Heat into every surface (W) and its derivative with the surface's temperature (W/K)."""
        d = self.design
        Ts = T[self.s_node]
        if d.linear:
            h = 1.2 * self.s_c + forced + 4 * d.emissivity * SIGMA * 295.0 ** 3
            h = h / (1 + h * self.s_depth)
            return self.s_area * h * (room_C - Ts), self.s_area * h
        diff = np.sqrt((Ts - room_C) ** 2 + 0.04)
        natural = self.s_c * diff ** self.s_n
        h = np.cbrt(natural ** 3 + forced ** 3)
        slope = (natural / h) ** 2 * natural * self.s_n
        Tk, Tak = Ts + 273.15, room_C + 273.15
        radiated = d.emissivity * SIGMA * (Tk ** 4 - Tak ** 4)
        area = self.s_area / (1 + self.s_depth * (h + 4 * d.emissivity * SIGMA * Tk ** 3))
        return area * (h * (room_C - Ts) - radiated), area * (h + slope + 4 * d.emissivity * SIGMA * Tk ** 3)

    def heat(self, means, regime, since_start_s):
        """Heat of the six places (W): front bearings, rear bearings, stator, rotor, tool side, bed."""
        d = self.design
        omega = regime.rpm * 2 * np.pi / 60
        out = np.zeros(6)
        T_in, T_out, T_motor = means[[0, 2]], means[[1, 3]], means[4]
        oil = np.full(2, 30.0) if d.linear else 0.5 * (T_in + T_out)
        nu_n = np.maximum(walther_viscosity(oil, d.nu40_mm2_s, d.nu100_mm2_s) * regime.rpm, 2000.0)
        viscous = 1e-7 * d.f0 * nu_n ** (2 / 3) * d.dm_mm ** 3 * 1e-3
        growth = 0.0 if d.linear else d.preload_growth_per_K * (T_in - T_out)
        preload = d.preload_N * (0.2 + np.logaddexp(0.0, 4.0 * (0.8 + growth)) / 4.0)
        load = d.f1 * (preload + 0.3 * regime.cutting_W) * d.dm_mm * 1e-3
        run_in = 1.0 + d.run_in * np.exp(-max(since_start_s, 0.0) / (60.0 * d.run_in_min))
        torque = (viscous * run_in + load) * np.array([3.0, 2.0 * d.rear_share])
        out[:2] = d.friction_scale * torque * omega
        if regime.rpm > 0:
            copper = d.motor_copper_W * (0.08 + regime.load ** 2) * (1.0 if d.linear else 1.0 + 0.0039 * (T_motor - 20.0))
            iron = d.motor_iron_W * (regime.rpm / 6000.0) ** 1.5
            out[2] = d.friction_scale * (copper + 0.6 * iron)
            out[3] = d.friction_scale * 0.4 * iron
            out[4] = regime.cutting_W
            out[5] = d.hydraulic_W
        return out

    def flow(self, T, room_C, coolant_C, regime, forced, since_start_s):
        """Net heat into every volume, W."""
        surface, _ = self.surface_flow(T, room_C, forced)
        return (self.conduction @ T + self.s_map @ surface + self.deposit @ self.heat(self.means @ T, regime, since_start_s)
                + self.cooling * (coolant_C - T))

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

    # -- solutions --------------------------------------------------------------------------------------------------

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

    def simulate(self, T0, regimes, room, coolant, t_start_s, t_end_s, times_s, observe, tolerance_C=0.02, max_step_s=240.0):
        """Integrates from t_start_s; returns observe @ T at times_s (rows: times). regimes sorted by t_s."""
        steps = 1.875 * 2.0 ** np.arange(0, 10)
        breaks = sorted({*(r.t_s for r in regimes), *room.breaks, t_end_s, 0.0})
        T, t, level = T0.copy(), t_start_s, 0
        observed = np.empty((len(times_s), observe.shape[0]))
        next_output = int(np.searchsorted(times_s, t_start_s - 1e-9))
        observed[:next_output] = np.nan
        inverses, jac, regime = {}, None, None
        forced = None
        limit = min(max_step_s, getattr(room, "max_step_s", max_step_s),
                    coolant.period_s / 12 if coolant.swing_C and self.design.chiller_W_per_K else max_step_s)

        def rate(T, t):
            return self.flow(T, room(t), coolant(t), regime, forced, t) / self.capacity

        f = None
        while t < t_end_s - 1e-6:
            current = [r for r in regimes if r.t_s <= t + 1e-6][-1]
            if current is not regime:
                regime, forced, jac, level, f = current, self.forced_h(current.rpm), None, 0, None
            if f is None:
                f = rate(T, t)
            stop = min(b for b in breaks if b > t + 1e-6)
            h = min(steps[level], limit, stop - t)
            key = round(h, 6)
            for attempt in range(2):
                if jac is None:
                    jac, inverses = self.jacobian(T, room(t), regime, forced, t), {}
                if key not in inverses:
                    if len(inverses) > 8:
                        inverses.clear()
                    inverses[key] = np.linalg.inv(np.diag(self.capacity / (GAMMA * h)) - jac)
                solution = self._sdirk2(T, f, t, h, rate, inverses[key])
                if solution is not None:
                    break
                jac = None
            if solution is None:
                level = max(level - 1, 0)
                if h < 0.5:
                    raise RuntimeError("the integration does not converge")
                steps = np.r_[steps[0] / 2, steps] if level == 0 else steps
                continue
            T_new, k1, k2 = solution
            error = np.abs(GAMMA * h * (k2 - k1)).max()
            if error > 4 * tolerance_C and level > 0 and h > steps[0]:
                level -= 1
                continue
            t_new = t + h if stop - t - h > 1e-6 else stop
            f_new = rate(T_new, t_new)
            y0, y1, d0, d1 = observe @ T, observe @ T_new, observe @ f, observe @ f_new
            while next_output < len(times_s) and times_s[next_output] <= t_new + 1e-6:
                s = (times_s[next_output] - t) / h
                observed[next_output] = ((1 + 2 * s) * (1 - s) ** 2 * y0 + s * (1 - s) ** 2 * h * d0
                                         + s ** 2 * (3 - 2 * s) * y1 + s ** 2 * (s - 1) * h * d1)
                next_output += 1
            T, t, f = T_new, t_new, f_new
            if t in breaks:
                level, f = 0, None
            elif error < 0.5 * tolerance_C and level < len(steps) - 1 and h >= 0.99 * steps[level]:
                level += 1
            elif error > tolerance_C and level > 0:
                level -= 1
        self.final = T
        return observed

    def _sdirk2(self, T, f, t, h, rate, inverse):
        """One step; None when Newton does not converge. Returns the new state and both stage rates."""
        gh = GAMMA * h
        stages = []
        base, k = T, f
        for c in (GAMMA, 1.0):
            x = base + gh * k
            for iteration in range(8):
                k_here = rate(x, t + c * h)
                step = inverse @ (self.capacity / gh * (base + gh * k_here - x))
                x = x + step
                if np.abs(step).max() < 2e-5:
                    break
            else:
                return None
            k = (x - base) / gh
            stages.append(k)
            base = T + (1 - GAMMA) * h * k
        return x, stages[0], stages[1]


# -- rooms ----------------------------------------------------------------------------------------------------------

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
            value = value + self.day_C * (np.sin(2 * np.pi * t / 86400.0 + self.day_phase) - np.sin(self.day_phase))
        if self.hvac_C:
            # A thermostat's sawtooth, corners included: cooled for one share of the period, drifting up for the rest.
            phase = (t / self.hvac_period_s + self.hvac_phase) % 1.0
            share = self.hvac_on_share
            value = value + self.hvac_C * np.where(phase < share, 1 - 2 * phase / share, 2 * (phase - share) / (1 - share) - 1)
        for at, size, tau, back in self.jumps:
            value = value + np.where(t > at, size * (1 - np.exp(-np.maximum(t - at, 0.0) / tau)), 0.0)
            if back:
                value = value - np.where(t > at + back, size * (1 - np.exp(-np.maximum(t - at - back, 0.0) / tau)), 0.0)
        for amplitude, period, phase in self.wander:
            value = value + amplitude * (np.sin(2 * np.pi * t / period + phase) - np.sin(phase))
        return value

    def frozen(self, level_C):
        return Room(level_C=level_C)


# -- drawing machines -----------------------------------------------------------------------------------------------

def draw_design(rng, kind="ordinary"):
    """A machine at random. kind: ordinary, slow (thick castings), linear, nonlinear (friction and preload strong)."""
    u = lambda a, b: float(rng.uniform(a, b))
    slow = kind == "slow"
    size = u(0.65, 1.1) * (1.5 if slow else 1.0)
    nonlinear = kind == "nonlinear"
    return Design(
        head_m=(0.40 * size * u(0.9, 1.1), 0.38 * size * u(0.9, 1.1), 0.65 * size * u(0.85, 1.2)),
        head_solid=u(0.12, 0.26) if slow else u(0.04, 0.12),
        column_m=(0.5 * size, u(1.0, 1.6), 0.45 * size), column_solid=u(0.15, 0.26) if slow else u(0.04, 0.11),
        bed_m=(u(0.7, 1.1), u(0.35, 0.55), u(0.9, 1.4)), bed_solid=u(0.12, 0.24) if slow else u(0.04, 0.10), hydraulic_W=u(10, 90),
        shaft_r_m=(u(0.012, 0.022), u(0.036, 0.055)), ring_m=u(0.010, 0.015), sleeve_m=u(0.018, 0.032),
        sleeve_contact=u(600, 4000), guide_contact=u(500, 2500), guide_share=u(0.06, 0.2), bolted_contact=u(1500, 5000),
        ring_conductance_W_per_K=u(3, 12), cover_gap=u(3.5, 7), covered=u(0.3, 0.85),
        integrated_motor=bool(rng.random() < 0.5), flange_W_per_K=u(3, 10), air_speed_h=u(3, 7) if slow else u(6, 17), emissivity=u(0.3, 0.95),
        dm_mm=u(75, 120), f0=u(0.8, 2.5), f1=u(0.0003, 0.0013), preload_N=u(280, 950),
        preload_growth_per_K=u(0.08, 0.18) if nonlinear else u(0.0, 0.05),
        nu40_mm2_s=u(60, 110) if nonlinear else u(12, 40), nu100_mm2_s=u(7, 9) if nonlinear else u(2.8, 4.5),
        rear_share=u(0.4, 0.9), motor_iron_W=u(30, 150), motor_copper_W=u(60, 250),
        run_in=u(0.1, 0.35) if nonlinear and rng.random() < 0.4 else 0.0, run_in_min=u(15, 60), linear=kind == "linear")


def with_design(machine, **changes):
    return Machine(replace(machine.design, **changes))


PLACES = ("sleeve_front", "sleeve_rear", "head_bearing", "head_front_low", "head_left", "head_right", "head_top",
          "head_rear", "head_middle", "cover_left", "cover_right", "motor", "column_top", "column_middle", "bed", "nose_ring")


def place_node(machine, place):
    h, c, b = machine.head, machine.column, machine.bed
    nx, ny, nz = h.shape
    nodes = {
        "sleeve_front": machine.sleeve[2 * len(machine.sleeve) // 16], "sleeve_rear": machine.sleeve[-(3 * len(machine.sleeve) // 16)],
        "head_bearing": h[nx // 2, ny - 1, nz // 8], "head_front_low": h[nx // 2, 0, 0], "head_left": h[0, ny // 2, nz // 3],
        "head_right": h[-1, ny // 2, 2 * nz // 3], "head_top": h[nx // 2, -1, nz // 2], "head_rear": h[nx // 2, ny // 2, -1],
        "head_middle": h[nx // 2, ny // 2, nz // 2], "cover_left": machine.covers["x-"][1], "cover_right": machine.covers["x+"][2],
        "motor": machine.motor_case[0], "column_top": c[c.shape[0] // 2, -1, 0], "column_middle": c[0, c.shape[1] // 2, 1],
        "bed": b[0, -1, -1], "nose_ring": machine.inner_sleeve[0]}
    return int(nodes[place])

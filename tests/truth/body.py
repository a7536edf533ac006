"""The shape of a spindle-head machine tool: volumes, links, surfaces, and how a design becomes them.

Lengths in m, contact conductances in W/(m2 K), heat capacities in J/K. Equations and sources: README.md.
"""
from dataclasses import dataclass

import numpy as np

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


class Geometry:
    """Builds the body of a design, and remembers which of its nodes are what."""

    def _build(self, body, d):
        r = d.cells
        bare = 1.0 - d.covered
        head = body.box(
            d.head_m,
            (4 * r, 4 * r, 8 * r),
            d.head_solid,
            CAST_IRON,
            {"x-": bare, "x+": bare, "y+": 1.0, "y-": 0.2, "z-": 0.8, "z+": 0.6},
        )
        column = body.box(
            d.column_m,
            (3 * r, 8 * r, 3 * r),
            d.column_solid,
            CAST_IRON,
            {"x-": 1.0, "x+": 1.0, "z-": 1.0, "z+": 0.8, "y+": 1.0},
        )
        bed = body.box(
            d.bed_m,
            (3 * r, 3 * r, 4 * r),
            d.bed_solid,
            CAST_IRON,
            {"x-": 1.0, "x+": 1.0, "z-": 1.0, "z+": 1.0, "y+": 0.5},
        )
        self._join(
            body,
            head[:, 0, :],
            column[:, -(2 * r) :, 0],
            d.guide_contact * d.guide_share * d.head_m[0] * d.head_m[2],
        )
        self._join(
            body,
            column[:, 0, :],
            bed[:, -1, -(2 * r) :],
            d.bolted_contact * 0.2 * d.column_m[0] * d.column_m[2],
        )
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
        edges = {
            "shaft0": (r_in, 0.5 * (r_in + r_shaft)),
            "shaft1": (0.5 * (r_in + r_shaft), r_shaft),
            "inner": (r_shaft, r_ring),
            "outer": (r_ring, r_bore),
            "sleeve0": (r_bore, r_bore + 0.5 * d.sleeve_m),
            "sleeve1": (r_bore + 0.5 * d.sleeve_m, r_bore + d.sleeve_m),
        }
        cells = {name: [None] * nz for name in edges}
        for name, (r0, r1) in edges.items():
            section = np.pi * (r1**2 - r0**2)
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
            gap = (
                80.0 * 2 * np.pi * r_ring * dz
                if zone[i] == "motor"
                else d.ring_conductance_W_per_K / count[zone[i]]
            )
            body.link(cells["inner"][i], cells["outer"][i], gap)
        bore = self._bore_cells(head)
        for i in range(nz):
            slice_cells = bore[min(int((i + 0.5) / nz * head.shape[2]), head.shape[2] - 1)]
            g = d.sleeve_contact * 2 * np.pi * (r_bore + d.sleeve_m) * dz
            for cell in slice_cells:
                body.link(cells["sleeve1"][i], cell, g / len(slice_cells))
        self.rings = {
            name: (
                [cells["inner"][i] for i in range(nz) if zone[i] == name],
                [cells["outer"][i] for i in range(nz) if zone[i] == name],
            )
            for name in ("front", "rear")
        }
        nose = body.volume(np.pi * (1.6 * r_shaft) ** 2 * 0.07 * STEEL["rho"] * STEEL["c"])
        body.link(nose, cells["shaft0"][0], STEEL["k"] * np.pi * r_shaft**2 / 0.05)
        body.link(nose, cells["shaft1"][0], STEEL["k"] * np.pi * r_shaft**2 / 0.05)
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
        return [head[nx // 4 : nx - nx // 4, ny // 4 : ny - ny // 4, iz].ravel() for iz in range(nz)]

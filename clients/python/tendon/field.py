# SPDX-License-Identifier: Apache-2.0
"""Fields: objects that an engine describes once, and that the server renders at the rate of the device, so that a
delay of the engine does not matter (core/field/README.md).

    field = tendon.Field.from_mesh("part.stl", spacing_mm=1)
    field.material("steel", stiffness=1500, friction=0.3)

A field is the union of primitives and of bricks, which are blocks of 8³ weights of a quadratic B-spline near the
surface of any other shape (core/field/brick_field.h). Lengths are in m, in the frame of the object.
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from .expect import expect
from .limits import UNIT_TOLERANCE
from .mesh import Mesh, Node, NodeDistances, read_mesh
from .messages import FieldBrick, FieldDepthTable, FieldFixture, FieldFixtureKind, FieldMaterial, Vec3
from .shape import Box, Capsule, Plane, Primitive, Sphere, rotated
from .upload import Description

SIDE = 8
BAND = 2.5
"""If the distance of a node to the surface is less than this number of spacings, it must be in a brick."""
MOST_BRICKS = 1023
MOST_CELLS = 65536
MOST_EXTENT = 2.0
MOST_PRIMITIVES = 32
MOST_MATERIALS = 8
MOST_TABLES = 3
MOST_ENTRIES = 16
MOST_FIXTURES = 4

_LEAST_STEP, _MOST_STEP = 1e-4, 0.1  # m
_MOST_RATIO = 8  # of the stiffness to the smallest slope of a curve; must be less than 10 (core/field/material.h)
_KINDS: dict[type, int] = {Plane: 1, Sphere: 2, Capsule: 3, Box: 4}
_BIGGEST = 32767
_SCALED_BAND = 16
_MARGIN = (3, 4)
"""The distances in spacings between the mesh and the ends of the lattice. The lattice must contain the band, and its last
node is one spacing before its end."""


@dataclass(frozen=True)
class Lattice:
    origin: Vec3  # of node 0 of brick 0
    spacing: float  # m
    bricks: Node  # along x, y and z

    def __post_init__(self) -> None:
        expect(all(abs(value) <= 1e12 for value in self.origin), "origin", self.origin, "±1e12 m")
        expect(0.25e-3 <= self.spacing <= 8e-3, "spacing", self.spacing, "0.00025 to 0.008 m")
        extents = [count * SIDE * self.spacing for count in self.bricks]
        expect(0 < min(extents) and max(extents) <= MOST_EXTENT, "extent", extents, "at most 2 m along each axis")
        cells = math.prod(self.bricks)
        expect(cells <= MOST_CELLS, "lattice", cells, f"at most {MOST_CELLS} bricks of 8³ nodes")

    @property
    def scale(self) -> float:
        """m per unit of a weight."""
        return _SCALED_BAND * self.spacing / _BIGGEST

    def at(self, i: int, j: int, k: int) -> Vec3:
        """The position of a node."""
        (x, y, z), h = self.origin, self.spacing
        return (x + h * i, y + h * j, z + h * k)

    def centre(self, place: Node) -> Vec3:
        x, y, z = (origin + self.spacing * (SIDE * n + SIDE / 2 - 0.5) for origin, n in zip(self.origin, place))
        return (x, y, z)


@dataclass(frozen=True)
class Brick:
    place: Node
    weights: bytes  # int16, little-endian; x is the fastest index
    hash: bytes


@dataclass(frozen=True)
class DepthTable:
    """This table is added to the force of the springs of a material. The correction is zero at the surface, and is
    interpolated linearly between the entries. The last entry is also used for all greater depths. The server checks the
    slope of the table."""

    step: float  # m
    force: Sequence[float]  # N; entry i is for the depth (i + 1) · step

    def __post_init__(self) -> None:
        expect(_LEAST_STEP <= self.step <= _MOST_STEP, "step", self.step, f"{_LEAST_STEP:g} to {_MOST_STEP:g} m")
        expect(1 <= len(self.force) <= MOST_ENTRIES, "force", len(self.force), f"1 to {MOST_ENTRIES} entries")
        expect(all(abs(force) <= 1e12 for force in self.force), "force", self.force, "±1e12 N")

    @classmethod
    def of_curve(cls, depths: Sequence[float], forces: Sequence[float]) -> tuple[float, DepthTable]:
        """Returns the stiffness and the table of a material that match a measured curve. The forces (N) and the depths (m)
        must be increasing, and the curve starts at zero. If there are at most 16 points and they are equally spaced, the
        table contains these points. Otherwise, the curve is resampled at 16 depths. For greater depths, only the
        stiffness is used."""
        expect(len(forces) == len(depths) > 0, "forces", len(forces), f"as many as depths, {len(depths)}, and at least 1")
        points = [(0.0, 0.0), *zip(depths, forces)]
        slopes = []
        for n, ((depth, force), (next_depth, next_force)) in enumerate(zip(points, points[1:])):
            expect(depth < next_depth < math.inf, f"depths[{n}]", next_depth, f"above {depth} m")
            expect(force < next_force < math.inf, f"forces[{n}]", next_force, f"above {force} N")
            slopes.append((next_force - force) / (next_depth - depth))
        count, end = len(depths), depths[-1]
        even = all(abs(depth - end * (n + 1) / count) <= 1e-9 * end for n, depth in enumerate(depths))
        count = count if even and count <= MOST_ENTRIES else MOST_ENTRIES
        step = max(end / count, _LEAST_STEP)
        stiffness = min(slopes[-1], _MOST_RATIO * min(slopes))

        def correction(depth: float) -> float:
            at = min(sum(start <= depth for start in depths), len(slopes) - 1)
            return points[at][1] + slopes[at] * (depth - points[at][0]) - stiffness * depth

        return stiffness, cls(step, tuple(correction(step * (n + 1)) for n in range(count)))


@dataclass(frozen=True)
class Material:
    """A spring that is parallel to a Maxwell branch with the stiffness `branch` (core/field/material.h)."""

    name: str = "default"
    stiffness: float = 1000.0  # N/m
    friction: float = 0.0  # coefficient
    branch: float = 0.0  # N/m
    relax_s: float = 0.0  # time constant; only used with a branch
    region: Primitive | None = None  # bricks and primitives whose centres are inside; None: all others
    table: DepthTable | None = None


class Field:
    """The shape and the materials of one object. Use `client.use(field)` to have it rendered."""

    def __init__(
        self, lattice: Lattice | None = None, bricks: Iterable[Brick] = (), primitives: Iterable[Primitive] = ()
    ) -> None:
        self.lattice = lattice
        self.bricks = list(bricks)
        self.primitives = list(primitives)
        expect(len(self.primitives) <= MOST_PRIMITIVES, "primitives", len(self.primitives), f"at most {MOST_PRIMITIVES}")
        if not self.bricks and not self.primitives:
            raise ValueError("the field has no surface: expected a distance that changes its sign")
        if lattice is not None and len(self.bricks) > MOST_BRICKS:
            wider = 1000 * lattice.spacing * math.sqrt(len(self.bricks) / MOST_BRICKS) * 1.05
            raise ValueError(
                f"{len(self.bricks)} bricks at a spacing of {1000 * lattice.spacing:g} mm: expected at most {MOST_BRICKS}; "
                f"try a spacing of {wider:.2g} mm"
            )
        self._materials = [Material()]
        self._fixtures: list[FieldFixture] = []

    # ---- Shapes ----

    @classmethod
    def from_mesh(cls, path: str | Path, spacing_mm: float = 1, unit_m: float = 1e-3) -> Field:
        """Reads a closed surface from an STL or OBJ file. `unit_m` is the unit of the file in m (default: mm). The walls
        of the object should be at least two spacings thick. Raises ValueError if the file is not valid, and for open edges."""
        return cls._of_mesh(read_mesh(path, unit_m), spacing_mm)

    @classmethod
    def from_triangles(
        cls, points: Iterable[Sequence[float]], triangles: Iterable[Sequence[int]], spacing_mm: float = 1, name: str = "mesh"
    ) -> Field:
        """Creates a field from a list of points (m) and a list of triangles with the indices of their corners."""
        return cls._of_mesh(Mesh.of(name, points, triangles), spacing_mm)

    @classmethod
    def from_function(
        cls, distance: Callable[[Vec3], float], low: Sequence[float], high: Sequence[float], spacing_mm: float = 1
    ) -> Field:
        """Samples a signed distance (m, negative inside the solid) between two corners."""
        lattice = _lattice_between(low, high, spacing_mm / 1000)
        a, b, c = lattice.bricks
        near = {
            place
            for place in product(range(a), range(b), range(c))
            if any(abs(distance(lattice.at(*node))) < BAND * lattice.spacing for node in _nodes(place))
        }
        return cls(lattice, _bricks(lattice, near, lambda i, j, k: distance(lattice.at(i, j, k))))

    @classmethod
    def from_array(cls, distances: Any, origin: Sequence[float], spacing: float) -> Field:
        """Creates a field from signed distances in m. `distances[i][j][k]` is the distance at the position
        origin + spacing · (i, j, k). It can be a NumPy array. Outside of the array, the distances are extrapolated
        linearly."""
        rows = distances.tolist() if hasattr(distances, "tolist") else distances
        sizes = (len(rows), len(rows[0]), len(rows[0][0]))
        expect(min(sizes) >= 2, "distances.shape", sizes, "at least 2 along each axis")
        if any(len(plane) != sizes[1] or any(len(row) != sizes[2] for row in plane) for plane in rows):
            raise ValueError("distances: expected rows of the same length")
        if not all(math.isfinite(value) for plane in rows for row in plane for value in row):
            raise ValueError("distances: expected finite numbers")

        def value(i: int, j: int, k: int) -> float:
            node = (i, j, k)
            for axis, count in enumerate(sizes):
                beyond = -node[axis] if node[axis] < 0 else max(node[axis] - (count - 1), 0)
                if beyond:
                    last, before = [*node], [*node]
                    last[axis], before[axis] = (0, 1) if node[axis] < 0 else (count - 1, count - 2)
                    end = value(*last)
                    return end + beyond * (end - value(*before))
            return float(rows[i][j][k])

        x, y, z = (float(at) for at in origin)
        a, b, c = (-(-size // SIDE) for size in sizes)
        lattice = Lattice((x, y, z), spacing, (a, b, c))
        near = {
            place
            for place in product(range(a), range(b), range(c))
            if any(abs(value(*node)) < BAND * spacing for node in _nodes(place))
        }
        return cls(lattice, _bricks(lattice, near, value))

    @classmethod
    def from_primitives(cls, *primitives: Primitive) -> Field:
        """Creates a field from the union of planes, spheres, capsules and boxes. This does not need any bricks. Adjacent
        primitives should overlap by at least 1 mm."""
        return cls(primitives=primitives)

    @classmethod
    def from_mujoco(cls, model: Any, geom: str | int, spacing_mm: float = 1) -> Field:
        """Creates a field from a geom of a `mujoco.MjModel` (plane, sphere, capsule, box or mesh) in the frame of its body.
        The object therefore has the same pose as the body (`data.xpos`, `data.xquat`). The unit of the model must be m."""
        g = model.geom(geom).id if isinstance(geom, str) else geom
        at: Vec3 = _vector(model.geom_pos[g])
        w, x, y, z = (float(value) for value in model.geom_quat[g])
        turn = (w, x, y, z)
        size = _vector(model.geom_size[g])
        kind = int(model.geom_type[g])
        if kind == 0:
            return cls.from_primitives(Plane(at, rotated(turn, (0.0, 0.0, 1.0))))
        if kind == 2:
            return cls.from_primitives(Sphere(at, size[0]))
        if kind == 3:
            along = rotated(turn, (0.0, 0.0, size[1]))
            start, end = _sum(at, along, -1), _sum(at, along, 1)
            return cls.from_primitives(Capsule(start, end, size[0]))
        if kind == 6:
            return cls.from_primitives(Box(at, size, turn=turn))
        if kind == 7:
            mesh = int(model.geom_dataid[g])
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            points = [_sum(at, rotated(turn, _vector(model.mesh_vert[first + i])), 1) for i in range(count)]
            first, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
            faces = [tuple(int(corner) for corner in model.mesh_face[first + i]) for i in range(count)]
            return cls.from_triangles(points, faces, spacing_mm, f"geom {geom}")
        raise ValueError(f"geom {geom} has type {kind}: expected a plane (0), sphere (2), capsule (3), box (6) or mesh (7)")

    # ---- Materials ----

    def material(
        self,
        name: str,
        stiffness: float,
        friction: float = 0,
        relax_s: float | None = None,
        branch: float | None = None,
        region: Primitive | None = None,
        table: DepthTable | None = None,
    ) -> None:
        """Sets a material. If there is no region, the material is used for the whole object. Otherwise, it is used for
        each brick and each primitive with its centre in the region. If several regions contain the centre, the last
        material is used. If there is already a material with this name, it is replaced. Call `use` afterwards.

        `stiffness` is in N/m. With `relax_s`, a second spring of `branch` N/m (default: `stiffness`) is added, whose
        force decays with this time constant in s. `table` is added to this force."""
        expect(0 < stiffness <= 1e12, "stiffness", stiffness, "above 0 N/m, and at most 1e12")
        expect(0 <= friction <= 2, "friction", friction, "0 to 2")
        if relax_s is None:
            expect(branch is None, "branch", branch, "a branch with relax_s")
        else:
            expect(0.01 <= relax_s <= 10, "relax_s", relax_s, "0.01 to 10 s")
            expect(0 < (branch if branch is not None else stiffness) <= 1e12, "branch", branch, "above 0 N/m, and at most 1e12")
        spring = 0.0 if relax_s is None else stiffness if branch is None else branch
        new = Material(name, stiffness, friction, spring, relax_s or 0.0, region, table)
        known = [number for number, old in enumerate(self._materials) if number and old.name == name]
        at = 0 if region is None else known[0] if known else len(self._materials)
        expect(at < MOST_MATERIALS, "materials", at + 1, f"at most {MOST_MATERIALS}")
        changed = [*self._materials[:at], new, *self._materials[at + 1 :]]
        tables = sum(one.table is not None for one in changed)
        expect(tables <= MOST_TABLES, "tables", tables, f"at most {MOST_TABLES}")
        self._materials = changed

    def _material_at(self, centre: Vec3) -> int:
        for number in range(len(self._materials) - 1, 0, -1):
            region = self._materials[number].region
            if region is not None and region.distance(centre) <= 0:
                return number
        return 0

    def fixture(
        self,
        kind: str,
        at: Sequence[float],
        stiffness: float,
        normal: Sequence[float] = (0.0, 0.0, 1.0),
        most_force: float | None = None,
    ) -> None:
        """Adds a spring from the hand to the nearest position on a "point", a "line" along `normal` through `at`, or a
        "plane" with this normal (core/field/fixture.h). `stiffness` is in N/m, and the force is at most `most_force` N."""
        kinds = [known.name.lower() for known in FieldFixtureKind]
        expect(kind in kinds, "kind", kind, " or ".join(kinds))
        expect(len(self._fixtures) < MOST_FIXTURES, "fixtures", len(self._fixtures) + 1, f"at most {MOST_FIXTURES}")
        expect(0 < stiffness <= 1e12, "stiffness", stiffness, "above 0 N/m, and at most 1e12")
        expect(most_force is None or 0 < most_force <= 1e12, "most_force", most_force, "above 0 N, and at most 1e12")
        along = _vector(normal)
        expect(abs(math.hypot(*along) - 1) <= UNIT_TOLERANCE, "normal", along, "a vector of length 1")
        self._fixtures.append(FieldFixture(FieldFixtureKind[kind.upper()], _vector(at), along, stiffness, most_force))

    # ---- Inside ----

    def describe(self) -> Description:
        """Returns what is sent to a server: a copy, which later changes do not affect."""
        manifest = self._manifest()
        return Description(
            hashlib.blake2b(manifest, digest_size=32).digest(),
            manifest,
            tuple(FieldBrick(brick.hash, brick.weights) for brick in self.bricks),
            tuple(FieldMaterial(one.stiffness, one.branch, one.relax_s, one.friction) for one in self._materials),
            tuple(self._fixtures),
            tuple(
                FieldDepthTable(number, one.table.step, tuple(one.table.force))
                for number, one in enumerate(self._materials)
                if one.table is not None
            ),
        )

    def _manifest(self) -> bytes:
        """protocol/field/manifest.h"""
        lattice = self.lattice
        head = (0.0, 0.0, 0.0, 1e-3, 1e-7, 1, 1, 1)  # without bricks, these numbers are ignored
        if lattice is not None:
            head = (*lattice.origin, lattice.spacing, lattice.scale, *lattice.bricks)
        out = bytearray(struct.pack("<5d5H", *head, len(self.bricks), len(self.primitives)))
        for brick in self.bricks:
            assert lattice is not None
            out += struct.pack("<3HB", *brick.place, self._material_at(lattice.centre(brick.place))) + brick.hash
        for shape in self.primitives:
            numbers = shape.numbers()
            material = self._material_at(shape.centre)
            out += struct.pack("<3B11d", _KINDS[type(shape)], shape.hollow, material, *numbers, *[0.0] * (11 - len(numbers)))
        return bytes(out)

    @classmethod
    def _of_mesh(cls, mesh: Mesh, spacing_mm: float) -> Field:
        h = spacing_mm / 1000
        expect(h > 0, "spacing_mm", spacing_mm, "0.25 to 8")
        low, high = mesh.bounds()
        # The origin is a multiple of the size of a brick, so that a change of the mesh only changes the bricks near it.
        grid = SIDE * h
        x, y, z = (grid * math.floor((at - _MARGIN[0] * h) / grid) for at in low)
        lattice = _lattice_between((x, y, z), [at + _MARGIN[1] * h for at in high], h)
        a, b, c = (SIDE * count for count in lattice.bricks)
        distances = NodeDistances(mesh, lattice.origin, h, (a, b, c), BAND)
        near = {
            (i // SIDE, j // SIDE, k // SIDE) for i, j, k in distances.near() if 0 <= i < a and 0 <= j < b and 0 <= k < c
        }
        values = distances.fill({node for place in near for node in _nodes(place, apron=1)})
        return cls(lattice, _bricks(lattice, near, lambda i, j, k: h * values[i, j, k]))


def _vector(values: Iterable[Any]) -> Vec3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _sum(a: Vec3, b: Vec3, sign: int) -> Vec3:
    return (a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2])


def _lattice_between(low: Sequence[float], high: Sequence[float], spacing: float) -> Lattice:
    expect(spacing > 0, "spacing", spacing, "0.00025 to 0.008 m")
    x, y, z = (float(value) for value in low)
    a, b, c = (math.ceil((end - start) / (SIDE * spacing)) for start, end in zip(low, high))
    return Lattice((x, y, z), spacing, (a, b, c))


def _nodes(place: Node, apron: int = 0) -> Iterable[Node]:
    x, y, z = (SIDE * n for n in place)
    width = range(-apron, SIDE + apron)
    return ((x + i, y + j, z + k) for k in width for j in width for i in width)


def _bricks(lattice: Lattice, places: Iterable[Node], value: Callable[[int, int, int], float]) -> list[Brick]:
    bricks = []
    for place in sorted(places, key=lambda place: place[::-1]):
        weights = _weights([value(*node) for node in _nodes(place, apron=1)], lattice.scale)
        bricks.append(Brick(place, weights, hashlib.blake2b(weights, digest_size=16).digest()))
    return bricks


def _weights(values: list[float], scale: float) -> bytes:
    """Filters the values of the 10³ nodes of a brick with its apron along x, y and z, in this order."""
    wide = SIDE + 2
    for step in (1, wide, wide * wide):
        middle = values[step:-step]
        filtered = [-0.125 * a + 1.25 * b + -0.125 * c for a, b, c in zip(values, middle, values[2 * step :])]
        values = [0.0] * step + filtered + [0.0] * step
    inside = (
        values[(k * wide + j) * wide + i] / scale
        for k in range(1, wide - 1)
        for j in range(1, wide - 1)
        for i in range(1, wide - 1)
    )
    return struct.pack("<512h", *(_rounded(min(max(value, -_BIGGEST), _BIGGEST)) for value in inside))


def _rounded(value: float) -> int:
    """Halves are rounded away from zero."""
    whole = int(value)
    rest = value - whole
    return whole + (1 if rest >= 0.5 else -1 if rest <= -0.5 else 0)

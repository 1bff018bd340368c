# SPDX-License-Identifier: Apache-2.0
"""Closed triangle meshes, and their signed distance at the nodes of a lattice."""

from __future__ import annotations

import math
import re
import struct
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from .messages import Vec3

Triangle = tuple[int, int, int]

_STL_HEAD = 84
_STL_TRIANGLE = 50


@dataclass(frozen=True)
class Mesh:
    """The normal of a triangle (a, b, c) is (b − a) × (c − a). Normals must point out of the solid, or all into it."""

    name: str
    vertices: list[Vec3]  # m
    triangles: list[Triangle]

    @classmethod
    def of(cls, name: str, points: Iterable[Sequence[float]], triangles: Iterable[Sequence[int]]) -> Mesh:
        """Creates a mesh. Equal points are merged, and duplicate or degenerate triangles are removed. Raises ValueError if
        the mesh is not closed."""
        numbers: dict[Vec3, int] = {}
        merged = [numbers.setdefault((float(x), float(y), float(z)), len(numbers)) for x, y, z in points]
        if not all(math.isfinite(value) for point in numbers for value in point):
            raise ValueError(f"{name}: expected coordinates that are finite")
        kept: dict[Triangle, None] = {}
        for number, corners in enumerate(triangles):
            if not all(0 <= corner < len(merged) for corner in corners):
                raise ValueError(f"{name}: triangle {number + 1} = {tuple(corners)}: expected vertices 0 … {len(merged) - 1}")
            a, b, c = (merged[corner] for corner in corners)
            if a != b and b != c and c != a:
                kept[min((a, b, c), (b, c, a), (c, a, b))] = None
        mesh = cls(name, list(numbers), list(kept))
        mesh._expect_closed()
        return mesh

    def _expect_closed(self) -> None:
        if not self.triangles:
            raise ValueError(f"{self.name}: expected at least one triangle")
        edges = Counter(edge for a, b, c in self.triangles for edge in ((a, b), (b, c), (c, a)))
        lone = [edge for edge, count in edges.items() if count != edges[edge[1], edge[0]]]
        if not lone:
            return
        is_open = [edge for edge in lone if (edges[edge] + edges[edge[1], edge[0]]) % 2]
        places = ", ".join(self._place(edge) for edge in (is_open or lone)[:3])
        if is_open:
            raise ValueError(f"{self.name}: {len(is_open)} open edges, for example {places}; expected a closed surface")
        raise ValueError(
            f"{self.name}: {len(lone)} edges whose triangles have opposite normals, for example {places}; "
            "expected normals that all point out of the solid"
        )

    def _place(self, edge: tuple[int, int]) -> str:
        ends = ("(" + ", ".join(f"{1000 * value:.6g}" for value in self.vertices[end]) + ")" for end in edge)
        return "from " + " to ".join(ends) + " mm"

    def bounds(self) -> tuple[Vec3, Vec3]:
        used = [self.vertices[corner] for triangle in self.triangles for corner in triangle]
        xs, ys, zs = zip(*used)
        return (min(xs), min(ys), min(zs)), (max(xs), max(ys), max(zs))


def read_mesh(path: str | Path, unit_m: float) -> Mesh:
    """Reads an STL file (binary or ASCII) or an OBJ file. `unit_m` is the unit of the file in m."""
    path = Path(path)
    kind = path.suffix.lower()
    if kind == ".obj":
        points, triangles = _read_obj(path)
    elif kind == ".stl":
        points, triangles = _read_stl(path)
    else:
        raise ValueError(f'{path}: expected a file that ends with .stl or .obj, got "{path.suffix}"')
    return Mesh.of(path.name, ((x * unit_m, y * unit_m, z * unit_m) for x, y, z in points), triangles)


def _read_stl(path: Path) -> tuple[list[Vec3], list[Triangle]]:
    data = path.read_bytes()
    count = int.from_bytes(data[80:_STL_HEAD], "little") if len(data) >= _STL_HEAD else -1
    points: list[Vec3]
    if len(data) == _STL_HEAD + _STL_TRIANGLE * count:  # a binary file may start with "solid", too
        corners = struct.iter_unpack("<12x9f2x", data[_STL_HEAD:])
        points = [corner for c in corners for corner in ((c[0], c[1], c[2]), (c[3], c[4], c[5]), (c[6], c[7], c[8]))]
    elif data.lstrip()[:5].lower() == b"solid":
        points = []
        for number, line in enumerate(data.decode(errors="replace").splitlines(), 1):
            words = line.split()
            if words and words[0].lower() == "vertex":
                points.append(_point(path, number, words[1:]))
        if len(points) % 3:
            raise ValueError(f"{path}: {len(points)} vertices; expected three for each facet")
    else:
        raise ValueError(
            f"{path}: {len(data)} bytes; expected {_STL_HEAD + _STL_TRIANGLE * max(count, 0)} for a binary STL file of "
            f'{max(count, 0)} triangles, or a file that starts with "solid"'
        )
    return points, [(i, i + 1, i + 2) for i in range(0, len(points), 3)]


def _point(path: Path, line: int, words: Sequence[str]) -> Vec3:
    try:
        x, y, z = map(float, words[:3])
    except ValueError:
        raise ValueError(f"{path}:{line}: expected three numbers, got \"{' '.join(words)}\"") from None
    return (x, y, z)


def _read_obj(path: Path) -> tuple[list[Vec3], list[Triangle]]:
    points: list[Vec3] = []
    triangles: list[Triangle] = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        words = line.split()
        if words[:1] == ["v"]:
            points.append(_point(path, number, words[1:]))
        elif words[:1] == ["f"]:
            corners = []
            for word in words[1:]:
                index = re.match(r"-?\d+", word)
                at = int(index[0]) if index else 0
                if not 0 < abs(at) <= len(points):
                    raise ValueError(f'{path}:{number}: "{word}": expected a vertex 1 … {len(points)}')
                corners.append(at - 1 if at > 0 else at + len(points))
            triangles += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:])]
    return points, triangles


class _Facet:
    """A triangle with the axes u and v in its plane. In these axes, the corners are (0, 0), (l, 0) and (cx, cy). The edge
    from (0, 0) to (l, 0) is the longest one, so 0 ≤ cx ≤ l."""

    __slots__ = ("at", "u", "v", "w", "l", "cx", "cy")

    def __init__(self, corners: Sequence[Vec3]) -> None:
        a, b, c = max(
            ((corners[i], corners[i - 2], corners[i - 1]) for i in range(3)), key=lambda abc: _length(_way(abc[0], abc[1]))
        )
        ab, ac = _way(a, b), _way(a, c)
        self.at, self.l = a, _length(ab)
        self.u = u = (ab[0] / self.l, ab[1] / self.l, ab[2] / self.l)
        self.cx = u[0] * ac[0] + u[1] * ac[1] + u[2] * ac[2]
        v = (ac[0] - self.cx * u[0], ac[1] - self.cx * u[1], ac[2] - self.cx * u[2])
        self.cy = _length(v)
        # If the corners are collinear, any plane that contains the edge can be used.
        self.v = v = (v[0] / self.cy, v[1] / self.cy, v[2] / self.cy) if self.cy > 1e-9 * self.l else _across(u)
        self.w = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])

    def squared(self, x: float, y: float, z: float) -> float:
        """Returns the square of the distance."""
        x, y, z = x - self.at[0], y - self.at[1], z - self.at[2]
        w = self.w[0] * x + self.w[1] * y + self.w[2] * z
        return w * w + self.beside(
            self.u[0] * x + self.u[1] * y + self.u[2] * z, self.v[0] * x + self.v[1] * y + self.v[2] * z
        )

    def beside(self, u: float, v: float) -> float:
        """Returns the square of the distance in the plane."""
        l, cx, cy = self.l, self.cx, self.cy
        if v <= 0:  # the angles at the ends of the longest edge are acute
            u -= 0 if u <= 0 else l if u >= l else u
            return u * u + v * v
        nearest = -1.0
        if cx * v > cy * u:
            nearest = _to_segment(u, v, cx, cy)
        if (l - cx) * v > cy * (l - u):
            other = _to_segment(l - u, v, l - cx, cy)
            nearest = other if nearest < 0 else min(nearest, other)
        return max(nearest, 0.0)


def _way(a: Vec3, b: Vec3) -> Vec3:
    return (b[0] - a[0], b[1] - a[1], b[2] - a[2])


def _length(v: Vec3) -> float:
    return math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


def _across(u: Vec3) -> Vec3:
    """Returns a unit vector that is perpendicular to `u`."""
    axis = min(range(3), key=lambda i: abs(u[i]))
    part = u[axis]
    x, y, z = (float(i == axis) - part * u[i] for i in range(3))
    length = _length((x, y, z))
    return (x / length, y / length, z / length)


def _to_segment(u: float, v: float, x: float, y: float) -> float:
    """Returns the square of the distance from (u, v) to the segment from (0, 0) to (x, y)."""
    share = (u * x + v * y) / (x * x + y * y)
    share = 0.0 if share <= 0 else 1.0 if share >= 1 else share
    u, v = u - share * x, v - share * y
    return u * u + v * v


Node = tuple[int, int, int]

_OFF_LINE_Y, _OFF_LINE_Z = 1.37e-7, 2.71e-7
"""The offset of the lines from the nodes, in spacings. Otherwise, a line could contain an edge or a vertex of a mesh that
is aligned with the nodes."""


class NodeDistances:
    """Computes the signed distance of a mesh at the nodes of a lattice. All lengths are in spacings, and the position of
    node (i, j, k) is (i, j, k).

    The distance is exact if it is less than `band`. Otherwise, only the nearest triangles of the neighbours are tested.
    The distance is negative if the winding number is not zero. The winding number is the sum of the crossings along a
    line in the direction of x. This also works for several solids that overlap, and for cavities. The faces inside of an
    overlap are not removed."""

    def __init__(self, mesh: Mesh, origin: Vec3, spacing: float, counts: Node, band: float) -> None:
        """The indices of the nodes along an axis are −1 … count."""
        scaled = [tuple((value - at) / spacing for value, at in zip(vertex, origin)) for vertex in mesh.vertices]
        self._vertices: list[Vec3] = [(x, y, z) for x, y, z in scaled]
        self._triangles = mesh.triangles
        self._counts = counts
        self._facets = [_Facet([self._vertices[corner] for corner in triangle]) for triangle in mesh.triangles]
        wide, high = counts[0] + 4, counts[1] + 4  # also with a node beyond −1 and count
        self._steps = (1, wide, wide * high)
        self._beside = [i + wide * (j + high * k) for i, j, k in product((-1, 0, 1), repeat=3) if (i, j, k) != (0, 0, 0)]
        self._squared: dict[int, float] = {}  # by the number of a node
        self._nearest: dict[int, int] = {}
        for number, facet in enumerate(self._facets):
            self._spread(number, facet, band)

    def near(self) -> list[Node]:
        """Returns the nodes within the band."""
        _, wide, plane = self._steps
        return [(at % wide - 2, at % plane // wide - 2, at // plane - 2) for at in self._squared]

    def fill(self, nodes: Iterable[Node]) -> dict[Node, float]:
        """Returns the signed distances of the nodes. They must be connected to the band."""
        nodes = list(nodes)
        squared, nearest, facets = self._squared, self._nearest, self._facets
        beyond = {at: node for node in nodes if (at := self._number(node)) not in squared}
        todo = list(beyond)
        while todo:
            later, found = [], []
            for at in todo:
                candidates = {nearest.get(at + step, -1) for step in self._beside} - {-1}
                if candidates:
                    found.append((at, *min((facets[number].squared(*beyond[at]), number) for number in candidates)))
                else:
                    later.append(at)
            if not found:
                raise ValueError("expected nodes that are connected to the surface")
            for at, distance, number in found:
                squared[at], nearest[at] = distance, number
            todo = later
        self._refine(beyond)
        crossings = self._crossings({(j, k) for _, j, k in nodes})
        signed = {}
        for node in nodes:
            winding = sum(sign for x, sign in crossings.get(node[1:], ()) if x < node[0])
            distance = math.sqrt(squared[self._number(node)])
            signed[node] = -distance if winding else distance
        return signed

    def _number(self, node: Node) -> int:
        _, wide, plane = self._steps
        return node[0] + 2 + wide * (node[1] + 2) + plane * (node[2] + 2)

    def _refine(self, beyond: dict[int, Node]) -> None:
        """Updates the nearest triangle of each node from its neighbours until there is no change."""
        squared, nearest = self._squared, self._nearest
        faces = [sign * step for step in self._steps for sign in (-1, 1)]
        nodes = list(beyond)
        while nodes:
            changed: dict[int, None] = {}
            for at in nodes:
                for number in {nearest.get(at + step, -1) for step in faces} - {-1, nearest[at]}:
                    distance = self._facets[number].squared(*beyond[at])
                    if distance < squared[at]:
                        squared[at], nearest[at] = distance, number
                        changed.update((at + step, None) for step in faces)
            nodes = [at for at in changed if at in beyond]

    def _spread(self, number: int, facet: _Facet, band: float) -> None:
        """Updates the nodes within the band of one triangle."""
        squared, nearest, most = self._squared, self._nearest, band * band
        corners = [self._vertices[corner] for corner in self._triangles[number]]
        first, last = zip(
            *(
                (max(math.ceil(min(axis) - band), -1), min(math.floor(max(axis) + band), count))
                for axis, count in zip(zip(*corners), self._counts)
            )
        )
        (ax, ay, az), (ux, uy, uz), (vx, vy, vz), (wx, wy, wz) = facet.at, facet.u, facet.v, facet.w
        beside = facet.beside
        for k in range(first[2], last[2] + 1):
            z = k - az
            for j in range(first[1], last[1] + 1):
                y = j - ay
                u, v, w = uy * y + uz * z, vy * y + vz * z, wy * y + wz * z
                start, end = first[0], last[0]
                if abs(wx) > 1e-9:  # the row crosses the slab around the plane
                    ends = sorted(((-band - w) / wx + ax, (band - w) / wx + ax))
                    start, end = max(start, math.ceil(ends[0])), min(end, math.floor(ends[1]))
                elif abs(w) > band:
                    continue
                row = self._number((0, j, k))
                for i in range(start, end + 1):
                    x = i - ax
                    out = wx * x + w
                    distance = out * out + beside(ux * x + u, vx * x + v)
                    if distance < most and distance < squared.get(row + i, most):
                        squared[row + i], nearest[row + i] = distance, number

    def _crossings(self, rows: set[tuple[int, int]]) -> dict[tuple[int, int], list[tuple[float, int]]]:
        """Returns the positions where the surface crosses each row (j, k), with 1 if the line enters the solid and −1 if it
        leaves the solid."""
        found: dict[tuple[int, int], list[tuple[float, int]]] = {}
        points = self._vertices
        for corners, facet in zip(self._triangles, self._facets):
            (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (points[corner] for corner in corners)
            low_y, high_y = math.ceil(min(ay, by, cy) - _OFF_LINE_Y), math.floor(max(ay, by, cy) - _OFF_LINE_Y)
            low_z, high_z = math.ceil(min(az, bz, cz) - _OFF_LINE_Z), math.floor(max(az, bz, cz) - _OFF_LINE_Z)
            if low_y > high_y or low_z > high_z:
                continue
            edges = [(corners[i - 1], corners[i]) for i in range(3)]
            out = ((by - ay) * (cz - az) - (bz - az) * (cy - ay), (bz - az) * (cx - ax) - (bx - ax) * (cz - az),
                   (bx - ax) * (cy - ay) - (by - ay) * (cx - ax))  # fmt: skip
            for j, k in product(range(low_y, high_y + 1), range(low_z, high_z + 1)):
                if (j, k) not in rows:
                    continue
                y, z = j + _OFF_LINE_Y, k + _OFF_LINE_Z
                sides = [self._is_left(p, q, y, z) for p, q in edges]
                if sides[0] != sides[1] or sides[1] != sides[2] or out[0] == 0:
                    continue
                x = ax - (out[1] * (y - ay) + out[2] * (z - az)) / out[0]
                x = min(max(x, min(ax, bx, cx)), max(ax, bx, cx))
                found.setdefault((j, k), []).append((x, -1 if out[0] > 0 else 1))
        return found

    def _is_left(self, p: int, q: int, y: float, z: float) -> bool:
        """Returns True if the line is on the left side of an edge. The result is the same for both triangles of the edge."""
        if p > q:
            return not self._is_left(q, p, y, z)
        _, py, pz = self._vertices[p]
        _, qy, qz = self._vertices[q]
        return (qy - py) * (z - pz) > (qz - pz) * (y - py)

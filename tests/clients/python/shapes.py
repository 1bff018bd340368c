# SPDX-License-Identifier: Apache-2.0
"""Meshes, their files, and the distance that a receiver computes from a field."""

from __future__ import annotations

import math
import struct
from itertools import product

CORNERS = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
CUBE = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]  # fmt: skip


def cube(half=0.01, centre=(0.0, 0.0, 0.0)):
    return [tuple(c + half * x for c, x in zip(centre, corner)) for corner in CORNERS], list(CUBE)


def ball(radius, centre=(0.0, 0.0, 0.0), rings=12, inward=False):
    """Returns the mesh of a sphere."""
    points = [(0, 0, -1)]
    for ring in range(1, rings):
        up = math.pi * ring / rings - math.pi / 2
        for step in range(2 * rings):
            turn = math.pi * step / rings
            points.append((math.cos(up) * math.cos(turn), math.cos(up) * math.sin(turn), math.sin(up)))
    points.append((0, 0, 1))
    wide, top = 2 * rings, len(points) - 1
    faces = []
    for step in range(wide):
        after = (step + 1) % wide
        faces.append((0, 1 + after, 1 + step))
        faces.append((top, top - wide + step, top - wide + after))
        for ring in range(rings - 2):
            a, b = 1 + ring * wide + step, 1 + ring * wide + after
            faces += [(a, b, b + wide), (a, b + wide, a + wide)]
    if inward:
        faces = [(a, c, b) for a, b, c in faces]
    return [tuple(at + radius * x for at, x in zip(centre, point)) for point in points], faces


def joined(*meshes):
    points, faces = [], []
    for more, triangles in meshes:
        faces += [tuple(corner + len(points) for corner in face) for face in triangles]
        points += more
    return points, faces


def binary_stl(points, faces, unit=1000.0):
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *(unit * x for corner in face for x in points[corner]), 0) for face in faces
    )
    return b"solid of a program that writes binary files".ljust(80) + struct.pack("<I", len(faces)) + body


def ascii_stl(points, faces, unit=1000.0):
    out = ["solid part"]
    for face in faces:
        out += ["facet normal 0 0 0", " outer loop"]
        out += ["  vertex " + " ".join(f"{unit * x:.9g}" for x in points[corner]) for corner in face]
        out += [" endloop", "endfacet"]
    return "\n".join([*out, "endsolid part"]).encode()


def obj(points, faces, unit=1000.0):
    out = ["# a part", *("v " + " ".join(f"{unit * x:.9g}" for x in point) for point in points)]
    out += ["f " + " ".join(f"{corner + 1}//1" for corner in face) for face in faces]
    return "\n".join(out).encode()


class Received:
    """Evaluates a field as in core/field/brick_field.h, but without aprons."""

    def __init__(self, field):
        self.lattice = field.lattice
        self.weights = {}
        for brick in field.bricks:
            values = struct.unpack("<512h", brick.weights)
            for n, (k, j, i) in enumerate(product(range(8), repeat=3)):
                self.weights[tuple(8 * at + d for at, d in zip(brick.place, (i, j, k)))] = values[n]

    def at(self, x):
        """Returns the distance in m, or None if a weight is missing."""
        places = [(a - o) / self.lattice.spacing for a, o in zip(x, self.lattice.origin)]
        middle = [math.floor(s + 0.5) for s in places]
        taps = []
        for s, n in zip(places, middle):
            t = s - n
            taps.append((0.5 * (0.5 - t) ** 2, 0.75 - t * t, 0.5 * (0.5 + t) ** 2))
        total = 0.0
        for a, b, c in product(range(3), repeat=3):
            weight = self.weights.get((middle[0] + a - 1, middle[1] + b - 1, middle[2] + c - 1))
            if weight is None:
                return None
            total += taps[0][a] * taps[1][b] * taps[2][c] * weight
        return total * self.lattice.scale

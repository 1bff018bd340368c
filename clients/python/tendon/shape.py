# SPDX-License-Identifier: Apache-2.0
"""Primitives: shapes with an exact signed distance, which is negative inside the solid (core/field/primitives.h). All
lengths are in m, in the frame of the object."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Union

from .expect import expect
from .limits import UNIT_TOLERANCE
from .messages import ZERO, Quat, Vec3


def _dot(a: Vec3, b: Vec3) -> float:
    # Eigen adds in this order, so that both languages compute the same bits.
    return a[0] * b[0] + (a[1] * b[1] + a[2] * b[2])


def _norm(v: Vec3) -> float:
    return math.sqrt(_dot(v, v))


def _minus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def rotated(turn: Quat, v: Vec3) -> Vec3:
    """Returns R v. A quaternion is (w, x, y, z)."""
    w, axis = turn[0], (turn[1], turn[2], turn[3])
    c = _cross(axis, v)
    across = (2 * c[0], 2 * c[1], 2 * c[2])
    d = _cross(axis, across)
    return (v[0] + w * across[0] + d[0], v[1] + w * across[1] + d[1], v[2] + w * across[2] + d[2])


def _vector(owner: object, name: str) -> None:
    """Makes a field of a frozen dataclass a tuple of three finite floats."""
    try:
        x, y, z = (float(value) for value in getattr(owner, name))
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {getattr(owner, name)}: expected three numbers") from None
    expect(all(map(math.isfinite, (x, y, z))), name, (x, y, z), "finite numbers")
    object.__setattr__(owner, name, (x, y, z))


def _length(owner: object, name: str) -> None:
    value = float(getattr(owner, name))
    expect(0 < value < math.inf, name, value, "a length above 0 m")
    object.__setattr__(owner, name, value)


@dataclass(frozen=True)
class Plane:
    """A half-space. `normal` is a unit vector that points out of the solid."""

    at: Vec3 = ZERO
    normal: Vec3 = (0.0, 0.0, 1.0)
    hollow: bool = False  # the solid is everything outside of the shape

    def __post_init__(self) -> None:
        _vector(self, "at")
        _vector(self, "normal")
        expect(abs(_norm(self.normal) - 1) <= UNIT_TOLERANCE, "normal", self.normal, "a vector of length 1")

    @property
    def centre(self) -> Vec3:
        return self.at

    def numbers(self) -> tuple[float, ...]:
        """As in a manifest."""
        return (*self.at, *self.normal)

    def distance(self, x: Vec3) -> float:
        """Returns the signed distance in m."""
        inside = _dot(self.normal, _minus(x, self.at))
        return -inside if self.hollow else inside


@dataclass(frozen=True)
class Sphere:
    centre: Vec3 = ZERO
    radius: float = 0.01
    hollow: bool = False

    def __post_init__(self) -> None:
        _vector(self, "centre")
        _length(self, "radius")

    def numbers(self) -> tuple[float, ...]:
        return (*self.centre, self.radius)

    def distance(self, x: Vec3) -> float:
        inside = _norm(_minus(x, self.centre)) - self.radius
        return -inside if self.hollow else inside


@dataclass(frozen=True)
class Capsule:
    """All positions within `radius` of the line from `start` to `end`."""

    start: Vec3
    end: Vec3
    radius: float
    hollow: bool = False

    def __post_init__(self) -> None:
        _vector(self, "start")
        _vector(self, "end")
        _length(self, "radius")

    @property
    def centre(self) -> Vec3:
        (ax, ay, az), (bx, by, bz) = self.start, self.end
        return ((ax + bx) / 2, (ay + by) / 2, (az + bz) / 2)

    def numbers(self) -> tuple[float, ...]:
        return (*self.start, *self.end, self.radius)

    def distance(self, x: Vec3) -> float:
        axis, way = _minus(self.end, self.start), _minus(x, self.start)
        squared = _dot(axis, axis)
        share = min(max(_dot(way, axis) / squared, 0.0), 1.0) if squared > 0 else 0.0
        inside = _norm((way[0] - share * axis[0], way[1] - share * axis[1], way[2] - share * axis[2])) - self.radius
        return -inside if self.hollow else inside


@dataclass(frozen=True)
class Box:
    """A box with sides of 2 `half`, whose edges are rounded with `rounding`, turned by `turn` about its centre."""

    centre: Vec3
    half: Vec3
    rounding: float = 0.0
    turn: Quat = (1.0, 0.0, 0.0, 0.0)
    hollow: bool = False

    def __post_init__(self) -> None:
        _vector(self, "centre")
        _vector(self, "half")
        expect(min(self.half) > 0, "half", self.half, "lengths above 0 m")
        expect(0 <= self.rounding <= min(self.half), "rounding", self.rounding, f"0 to {min(self.half)} m")
        w, x, y, z = (float(value) for value in self.turn)
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        expect(abs(norm - 1) <= UNIT_TOLERANCE, "turn", self.turn, "a quaternion (w, x, y, z) of length 1")
        object.__setattr__(self, "turn", (w, x, y, z))

    def numbers(self) -> tuple[float, ...]:
        return (*self.centre, *self.half, self.rounding, *self.turn)

    def distance(self, x: Vec3) -> float:
        w, i, j, k = self.turn
        local, half, r = rotated((w, -i, -j, -k), _minus(x, self.centre)), self.half, self.rounding
        q = (abs(local[0]) - half[0] + r, abs(local[1]) - half[1] + r, abs(local[2]) - half[2] + r)
        outside = (max(q[0], 0.0), max(q[1], 0.0), max(q[2], 0.0))
        inside = (_norm(outside) if max(outside) > 0 else max(q)) - r
        return -inside if self.hollow else inside


Primitive = Union[Plane, Sphere, Capsule, Box]

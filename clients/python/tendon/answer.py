# SPDX-License-Identifier: Apache-2.0
"""Conversion and validation of the result of a haptic function."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

from . import codec, limits
from .messages import (
    ZERO,
    Contact,
    ForceTable,
    LocalModel,
    Mat3,
    RotationModel,
    Stiffness,
    Torque,
    Touch,
    Turning,
    Vec3,
)


@dataclass(frozen=True, kw_only=True)
class Answer:
    """A Touch with valid shapes. Its numbers may still be invalid; see objection()."""

    force: Vec3
    stiffness: Mat3 | None
    valid_radius: float
    contact: Contact | None
    topology_changed: bool
    error: float | None
    torque: Vec3 | None = None
    angular_stiffness: Mat3 | None = None
    grip_force: float | None = None
    way: int = 0

    def objection(self) -> str:
        """Returns why this answer is unusable, or an empty string."""
        if not _usable(self.force):
            if not all(map(math.isfinite, self.force)):
                return "the force is not finite (NaN or infinity)"
            return "the force exceeds 1e12 N"
        if self.torque is not None and not all(map(math.isfinite, self.torque)):
            return "the torque is not finite (NaN or infinity)"
        if self.torque is not None and not _usable(self.torque):
            return "the torque exceeds 1e12 N·m"
        if self.angular_stiffness is not None and not all(map(_usable, self.angular_stiffness)):
            return "its angular stiffness is not finite, or out of the bounds in WIRE.md"
        if self.grip_force is not None and not abs(self.grip_force) <= limits.MAX_VALUE:
            return "the grip force is not finite, or exceeds 1e12 N"
        if (
            (self.stiffness is not None and not all(map(_usable, self.stiffness)))
            or (self.contact is not None and not codec.is_contact(self.contact))
            or not codec.is_radius(self.valid_radius)
            or (self.error is not None and not 0 <= self.error <= limits.MAX_VALUE)
        ):
            return "its stiffness, radius, contact or error is not finite, or out of the bounds in WIRE.md"
        return ""

    def local_model(self, at: Vec3) -> LocalModel | None:
        """Returns the local model around `at`, or None if the engine provided neither stiffness nor contact."""
        if self.stiffness is None and self.contact is None:
            return None
        return LocalModel(at, self.stiffness or (ZERO, ZERO, ZERO), self.valid_radius, self.contact)

    @property
    def asks_for_handle(self) -> bool:
        """Whether the answer contains a torque or a grip force."""
        return (self.torque, self.angular_stiffness, self.grip_force) != (None, None, None)

    def turning(self, hand: Turning | None) -> Torque | None:
        """Returns the torque, with a model around the orientation of the hand if the device measures it."""
        if self.torque is None and self.angular_stiffness is None:
            return None
        model = RotationModel(hand.orientation, self.angular_stiffness) if hand and self.angular_stiffness else None
        return Torque(self.torque or ZERO, model)


def read_touch(touch: Touch) -> Answer:
    """Raises ValueError if a force, stiffness or normal has a wrong shape."""
    return Answer(
        force=_vector(touch.force),
        stiffness=None if touch.stiffness is None else _matrix(touch.stiffness),
        valid_radius=touch.valid_radius,
        contact=None if touch.contact is None else _contact(touch.contact),
        topology_changed=touch.topology_changed,
        error=touch.error,
        torque=None if touch.torque is None else _vector(touch.torque, "a torque of three numbers"),
        angular_stiffness=None if touch.angular_stiffness is None else _matrix(touch.angular_stiffness),
        grip_force=None if touch.grip_force is None else float(touch.grip_force),
        way=touch.way,
    )


def _usable(vector: Vec3) -> bool:
    x, y, z = vector
    most = limits.MAX_VALUE
    return -most <= x <= most and -most <= y <= most and -most <= z <= most  # False for NaN


def _vector(numbers: Sequence[float], expected: str = "a force of three numbers") -> Vec3:
    try:
        x, y, z = map(float, numbers)
    except (TypeError, ValueError):
        raise ValueError(f"expected {expected}, got {numbers!r}") from None
    return (x, y, z)


def _matrix(stiffness: Stiffness) -> Mat3:
    """Converts any form of Touch.stiffness to a 3 × 3 matrix."""
    expected = "a stiffness of one number, three, or 3 × 3"
    if not hasattr(stiffness, "__len__"):
        k = float(stiffness)
        return ((k, 0.0, 0.0), (0.0, k, 0.0), (0.0, 0.0, k))
    rows = cast("Sequence[Sequence[float]]", stiffness)
    if len(rows) == 3 and all(hasattr(row, "__len__") for row in rows):
        a, b, c = (_vector(row, expected) for row in rows)
        return (a, b, c)
    x, y, z = _vector(cast("Sequence[float]", stiffness), expected)
    return ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))


def _contact(contact: Contact) -> Contact:
    """Converts the numbers to Python types."""
    table = contact.table
    if table is not None:
        table = ForceTable(float(table.first), float(table.step), tuple(map(float, table.force)))
    return Contact(_vector(contact.normal, "a normal of three numbers"), float(contact.gap), table)

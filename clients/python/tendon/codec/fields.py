# SPDX-License-Identifier: Apache-2.0
"""Conversion of single fields of protobuf messages, for `generated`. Each function checks the bounds of the field and
raises OutOfBounds with the name of the field if they are violated."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from math import hypot
from typing import TypeVar

from google.protobuf.message import DecodeError

from .. import limits
from .. import tendon_pb2 as pb
from ..generated import Mat3, Quat, Vec3


class OutOfBounds(Exception):
    """This is raised if a value is out of bounds."""

    def __init__(self, field: str) -> None:
        super().__init__(field)
        self.field = field


_Value = TypeVar("_Value")
_Inner = TypeVar("_Inner")


def read_inner(name: str, read: Callable[[_Inner], _Value], message: _Inner) -> _Value:
    """Reads a nested message. Exceptions are prefixed with the name of the field."""
    try:
        return read(message)
    except OutOfBounds as error:
        raise OutOfBounds(f"{name}.{error.field}") from None


def read_each(
    name: str, messages: Sequence[_Inner], fewest: int, most: int, read: Callable[[_Inner], _Value]
) -> tuple[_Value, ...]:
    if not fewest <= len(messages) <= most:
        raise OutOfBounds(name)
    return tuple(read_inner(name, read, message) for message in messages)


def read_vector(name: str, message: pb.Vec3) -> Vec3:
    x, y, z = message.x, message.y, message.z
    if not (-1e12 <= x <= 1e12 and -1e12 <= y <= 1e12 and -1e12 <= z <= 1e12):  # false for NaN
        raise OutOfBounds(name)
    return (x, y, z)


def write_vector(message: pb.Vec3, vector: Sequence[float]) -> None:
    message.x, message.y, message.z = vector
    message.SetInParent()  # marks the message as present even if all values are zero


def read_normal(name: str, message: pb.Vec3) -> Vec3:
    """Reads a unit vector."""
    normal = read_vector(name, message)
    if not abs(hypot(*normal) - 1) <= limits.UNIT_TOLERANCE:
        raise OutOfBounds(name)
    return normal


def read_box(name: str, low: Vec3 | None, high: Vec3 | None) -> tuple[Vec3, Vec3] | None:
    """Returns both corners, or None if neither is present. Requires `low` ≤ `high` in each coordinate."""
    if low is None and high is None:
        return None
    if low is None or high is None or any(a > b for a, b in zip(low, high)):
        raise OutOfBounds(name)
    return (low, high)


def read_rotation(name: str, message: pb.Quat) -> Quat:
    q = (message.w, message.x, message.y, message.z)
    if not abs(hypot(*q) - 1) <= limits.UNIT_TOLERANCE:  # false for NaN
        raise OutOfBounds(name)
    return q


def write_rotation(message: pb.Quat, q: Quat) -> None:
    message.w, message.x, message.y, message.z = q
    message.SetInParent()


def read_numbers(
    name: str, entries: Sequence[float], fewest: int, most: int, least: float, largest: float
) -> tuple[float, ...]:
    if not fewest <= len(entries) <= most or not all(least <= entry <= largest for entry in entries):
        raise OutOfBounds(name)
    return tuple(entries)


def read_counts(name: str, entries: Sequence[int], fewest: int, most: int) -> tuple[int, ...]:
    if not fewest <= len(entries) <= most:
        raise OutOfBounds(name)
    return tuple(entries)


def read_padded(entries: tuple[float, ...], length: int) -> tuple[float, ...]:
    """Returns `length` entries, padded with 0."""
    return entries[:length] + (0.0,) * (length - len(entries))


def read_matrix(name: str, entries: Sequence[float]) -> Mat3:
    """Reads a matrix from 1, 3 or 9 entries."""
    k = read_numbers(name, entries, 1, 9, -1e12, 1e12)
    if len(k) == 1:
        return ((k[0], 0.0, 0.0), (0.0, k[0], 0.0), (0.0, 0.0, k[0]))
    if len(k) == 3:
        return ((k[0], 0.0, 0.0), (0.0, k[1], 0.0), (0.0, 0.0, k[2]))
    if len(k) == 9:
        return ((k[0], k[1], k[2]), (k[3], k[4], k[5]), (k[6], k[7], k[8]))
    raise OutOfBounds(name)


def entries(matrix: Mat3) -> list[float]:
    """Returns the shortest of the three forms."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    if any((b, c, d, f, g, h)):
        return [a, b, c, d, e, f, g, h, i]
    return [a] if a == e == i else [a, e, i]


def read_text(name: str, text: str, most: int) -> str:
    if len(text) > most or len(text.encode()) > most:
        raise OutOfBounds(name)
    return text


def read_texts(name: str, texts: Iterable[str], fewest: int, most: int, bytes: int) -> tuple[str, ...]:
    read = tuple(read_text(name, text, bytes) for text in texts)
    if not fewest <= len(read) <= most:
        raise OutOfBounds(name)
    return read


def clip(text: str, limit: int) -> str:
    """Truncates `text` to at most `limit` bytes of UTF-8, and before the first lone surrogate, which has no UTF-8."""
    try:
        encoded = text.encode()
    except UnicodeEncodeError as error:
        encoded = text[: error.start].encode()
    return encoded[:limit].decode(errors="ignore")


_Message = TypeVar("_Message", pb.Datagram, pb.Hello, pb.Answer)


def parsed(message: _Message, body: bytes) -> _Message:
    """Raises DecodeError if the body is not protobuf."""
    message.ParseFromString(body)
    try:
        whole = _is_whole(body)
    except IndexError:
        whole = False
    if not whole:
        raise DecodeError
    return message


def _is_whole(body: bytes) -> bool:
    """Whether the body is exactly one message. Some versions of protobuf, including that of Debian, end the message
    at a field 0 or an unexpected end of group and ignore the rest. Raises IndexError if the body is not protobuf."""
    at, groups, end = 0, 0, len(body)
    while at < end:
        tag = body[at]
        at += 1
        if tag >= 0x80:
            tag, at = _varint(body, at - 1)
        kind = tag & 7
        if tag & 0xFFFFFFFF < 8:  # field 0, since protobuf uses the lower 32 bits
            return False
        if kind == 2:
            size = body[at]
            at += 1
            if size >= 0x80:
                size, at = _varint(body, at - 1)
            at += size
        elif kind == 0:
            while body[at] >= 0x80:
                at += 1
            at += 1
        elif kind == 1:
            at += 8
        elif kind == 5:
            at += 4
        else:
            groups += 1 if kind == 3 else -1
            if groups < 0:
                return False
    return True


def _varint(body: bytes, at: int) -> tuple[int, int]:
    """Returns the integer at `at` and the position after it."""
    value = shift = 0
    while True:
        byte = body[at]
        at += 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return value, at

# SPDX-License-Identifier: Apache-2.0
"""Single values of protobuf messages: each is checked against its bound. Out of bounds raises OutOfBounds."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from math import hypot
from typing import TypeVar

from google.protobuf.message import DecodeError

from .. import limits
from .. import tendon_pb2 as pb
from ..messages import ChannelRule, Code, Hand, LampColour, Mat3, Mode, OutputKind, Quat, Role, Safety, Vec3, Vibration


class OutOfBounds(Exception):
    """A value that no correct peer sends."""


def number(value: float) -> float:
    if not -limits.MAX_VALUE <= value <= limits.MAX_VALUE:  # nor is NaN
        raise OutOfBounds
    return value


def magnitude(value: float) -> float:
    if not 0 <= value <= limits.MAX_VALUE:
        raise OutOfBounds
    return value


def vector(message: pb.Vec3) -> Vec3:
    x, y, z = message.x, message.y, message.z
    most = limits.MAX_VALUE
    if not (-most <= x <= most and -most <= y <= most and -most <= z <= most):
        raise OutOfBounds
    return (x, y, z)


def quaternion(message: pb.Quat) -> Quat:
    q = (message.w, message.x, message.y, message.z)
    if not is_rotation(q):
        raise OutOfBounds
    return q


def is_rotation(q: Quat) -> bool:
    return abs(hypot(*q) - 1) <= limits.UNIT_TOLERANCE  # nor is NaN


def is_setting(setting: LampColour | Vibration) -> bool:
    """Whether a receiver accepts it."""
    if isinstance(setting, LampColour):
        return 0 <= setting.rgb <= 0xFFFFFF
    return (
        0 <= setting.amplitude <= 1
        and 0 <= setting.duration_ms <= limits.MAX_VIBRATION_MS
        and (setting.frequency == 0 or limits.MIN_VIBRATION_HZ <= setting.frequency <= limits.MAX_VIBRATION_HZ)
    )


def matrix(entries: Sequence[float]) -> Mat3:
    """A stiffness from 1, 3 or 9 entries."""
    k = [number(entry) for entry in entries]
    if len(k) == 1:
        return ((k[0], 0.0, 0.0), (0.0, k[0], 0.0), (0.0, 0.0, k[0]))
    if len(k) == 3:
        return ((k[0], 0.0, 0.0), (0.0, k[1], 0.0), (0.0, 0.0, k[2]))
    if len(k) == 9:
        return ((k[0], k[1], k[2]), (k[3], k[4], k[5]), (k[6], k[7], k[8]))
    raise OutOfBounds


def entries(matrix: Mat3) -> list[float]:
    """The shortest of the three forms."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    if any((b, c, d, f, g, h)):
        return [a, b, c, d, e, f, g, h, i]
    return [a] if a == e == i else [a, e, i]


def whole(value: int, least: int, most: int) -> int:
    if not least <= value <= most:
        raise OutOfBounds
    return value


def time(ns: int) -> int:
    if not -limits.MAX_TIME_NS <= ns <= limits.MAX_TIME_NS:
        raise OutOfBounds
    return ns


def length(ns: int) -> int:
    """A length of time in ns, which is never below zero."""
    return whole(ns, 0, limits.MAX_TIME_NS)


def device(number: int) -> int:
    return whole(number, 0, limits.MAX_DEVICES - 1)


def channel(number: int) -> int:
    return whole(number, 0, limits.MAX_CHANNELS - 1)


def text(text: str, limit: int) -> str:
    if len(text) > limit or len(text.encode()) > limit:
        raise OutOfBounds
    return text


def features(features: Sequence[str]) -> tuple[str, ...]:
    if len(features) > limits.MAX_FEATURES:
        raise OutOfBounds
    return tuple(text(feature, limits.MAX_FEATURE) for feature in features)


_Number = TypeVar("_Number", bound=IntEnum)
MODES: dict[int, Mode] = {int(mode): mode for mode in Mode}
CODES: dict[int, Code] = {int(code): code for code in Code}
ROLES: dict[int, Role] = {int(role): role for role in Role}
SAFETY: dict[int, Safety] = {int(safety): safety for safety in Safety}
HANDS: dict[int, Hand] = {int(hand): hand for hand in Hand}
OUTPUT_KINDS: dict[int, OutputKind] = {int(kind): kind for kind in OutputKind}
RULES: dict[int, ChannelRule] = {int(rule): rule for rule in ChannelRule}


def enum(known: dict[int, _Number], number: int) -> _Number:
    value = known.get(number)
    if value is None:
        raise OutOfBounds
    return value


def clip(text: str, limit: int) -> str:
    """The front of `text`, at most `limit` bytes of UTF-8, and up to the first lone surrogate, which has no UTF-8."""
    try:
        encoded = text.encode()
    except UnicodeEncodeError as error:
        encoded = text[: error.start].encode()
    return encoded[:limit].decode(errors="ignore")


_Message = TypeVar("_Message", pb.Datagram, pb.Hello, pb.Answer)


def parsed(message: _Message, body: bytes) -> _Message:
    """Raises DecodeError when the body is not protobuf."""
    message.ParseFromString(body)
    try:
        whole = _is_whole(body)
    except IndexError:
        whole = False
    if not whole:
        raise DecodeError
    return message


def _is_whole(body: bytes) -> bool:
    """Whether the whole body is one message. Some versions of protobuf, Debian's among them, end the message at a
    field 0 or at the end of a group that has not begun, and ignore the rest. Raises IndexError when
    that is not protobuf."""
    at, groups, end = 0, 0, len(body)
    while at < end:
        tag = body[at]
        at += 1
        if tag >= 0x80:
            tag, at = _varint(body, at - 1)
        kind = tag & 7
        if tag < 8:  # field 0
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
    """The integer at `at`, and where it ends."""
    value = shift = 0
    while True:
        byte = body[at]
        at += 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return value, at

# SPDX-License-Identifier: Apache-2.0
"""The unencrypted 16-byte header of each datagram (WIRE.md, "Header")."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from .. import limits
from ..messages import PROTOCOL_VERSION, Hello, Refused, Welcome


class DatagramType(IntEnum):
    HELLO = 1  # client → server: request for a session
    RETRY = 2  # server → client: request to repeat the Hello with this cookie
    DATA = 3  # both directions, in a session
    ANSWER = 4  # server → client: Welcome or Refused


class Suite(IntEnum):
    """Protection of a datagram."""

    PLAIN = 0  # none; only on loopback
    NOISE = 1  # Noise_NNpsk0_25519_ChaChaPoly_SHA256
    AES_GCM = 2  # handshake of suite 1, then AES-256-GCM; Data only


@dataclass(frozen=True, slots=True)
class Header:
    """The unencrypted 16-byte header of each datagram. Suites 1 and 2 authenticate it."""

    type: DatagramType
    suite: Suite = Suite.PLAIN
    epoch: int = 0  # number of key renewals of the sender modulo 256; only in Data of suites 1 and 2
    connection_id: int = 0  # 0 until the server has assigned one
    packet_number: int = 0  # 0, 1, 2 … for each direction in Data, otherwise 0


HEADER_SIZE = 16
_HEADER = struct.Struct("<4BIQ")
_MAGIC = 0x54  # 'T'
_TYPES = {PROTOCOL_VERSION << 4 | kind: kind for kind in DatagramType}
_SUITES = {int(suite): suite for suite in Suite}


def encode_header(header: Header) -> bytes:
    version_and_type = PROTOCOL_VERSION << 4 | header.type
    return _HEADER.pack(
        _MAGIC, version_and_type, header.epoch, header.suite, header.connection_id, header.packet_number
    )


def decode_header(datagram: bytes) -> Header | None:
    if not HEADER_SIZE <= len(datagram) <= limits.MAX_DATAGRAM:
        return None
    magic, version_and_type, epoch, suite_number, connection_id, packet_number = _HEADER.unpack_from(datagram)
    kind = _TYPES.get(version_and_type)
    suite = _SUITES.get(suite_number)
    if magic != _MAGIC or kind is None or suite is None:
        return None
    if kind is not DatagramType.DATA and (epoch != 0 or suite is Suite.AES_GCM):
        return None
    if epoch != 0 and suite is Suite.PLAIN:
        return None
    return Header(kind, suite, epoch, connection_id, packet_number)

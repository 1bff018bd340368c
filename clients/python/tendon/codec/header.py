# SPDX-License-Identifier: Apache-2.0
"""The 16 bytes in the clear at the front of every datagram (WIRE.md, "Header")."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from .. import limits
from ..messages import PROTOCOL_VERSION, Hello, Refused, Welcome


class DatagramType(IntEnum):
    HELLO = 1  # client → server: may I come in?
    RETRY = 2  # server → client: say it again with this cookie
    DATA = 3  # either way, once connected
    ANSWER = 4  # server → client: Welcome or Refused


class Suite(IntEnum):
    """How a datagram is protected."""

    PLAIN = 0  # not at all: loopback only
    NOISE = 1  # Noise_NNpsk0_25519_ChaChaPoly_SHA256
    AES_GCM = 2  # the handshake of suite 1, and AES-256-GCM from then on: Data only


@dataclass(frozen=True, slots=True)
class Header:
    """The 16 bytes in the clear at the front of every datagram; suites 1 and 2 authenticate them."""

    type: DatagramType
    suite: Suite = Suite.PLAIN
    epoch: int = 0  # how often the sender has renewed its key, modulo 256; Data of suites 1 and 2 only
    connection_id: int = 0  # 0 before the server has given one
    packet_number: int = 0  # 0, 1, 2 … per direction in Data, 0 in all others


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

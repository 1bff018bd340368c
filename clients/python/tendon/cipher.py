# SPDX-License-Identifier: Apache-2.0
"""Protects a session's datagrams: not at all (suite 0), or by ChaCha20-Poly1305 with renewed keys (suite 1)."""

from __future__ import annotations

from typing import Protocol

from . import noise
from .codec import Suite

RENEW_AFTER_DATAGRAMS = 1 << 20
RENEW_AFTER_NS = 600_000_000_000
OVERLAP_NS = 2_000_000_000
"""How long datagrams under the previous key are still opened after the peer has renewed its key."""


class Forged(Exception):
    """The datagram is not sealed with the key of its epoch: it is forged, or damaged in transit."""


class OldKey(Exception):
    """We do not hold the key of the datagram's epoch: it has expired, or is more than one ahead."""


class Cipher(Protocol):
    suite: Suite
    overhead: int
    """Number of bytes that `seal` adds."""

    def next_epoch(self, now: int) -> int:
        """Key epoch of the next datagram to be sealed; renews the key when that is due."""

    def seal(self, number: int, header: bytes, body: bytes) -> bytes:
        """The body in the form in which it is sent."""

    def open(self, now: int, epoch: int, number: int, header: bytes, body: bytes) -> bytes:
        """The body in the clear. Raises Forged or OldKey."""


class Plain:
    suite = Suite.PLAIN
    overhead = 0

    def next_epoch(self, now: int) -> int:
        return 0

    def seal(self, number: int, header: bytes, body: bytes) -> bytes:
        return body

    def open(self, now: int, epoch: int, number: int, header: bytes, body: bytes) -> bytes:
        return body


class Sealed:
    suite = Suite.NOISE
    overhead = noise.TAG_SIZE

    def __init__(self, ours: bytes, theirs: bytes, now: int) -> None:
        """`ours` seals what we send, `theirs` what the peer sends, from `now` on."""
        self._ours = ours
        self._our_epoch = 0
        self._sealed = 0  # datagrams under our present key
        self._renewed_at = now

        self._theirs = theirs
        self._their_next = noise.renewed(theirs)
        self._their_epoch = 0
        self._their_previous: bytes | None = None
        self._moved_on_at = now

    def next_epoch(self, now: int) -> int:
        if self._sealed >= RENEW_AFTER_DATAGRAMS or now - self._renewed_at >= RENEW_AFTER_NS:
            self._ours = noise.renewed(self._ours)
            self._our_epoch = (self._our_epoch + 1) % 256
            self._sealed = 0
            self._renewed_at = now
        return self._our_epoch

    def seal(self, number: int, header: bytes, body: bytes) -> bytes:
        self._sealed += 1
        return noise.seal(self._ours, number, header, body)

    def open(self, now: int, epoch: int, number: int, header: bytes, body: bytes) -> bytes:
        ahead = (epoch - self._their_epoch) % 256
        if ahead == 0:
            return _opened(self._theirs, number, header, body)
        if ahead == 1:
            plain = _opened(self._their_next, number, header, body)
            self._their_previous, self._theirs = self._theirs, self._their_next
            self._their_next = noise.renewed(self._theirs)
            self._their_epoch = epoch
            self._moved_on_at = now
            return plain
        if ahead == 255 and self._their_previous is not None and now - self._moved_on_at < OVERLAP_NS:
            return _opened(self._their_previous, number, header, body)
        raise OldKey


def _opened(key: bytes, number: int, header: bytes, body: bytes) -> bytes:
    plain = noise.unseal(key, number, header, body)
    if plain is None:
        raise Forged
    return plain

# SPDX-License-Identifier: Apache-2.0
"""Protects the datagrams of a session. Suite 0 has no protection. Suite 1 (ChaCha20-Poly1305) and suite 2 (AES-256-GCM)
use authenticated encryption with key renewal."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol, Union

from . import aes, noise
from .codec import Suite

SUITE_NAMES = {Suite.AES_GCM: "aes-256-gcm", Suite.NOISE: "chacha20-poly1305"}
"""Encrypting suites in order of preference. The name of suite 2 is also the feature with which a client offers and a
server selects it."""


def usable_suites() -> tuple[Suite, ...]:
    """Returns the available encrypting suites. Suite 2 requires the package `cryptography`."""
    return tuple(suite for suite in SUITE_NAMES if suite is not Suite.AES_GCM or aes.AVAILABLE)


def names_of(suites: Iterable[Suite]) -> str:
    return ", ".join(SUITE_NAMES.get(suite, "plain") for suite in suites)


RENEW_AFTER_DATAGRAMS = 1 << 20
RENEW_AFTER_NS = 600_000_000_000
OVERLAP_NS = 2_000_000_000
"""After the peer has renewed its key, datagrams with the previous key are accepted for this time."""


class Forged(Exception):
    """Authentication failed: the datagram was forged or damaged."""


class OldKey(Exception):
    """The key of this epoch has expired, or the epoch is too far ahead."""


class Cipher(Protocol):
    suite: Suite
    overhead: int
    """Number of bytes that `seal` adds."""

    def next_epoch(self, now: int) -> int:
        """Returns the key epoch of the next datagram. Renews the key if that is due."""

    def seal(self, number: int, header: bytes, body: bytes) -> bytes:
        """Encrypts the body of a datagram."""

    def open(self, now: int, epoch: int, number: int, header: bytes, body: bytes) -> bytes:
        """Decrypts the body of a datagram. Raises Forged or OldKey."""


class Plain:
    suite = Suite.PLAIN
    overhead = 0

    def next_epoch(self, now: int) -> int:
        return 0

    def seal(self, number: int, header: bytes, body: bytes) -> bytes:
        return body

    def open(self, now: int, epoch: int, number: int, header: bytes, body: bytes) -> bytes:
        return body


class _ChaCha:
    """A key of suite 1 that has the same interface as AesGcm."""

    def __init__(self, key: bytes) -> None:
        self._key = key

    def seal(self, number: int, associated: bytes, plain: bytes) -> bytes:
        return noise.seal(self._key, number, associated, plain)

    def unseal(self, number: int, associated: bytes, sealed: bytes) -> bytes | None:
        return noise.unseal(self._key, number, associated, sealed)

    def renewed(self) -> _ChaCha:
        return _ChaCha(noise.renewed(self._key))


_Key = Union[_ChaCha, aes.AesGcm]


class Sealed:
    overhead = noise.TAG_SIZE

    def __init__(self, ours: bytes, theirs: bytes, now: int, suite: Suite = Suite.NOISE) -> None:
        """`ours` encrypts sent datagrams, `theirs` decrypts received ones."""
        key_of: type[_Key] = aes.AesGcm if suite is Suite.AES_GCM else _ChaCha
        self.suite = suite
        self._ours: _Key = key_of(ours)
        self._our_epoch = 0
        self._sealed = 0  # datagrams encrypted with the current key
        self._renewed_at = now

        self._theirs: _Key = key_of(theirs)
        self._their_next: _Key = self._theirs.renewed()
        self._their_epoch = 0
        self._their_previous: _Key | None = None
        self._moved_on_at = now

    def next_epoch(self, now: int) -> int:
        if self._sealed >= RENEW_AFTER_DATAGRAMS or now - self._renewed_at >= RENEW_AFTER_NS:
            self._ours = self._ours.renewed()
            self._our_epoch = (self._our_epoch + 1) % 256
            self._sealed = 0
            self._renewed_at = now
        return self._our_epoch

    def seal(self, number: int, header: bytes, body: bytes) -> bytes:
        self._sealed += 1
        return self._ours.seal(number, header, body)

    def open(self, now: int, epoch: int, number: int, header: bytes, body: bytes) -> bytes:
        ahead = (epoch - self._their_epoch) % 256
        if ahead == 0:
            return _opened(self._theirs, number, header, body)
        if ahead == 1:
            plain = _opened(self._their_next, number, header, body)
            self._their_previous, self._theirs = self._theirs, self._their_next
            self._their_next = self._theirs.renewed()
            self._their_epoch = epoch
            self._moved_on_at = now
            return plain
        if ahead == 255 and self._their_previous is not None and now - self._moved_on_at < OVERLAP_NS:
            return _opened(self._their_previous, number, header, body)
        raise OldKey


def _opened(key: _Key, number: int, header: bytes, body: bytes) -> bytes:
    plain = key.unseal(number, header, body)
    if plain is None:
        raise Forged
    return plain

# SPDX-License-Identifier: Apache-2.0
"""Noise_NNpsk0_25519_ChaChaPoly_SHA256 (Noise rev. 34), the handshake of cipher suite 1:

    -> psk, e
    <- e, ee

and its primitives. This is the only module that uses libsodium (PyNaCl). It does not generate random numbers: ephemeral
keys are passed as arguments, and each of them can be used for only one handshake.
"""

from __future__ import annotations

import copy
import hmac
from dataclasses import dataclass
from hashlib import sha256

from nacl import bindings as sodium
from nacl.exceptions import CryptoError

KEY_SIZE = 32
TAG_SIZE = 16

_PROTOCOL = b"Noise_NNpsk0_25519_ChaChaPoly_SHA256"


def _nonce(number: int) -> bytes:
    return bytes(4) + number.to_bytes(8, "little")


def seal(key: bytes, number: int, associated: bytes, plain: bytes) -> bytes:
    return bytes(sodium.crypto_aead_chacha20poly1305_ietf_encrypt(plain, associated, _nonce(number), key))


def unseal(key: bytes, number: int, associated: bytes, sealed: bytes) -> bytes | None:
    """Returns None if authentication fails."""
    if len(sealed) < TAG_SIZE:  # PyNaCl does not check this
        return None
    try:
        return bytes(sodium.crypto_aead_chacha20poly1305_ietf_decrypt(sealed, associated, _nonce(number), key))
    except CryptoError:
        return None


def renewed(key: bytes) -> bytes:
    """REKEY(key) of Noise. Returns the next key, from which the current one cannot be derived."""
    return seal(key, 2**64 - 1, b"", bytes(KEY_SIZE))[:KEY_SIZE]


def public_key(secret: bytes) -> bytes:
    return bytes(sodium.crypto_scalarmult_base(secret))


def shared_key(secret: bytes, point: bytes) -> bytes | None:
    """Returns None if the point has a low order, because anyone could then compute the shared secret."""
    try:
        return bytes(sodium.crypto_scalarmult(secret, point))
    except (CryptoError, RuntimeError):  # depends on PyNaCl's version
        return None


@dataclass(frozen=True, slots=True)
class Split:
    """The result of a handshake, equal on both sides."""

    initiator_to_responder: bytes
    responder_to_initiator: bytes
    handshake_hash: bytes  # hash of the entire handshake

    def of_suite_2(self) -> Split:
        """Derives the keys of suite 2, which are bound to Hello and Answer and differ from those of suite 1."""
        ours, theirs = (
            hmac.digest(key, b"tendon-suite-2" + self.handshake_hash, "sha256")
            for key in (self.initiator_to_responder, self.responder_to_initiator)
        )
        return Split(ours, theirs, self.handshake_hash)


class SymmetricState:
    """The symmetric state of Noise: the hash and key that both sides have mixed so far.

    In this pattern a new key precedes each encryption, so the nonce is always 0.
    """

    def __init__(self, prologue: bytes) -> None:
        self.hash = sha256(_PROTOCOL).digest()  # because the name is longer than a hash
        self._chaining_key = self.hash
        self._key = b""
        self.mix_hash(prologue)

    def mix_hash(self, data: bytes) -> None:
        self.hash = sha256(self.hash + data).digest()

    def mix_key(self, material: bytes) -> None:
        self._chaining_key, self._key = self._derive(material, 2)

    def mix_key_and_hash(self, material: bytes) -> None:
        self._chaining_key, mixed, self._key = self._derive(material, 3)
        self.mix_hash(mixed)

    def mix_ephemeral(self, point: bytes) -> None:
        """Mixes the token e in a pattern with a pre-shared key."""
        self.mix_hash(point)
        self.mix_key(point)

    def encrypt(self, plain: bytes) -> bytes:
        sealed = seal(self._key, 0, self.hash, plain)
        self.mix_hash(sealed)
        return sealed

    def decrypt(self, sealed: bytes) -> bytes | None:
        plain = unseal(self._key, 0, self.hash, sealed)
        self.mix_hash(sealed)
        return plain

    def split(self) -> Split:
        first, second = self._derive(b"", 2)
        return Split(first, second, self.hash)

    def _derive(self, material: bytes, outputs: int) -> list[bytes]:
        """HKDF as specified by Noise."""
        temporary = hmac.digest(self._chaining_key, material, "sha256")
        derived = [b""]
        for i in range(1, outputs + 1):
            derived.append(hmac.digest(temporary, derived[-1] + bytes([i]), "sha256"))
        return derived[1:]


class Initiator:
    """The client side. Each object must only be used to encrypt one message 1, because the nonce would be used again
    for another payload."""

    def __init__(self, key: bytes, ephemeral: bytes, prologue: bytes, payload: bytes) -> None:
        self._ephemeral = ephemeral
        self._state = SymmetricState(prologue)
        self._state.mix_key_and_hash(key)
        point = public_key(ephemeral)
        self._state.mix_ephemeral(point)
        self.message = point + self._state.encrypt(payload)

    def read(self, message: bytes) -> tuple[bytes, Split] | None:
        """Returns the payload of message 2, or None if authentication fails. Another message may then be tried."""
        state = copy.copy(self._state)
        point = message[:KEY_SIZE]
        if len(message) < KEY_SIZE + TAG_SIZE:
            return None
        state.mix_ephemeral(point)
        shared = shared_key(self._ephemeral, point)
        if shared is None:
            return None
        state.mix_key(shared)
        payload = state.decrypt(message[KEY_SIZE:])
        return None if payload is None else (payload, state.split())

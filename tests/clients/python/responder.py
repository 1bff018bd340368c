# SPDX-License-Identifier: Apache-2.0
"""The responder of the Noise handshake."""

from __future__ import annotations

from tendon.noise import KEY_SIZE, TAG_SIZE, Split, SymmetricState, public_key, shared_key


class Responder:
    def __init__(self, key: bytes, prologue: bytes) -> None:
        self._state = SymmetricState(prologue)
        self._state.mix_key_and_hash(key)
        self._peer = b""

    def read(self, message: bytes) -> bytes | None:
        """Returns the payload of message 1, or None if it is not authentic."""
        if len(message) < KEY_SIZE + TAG_SIZE:
            return None
        self._peer = message[:KEY_SIZE]
        self._state.mix_ephemeral(self._peer)
        return self._state.decrypt(message[KEY_SIZE:])

    def reply(self, ephemeral: bytes, payload: bytes) -> tuple[bytes, Split]:
        """Returns message 2 and the keys. Can be called once."""
        point = public_key(ephemeral)
        self._state.mix_ephemeral(point)
        shared = shared_key(ephemeral, self._peer)
        assert shared is not None
        self._state.mix_key(shared)
        return point + self._state.encrypt(payload), self._state.split()

# SPDX-License-Identifier: Apache-2.0
"""AES-256-GCM for cipher suite 2. The only module that uses `cryptography` (OpenSSL), because PyNaCl has no AES.
Suite 2 requires that package."""

from __future__ import annotations

try:
    from cryptography.exceptions import InvalidTag
    from cryptography.hazmat.primitives.ciphers.aead import AESGCM
except ImportError:
    AVAILABLE = False
else:
    AVAILABLE = True

TAG_SIZE = 16


class AesGcm:
    """A key for which the key schedule has been computed."""

    def __init__(self, key: bytes) -> None:
        self._aes = AESGCM(key)

    def seal(self, number: int, associated: bytes, plain: bytes) -> bytes:
        return self._aes.encrypt(_nonce(number), plain, associated)

    def unseal(self, number: int, associated: bytes, sealed: bytes) -> bytes | None:
        """Returns None if authentication fails."""
        if len(sealed) < TAG_SIZE:  # `cryptography` would raise another exception
            return None
        try:
            return self._aes.decrypt(_nonce(number), sealed, associated)
        except InvalidTag:
            return None

    def renewed(self) -> AesGcm:
        """REKEY(key) of Noise. Returns the next key, from which the current one cannot be derived."""
        return AesGcm(self.seal(2**64 - 1, b"", bytes(32))[:32])


def _nonce(number: int) -> bytes:
    """The nonce of Noise's AESGCM is big-endian, unlike that of ChaChaPoly."""
    return bytes(4) + number.to_bytes(8, "big")

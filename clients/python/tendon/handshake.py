# SPDX-License-Identifier: Apache-2.0
"""The client side of the handshake (SESSION.md, "Opening"), sans I/O."""

from __future__ import annotations

from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Union

from . import codec, noise
from .cipher import SUITE_NAMES, Cipher, Plain, Sealed, names_of, usable_suites
from .codec import Suite
from .messages import NEVER, Code, Hello, Instant, Refused, Welcome

RESEND_NS = 100_000_000
_AES_GCM = SUITE_NAMES[Suite.AES_GCM]


@dataclass(frozen=True, slots=True)
class Accepted:
    connection_id: int
    welcome: Welcome
    cipher: Cipher


Outcome = Union[Accepted, Refused]


def key_id(key: bytes) -> bytes:
    """Identifies the key to the server without revealing it."""
    return sha256(b"tendon-key-id" + key).digest()[:8]


def prologue(header: bytes, identity: bytes, random: bytes) -> bytes:
    """The data that both sides of suite 1 must agree on in addition to the key."""
    return b"tendon-1" + header + identity + random


class ClientHandshake:
    """Sends Hellos until a Retry with a cookie arrives, then Hellos with the cookie until the answer arrives.

    There is no timeout. A datagram is ignored if it is malformed, not authentic, or if it belongs to another attempt.
    """

    def __init__(
        self,
        hello: Hello,
        random: bytes,
        now: int,
        *,
        key: bytes | None = None,
        ephemeral: bytes = b"",
        suites: tuple[Suite, ...] = usable_suites(),
    ):
        """`random` must be 16 new bytes and `ephemeral` 32 new bytes for each attempt. With `key`, the session is
        encrypted with one of `suites`, which the server selects."""
        self._hello = hello
        self._random = random
        self._suites = suites
        self._initiator: noise.Initiator | None = None
        self._suite = Suite.PLAIN
        if key is not None and Suite.AES_GCM in suites:
            hello = replace(hello, features=(*hello.features, _AES_GCM))
        self._body = codec.write_hello(hello)
        if key is not None:
            self._suite = Suite.NOISE
            header = codec.encode_header(codec.Header(codec.DatagramType.HELLO, self._suite))
            identity = key_id(key)
            agreed = prologue(header, identity, random)
            self._initiator = noise.Initiator(key, ephemeral, agreed, self._body)
            self._body = identity + self._initiator.message
        self._cookie: bytes | None = None
        self._next_hello: Instant = now
        self.outcome: Outcome | None = None
        """This is set when the server has answered. The handshake is then complete."""

    def receive(self, now: int, datagram: bytes) -> None:
        if self.outcome is not None:
            return
        retry = codec.decode_retry(datagram)
        if retry is not None:
            if retry.random == self._random and retry.suite == self._suite:
                if self._cookie is None:  # only the first cookie is answered immediately, to prevent a loop
                    self._next_hello = now
                self._cookie = retry.cookie
            return
        answer = codec.decode_answer(datagram)
        if answer is not None and answer.random == self._random and answer.suite == self._suite:
            self.outcome = self._read(now, answer)
            if self.outcome is not None:
                self._next_hello = NEVER

    def next_datagram(self, now: int) -> bytes | None:
        """Returns the Hello if it is due."""
        if now < self._next_hello:
            return None
        self._next_hello = now + RESEND_NS
        cookie = self._cookie or codec.NO_COOKIE
        return codec.encode_hello(codec.HelloDatagram(self._random, self._body, cookie, self._suite))

    def next_turn(self) -> Instant:
        """Returns when `next_datagram` is due."""
        return self._next_hello

    def _read(self, now: int, answer: codec.AnswerDatagram) -> Outcome | None:
        body = answer.body
        cipher: Cipher = Plain()
        if self._initiator is not None:
            read = self._initiator.read(body)
            if read is None:
                return None
            body, split = read
        said = codec.read_answer(body)
        if not isinstance(said, Welcome):
            return said
        if not self._hello.version_min <= said.version <= self._hello.version_max:
            return None
        if self._initiator is not None:
            suite = Suite.AES_GCM if Suite.AES_GCM in self._suites and _AES_GCM in said.features else Suite.NOISE
            if suite not in self._suites:
                theirs, ours = names_of([suite]), names_of(self._suites)
                why = f"no common cipher suite: the server uses {theirs}, this client only accepts {ours}"
                return Refused(Code.UNSUPPORTED, why, 0, 0)
            keys = split.of_suite_2() if suite is Suite.AES_GCM else split
            cipher = Sealed(keys.initiator_to_responder, keys.responder_to_initiator, now, suite)
        return Accepted(answer.connection_id, said, cipher)

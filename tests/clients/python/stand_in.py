# SPDX-License-Identifier: Apache-2.0
"""A server for one client that does not do any I/O. It can perform the handshake in either suite, and has a single
Session."""

from __future__ import annotations

from dataclasses import replace

from responder import Responder

from tendon import codec
from tendon.cipher import SUITE_NAMES, Cipher, Plain, Sealed
from tendon.codec import DatagramType, Header, Suite
from tendon.handshake import key_id, prologue
from tendon.messages import NEVER, Grant, Hello, Instant, Refused, Welcome
from tendon.session import Session

COOKIE = bytes(range(1, 17))


class StandIn:
    """If `refusal` is set, it refuses every client. If `deaf` is set, it never answers. `grants` is the answer to any
    claim."""

    def __init__(self, key: bytes | None = None, suites: tuple[Suite, ...] = (Suite.NOISE,)) -> None:
        self.key = key
        self.suites = suites  # in order of preference
        self.refusal: Refused | None = None
        self.deaf = False
        self.features: tuple[str, ...] = ("local-model",)
        self.grants: tuple[Grant, ...] = ()
        self.version = 1
        self.hellos: list[Hello] = []  # with a valid cookie, one for each attempt
        self.session: Session | None = None
        self._answers: dict[bytes, bytes] = {}
        self._to_send: list[bytes] = []
        self._welcomed = 0

    def receive(self, now: int, datagram: bytes) -> None:
        if self.deaf:
            return
        hello = codec.decode_hello(datagram)
        if hello is None:
            if self.session is not None:
                self.session.receive(now, datagram)
        elif hello.cookie != COOKIE:
            self._to_send.append(codec.encode_retry(codec.RetryDatagram(hello.random, COOKIE, hello.suite)))
        else:
            if hello.random not in self._answers:
                self._answer(now, hello)
            if hello.random in self._answers:
                self._to_send.append(self._answers[hello.random])

    def tick(self, now: int) -> None:
        if self.session is not None:
            self.session.tick(now)

    def next_datagram(self, now: int) -> bytes | None:
        if self._to_send:
            return self._to_send.pop(0)
        return None if self.deaf or self.session is None else self.session.next_datagram(now)

    def next_turn(self) -> Instant:
        return NEVER if self.deaf or self.session is None else self.session.next_turn()

    def _answer(self, now: int, hello: codec.HelloDatagram) -> None:
        body, responder = hello.body, None
        if hello.suite is Suite.NOISE:
            header = codec.encode_header(Header(DatagramType.HELLO, Suite.NOISE))
            if self.key is None or body[:8] != key_id(self.key):
                return
            responder = Responder(self.key, prologue(header, body[:8], hello.random))
            opened = responder.read(body[8:])
            if opened is None:
                return
            body = opened
        said = codec.read_hello(body)
        if said is None:
            return
        self.hellos.append(said)
        self._welcomed += 1
        answer: codec.Answer = self.refusal or Welcome(
            self.version, self.features, said.role, "stand-in", 8.0, 0.0, 1000, 2000, "test", self.grants
        )
        connection_id = 0 if self.refusal else self._welcomed
        word = SUITE_NAMES[Suite.AES_GCM]
        aes = responder is not None and Suite.AES_GCM in self.suites and word in said.features
        if aes and isinstance(answer, Welcome):
            answer = replace(answer, features=(word, *answer.features))
        body = codec.write_answer(answer)
        cipher: Cipher = Plain()
        if responder is not None:
            body, split = responder.reply(bytes(31) + bytes([self._welcomed]), body)
            keys = split.of_suite_2() if aes else split
            suite = Suite.AES_GCM if aes else Suite.NOISE
            cipher = Sealed(keys.responder_to_initiator, keys.initiator_to_responder, now, suite)
        if self.refusal is None:
            self.session = Session(connection_id, now, cipher)
        datagram = codec.AnswerDatagram(hello.random, body, connection_id, hello.suite)
        self._answers[hello.random] = codec.encode_answer(datagram)

# SPDX-License-Identifier: Apache-2.0
"""The datagrams of the handshake, Hello, Retry and Answer, and their messages."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from google.protobuf.message import DecodeError

from .. import limits
from .. import tendon_pb2 as pb
from ..generated import Answer, Hello
from . import generated
from .fields import OutOfBounds, parsed
from .header import HEADER_SIZE, DatagramType, Header, Suite, decode_header, encode_header

RANDOM_SIZE = 16
NO_COOKIE = bytes(16)

_HELLO = struct.Struct("<16s16sH")
_BODY_AT = HEADER_SIZE + _HELLO.size
_ANSWER_AT = HEADER_SIZE + RANDOM_SIZE
_RETRY_SIZE = 48


@dataclass(frozen=True, slots=True)
class HelloDatagram:
    """A Hello datagram. In suite 0, `body` is the result of write_hello(); in suite 1, the handshake extends it."""

    random: bytes  # chosen by the client; identifies the attempt in Retry and Answer
    body: bytes
    cookie: bytes = NO_COOKIE
    suite: Suite = Suite.PLAIN


@dataclass(frozen=True, slots=True)
class RetryDatagram:
    random: bytes
    cookie: bytes
    suite: Suite = Suite.PLAIN


@dataclass(frozen=True, slots=True)
class AnswerDatagram:
    random: bytes
    body: bytes
    connection_id: int = 0  # 0 with Refused
    suite: Suite = Suite.PLAIN


def encode_hello(hello: HelloDatagram) -> bytes:
    """Always returns MAX_DATAGRAM bytes, so that replies are never larger (no amplification)."""
    header = encode_header(Header(DatagramType.HELLO, hello.suite))
    datagram = header + _HELLO.pack(hello.random, hello.cookie, len(hello.body)) + hello.body
    return datagram.ljust(limits.MAX_DATAGRAM, b"\0")


def encode_retry(retry: RetryDatagram) -> bytes:
    return encode_header(Header(DatagramType.RETRY, retry.suite)) + retry.random + retry.cookie


def encode_answer(answer: AnswerDatagram) -> bytes:
    header = Header(DatagramType.ANSWER, answer.suite, connection_id=answer.connection_id)
    return encode_header(header) + answer.random + answer.body


def _handshake_header(datagram: bytes, kind: DatagramType) -> Header | None:
    header = decode_header(datagram)
    if header is None or header.type is not kind or header.packet_number != 0:
        return None
    if header.connection_id != 0 and kind is not DatagramType.ANSWER:
        return None
    return header


def decode_hello(datagram: bytes) -> HelloDatagram | None:
    header = _handshake_header(datagram, DatagramType.HELLO)
    if header is None or len(datagram) != limits.MAX_DATAGRAM:
        return None
    random, cookie, size = _HELLO.unpack_from(datagram, HEADER_SIZE)
    if size > limits.MAX_HELLO_BODY or any(datagram[_BODY_AT + size :]):
        return None
    return HelloDatagram(random, datagram[_BODY_AT : _BODY_AT + size], cookie, header.suite)


def decode_retry(datagram: bytes) -> RetryDatagram | None:
    header = _handshake_header(datagram, DatagramType.RETRY)
    if header is None or len(datagram) != _RETRY_SIZE:
        return None
    return RetryDatagram(datagram[HEADER_SIZE:_ANSWER_AT], datagram[_ANSWER_AT:], header.suite)


def decode_answer(datagram: bytes) -> AnswerDatagram | None:
    header = _handshake_header(datagram, DatagramType.ANSWER)
    if header is None or len(datagram) < _ANSWER_AT:
        return None
    return AnswerDatagram(
        datagram[HEADER_SIZE:_ANSWER_AT], datagram[_ANSWER_AT:], header.connection_id, header.suite
    )


def write_hello(hello: Hello) -> bytes:
    message = pb.Hello()
    generated.write_hello(message, hello)
    return bytes(message.SerializeToString())


def write_answer(answer: Answer) -> bytes:
    message = pb.Answer()
    generated.write_answer(message, answer)
    return bytes(message.SerializeToString())


def read_hello(body: bytes) -> Hello | None:
    try:
        return generated.read_hello(parsed(pb.Hello(), body))
    except (DecodeError, OutOfBounds):
        return None


def read_answer(body: bytes) -> Answer | None:
    try:
        return generated.read_answer(parsed(pb.Answer(), body))
    except (DecodeError, OutOfBounds):
        return None

# SPDX-License-Identifier: Apache-2.0
"""The datagrams of the handshake, Hello, Retry and Answer, and the messages in them."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Union, cast

from google.protobuf.message import DecodeError

from .. import limits
from .. import tendon_pb2 as pb
from ..messages import Claim, Grant, Hello, Refused, Welcome
from . import fields
from .header import HEADER_SIZE, DatagramType, Header, Suite, decode_header, encode_header

RANDOM_SIZE = 16
NO_COOKIE = bytes(16)

_HELLO = struct.Struct("<16s16sH")
_BODY_AT = HEADER_SIZE + _HELLO.size
_ANSWER_AT = HEADER_SIZE + RANDOM_SIZE
_RETRY_SIZE = 48


@dataclass(frozen=True, slots=True)
class HelloDatagram:
    """A Hello as it is sent. In suite 0 `body` is the result of write_hello(); in suite 1 the handshake adds to it."""

    random: bytes  # chosen by the client; ties Retry and Answer to one attempt
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


Answer = Union[Welcome, Refused]


def encode_hello(hello: HelloDatagram) -> bytes:
    """Always MAX_DATAGRAM bytes, so that no reply to it is larger."""
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
    message = pb.Hello(
        version_min=hello.version_min,
        version_max=hello.version_max,
        role=cast(pb.Role, hello.role),
        name=fields.clip(hello.name, limits.MAX_NAME),
        features=[fields.clip(feature, limits.MAX_FEATURE) for feature in hello.features[: limits.MAX_FEATURES]],
        claims=[
            pb.Claim(
                device=fields.clip(claim.device, limits.MAX_LABEL),
                channel=fields.clip(claim.channel, limits.MAX_LABEL),
                role=cast(pb.Role, claim.role),
            )
            for claim in hello.claims[: limits.MAX_CLAIMS]
        ],
        ways=[fields.clip(way, limits.MAX_LABEL) for way in hello.ways[: limits.MAX_WAYS]],
    )
    return bytes(message.SerializeToString())


def write_answer(answer: Answer) -> bytes:
    if isinstance(answer, Refused):
        refused = pb.Refused(
            code=cast(pb.Code, answer.code),
            detail=fields.clip(answer.detail, limits.MAX_DETAIL),
            version_min=answer.version_min,
            version_max=answer.version_max,
        )
        return bytes(pb.Answer(refused=refused).SerializeToString())
    welcome = pb.Welcome(
        version=answer.version,
        features=[fields.clip(feature, limits.MAX_FEATURE) for feature in answer.features[: limits.MAX_FEATURES]],
        role=cast(pb.Role, answer.role),
        device_name=fields.clip(answer.device_name, limits.MAX_NAME),
        max_force_n=answer.max_force,
        position_resolution_m=answer.position_resolution,
        loop_hz=answer.loop_hz,
        timeout_ms=answer.timeout_ms,
        server=fields.clip(answer.server, limits.MAX_NAME),
        grants=[
            pb.Grant(device=grant.device, channel=grant.channel, role=cast(pb.Role, grant.role))
            for grant in answer.grants[: limits.MAX_CLAIMS]
        ],
    )
    return bytes(pb.Answer(welcome=welcome).SerializeToString())


def read_hello(body: bytes) -> Hello | None:
    try:
        message = fields.parsed(pb.Hello(), body)
        return Hello(
            role=fields.enum(fields.ROLES, message.role),
            name=fields.text(message.name, limits.MAX_NAME),
            features=fields.features(message.features),
            version_min=fields.whole(message.version_min, 1, message.version_max),
            version_max=message.version_max,
            claims=_read_claims(message),
            ways=_read_ways(message),
        )
    except (DecodeError, fields.OutOfBounds):
        return None


def read_answer(body: bytes) -> Answer | None:
    try:
        message = fields.parsed(pb.Answer(), body)
        kind = message.WhichOneof("body")
        if kind == "welcome":
            return _read_welcome(message.welcome)
        if kind == "refused":
            return _read_refused(message.refused)
    except (DecodeError, fields.OutOfBounds):
        pass
    return None


def _read_claims(message: pb.Hello) -> tuple[Claim, ...]:
    fields.whole(len(message.claims), 0, limits.MAX_CLAIMS)
    label = limits.MAX_LABEL
    return tuple(
        Claim(fields.enum(fields.ROLES, claim.role), fields.text(claim.device, label), fields.text(claim.channel, label))
        for claim in message.claims
    )


def _read_ways(message: pb.Hello) -> tuple[str, ...]:
    fields.whole(len(message.ways), 0, limits.MAX_WAYS)
    return tuple(fields.text(way, limits.MAX_LABEL) for way in message.ways)


def _read_grants(message: pb.Welcome) -> tuple[Grant, ...]:
    fields.whole(len(message.grants), 0, limits.MAX_CLAIMS)
    return tuple(
        Grant(fields.enum(fields.ROLES, grant.role), fields.device(grant.device), fields.channel(grant.channel)) for grant in message.grants
    )


def _read_welcome(message: pb.Welcome) -> Welcome:
    return Welcome(
        version=fields.whole(message.version, 1, 2**32),
        features=fields.features(message.features),
        role=fields.enum(fields.ROLES, message.role),
        device_name=fields.text(message.device_name, limits.MAX_NAME),
        max_force=fields.magnitude(message.max_force_n),
        position_resolution=fields.magnitude(message.position_resolution_m),
        loop_hz=fields.whole(message.loop_hz, 1, limits.MAX_LOOP_HZ),
        timeout_ms=fields.whole(message.timeout_ms, 1, limits.MAX_TIMEOUT_MS),
        server=fields.text(message.server, limits.MAX_NAME),
        grants=_read_grants(message),
    )


def _read_refused(message: pb.Refused) -> Refused:
    return Refused(
        code=fields.enum(fields.CODES, message.code),
        detail=fields.text(message.detail, limits.MAX_DETAIL),
        version_min=message.version_min,
        version_max=message.version_max,
    )

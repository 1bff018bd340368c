# SPDX-License-Identifier: Apache-2.0
"""Data datagrams: time, echo, and any number of frames."""

from __future__ import annotations

from dataclasses import dataclass

from google.protobuf.message import DecodeError

from .. import limits
from .. import tendon_pb2 as pb
from ..generated import Echo
from ..messages import Frame
from . import frames, generated
from .fields import OutOfBounds, parsed


@dataclass(frozen=True, slots=True)
class DataContent:
    """The content of a Data datagram."""

    sent_ns: int
    echo: Echo | None
    frames: list[Frame]  # in order, with all values within bounds; states in columns are separate entries
    # Number of frames and echoes with a value out of bounds. They are omitted, except requests (see Control.invalid)
    # and answers (see Code.INVALID) with a valid id.
    invalid: int


def write_data_head(sent_ns: int, echo: Echo | None) -> bytes:
    """Encodes the beginning of a Data body. Results of write_frame() may follow, since Protobuf merges concatenated
    messages.
    """
    head = pb.Datagram(tx_time_ns=sent_ns)
    if echo is not None:
        generated.write_echo(head.echo, echo)
    return bytes(head.SerializeToString())


def write_frame(frame: Frame) -> bytes:
    message = pb.Datagram()
    frames.write_into(message.frames.add(), frame)
    return bytes(message.SerializeToString())


def read_data(body: bytes) -> DataContent | None:
    """Returns None if the body is malformed, which means that it is not protobuf, has too many frames, or does not have
    a valid tx_time."""
    try:
        message = parsed(pb.Datagram(), body)
    except DecodeError:
        return None
    sent_ns = message.tx_time_ns
    if not -limits.MAX_TIME_NS <= sent_ns <= limits.MAX_TIME_NS or len(message.frames) > limits.MAX_FRAMES:
        return None
    invalid = 0
    echo = None
    if message.HasField("echo"):
        try:
            echo = generated.read_echo(message.echo)
        except OutOfBounds:
            invalid += 1
    content: list[Frame] = []
    for piece in message.frames:
        try:
            if piece.HasField("states"):
                content += frames.read_states(piece.states)
                continue
            frame = frames.read(piece)
        except frames.Refused as refused:
            invalid += 1
            frame = refused.frame
        except OutOfBounds:
            invalid += 1
            continue
        if frame is not None:
            content.append(frame)
    return DataContent(sent_ns, echo, content, invalid)

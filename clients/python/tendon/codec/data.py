# SPDX-License-Identifier: Apache-2.0
"""Data datagrams: time, echo, and any number of frames."""

from __future__ import annotations

from dataclasses import dataclass

from google.protobuf.message import DecodeError

from .. import limits
from .. import tendon_pb2 as pb
from ..messages import Frame
from . import fields, frames


@dataclass(frozen=True, slots=True)
class Echo:
    """The newest datagram that one end has received, reported back to its sender."""

    sent_ns: int  # T1: when it was sent, on its sender's clock
    received_ns: int  # T2: when it arrived, on its receiver's clock
    packet_number: int
    received_mask: int = 0  # bit i: packet (packet_number − 1 − i) has arrived too


@dataclass(frozen=True, slots=True)
class DataContent:
    """What a Data datagram holds."""

    sent_ns: int
    echo: Echo | None
    frames: list[Frame]  # in the order of the datagram, every value within bounds; of columns each state
    invalid: int  # frames (and echoes) left out because a value was out of bounds


def write_data_head(sent_ns: int, echo: Echo | None) -> bytes:
    """The front of a Data datagram's body. Any number of results of write_frame() may follow it.

    (Protobuf defines the concatenation of two messages as their merge.)
    """
    head = pb.Datagram(tx_time_ns=sent_ns)
    if echo is not None:
        told = head.echo
        told.peer_tx_time_ns = echo.sent_ns
        told.rx_time_ns = echo.received_ns
        told.peer_packet_number = echo.packet_number
        told.received_mask = echo.received_mask
    return bytes(head.SerializeToString())


def write_frame(frame: Frame) -> bytes:
    message = pb.Datagram()
    frames.write_into(message.frames.add(), frame)
    return bytes(message.SerializeToString())


def _read_echo(message: pb.Echo) -> Echo:
    return Echo(
        sent_ns=fields.time(message.peer_tx_time_ns),
        received_ns=fields.time(message.rx_time_ns),
        packet_number=message.peer_packet_number,
        received_mask=message.received_mask,
    )


def read_data(body: bytes) -> DataContent | None:
    """None when the body is malformed: not protobuf, too many frames, or without a usable tx_time."""
    try:
        message = fields.parsed(pb.Datagram(), body)
        sent_ns = fields.time(message.tx_time_ns)
    except (DecodeError, fields.OutOfBounds):
        return None
    if len(message.frames) > limits.MAX_FRAMES:
        return None
    invalid = 0
    echo = None
    if message.HasField("echo"):
        try:
            echo = _read_echo(message.echo)
        except fields.OutOfBounds:
            invalid += 1
    content: list[Frame] = []
    for piece in message.frames:
        try:
            if piece.HasField("states"):
                content += frames.read_states(piece.states)
                continue
            frame = frames.read(piece)
        except fields.OutOfBounds:
            invalid += 1
        else:
            if frame is not None:
                content.append(frame)
    return DataContent(sent_ns, echo, content, invalid)

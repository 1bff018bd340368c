# SPDX-License-Identifier: Apache-2.0
"""Frames with additional rules: invalid requests and answers, and states in columns."""

from __future__ import annotations

from math import inf

from .. import limits
from .. import tendon_pb2 as pb
from ..messages import Code, Contact, Control, ControlAck, DeviceState, Frame, Request
from . import generated
from .fields import OutOfBounds


class Refused(OutOfBounds):
    """Replaces a request or an answer that is out of bounds. `frame` is used instead, because dropping it would block
    the following ones."""

    def __init__(self, field: str, frame: Control | ControlAck) -> None:
        super().__init__(field)
        self.frame = frame


def read(message: pb.Frame) -> Frame | None:
    """Returns None if the frame is only known to newer peers."""
    if message.HasField("control"):
        return _read_control(message.control)
    if message.HasField("control_ack"):
        return _read_ack(message.control_ack)
    return generated.read_frame(message)


def _read_control(message: pb.Control) -> Control:
    number = message.id
    if number == 0:
        raise OutOfBounds("id")
    try:
        return Control(number, generated.read_request(message))
    except OutOfBounds as error:
        raise Refused(error.field, Control(number, None, error.field)) from None


def _read_ack(message: pb.ControlAck) -> ControlAck:
    try:
        return generated.read_control_ack(message)
    except OutOfBounds as error:
        if message.id == 0:
            raise
        refused = ControlAck(message.id, Code.INVALID, "a field of the answer is out of bounds")
        raise Refused(error.field, refused) from None


def write_into(message: pb.Frame, frame: Frame) -> None:
    """Writes the frame into an empty message."""
    if isinstance(frame, Control):
        message.control.id = frame.id
        if frame.request is not None:
            generated.write_request(message.control, frame.request)
    else:
        generated.write_frame(message, frame)


def read_states(message: pb.DeviceStates) -> list[DeviceState]:
    """Expands states that are encoded in columns. If a column is optional, it can be empty. Otherwise, it has one entry
    for each device."""
    devices = [device for device in range(limits.MAX_DEVICES) if message.devices >> device & 1]
    count = len(devices)
    vectors = (message.position_m, message.velocity_mps, message.force_applied_n)
    numbers = (message.energy_j, message.permitted_force_n, message.mode)
    counts = (message.reasons, message.force_sequence, message.force_age_ns, message.channel, message.buttons)
    if (
        not count
        or message.devices >> limits.MAX_DEVICES
        or any(len(column) != 3 * count for column in vectors)
        or any(len(column) != count for column in numbers)
        or any(len(column) not in (0, count) for column in counts)
    ):
        raise OutOfBounds("devices")
    states = []
    for i, device in enumerate(devices):
        one = pb.DeviceState(tick=message.tick, sampled_ns=message.sampled_ns, device=device)
        for of_one, column in zip((one.position_m, one.velocity_mps, one.force_applied_n), vectors):
            of_one.x, of_one.y, of_one.z = column[3 * i : 3 * i + 3]
        one.energy_j, one.permitted_force_n, one.mode = (column[i] for column in numbers)
        one.reasons, one.force_sequence, one.force_age_ns, one.channel, one.buttons = (
            column[i] if column else 0 for column in counts
        )
        states.append(generated.read_device_state(one))
    return states


# ---- Validation of values before sending ----


def is_radius(metres: float) -> bool:
    return metres == inf or 0 <= metres <= limits.MAX_VALUE


def is_contact(contact: Contact) -> bool:
    """Returns True if a peer accepts the contact."""
    message = pb.Contact()
    generated.write_contact(message, contact)
    try:
        generated.read_contact(message)
    except OutOfBounds:
        return False
    return True


def is_request(request: Request) -> bool:
    """Returns True if a peer accepts the request."""
    message = pb.Control()
    try:
        generated.write_request(message, request)
        generated.read_request(message)
    except (OutOfBounds, ValueError):  # ValueError: out of the range of the protobuf type
        return False
    return True

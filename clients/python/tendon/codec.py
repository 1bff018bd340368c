# SPDX-License-Identifier: Apache-2.0
"""Values to bytes and back: the only module that knows the layout of the header and protobuf (WIRE.md).

Encoding trusts its input, except that texts and lists are cut to their bounds. Decoding trusts nothing: it
returns None for what it refuses.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import hypot, inf
from typing import TypeVar, Union, cast

from google.protobuf.message import DecodeError

from . import limits
from . import tendon_pb2 as pb
from .messages import (
    PROTOCOL_VERSION,
    Bye,
    ChannelDescription,
    ChannelRule,
    Claim,
    Code,
    Contact,
    Control,
    ControlAck,
    Delays,
    Describe,
    DeviceDescription,
    DeviceReport,
    DeviceState,
    Disarm,
    ForceCommand,
    ForceTable,
    Frame,
    GiveLease,
    Grant,
    Hello,
    LeaseLost,
    LinkReport,
    LocalModel,
    Mat3,
    Mode,
    PeerReport,
    Rearm,
    Refused,
    Request,
    Role,
    Safety,
    SetStateDeadband,
    SetStateRate,
    TakeLease,
    Vec3,
    Welcome,
)

# ---- Header ----------------------------------------------------------------------------------------


class DatagramType(IntEnum):
    HELLO = 1  # client → server: may I come in?
    RETRY = 2  # server → client: say it again with this cookie
    DATA = 3  # either way, once connected
    ANSWER = 4  # server → client: Welcome or Refused


class Suite(IntEnum):
    """How a conversation is protected; chosen by the client in its first Hello."""

    PLAIN = 0  # not at all: loopback only
    NOISE = 1  # Noise_NNpsk0_25519_ChaChaPoly_SHA256


@dataclass(frozen=True, slots=True)
class Header:
    """The 16 bytes in the clear at the front of every datagram; suite 1 authenticates them."""

    type: DatagramType
    suite: Suite = Suite.PLAIN
    epoch: int = 0  # how often the sender has renewed its key, modulo 256; Data of suite 1 only
    connection_id: int = 0  # 0 before the server has given one
    packet_number: int = 0  # 0, 1, 2 … per direction in Data, 0 in all others


HEADER_SIZE = 16
_HEADER = struct.Struct("<4BIQ")
_MAGIC = 0x54  # 'T'
_TYPES = {PROTOCOL_VERSION << 4 | kind: kind for kind in DatagramType}
_SUITES = {int(suite): suite for suite in Suite}


def encode_header(header: Header) -> bytes:
    version_and_type = PROTOCOL_VERSION << 4 | header.type
    return _HEADER.pack(
        _MAGIC, version_and_type, header.epoch, header.suite, header.connection_id, header.packet_number
    )


def decode_header(datagram: bytes) -> Header | None:
    if not HEADER_SIZE <= len(datagram) <= limits.MAX_DATAGRAM:
        return None
    magic, version_and_type, epoch, suite_number, connection_id, packet_number = _HEADER.unpack_from(datagram)
    kind = _TYPES.get(version_and_type)
    suite = _SUITES.get(suite_number)
    if magic != _MAGIC or kind is None or suite is None:
        return None
    if epoch != 0 and (suite is Suite.PLAIN or kind is not DatagramType.DATA):
        return None
    return Header(kind, suite, epoch, connection_id, packet_number)


# ---- Single values ---------------------------------------------------------------------------------


class _OutOfBounds(Exception):
    """A value that no correct peer sends."""


def _number(value: float) -> float:
    if not -limits.MAX_VALUE <= value <= limits.MAX_VALUE:  # nor is NaN
        raise _OutOfBounds
    return value


def _magnitude(value: float) -> float:
    if not 0 <= value <= limits.MAX_VALUE:
        raise _OutOfBounds
    return value


def _vector(message: pb.Vec3) -> Vec3:
    x, y, z = message.x, message.y, message.z
    most = limits.MAX_VALUE
    if not (-most <= x <= most and -most <= y <= most and -most <= z <= most):
        raise _OutOfBounds
    return (x, y, z)


def _whole(value: int, least: int, most: int) -> int:
    if not least <= value <= most:
        raise _OutOfBounds
    return value


def _time(ns: int) -> int:
    return _whole(ns, -limits.MAX_TIME_NS, limits.MAX_TIME_NS)


def _length(ns: int) -> int:
    """Of time, which is never below zero."""
    return _whole(ns, 0, limits.MAX_TIME_NS)


def _device(number: int) -> int:
    return _whole(number, 0, limits.MAX_DEVICES - 1)


def _channel(number: int) -> int:
    return _whole(number, 0, limits.MAX_CHANNELS - 1)


def _text(text: str, limit: int) -> str:
    if len(text) > limit or len(text.encode()) > limit:
        raise _OutOfBounds
    return text


def _features(features: Sequence[str]) -> tuple[str, ...]:
    if len(features) > limits.MAX_FEATURES:
        raise _OutOfBounds
    return tuple(_text(feature, limits.MAX_FEATURE) for feature in features)


_Number = TypeVar("_Number", bound=IntEnum)
_MODES: dict[int, Mode] = {int(mode): mode for mode in Mode}
_CODES: dict[int, Code] = {int(code): code for code in Code}
_ROLES: dict[int, Role] = {int(role): role for role in Role}
_SAFETY: dict[int, Safety] = {int(safety): safety for safety in Safety}
_RULES: dict[int, ChannelRule] = {int(rule): rule for rule in ChannelRule}


def _enum(known: dict[int, _Number], number: int) -> _Number:
    value = known.get(number)
    if value is None:
        raise _OutOfBounds
    return value


def _clip(text: str, limit: int) -> str:
    """The front of `text`, at most `limit` bytes of UTF-8, and up to the first lone surrogate, which has no UTF-8."""
    try:
        encoded = text.encode()
    except UnicodeEncodeError as error:
        encoded = text[: error.start].encode()
    return encoded[:limit].decode(errors="ignore")


_Message = TypeVar("_Message", pb.Datagram, pb.Hello, pb.Answer)


def _parsed(message: _Message, body: bytes) -> _Message:
    """Raises DecodeError when the body is not protobuf."""
    message.ParseFromString(body)
    try:
        whole = _is_whole(body)
    except IndexError:
        whole = False
    if not whole:
        raise DecodeError
    return message


def _is_whole(body: bytes) -> bool:
    """Some versions of protobuf, Debian's among them, take a field 0, and the end of a group that has not begun, for the
    end of the message, and do not look at what follows. Raises IndexError when that is nothing like protobuf."""
    at, groups = 0, 0
    while at < len(body):
        tag, at = _varint(body, at)
        field, kind = tag >> 3, tag & 7
        if field == 0:
            return False
        if kind == 0:
            at = _varint(body, at)[1]
        elif kind == 1:
            at += 8
        elif kind == 2:
            size, at = _varint(body, at)
            at += size
        elif kind == 5:
            at += 4
        else:
            groups += 1 if kind == 3 else -1
            if groups < 0:
                return False
    return True


def _varint(body: bytes, at: int) -> tuple[int, int]:
    """The integer at `at`, and where it ends."""
    value = shift = 0
    while True:
        byte = body[at]
        at += 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return value, at


# ---- Frames ----------------------------------------------------------------------------------------


def _read_state(message: pb.DeviceState) -> DeviceState:
    permitted = message.permitted_force_n
    return DeviceState(
        tick=message.tick,
        sampled_ns=_time(message.sampled_ns),
        position=_vector(message.position_m),
        velocity=_vector(message.velocity_mps),
        force_applied=_vector(message.force_applied_n),
        energy=_number(message.energy_j),
        permitted_force=permitted if permitted == inf else _magnitude(permitted),
        reasons=message.reasons,
        force_sequence=message.force_sequence,
        force_age_ns=_length(message.force_age_ns),
        mode=_enum(_MODES, message.mode),
        device=_device(message.device),
        channel=_channel(message.channel),
        force_wanted=_vector(message.force_wanted_n) if message.HasField("force_wanted_n") else None,
    )


def is_radius(metres: float) -> bool:
    return metres == inf or 0 <= metres <= limits.MAX_VALUE


def is_contact(contact: Contact) -> bool:
    """Whether a peer takes it: every number is within its bounds."""
    table = contact.table
    numbers = [*contact.normal, contact.gap]
    if table is not None:
        if not (table.step > 0 and limits.MIN_TABLE <= len(table.force) <= limits.MAX_TABLE):
            return False
        numbers += [table.first, table.step, *table.force]
    bounded = all(abs(number) <= limits.MAX_VALUE for number in numbers)  # nor is NaN
    return bounded and abs(hypot(*contact.normal) - 1) <= limits.UNIT_TOLERANCE


def _read_contact(message: pb.Contact) -> Contact:
    table = None
    if message.HasField("table"):
        table = ForceTable(message.table.first_depth_m, message.table.step_m, tuple(message.table.force_n))
    contact = Contact(_vector(message.normal), message.gap_m, table)
    if not is_contact(contact):
        raise _OutOfBounds
    return contact


def _write_contact(contact: Contact) -> pb.Contact:
    x, y, z = contact.normal
    message = pb.Contact(normal=pb.Vec3(x=x, y=y, z=z), gap_m=contact.gap)
    if contact.table is not None:
        table = contact.table
        message.table.CopyFrom(pb.ForceTable(first_depth_m=table.first, step_m=table.step, force_n=table.force))
    return message


def _read_model(message: pb.LocalModel) -> LocalModel:
    k = [_number(value) for value in message.stiffness_npm]
    stiffness: Mat3
    if len(k) == 1:
        stiffness = ((k[0], 0.0, 0.0), (0.0, k[0], 0.0), (0.0, 0.0, k[0]))
    elif len(k) == 3:
        stiffness = ((k[0], 0.0, 0.0), (0.0, k[1], 0.0), (0.0, 0.0, k[2]))
    elif len(k) == 9:
        stiffness = ((k[0], k[1], k[2]), (k[3], k[4], k[5]), (k[6], k[7], k[8]))
    else:
        raise _OutOfBounds
    valid_radius = message.valid_radius_m if message.HasField("valid_radius_m") else inf
    if not is_radius(valid_radius):
        raise _OutOfBounds
    return LocalModel(
        at=_vector(message.at_m),
        stiffness=stiffness,
        valid_radius=valid_radius,
        contact=_read_contact(message.contact) if message.HasField("contact") else None,
    )


def _write_model(model: LocalModel) -> pb.LocalModel:
    """The shortest of the three forms that says the same."""
    (a, b, c), (d, e, f), (g, h, i) = model.stiffness
    entries: list[float] = [a, b, c, d, e, f, g, h, i]
    if not any((b, c, d, f, g, h)):
        entries = [a] if a == e == i else [a, e, i]
    return pb.LocalModel(
        at_m=_write_vector(model.at),
        stiffness_npm=entries,
        valid_radius_m=None if model.valid_radius == inf else model.valid_radius,
        contact=None if model.contact is None else _write_contact(model.contact),
    )


def _read_force(message: pb.ForceCommand) -> ForceCommand:
    return ForceCommand(
        sequence=_whole(message.sequence, 1, 2**64),
        based_on_tick=message.based_on_tick,
        force=_vector(message.force_n),
        valid_for_us=_whole(message.valid_for_us, 1, limits.MAX_VALID_FOR_US),
        model=_read_model(message.model) if message.HasField("model") else None,
        device=_device(message.device),
        channel=_channel(message.channel),
        topology_changed=message.topology_changed,
        error=_magnitude(message.error_n) if message.HasField("error_n") else None,
    )


def _read_control(message: pb.Control) -> Control:
    op = message.WhichOneof("op")
    request: Request | None = None
    if op == "set_state_rate":
        request = SetStateRate(message.set_state_rate.hz, _device(message.set_state_rate.device))
    elif op == "rearm":
        request = Rearm(_device(message.rearm.device))
    elif op == "disarm":
        request = Disarm(_device(message.disarm.device))
    elif op == "describe":
        request = Describe(_device(message.describe.device))
    elif op == "take_lease":
        request = TakeLease(_device(message.take_lease.device), _channel(message.take_lease.channel))
    elif op == "give_lease":
        request = GiveLease(_device(message.give_lease.device), _channel(message.give_lease.channel))
    elif op == "lease_lost":
        lost = message.lease_lost
        request = LeaseLost(_device(lost.device), _channel(lost.channel), _text(lost.to, limits.MAX_NAME))
    elif op == "set_state_deadband":
        asked = message.set_state_deadband
        request = SetStateDeadband(_number(asked.share), _number(asked.floor_mps), asked.max_silence_us)
    return Control(id=_whole(message.id, 1, 2**32), request=request)


def _read_ack(message: pb.ControlAck) -> ControlAck:
    return ControlAck(
        id=_whole(message.id, 1, 2**32),
        code=_enum(_CODES, message.code),
        detail=_text(message.detail, limits.MAX_DETAIL),
        wait_ms=_whole(message.wait_ms, 0, limits.MAX_TIMEOUT_MS),
        device=_read_description(message.device) if message.HasField("device") else None,
    )


def _read_description(message: pb.DeviceDescription) -> DeviceDescription:
    if message.HasField("workspace_min_m") != message.HasField("workspace_max_m"):
        raise _OutOfBounds
    workspace = None
    if message.HasField("workspace_min_m"):
        low, high = workspace = (_vector(message.workspace_min_m), _vector(message.workspace_max_m))
        if any(a > b for a, b in zip(low, high)):
            raise _OutOfBounds
    _whole(len(message.channels), 1, limits.MAX_CHANNELS)
    return DeviceDescription(
        device=_device(message.device),
        name=_text(message.name, limits.MAX_LABEL),
        model=_text(message.model, limits.MAX_NAME),
        position_dof=_whole(message.position_dof, 1, limits.MAX_DOF),
        force_dof=_whole(message.force_dof, 1, limits.MAX_DOF),
        workspace=workspace,
        max_force=_magnitude(message.max_force_n),
        continuous_force=_magnitude(message.continuous_force_n),
        max_stiffness=_magnitude(message.max_stiffness_npm),
        position_resolution=_magnitude(message.position_resolution_m),
        loop_hz=_whole(message.loop_hz, 1, limits.MAX_LOOP_HZ),
        channels=tuple(
            ChannelDescription(
                name=_text(channel.name, limits.MAX_LABEL),
                rule=_enum(_RULES, channel.rule),
                lease_ms=_whole(channel.lease_ms, 0, limits.MAX_TIMEOUT_MS),
                holder=_text(channel.holder, limits.MAX_LABEL),
            )
            for channel in message.channels
        ),
    )


def _write_description(description: DeviceDescription) -> pb.DeviceDescription:
    message = pb.DeviceDescription(
        device=description.device,
        name=_clip(description.name, limits.MAX_LABEL),
        model=_clip(description.model, limits.MAX_NAME),
        position_dof=description.position_dof,
        force_dof=description.force_dof,
        max_force_n=description.max_force,
        continuous_force_n=description.continuous_force,
        max_stiffness_npm=description.max_stiffness,
        position_resolution_m=description.position_resolution,
        loop_hz=description.loop_hz,
    )
    if description.workspace is not None:
        low, high = description.workspace
        message.workspace_min_m.CopyFrom(_write_vector(low))
        message.workspace_max_m.CopyFrom(_write_vector(high))
    for channel in description.channels[: limits.MAX_CHANNELS]:
        message.channels.append(
            pb.ChannelDescription(
                name=_clip(channel.name, limits.MAX_LABEL),
                rule=cast(pb.ChannelRule, channel.rule),
                lease_ms=channel.lease_ms,
                holder=_clip(channel.holder, limits.MAX_LABEL),
            )
        )
    return message


def _read_bye(message: pb.Bye) -> Bye:
    return Bye(code=_enum(_CODES, message.code), reason=_text(message.reason, limits.MAX_DETAIL))


def _read_delays(message: pb.Delays) -> Delays:
    return Delays(_time(message.median_ns), _time(message.p99_ns))


def _read_report(message: pb.LinkReport) -> LinkReport:
    return LinkReport(
        number=_whole(message.number, 1, 2**64),
        until_ns=_time(message.until_ns),
        span_ns=_length(message.span_ns),
        forces=message.forces,
        late_server=message.late_server,
        late_network=message.late_network,
        late_engine=message.late_engine,
        worst_late_ns=_length(message.worst_late_ns),
        longest_gap_ns=_length(message.longest_gap_ns),
        round_trip=_read_delays(message.round_trip) if message.HasField("round_trip") else None,
        to_server=_read_delays(message.to_server) if message.HasField("to_server") else None,
        to_client=_read_delays(message.to_client) if message.HasField("to_client") else None,
        clock_offset_ns=_time(message.clock_offset_ns),
        clock_drift_ppm=_number(message.clock_drift_ppm),
        clock_error_ns=_length(message.clock_error_ns),
        received=message.received,
        lost=message.lost,
        reordered=message.reordered,
        duplicated=message.duplicated,
        words=_text(message.words, limits.MAX_DETAIL),
    )


def _write_delays(delays: Delays | None) -> pb.Delays | None:
    return None if delays is None else pb.Delays(median_ns=delays.median_ns, p99_ns=delays.p99_ns)


def _write_report(report: LinkReport) -> pb.LinkReport:
    return pb.LinkReport(
        number=report.number,
        until_ns=report.until_ns,
        span_ns=report.span_ns,
        forces=report.forces,
        late_server=report.late_server,
        late_network=report.late_network,
        late_engine=report.late_engine,
        worst_late_ns=report.worst_late_ns,
        longest_gap_ns=report.longest_gap_ns,
        round_trip=_write_delays(report.round_trip),
        to_server=_write_delays(report.to_server),
        to_client=_write_delays(report.to_client),
        clock_offset_ns=report.clock_offset_ns,
        clock_drift_ppm=report.clock_drift_ppm,
        clock_error_ns=report.clock_error_ns,
        received=report.received,
        lost=report.lost,
        reordered=report.reordered,
        duplicated=report.duplicated,
        words=_clip(report.words, limits.MAX_DETAIL),
    )


def _read_device_report(message: pb.DeviceReport) -> DeviceReport:
    steps, lateness = message.steps, tuple(message.lateness_us_log2)
    _whole(len(lateness), 0, limits.LATENESS_BUCKETS)
    _whole(sum(lateness), 0, steps)
    return DeviceReport(
        number=_whole(message.number, 1, 2**64),
        until_ns=_time(message.until_ns),
        span_ns=_length(message.span_ns),
        device=_device(message.device),
        steps=steps,
        missed=message.missed,
        overruns=_whole(message.overruns, 0, steps),
        unseen=_whole(message.unseen, 0, steps),
        lateness=lateness,
        safety=_enum(_SAFETY, message.safety),
        fault=_text(message.fault, limits.MAX_DETAIL),
        degraded=_text(message.degraded, limits.MAX_DETAIL),
    )


def _write_device_report(report: DeviceReport) -> pb.DeviceReport:
    return pb.DeviceReport(
        number=report.number,
        until_ns=report.until_ns,
        span_ns=report.span_ns,
        device=report.device,
        steps=report.steps,
        missed=report.missed,
        overruns=report.overruns,
        unseen=report.unseen,
        lateness_us_log2=report.lateness,
        safety=cast(pb.Safety, report.safety),
        fault=_clip(report.fault, limits.MAX_DETAIL),
        degraded=_clip(report.degraded, limits.MAX_DETAIL),
    )


def _read_peer_report(message: pb.PeerReport) -> PeerReport:
    if not message.HasField("link"):
        raise _OutOfBounds
    return PeerReport(
        device=_device(message.device),
        channel=_channel(message.channel),
        name=_text(message.name, limits.MAX_NAME),
        state_one_in=_whole(message.state_one_in, 1, limits.MAX_ONE_IN),
        forces_refused=message.forces_refused,
        link=_read_report(message.link),
    )


def _write_peer_report(report: PeerReport) -> pb.PeerReport:
    return pb.PeerReport(
        device=report.device,
        channel=report.channel,
        name=_clip(report.name, limits.MAX_NAME),
        state_one_in=report.state_one_in,
        forces_refused=report.forces_refused,
        link=_write_report(report.link),
    )


def _write_vector(vector: Vec3) -> pb.Vec3:
    return pb.Vec3(x=vector[0], y=vector[1], z=vector[2])


def _write_control(frame: Control) -> pb.Control:
    control, request = pb.Control(id=frame.id), frame.request
    if isinstance(request, SetStateRate):
        control.set_state_rate.CopyFrom(pb.SetStateRate(hz=request.hz, device=request.device))
    elif isinstance(request, Rearm):
        control.rearm.CopyFrom(pb.Rearm(device=request.device))
    elif isinstance(request, Disarm):
        control.disarm.CopyFrom(pb.Disarm(device=request.device))
    elif isinstance(request, Describe):
        control.describe.CopyFrom(pb.Describe(device=request.device))
    elif isinstance(request, TakeLease):
        control.take_lease.CopyFrom(pb.TakeLease(device=request.device, channel=request.channel))
    elif isinstance(request, GiveLease):
        control.give_lease.CopyFrom(pb.GiveLease(device=request.device, channel=request.channel))
    elif isinstance(request, LeaseLost):
        to = _clip(request.to, limits.MAX_NAME)
        control.lease_lost.CopyFrom(pb.LeaseLost(device=request.device, channel=request.channel, to=to))
    elif isinstance(request, SetStateDeadband):
        control.set_state_deadband.CopyFrom(
            pb.SetStateDeadband(share=request.share, floor_mps=request.floor, max_silence_us=request.max_silence_us)
        )
    return control


def _write_frame(frame: Frame) -> pb.Frame:
    if isinstance(frame, ForceCommand):
        force = pb.ForceCommand(
            sequence=frame.sequence,
            based_on_tick=frame.based_on_tick,
            force_n=_write_vector(frame.force),
            model=_write_model(frame.model) if frame.model else None,
            valid_for_us=frame.valid_for_us,
            device=frame.device,
            channel=frame.channel,
            topology_changed=frame.topology_changed,
            error_n=frame.error,
        )
        return pb.Frame(force=force)
    if isinstance(frame, DeviceState):
        state = pb.DeviceState(
            tick=frame.tick,
            sampled_ns=frame.sampled_ns,
            position_m=_write_vector(frame.position),
            velocity_mps=_write_vector(frame.velocity),
            force_applied_n=_write_vector(frame.force_applied),
            energy_j=frame.energy,
            permitted_force_n=frame.permitted_force,
            reasons=frame.reasons,
            force_sequence=frame.force_sequence,
            force_age_ns=frame.force_age_ns,
            mode=cast(pb.Mode, frame.mode),
            device=frame.device,
            channel=frame.channel,
            force_wanted_n=None if frame.force_wanted is None else _write_vector(frame.force_wanted),
        )
        return pb.Frame(state=state)
    if isinstance(frame, Control):
        return pb.Frame(control=_write_control(frame))
    if isinstance(frame, ControlAck):
        ack = pb.ControlAck(
            id=frame.id,
            code=cast(pb.Code, frame.code),
            detail=_clip(frame.detail, limits.MAX_DETAIL),
            wait_ms=frame.wait_ms,
            device=None if frame.device is None else _write_description(frame.device),
        )
        return pb.Frame(control_ack=ack)
    if isinstance(frame, LinkReport):
        return pb.Frame(report=_write_report(frame))
    if isinstance(frame, DeviceReport):
        return pb.Frame(device_report=_write_device_report(frame))
    if isinstance(frame, PeerReport):
        return pb.Frame(peer_report=_write_peer_report(frame))
    bye = pb.Bye(code=cast(pb.Code, frame.code), reason=_clip(frame.reason, limits.MAX_DETAIL))
    return pb.Frame(bye=bye)


# ---- Data ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Echo:
    """The newest datagram that one end has received from the other, told back to it."""

    sent_ns: int  # T1: when it was sent, on the clock of the one who sent it
    received_ns: int  # T2: when it arrived, on the clock of the one who tells
    packet_number: int
    received_mask: int = 0  # bit i: packet (packet_number − 1 − i) has arrived too


@dataclass(frozen=True, slots=True)
class DataContent:
    """What a Data datagram holds."""

    sent_ns: int
    echo: Echo | None
    frames: list[Frame]  # in the order of the datagram, every value within bounds
    invalid: int  # frames (and echoes) left out because a value was out of bounds


def write_data_head(sent_ns: int, echo: Echo | None) -> bytes:
    """The front of a Data datagram's body: what write_frame() gives follows, as often as wanted.

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
    return bytes(pb.Datagram(frames=[_write_frame(frame)]).SerializeToString())


def _read_echo(message: pb.Echo) -> Echo:
    return Echo(
        sent_ns=_time(message.peer_tx_time_ns),
        received_ns=_time(message.rx_time_ns),
        packet_number=message.peer_packet_number,
        received_mask=message.received_mask,
    )


def _read_frame(message: pb.Frame) -> Frame | None:
    body = message.WhichOneof("body")
    if body == "state":
        return _read_state(message.state)
    if body == "force":
        return _read_force(message.force)
    if body == "control":
        return _read_control(message.control)
    if body == "control_ack":
        return _read_ack(message.control_ack)
    if body == "bye":
        return _read_bye(message.bye)
    if body == "report":
        return _read_report(message.report)
    if body == "device_report":
        return _read_device_report(message.device_report)
    if body == "peer_report":
        return _read_peer_report(message.peer_report)
    return None  # a frame of a newer peer


def read_data(body: bytes) -> DataContent | None:
    """None when the body is malformed: not protobuf, too many frames, or without a usable tx_time."""
    try:
        message = _parsed(pb.Datagram(), body)
        sent_ns = _time(message.tx_time_ns)
    except (DecodeError, _OutOfBounds):
        return None
    if len(message.frames) > limits.MAX_FRAMES:
        return None
    invalid = 0
    echo = None
    if message.HasField("echo"):
        try:
            echo = _read_echo(message.echo)
        except _OutOfBounds:
            invalid += 1
    frames = []
    for piece in message.frames:
        try:
            frame = _read_frame(piece)
        except _OutOfBounds:
            invalid += 1
        else:
            if frame is not None:
                frames.append(frame)
    return DataContent(sent_ns, echo, frames, invalid)


# ---- Handshake -------------------------------------------------------------------------------------

RANDOM_SIZE = 16
NO_COOKIE = bytes(16)

_HELLO = struct.Struct("<16s16sH")
_BODY_AT = HEADER_SIZE + _HELLO.size
_ANSWER_AT = HEADER_SIZE + RANDOM_SIZE
_RETRY_SIZE = 48


@dataclass(frozen=True, slots=True)
class HelloDatagram:
    """As it travels. `body` is in suite 0 what write_hello() gives, in suite 1 that and what the handshake adds."""

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
        name=_clip(hello.name, limits.MAX_NAME),
        features=[_clip(feature, limits.MAX_FEATURE) for feature in hello.features[: limits.MAX_FEATURES]],
        claims=[
            pb.Claim(
                device=_clip(claim.device, limits.MAX_LABEL),
                channel=_clip(claim.channel, limits.MAX_LABEL),
                role=cast(pb.Role, claim.role),
            )
            for claim in hello.claims[: limits.MAX_CLAIMS]
        ],
    )
    return bytes(message.SerializeToString())


def write_answer(answer: Answer) -> bytes:
    if isinstance(answer, Refused):
        refused = pb.Refused(
            code=cast(pb.Code, answer.code),
            detail=_clip(answer.detail, limits.MAX_DETAIL),
            version_min=answer.version_min,
            version_max=answer.version_max,
        )
        return bytes(pb.Answer(refused=refused).SerializeToString())
    welcome = pb.Welcome(
        version=answer.version,
        features=[_clip(feature, limits.MAX_FEATURE) for feature in answer.features[: limits.MAX_FEATURES]],
        role=cast(pb.Role, answer.role),
        device_name=_clip(answer.device_name, limits.MAX_NAME),
        max_force_n=answer.max_force,
        position_resolution_m=answer.position_resolution,
        loop_hz=answer.loop_hz,
        timeout_ms=answer.timeout_ms,
        server=_clip(answer.server, limits.MAX_NAME),
        grants=[
            pb.Grant(device=grant.device, channel=grant.channel, role=cast(pb.Role, grant.role))
            for grant in answer.grants[: limits.MAX_CLAIMS]
        ],
    )
    return bytes(pb.Answer(welcome=welcome).SerializeToString())


def read_hello(body: bytes) -> Hello | None:
    try:
        message = _parsed(pb.Hello(), body)
        return Hello(
            role=_enum(_ROLES, message.role),
            name=_text(message.name, limits.MAX_NAME),
            features=_features(message.features),
            version_min=_whole(message.version_min, 1, message.version_max),
            version_max=message.version_max,
            claims=_read_claims(message),
        )
    except (DecodeError, _OutOfBounds):
        return None


def read_answer(body: bytes) -> Answer | None:
    try:
        message = _parsed(pb.Answer(), body)
        kind = message.WhichOneof("body")
        if kind == "welcome":
            return _read_welcome(message.welcome)
        if kind == "refused":
            return _read_refused(message.refused)
    except (DecodeError, _OutOfBounds):
        pass
    return None


def _read_claims(message: pb.Hello) -> tuple[Claim, ...]:
    _whole(len(message.claims), 0, limits.MAX_CLAIMS)
    label = limits.MAX_LABEL
    return tuple(
        Claim(_enum(_ROLES, claim.role), _text(claim.device, label), _text(claim.channel, label))
        for claim in message.claims
    )


def _read_grants(message: pb.Welcome) -> tuple[Grant, ...]:
    _whole(len(message.grants), 0, limits.MAX_CLAIMS)
    return tuple(
        Grant(_enum(_ROLES, grant.role), _device(grant.device), _channel(grant.channel)) for grant in message.grants
    )


def _read_welcome(message: pb.Welcome) -> Welcome:
    return Welcome(
        version=_whole(message.version, 1, 2**32),
        features=_features(message.features),
        role=_enum(_ROLES, message.role),
        device_name=_text(message.device_name, limits.MAX_NAME),
        max_force=_magnitude(message.max_force_n),
        position_resolution=_magnitude(message.position_resolution_m),
        loop_hz=_whole(message.loop_hz, 1, limits.MAX_LOOP_HZ),
        timeout_ms=_whole(message.timeout_ms, 1, limits.MAX_TIMEOUT_MS),
        server=_text(message.server, limits.MAX_NAME),
        grants=_read_grants(message),
    )


def _read_refused(message: pb.Refused) -> Refused:
    return Refused(
        code=_enum(_CODES, message.code),
        detail=_text(message.detail, limits.MAX_DETAIL),
        version_min=message.version_min,
        version_max=message.version_max,
    )

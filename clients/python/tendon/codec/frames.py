# SPDX-License-Identifier: Apache-2.0
"""The frames of a Data datagram: values to protobuf messages and back."""

from __future__ import annotations

from math import hypot, inf
from typing import cast

from .. import limits
from .. import tendon_pb2 as pb
from ..messages import (
    Bye,
    ChannelDescription,
    Contact,
    Control,
    ControlAck,
    Couple,
    Delays,
    Describe,
    DeviceDescription,
    DeviceReport,
    DeviceState,
    Disarm,
    Disengage,
    Engage,
    ForceCommand,
    ForceTable,
    Frame,
    GiveLease,
    Grip,
    HandleDescription,
    Joints,
    LampColour,
    LeaseLost,
    LinkReport,
    LocalModel,
    Mode,
    OutputDescription,
    PeerReport,
    PortState,
    Quat,
    Rearm,
    Request,
    RotationModel,
    SetOutput,
    SetScale,
    SetShare,
    SetStateDeadband,
    SetStateRate,
    TakeLease,
    Torque,
    Turning,
    Vec3,
    Vibration,
)
from . import fields, ports


def _read_turning(message: pb.DeviceState) -> Turning | None:
    angular_velocity = fields.vector(message.angular_velocity_radps)
    if not message.HasField("orientation"):
        return None
    return Turning(fields.quaternion(message.orientation), angular_velocity)


def _read_grip(message: pb.DeviceState) -> Grip | None:
    grip = Grip(fields.number(message.gripper_rad), fields.number(message.gripper_velocity_radps))
    return grip if message.HasField("gripper_rad") else None


def _read_joints(message: pb.DeviceState) -> Joints | None:
    if not message.joint_rad and not message.joint_velocity_radps:
        return None
    angles = tuple(fields.number(angle) for angle in message.joint_rad)
    told = tuple(fields.number(velocity) for velocity in message.joint_velocity_radps)
    if max(len(angles), len(told)) > limits.MAX_JOINTS:
        raise fields.OutOfBounds
    velocities = told[: len(angles)] + (0.0,) * (len(angles) - len(told))
    return Joints(angles, velocities) if angles else None


def _mode(mode: int, permitted: float) -> Mode:
    """The mode of a state, whose bound on the force is within bounds too."""
    known = fields.MODES.get(mode)
    if known is None or not permitted >= 0 or (permitted > limits.MAX_VALUE and permitted != inf):
        raise fields.OutOfBounds
    return known


def _read_state(message: pb.DeviceState) -> DeviceState:
    permitted = message.permitted_force_n
    mode = _mode(message.mode, permitted)
    return DeviceState(
        message.tick,
        fields.time(message.sampled_ns),
        fields.vector(message.position_m),
        fields.vector(message.velocity_mps),
        fields.vector(message.force_applied_n),
        fields.number(message.energy_j),
        permitted,
        message.reasons,
        message.force_sequence,
        fields.length(message.force_age_ns),
        mode,
        fields.device(message.device),
        fields.channel(message.channel),
        fields.vector(message.force_wanted_n) if message.HasField("force_wanted_n") else None,
        fields.matrix(message.stiffness_wanted_npm) if message.stiffness_wanted_npm else None,
        message.buttons,
        _read_turning(message),
        fields.vector(message.torque_applied_nm) if message.HasField("torque_applied_nm") else None,
        _read_grip(message),
        fields.number(message.gripper_force_applied_n) if message.HasField("gripper_force_applied_n") else None,
        fields.vector(message.hand_force_n) if message.HasField("hand_force_n") else None,
        _read_joints(message),
    )


def read_states(message: pb.DeviceStates) -> list[DeviceState]:
    """States in columns, one by one; each column has an entry of each device, or where it may be absent none."""
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
        raise fields.OutOfBounds
    states = []
    for i, device in enumerate(devices):
        position, velocity, force = (
            (fields.number(column[3 * i]), fields.number(column[3 * i + 1]), fields.number(column[3 * i + 2]))
            for column in vectors
        )
        reasons, sequence, age, channel, buttons = (column[i] if column else 0 for column in counts)
        permitted = message.permitted_force_n[i]
        state = DeviceState(
            message.tick,
            fields.time(message.sampled_ns),
            position,
            velocity,
            force,
            fields.number(message.energy_j[i]),
            permitted,
            reasons,
            sequence,
            fields.length(age),
            _mode(message.mode[i], permitted),
            device,
            fields.channel(channel),
            buttons=buttons,
        )
        states.append(state)
    return states


def is_radius(metres: float) -> bool:
    return metres == inf or 0 <= metres <= limits.MAX_VALUE


def is_contact(contact: Contact) -> bool:
    """Whether a peer accepts the contact: every number is within its bounds."""
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
    contact = Contact(fields.vector(message.normal), message.gap_m, table)
    if not is_contact(contact):
        raise fields.OutOfBounds
    return contact


def _write_contact(contact: Contact) -> pb.Contact:
    x, y, z = contact.normal
    message = pb.Contact(normal=pb.Vec3(x=x, y=y, z=z), gap_m=contact.gap)
    if contact.table is not None:
        table = contact.table
        message.table.CopyFrom(pb.ForceTable(first_depth_m=table.first, step_m=table.step, force_n=table.force))
    return message


def _read_model(message: pb.LocalModel) -> LocalModel:
    valid_radius = message.valid_radius_m if message.HasField("valid_radius_m") else inf
    if not is_radius(valid_radius):
        raise fields.OutOfBounds
    return LocalModel(
        at=fields.vector(message.at_m),
        stiffness=fields.matrix(message.stiffness_npm),
        valid_radius=valid_radius,
        contact=_read_contact(message.contact) if message.HasField("contact") else None,
    )


def _write_model(model: LocalModel) -> pb.LocalModel:
    return pb.LocalModel(
        at_m=_write_vector(model.at),
        stiffness_npm=fields.entries(model.stiffness),
        valid_radius_m=None if model.valid_radius == inf else model.valid_radius,
        contact=None if model.contact is None else _write_contact(model.contact),
    )


def _read_torque(message: pb.ForceCommand) -> Torque | None:
    if not message.HasField("rotation_model"):
        return Torque(fields.vector(message.torque_nm)) if message.HasField("torque_nm") else None
    at, stiffness = message.rotation_model.at_orientation, message.rotation_model.angular_stiffness_nmprad
    return Torque(fields.vector(message.torque_nm), RotationModel(fields.quaternion(at), fields.matrix(stiffness)))


def _write_rotation_model(model: RotationModel) -> pb.RotationModel:
    stiffness = fields.entries(model.stiffness)
    return pb.RotationModel(at_orientation=_write_quaternion(model.at), angular_stiffness_nmprad=stiffness)


def _read_force(message: pb.ForceCommand) -> ForceCommand:
    return ForceCommand(
        sequence=fields.whole(message.sequence, 1, 2**64),
        based_on_tick=message.based_on_tick,
        force=fields.vector(message.force_n),
        valid_for_us=fields.whole(message.valid_for_us, 1, limits.MAX_VALID_FOR_US),
        model=_read_model(message.model) if message.HasField("model") else None,
        device=fields.device(message.device),
        channel=fields.channel(message.channel),
        topology_changed=message.topology_changed,
        error=fields.magnitude(message.error_n) if message.HasField("error_n") else None,
        torque=_read_torque(message),
        grip_force=fields.number(message.gripper_force_n) if message.HasField("gripper_force_n") else None,
        way=fields.whole(message.way, 0, limits.MAX_WAYS),
    )


def _read_control(message: pb.Control) -> Control:
    op = message.WhichOneof("op")
    request: Request | None = None
    if op == "set_state_rate":
        request = SetStateRate(message.set_state_rate.hz, fields.device(message.set_state_rate.device))
    elif op == "rearm":
        request = Rearm(fields.device(message.rearm.device))
    elif op == "disarm":
        request = Disarm(fields.device(message.disarm.device))
    elif op == "describe":
        request = Describe(fields.device(message.describe.device), message.describe.handle)
    elif op == "take_lease":
        request = TakeLease(fields.device(message.take_lease.device), fields.channel(message.take_lease.channel))
    elif op == "give_lease":
        request = GiveLease(fields.device(message.give_lease.device), fields.channel(message.give_lease.channel))
    elif op == "lease_lost":
        lost = message.lease_lost
        request = LeaseLost(fields.device(lost.device), fields.channel(lost.channel), fields.text(lost.to, limits.MAX_NAME))
    elif op == "set_state_deadband":
        asked = message.set_state_deadband
        request = SetStateDeadband(fields.number(asked.share), fields.number(asked.floor_mps), asked.max_silence_us)
    elif op == "couple":
        request = ports.read_couple(message.couple)
    elif op == "engage":
        request = Engage(fields.device(message.engage.device))
    elif op == "disengage":
        request = Disengage(fields.device(message.disengage.device))
    elif op == "set_output":
        request = _read_set_output(message.set_output)
    elif op == "set_scale":
        request = ports.read_set_scale(message.set_scale)
    elif op == "set_share":
        request = ports.read_set_share(message.set_share)
    return Control(id=fields.whole(message.id, 1, 2**32), request=request)


def _read_set_output(message: pb.SetOutput) -> SetOutput:
    setting: LampColour | Vibration
    if message.WhichOneof("setting") == "vibration":
        pulse = message.vibration
        setting = Vibration(pulse.amplitude, pulse.frequency_hz, pulse.duration_ms)
    elif message.WhichOneof("setting") == "rgb":
        setting = LampColour(message.rgb)
    else:
        raise fields.OutOfBounds  # it says neither
    if not fields.is_setting(setting):
        raise fields.OutOfBounds
    return SetOutput(fields.device(message.device), fields.whole(message.output, 0, limits.MAX_OUTPUTS - 1), setting)


def _read_ack(message: pb.ControlAck) -> ControlAck:
    return ControlAck(
        id=fields.whole(message.id, 1, 2**32),
        code=fields.enum(fields.CODES, message.code),
        detail=fields.text(message.detail, limits.MAX_DETAIL),
        wait_ms=fields.whole(message.wait_ms, 0, limits.MAX_TIMEOUT_MS),
        device=_read_description(message.device) if message.HasField("device") else None,
        handle=_read_handle(message.handle) if message.HasField("handle") else None,
    )


def _read_description(message: pb.DeviceDescription) -> DeviceDescription:
    if message.HasField("workspace_min_m") != message.HasField("workspace_max_m"):
        raise fields.OutOfBounds
    workspace = None
    if message.HasField("workspace_min_m"):
        low, high = workspace = (fields.vector(message.workspace_min_m), fields.vector(message.workspace_max_m))
        if any(a > b for a, b in zip(low, high)):
            raise fields.OutOfBounds
    fields.whole(len(message.channels), 1, limits.MAX_CHANNELS)
    return DeviceDescription(
        device=fields.device(message.device),
        name=fields.text(message.name, limits.MAX_LABEL),
        model=fields.text(message.model, limits.MAX_NAME),
        position_dof=fields.whole(message.position_dof, 1, limits.MAX_DOF),
        force_dof=fields.whole(message.force_dof, 1, limits.MAX_DOF),
        workspace=workspace,
        max_force=fields.magnitude(message.max_force_n),
        continuous_force=fields.magnitude(message.continuous_force_n),
        max_stiffness=fields.magnitude(message.max_stiffness_npm),
        position_resolution=fields.magnitude(message.position_resolution_m),
        loop_hz=fields.whole(message.loop_hz, 1, limits.MAX_LOOP_HZ),
        channels=tuple(
            ChannelDescription(
                name=fields.text(channel.name, limits.MAX_LABEL),
                rule=fields.enum(fields.RULES, channel.rule),
                lease_ms=fields.whole(channel.lease_ms, 0, limits.MAX_TIMEOUT_MS),
                holder=fields.text(channel.holder, limits.MAX_LABEL),
            )
            for channel in message.channels
        ),
    )


def _write_description(description: DeviceDescription) -> pb.DeviceDescription:
    message = pb.DeviceDescription(
        device=description.device,
        name=fields.clip(description.name, limits.MAX_LABEL),
        model=fields.clip(description.model, limits.MAX_NAME),
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
                name=fields.clip(channel.name, limits.MAX_LABEL),
                rule=cast(pb.ChannelRule, channel.rule),
                lease_ms=channel.lease_ms,
                holder=fields.clip(channel.holder, limits.MAX_LABEL),
            )
        )
    return message


def _read_handle(message: pb.HandleDescription) -> HandleDescription:
    fields.whole(len(message.buttons), 0, limits.MAX_BUTTONS)
    fields.whole(len(message.joints), 0, limits.MAX_JOINTS)
    fields.whole(len(message.outputs), 0, limits.MAX_OUTPUTS)
    axes = message.operator_from_device
    return HandleDescription(
        device=fields.device(message.device),
        operator_from_device=fields.quaternion(axes) if message.HasField("operator_from_device") else None,
        buttons=tuple(fields.text(name, limits.MAX_LABEL) for name in message.buttons),
        joints=tuple(fields.text(name, limits.MAX_LABEL) for name in message.joints),
        outputs=tuple(
            OutputDescription(fields.text(output.name, limits.MAX_LABEL), fields.enum(fields.OUTPUT_KINDS, output.kind))
            for output in message.outputs
        ),
        orientation_measured=message.orientation_measured,
        max_torque=fields.magnitude(message.max_torque_nm),
        gripper_open=fields.magnitude(message.gripper_open_rad) if message.HasField("gripper_open_rad") else None,
        max_gripper_force=fields.magnitude(message.max_gripper_force_n),
        group=fields.text(message.group, limits.MAX_LABEL),
        hand=fields.enum(fields.HANDS, message.hand),
    )


def _write_handle(handle: HandleDescription) -> pb.HandleDescription:
    names = [fields.clip(name, limits.MAX_LABEL) for name in handle.buttons[: limits.MAX_BUTTONS]]
    axes = handle.operator_from_device
    return pb.HandleDescription(
        device=handle.device,
        operator_from_device=None if axes is None else _write_quaternion(axes),
        buttons=names,
        joints=[fields.clip(name, limits.MAX_LABEL) for name in handle.joints[: limits.MAX_JOINTS]],
        outputs=[
            pb.OutputDescription(name=fields.clip(output.name, limits.MAX_LABEL), kind=cast(pb.OutputKind, output.kind))
            for output in handle.outputs[: limits.MAX_OUTPUTS]
        ],
        orientation_measured=handle.orientation_measured,
        max_torque_nm=handle.max_torque,
        gripper_open_rad=handle.gripper_open,
        max_gripper_force_n=handle.max_gripper_force,
        group=fields.clip(handle.group, limits.MAX_LABEL),
        hand=cast(pb.Hand, handle.hand),
    )


def _read_bye(message: pb.Bye) -> Bye:
    return Bye(code=fields.enum(fields.CODES, message.code), reason=fields.text(message.reason, limits.MAX_DETAIL))


def _read_delays(message: pb.Delays) -> Delays:
    return Delays(fields.time(message.median_ns), fields.time(message.p99_ns))


def _read_report(message: pb.LinkReport) -> LinkReport:
    return LinkReport(
        number=fields.whole(message.number, 1, 2**64),
        until_ns=fields.time(message.until_ns),
        span_ns=fields.length(message.span_ns),
        forces=message.forces,
        late_server=message.late_server,
        late_network=message.late_network,
        late_engine=message.late_engine,
        worst_late_ns=fields.length(message.worst_late_ns),
        longest_gap_ns=fields.length(message.longest_gap_ns),
        round_trip=_read_delays(message.round_trip) if message.HasField("round_trip") else None,
        to_server=_read_delays(message.to_server) if message.HasField("to_server") else None,
        to_client=_read_delays(message.to_client) if message.HasField("to_client") else None,
        clock_offset_ns=fields.time(message.clock_offset_ns),
        clock_drift_ppm=fields.number(message.clock_drift_ppm),
        clock_error_ns=fields.length(message.clock_error_ns),
        received=message.received,
        lost=message.lost,
        reordered=message.reordered,
        duplicated=message.duplicated,
        words=fields.text(message.words, limits.MAX_DETAIL),
        late_unknown=message.late_unknown,
        refused_not_finite=message.refused_not_finite,
        refused_out_of_bounds=message.refused_out_of_bounds,
        refused_unknown_tick=message.refused_unknown_tick,
        refused_old_sequence=message.refused_old_sequence,
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
        words=fields.clip(report.words, limits.MAX_DETAIL),
        late_unknown=report.late_unknown,
        refused_not_finite=report.refused_not_finite,
        refused_out_of_bounds=report.refused_out_of_bounds,
        refused_unknown_tick=report.refused_unknown_tick,
        refused_old_sequence=report.refused_old_sequence,
    )


def _read_device_report(message: pb.DeviceReport) -> DeviceReport:
    steps, lateness = message.steps, tuple(message.lateness_us_log2)
    fields.whole(len(lateness), 0, limits.LATENESS_BUCKETS)
    fields.whole(sum(lateness), 0, steps)
    return DeviceReport(
        number=fields.whole(message.number, 1, 2**64),
        until_ns=fields.time(message.until_ns),
        span_ns=fields.length(message.span_ns),
        device=fields.device(message.device),
        steps=steps,
        missed=message.missed,
        overruns=fields.whole(message.overruns, 0, steps),
        unseen=fields.whole(message.unseen, 0, steps),
        lateness=lateness,
        safety=fields.enum(fields.SAFETY, message.safety),
        fault=fields.text(message.fault, limits.MAX_DETAIL),
        degraded=fields.text(message.degraded, limits.MAX_DETAIL),
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
        fault=fields.clip(report.fault, limits.MAX_DETAIL),
        degraded=fields.clip(report.degraded, limits.MAX_DETAIL),
    )


def _read_peer_report(message: pb.PeerReport) -> PeerReport:
    if not message.HasField("link"):
        raise fields.OutOfBounds
    return PeerReport(
        device=fields.device(message.device),
        channel=fields.channel(message.channel),
        name=fields.text(message.name, limits.MAX_NAME),
        state_one_in=fields.whole(message.state_one_in, 1, limits.MAX_ONE_IN),
        forces_refused=message.forces_refused,
        link=_read_report(message.link),
        error=fields.magnitude(message.error_n) if message.HasField("error_n") else None,
        way=fields.text(message.way, limits.MAX_LABEL),
    )


def _write_peer_report(report: PeerReport) -> pb.PeerReport:
    return pb.PeerReport(
        device=report.device,
        channel=report.channel,
        name=fields.clip(report.name, limits.MAX_NAME),
        state_one_in=report.state_one_in,
        forces_refused=report.forces_refused,
        link=_write_report(report.link),
        error_n=report.error,
        way=fields.clip(report.way, limits.MAX_LABEL),
    )


def _write_vector(vector: Vec3) -> pb.Vec3:
    return pb.Vec3(x=vector[0], y=vector[1], z=vector[2])


def _write_quaternion(q: Quat) -> pb.Quat:
    return pb.Quat(w=q[0], x=q[1], y=q[2], z=q[3])


def _write_control(frame: Control) -> pb.Control:
    control, request = pb.Control(id=frame.id), frame.request
    if isinstance(request, SetStateRate):
        control.set_state_rate.CopyFrom(pb.SetStateRate(hz=request.hz, device=request.device))
    elif isinstance(request, Rearm):
        control.rearm.CopyFrom(pb.Rearm(device=request.device))
    elif isinstance(request, Disarm):
        control.disarm.CopyFrom(pb.Disarm(device=request.device))
    elif isinstance(request, Describe):
        control.describe.CopyFrom(pb.Describe(device=request.device, handle=request.handle))
    elif isinstance(request, TakeLease):
        control.take_lease.CopyFrom(pb.TakeLease(device=request.device, channel=request.channel))
    elif isinstance(request, GiveLease):
        control.give_lease.CopyFrom(pb.GiveLease(device=request.device, channel=request.channel))
    elif isinstance(request, LeaseLost):
        to = fields.clip(request.to, limits.MAX_NAME)
        control.lease_lost.CopyFrom(pb.LeaseLost(device=request.device, channel=request.channel, to=to))
    elif isinstance(request, SetStateDeadband):
        control.set_state_deadband.CopyFrom(
            pb.SetStateDeadband(share=request.share, floor_mps=request.floor, max_silence_us=request.max_silence_us)
        )
    elif isinstance(request, Couple):
        control.couple.CopyFrom(ports.write_couple(request))
    elif isinstance(request, Engage):
        control.engage.CopyFrom(pb.Engage(device=request.device))
    elif isinstance(request, Disengage):
        control.disengage.CopyFrom(pb.Disengage(device=request.device))
    elif isinstance(request, SetOutput):
        control.set_output.CopyFrom(_write_set_output(request))
    elif isinstance(request, SetScale):
        position, force = request.position_scale, request.force_scale
        control.set_scale.CopyFrom(pb.SetScale(device=request.device, position_scale=position, force_scale=force))
    elif isinstance(request, SetShare):
        control.set_share.CopyFrom(pb.SetShare(device=request.device, channel=request.channel, share=request.share))
    return control


def _write_set_output(request: SetOutput) -> pb.SetOutput:
    setting = request.setting
    if isinstance(setting, LampColour):
        return pb.SetOutput(device=request.device, output=request.output, rgb=setting.rgb)
    pulse = pb.Vibration(amplitude=setting.amplitude, frequency_hz=setting.frequency, duration_ms=setting.duration_ms)
    return pb.SetOutput(device=request.device, output=request.output, vibration=pulse)


def write_into(piece: pb.Frame, frame: Frame) -> None:
    """Into an empty one."""
    if isinstance(frame, ForceCommand):
        _write_force(piece.force, frame)  # in its place: messages that are put into each other are copied
    else:
        piece.CopyFrom(_write(frame))


def _write_force(message: pb.ForceCommand, frame: ForceCommand) -> None:
    message.sequence = frame.sequence
    message.based_on_tick = frame.based_on_tick
    force = message.force_n
    force.x, force.y, force.z = frame.force
    force.SetInParent()  # where all of it is zero
    message.valid_for_us = frame.valid_for_us
    if frame.device:
        message.device = frame.device
    if frame.channel:
        message.channel = frame.channel
    if frame.model is not None:
        message.model.CopyFrom(_write_model(frame.model))
    if frame.topology_changed:
        message.topology_changed = True
    if frame.error is not None:
        message.error_n = frame.error
    if frame.torque is not None:
        message.torque_nm.CopyFrom(_write_vector(frame.torque.torque))
        if frame.torque.model is not None:
            message.rotation_model.CopyFrom(_write_rotation_model(frame.torque.model))
    if frame.grip_force is not None:
        message.gripper_force_n = frame.grip_force
    if frame.way:
        message.way = frame.way


def _write(frame: Frame) -> pb.Frame:
    if isinstance(frame, DeviceState):
        turning = frame.turning
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
            stiffness_wanted_npm=None if frame.stiffness_wanted is None else fields.entries(frame.stiffness_wanted),
            buttons=frame.buttons,
            orientation=None if turning is None else _write_quaternion(turning.orientation),
            angular_velocity_radps=None if turning is None else _write_vector(turning.angular_velocity),
            torque_applied_nm=None if frame.torque_applied is None else _write_vector(frame.torque_applied),
            gripper_rad=None if frame.grip is None else frame.grip.opening,
            gripper_velocity_radps=None if frame.grip is None else frame.grip.velocity,
            gripper_force_applied_n=frame.grip_applied,
            hand_force_n=None if frame.hand_force is None else _write_vector(frame.hand_force),
            joint_rad=None if frame.joints is None else frame.joints.angles,
            joint_velocity_radps=None if frame.joints is None else frame.joints.velocities,
        )
        return pb.Frame(state=state)
    if isinstance(frame, Control):
        return pb.Frame(control=_write_control(frame))
    if isinstance(frame, ControlAck):
        ack = pb.ControlAck(
            id=frame.id,
            code=cast(pb.Code, frame.code),
            detail=fields.clip(frame.detail, limits.MAX_DETAIL),
            wait_ms=frame.wait_ms,
            device=None if frame.device is None else _write_description(frame.device),
            handle=None if frame.handle is None else _write_handle(frame.handle),
        )
        return pb.Frame(control_ack=ack)
    if isinstance(frame, LinkReport):
        return pb.Frame(report=_write_report(frame))
    if isinstance(frame, DeviceReport):
        return pb.Frame(device_report=_write_device_report(frame))
    if isinstance(frame, PeerReport):
        return pb.Frame(peer_report=_write_peer_report(frame))
    if isinstance(frame, PortState):
        return pb.Frame(port_state=ports.write_port(frame))
    assert isinstance(frame, Bye)
    bye = pb.Bye(code=cast(pb.Code, frame.code), reason=fields.clip(frame.reason, limits.MAX_DETAIL))
    return pb.Frame(bye=bye)


def read(message: pb.Frame) -> Frame | None:
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
    if body == "port_state":
        return ports.read_port(message.port_state)
    return None  # a frame of a newer peer

# SPDX-License-Identifier: Apache-2.0
# Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
"""The messages of tendon.proto: values to protobuf messages and back."""

from __future__ import annotations

from math import inf

from .. import tendon_pb2 as pb
from ..generated import (
    Answer,
    Bye,
    ChannelDescription,
    ChannelRule,
    Claim,
    Code,
    Contact,
    ControlAck,
    Couple,
    CouplingMethod,
    Delays,
    Describe,
    DeviceDescription,
    DeviceReport,
    DeviceState,
    Disarm,
    Disengage,
    DropField,
    Echo,
    Engage,
    FieldBrick,
    FieldDepthTable,
    FieldFixture,
    FieldFixtureKind,
    FieldMaterial,
    FieldPose,
    FieldState,
    FieldStatus,
    ForceCommand,
    ForceTable,
    GiveLease,
    Grant,
    Grip,
    Hand,
    HandleDescription,
    Hello,
    Joints,
    LampColour,
    LeaseLost,
    LinkReport,
    LocalModel,
    Mode,
    OfferField,
    OutputDescription,
    OutputKind,
    PeerReport,
    PlainFrame,
    PortGrip,
    PortPhase,
    PortRole,
    PortState,
    PortSurface,
    PortTurn,
    RateControl,
    Rearm,
    Refused,
    Request,
    Role,
    RotationModel,
    Safety,
    SetOutput,
    SetScale,
    SetShare,
    SetStateDeadband,
    SetStateRate,
    TakeLease,
    Torque,
    Turning,
    UseField,
    Vibration,
    Welcome,
    ZERO,
)
from .fields import (
    OutOfBounds,
    clip,
    entries,
    read_box,
    read_counts,
    read_each,
    read_inner,
    read_matrix,
    read_normal,
    read_numbers,
    read_padded,
    read_rotation,
    read_text,
    read_texts,
    read_vector,
    write_rotation,
    write_vector,
)

_MODE = {int(value): value for value in Mode}
_FIELD_FIXTURE_KIND = {int(value): value for value in FieldFixtureKind}
_PORT_ROLE = {int(value): value for value in PortRole}
_COUPLING_METHOD = {int(value): value for value in CouplingMethod}
_OUTPUT_KIND = {int(value): value for value in OutputKind}
_HAND = {int(value): value for value in Hand}
_CHANNEL_RULE = {int(value): value for value in ChannelRule}
_PORT_PHASE = {int(value): value for value in PortPhase}
_SAFETY = {int(value): value for value in Safety}
_CODE = {int(value): value for value in Code}
_ROLE = {int(value): value for value in Role}


def read_echo(m: pb.Echo) -> Echo:
    peer_tx_time_ns = m.peer_tx_time_ns
    if not -(2**60) <= peer_tx_time_ns <= 2**60:
        raise OutOfBounds("peer_tx_time_ns")
    rx_time_ns = m.rx_time_ns
    if not -(2**60) <= rx_time_ns <= 2**60:
        raise OutOfBounds("rx_time_ns")
    return Echo(peer_tx_time_ns, rx_time_ns, m.peer_packet_number, m.received_mask)


def write_echo(m: pb.Echo, value: Echo) -> None:
    m.peer_tx_time_ns = value.sent_ns
    m.rx_time_ns = value.received_ns
    m.peer_packet_number = value.packet_number
    if value.received_mask:
        m.received_mask = value.received_mask


def read_device_state(m: pb.DeviceState) -> DeviceState:
    sampled_ns = m.sampled_ns
    if not -(2**60) <= sampled_ns <= 2**60:
        raise OutOfBounds("sampled_ns")
    position_m = read_vector("position_m", m.position_m)
    velocity_mps = read_vector("velocity_mps", m.velocity_mps)
    force_applied_n = read_vector("force_applied_n", m.force_applied_n)
    energy_j = m.energy_j
    if not -1e12 <= energy_j <= 1e12:
        raise OutOfBounds("energy_j")
    permitted_force_n = m.permitted_force_n
    if not (0 <= permitted_force_n <= 1e12 or permitted_force_n == inf):
        raise OutOfBounds("permitted_force_n")
    force_age_ns = m.force_age_ns
    if force_age_ns > 2**60:
        raise OutOfBounds("force_age_ns")
    mode = _MODE.get(m.mode)
    if mode is None:
        raise OutOfBounds("mode")
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    force_wanted_n = read_vector("force_wanted_n", m.force_wanted_n) if m.HasField("force_wanted_n") else None
    orientation = read_rotation("orientation", m.orientation) if m.HasField("orientation") else None
    angular_velocity_radps = (
        read_vector("angular_velocity_radps", m.angular_velocity_radps)
        if m.HasField("angular_velocity_radps") else ZERO
    )
    torque_applied_nm = (
        read_vector("torque_applied_nm", m.torque_applied_nm)
        if m.HasField("torque_applied_nm") else None
    )
    gripper_rad = m.gripper_rad if m.HasField("gripper_rad") else None
    if gripper_rad is not None and not -1e12 <= gripper_rad <= 1e12:
        raise OutOfBounds("gripper_rad")
    gripper_velocity_radps = m.gripper_velocity_radps
    if not -1e12 <= gripper_velocity_radps <= 1e12:
        raise OutOfBounds("gripper_velocity_radps")
    gripper_force_applied_n = m.gripper_force_applied_n if m.HasField("gripper_force_applied_n") else None
    if gripper_force_applied_n is not None and not -1e12 <= gripper_force_applied_n <= 1e12:
        raise OutOfBounds("gripper_force_applied_n")
    hand_force_n = read_vector("hand_force_n", m.hand_force_n) if m.HasField("hand_force_n") else None
    joint_rad = read_numbers("joint_rad", m.joint_rad, 0, 8, -1e12, 1e12) if m.joint_rad else ()
    joint_velocity_radps = (
        read_numbers("joint_velocity_radps", m.joint_velocity_radps, 0, 8, -1e12, 1e12)
        if m.joint_velocity_radps else ()
    )
    stiffness_wanted_npm = (
        read_matrix("stiffness_wanted_npm", m.stiffness_wanted_npm)
        if m.stiffness_wanted_npm else None
    )
    field_depth_m = m.field_depth_m
    if not 0 <= field_depth_m <= 1e12:
        raise OutOfBounds("field_depth_m")
    field_proxy_m = read_vector("field_proxy_m", m.field_proxy_m) if m.HasField("field_proxy_m") else ZERO
    return DeviceState(
        m.tick,
        sampled_ns,
        position_m,
        velocity_mps,
        force_applied_n,
        energy_j,
        permitted_force_n,
        m.reasons,
        m.force_sequence,
        force_age_ns,
        mode,
        device,
        channel,
        force_wanted_n,
        stiffness_wanted_npm,
        m.buttons,
        None if orientation is None else Turning(orientation, angular_velocity_radps),
        torque_applied_nm,
        None if gripper_rad is None else Grip(gripper_rad, gripper_velocity_radps),
        gripper_force_applied_n,
        hand_force_n,
        Joints(joint_rad, read_padded(joint_velocity_radps, len(joint_rad))) if joint_rad else None,
        FieldState(m.field, field_depth_m, field_proxy_m) if m.field else None,
    )


def write_device_state(m: pb.DeviceState, value: DeviceState) -> None:
    m.tick = value.tick
    m.sampled_ns = value.sampled_ns
    write_vector(m.position_m, value.position)
    write_vector(m.velocity_mps, value.velocity)
    write_vector(m.force_applied_n, value.force_applied)
    m.energy_j = value.energy
    m.permitted_force_n = value.permitted_force
    m.reasons = value.reasons
    m.force_sequence = value.force_sequence
    m.force_age_ns = value.force_age_ns
    m.mode = value.mode  # type: ignore[assignment]
    if value.device:
        m.device = value.device
    if value.channel:
        m.channel = value.channel
    if value.force_wanted is not None:
        write_vector(m.force_wanted_n, value.force_wanted)
    if value.stiffness_wanted is not None:
        m.stiffness_wanted_npm.extend(entries(value.stiffness_wanted))
    if value.buttons:
        m.buttons = value.buttons
    if value.turning is not None:
        write_rotation(m.orientation, value.turning.orientation)
        write_vector(m.angular_velocity_radps, value.turning.angular_velocity)
    if value.torque_applied is not None:
        write_vector(m.torque_applied_nm, value.torque_applied)
    if value.grip is not None:
        m.gripper_rad = value.grip.opening
        m.gripper_velocity_radps = value.grip.velocity
    if value.grip_applied is not None:
        m.gripper_force_applied_n = value.grip_applied
    if value.hand_force is not None:
        write_vector(m.hand_force_n, value.hand_force)
    if value.joints is not None:
        m.joint_rad.extend(value.joints.angles)
        m.joint_velocity_radps.extend(value.joints.velocities)
    if value.field is not None:
        m.field = value.field.generation
        m.field_depth_m = value.field.depth
        write_vector(m.field_proxy_m, value.field.proxy)


def read_force_table(m: pb.ForceTable) -> ForceTable:
    first_depth_m = m.first_depth_m
    if not -1e12 <= first_depth_m <= 1e12:
        raise OutOfBounds("first_depth_m")
    step_m = m.step_m
    if not 0 < step_m <= 1e12:
        raise OutOfBounds("step_m")
    force_n = read_numbers("force_n", m.force_n, 2, 16, -1e12, 1e12)
    return ForceTable(first_depth_m, step_m, force_n)


def write_force_table(m: pb.ForceTable, value: ForceTable) -> None:
    m.first_depth_m = value.first
    m.step_m = value.step
    m.force_n.extend(value.force)


def read_contact(m: pb.Contact) -> Contact:
    normal = read_normal("normal", m.normal)
    gap_m = m.gap_m
    if not -1e12 <= gap_m <= 1e12:
        raise OutOfBounds("gap_m")
    table = read_force_table(m.table) if m.HasField("table") else None
    return Contact(normal, gap_m, table)


def write_contact(m: pb.Contact, value: Contact) -> None:
    write_vector(m.normal, value.normal)
    m.gap_m = value.gap
    if value.table is not None:
        m.table.SetInParent()
        write_force_table(m.table, value.table)


def read_local_model(m: pb.LocalModel) -> LocalModel:
    at_m = read_vector("at_m", m.at_m)
    stiffness_npm = read_matrix("stiffness_npm", m.stiffness_npm)
    valid_radius_m = m.valid_radius_m if m.HasField("valid_radius_m") else inf
    if not (0 <= valid_radius_m <= 1e12 or valid_radius_m == inf):
        raise OutOfBounds("valid_radius_m")
    contact = read_contact(m.contact) if m.HasField("contact") else None
    return LocalModel(at_m, stiffness_npm, valid_radius_m, contact)


def write_local_model(m: pb.LocalModel, value: LocalModel) -> None:
    write_vector(m.at_m, value.at)
    m.stiffness_npm.extend(entries(value.stiffness))
    if value.valid_radius != inf:
        m.valid_radius_m = value.valid_radius
    if value.contact is not None:
        m.contact.SetInParent()
        write_contact(m.contact, value.contact)


def read_rotation_model(m: pb.RotationModel) -> RotationModel:
    at_orientation = read_rotation("at_orientation", m.at_orientation)
    angular_stiffness_nmprad = read_matrix("angular_stiffness_nmprad", m.angular_stiffness_nmprad)
    return RotationModel(at_orientation, angular_stiffness_nmprad)


def write_rotation_model(m: pb.RotationModel, value: RotationModel) -> None:
    write_rotation(m.at_orientation, value.at)
    m.angular_stiffness_nmprad.extend(entries(value.stiffness))


def read_force_command(m: pb.ForceCommand) -> ForceCommand:
    sequence = m.sequence
    if sequence < 1:
        raise OutOfBounds("sequence")
    force_n = read_vector("force_n", m.force_n)
    model = read_local_model(m.model) if m.HasField("model") else None
    valid_for_us = m.valid_for_us
    if not 1 <= valid_for_us <= 10_000_000:
        raise OutOfBounds("valid_for_us")
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    error_n = m.error_n if m.HasField("error_n") else None
    if error_n is not None and not 0 <= error_n <= 1e12:
        raise OutOfBounds("error_n")
    torque_nm = read_vector("torque_nm", m.torque_nm) if m.HasField("torque_nm") else None
    gripper_force_n = m.gripper_force_n if m.HasField("gripper_force_n") else None
    if gripper_force_n is not None and not -1e12 <= gripper_force_n <= 1e12:
        raise OutOfBounds("gripper_force_n")
    rotation_model = read_rotation_model(m.rotation_model) if m.HasField("rotation_model") else None
    way = m.way
    if way > 8:
        raise OutOfBounds("way")
    return ForceCommand(
        sequence,
        m.based_on_tick,
        force_n,
        valid_for_us,
        model,
        device,
        channel,
        m.topology_changed,
        error_n,
        None if torque_nm is None and rotation_model is None else Torque(torque_nm or ZERO, rotation_model),
        gripper_force_n,
        way,
        m.field,
    )


def write_force_command(m: pb.ForceCommand, value: ForceCommand) -> None:
    m.sequence = value.sequence
    m.based_on_tick = value.based_on_tick
    write_vector(m.force_n, value.force)
    m.valid_for_us = value.valid_for_us
    if value.model is not None:
        m.model.SetInParent()
        write_local_model(m.model, value.model)
    if value.device:
        m.device = value.device
    if value.channel:
        m.channel = value.channel
    if value.topology_changed:
        m.topology_changed = value.topology_changed
    if value.error is not None:
        m.error_n = value.error
    if value.torque is not None:
        write_vector(m.torque_nm, value.torque.torque)
        if value.torque.model is not None:
            m.rotation_model.SetInParent()
            write_rotation_model(m.rotation_model, value.torque.model)
    if value.grip_force is not None:
        m.gripper_force_n = value.grip_force
    if value.way:
        m.way = value.way
    if value.field:
        m.field = value.field


def read_offer_field(m: pb.OfferField) -> OfferField:
    field = m.field
    if not len(field) == 32:
        raise OutOfBounds("field")
    size = m.size
    if not 1 <= size <= 65_535:
        raise OutOfBounds("size")
    offset = m.offset
    if offset > 65_535:
        raise OutOfBounds("offset")
    part = m.part
    if not 1 <= len(part) <= 1000:
        raise OutOfBounds("part")
    return OfferField(field, size, offset, part)


def write_offer_field(m: pb.OfferField, value: OfferField) -> None:
    m.field = value.field[:32]
    m.size = value.size
    m.offset = value.offset
    m.part = value.part[:1000]


def read_field_material(m: pb.FieldMaterial) -> FieldMaterial:
    stiffness_npm = m.stiffness_npm
    if not 0 < stiffness_npm <= 1e12:
        raise OutOfBounds("stiffness_npm")
    branch_stiffness_npm = m.branch_stiffness_npm
    if not 0 <= branch_stiffness_npm <= 1e12:
        raise OutOfBounds("branch_stiffness_npm")
    relaxation_s = m.relaxation_s
    if not (0.01 <= relaxation_s <= 10 or relaxation_s == 0):
        raise OutOfBounds("relaxation_s")
    friction = m.friction
    if not 0 <= friction <= 2:
        raise OutOfBounds("friction")
    return FieldMaterial(stiffness_npm, branch_stiffness_npm, relaxation_s, friction)


def write_field_material(m: pb.FieldMaterial, value: FieldMaterial) -> None:
    m.stiffness_npm = value.stiffness
    m.branch_stiffness_npm = value.branch_stiffness
    m.relaxation_s = value.relaxation
    m.friction = value.friction


def read_field_fixture(m: pb.FieldFixture) -> FieldFixture:
    kind = _FIELD_FIXTURE_KIND.get(m.kind)
    if kind is None:
        raise OutOfBounds("kind")
    at_m = read_vector("at_m", m.at_m)
    normal = read_normal("normal", m.normal)
    stiffness_npm = m.stiffness_npm
    if not 0 < stiffness_npm <= 1e12:
        raise OutOfBounds("stiffness_npm")
    most_force_n = m.most_force_n if m.HasField("most_force_n") else None
    if most_force_n is not None and not 0 < most_force_n <= 1e12:
        raise OutOfBounds("most_force_n")
    return FieldFixture(kind, at_m, normal, stiffness_npm, most_force_n)


def write_field_fixture(m: pb.FieldFixture, value: FieldFixture) -> None:
    m.kind = value.kind  # type: ignore[assignment]
    write_vector(m.at_m, value.at)
    write_vector(m.normal, value.normal)
    m.stiffness_npm = value.stiffness
    if value.most_force is not None:
        m.most_force_n = value.most_force


def read_field_depth_table(m: pb.FieldDepthTable) -> FieldDepthTable:
    material = m.material
    if material > 7:
        raise OutOfBounds("material")
    step_m = m.step_m
    if not 0.0001 <= step_m <= 0.1:
        raise OutOfBounds("step_m")
    force_n = read_numbers("force_n", m.force_n, 1, 16, -1e12, 1e12)
    return FieldDepthTable(material, step_m, force_n)


def write_field_depth_table(m: pb.FieldDepthTable, value: FieldDepthTable) -> None:
    m.material = value.material
    m.step_m = value.step
    m.force_n.extend(value.force)


def read_use_field(m: pb.UseField) -> UseField:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    generation = m.generation
    if generation < 1:
        raise OutOfBounds("generation")
    field = m.field
    if not len(field) == 32:
        raise OutOfBounds("field")
    materials = read_each("materials", m.materials, 1, 8, read_field_material)
    fixtures = read_each("fixtures", m.fixtures, 0, 4, read_field_fixture)
    tables = read_each("tables", m.tables, 0, 3, read_field_depth_table)
    return UseField(device, channel, generation, field, materials, fixtures, tables)


def write_use_field(m: pb.UseField, value: UseField) -> None:
    m.device = value.device
    m.channel = value.channel
    m.generation = value.generation
    m.field = value.field[:32]
    for material in value.materials[:8]:
        write_field_material(m.materials.add(), material)
    for fixture in value.fixtures[:4]:
        write_field_fixture(m.fixtures.add(), fixture)
    for table in value.tables[:3]:
        write_field_depth_table(m.tables.add(), table)


def read_drop_field(m: pb.DropField) -> DropField:
    field = m.field
    if not len(field) == 32:
        raise OutOfBounds("field")
    return DropField(field)


def write_drop_field(m: pb.DropField, value: DropField) -> None:
    m.field = value.field[:32]


def read_field_brick(m: pb.FieldBrick) -> FieldBrick:
    hash = m.hash
    if not len(hash) == 16:
        raise OutOfBounds("hash")
    weights = m.weights
    if not len(weights) == 1024:
        raise OutOfBounds("weights")
    return FieldBrick(hash, weights)


def write_field_brick(m: pb.FieldBrick, value: FieldBrick) -> None:
    m.hash = value.hash[:16]
    m.weights = value.weights[:1024]


def read_field_status(m: pb.FieldStatus) -> FieldStatus:
    field = m.field
    if not len(field) == 32:
        raise OutOfBounds("field")
    missing = m.missing
    if len(missing) > 128:
        raise OutOfBounds("missing")
    return FieldStatus(field, missing)


def write_field_status(m: pb.FieldStatus, value: FieldStatus) -> None:
    m.field = value.field[:32]
    m.missing = value.missing[:128]


def read_field_pose(m: pb.FieldPose) -> FieldPose:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    sequence = m.sequence
    if sequence < 1:
        raise OutOfBounds("sequence")
    time_ns = m.time_ns
    if not -(2**60) <= time_ns <= 2**60:
        raise OutOfBounds("time_ns")
    position_m = read_vector("position_m", m.position_m)
    orientation = read_rotation("orientation", m.orientation)
    velocity_mps = read_vector("velocity_mps", m.velocity_mps)
    angular_velocity_radps = read_vector("angular_velocity_radps", m.angular_velocity_radps)
    return FieldPose(device, channel, sequence, time_ns, position_m, orientation, velocity_mps, angular_velocity_radps)


def write_field_pose(m: pb.FieldPose, value: FieldPose) -> None:
    m.device = value.device
    m.channel = value.channel
    m.sequence = value.sequence
    m.time_ns = value.time_ns
    write_vector(m.position_m, value.position)
    write_rotation(m.orientation, value.orientation)
    write_vector(m.velocity_mps, value.velocity)
    write_vector(m.angular_velocity_radps, value.angular_velocity)


def read_set_state_rate(m: pb.SetStateRate) -> SetStateRate:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    return SetStateRate(m.hz, device)


def write_set_state_rate(m: pb.SetStateRate, value: SetStateRate) -> None:
    m.hz = value.hz
    if value.device:
        m.device = value.device


def read_set_state_deadband(m: pb.SetStateDeadband) -> SetStateDeadband:
    share = m.share
    if not -1e12 <= share <= 1e12:
        raise OutOfBounds("share")
    floor_mps = m.floor_mps
    if not -1e12 <= floor_mps <= 1e12:
        raise OutOfBounds("floor_mps")
    return SetStateDeadband(share, floor_mps, m.max_silence_us)


def write_set_state_deadband(m: pb.SetStateDeadband, value: SetStateDeadband) -> None:
    m.share = value.share
    m.floor_mps = value.floor
    if value.max_silence_us:
        m.max_silence_us = value.max_silence_us


def read_rearm(m: pb.Rearm) -> Rearm:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    return Rearm(device)


def write_rearm(m: pb.Rearm, value: Rearm) -> None:
    if value.device:
        m.device = value.device


def read_disarm(m: pb.Disarm) -> Disarm:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    return Disarm(device)


def write_disarm(m: pb.Disarm, value: Disarm) -> None:
    if value.device:
        m.device = value.device


def read_rate_control(m: pb.RateControl) -> RateControl:
    dead_zone_m = m.dead_zone_m
    if not 0 <= dead_zone_m <= 1e12:
        raise OutOfBounds("dead_zone_m")
    gain_per_s = m.gain_per_s
    if not 0 < gain_per_s <= 1e12:
        raise OutOfBounds("gain_per_s")
    max_speed_mps = m.max_speed_mps
    if not 0 < max_speed_mps <= 1e12:
        raise OutOfBounds("max_speed_mps")
    return RateControl(dead_zone_m, gain_per_s, max_speed_mps)


def write_rate_control(m: pb.RateControl, value: RateControl) -> None:
    m.dead_zone_m = value.dead_zone
    m.gain_per_s = value.gain
    m.max_speed_mps = value.max_speed


def read_couple(m: pb.Couple) -> Couple:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    role = _PORT_ROLE.get(m.role)
    if role is None:
        raise OutOfBounds("role")
    method = _COUPLING_METHOD.get(m.method)
    if method is None:
        raise OutOfBounds("method")
    position_scale = m.position_scale
    if not 0.01 <= position_scale <= 100:
        raise OutOfBounds("position_scale")
    force_scale = m.force_scale
    if not 0.01 <= force_scale <= 100:
        raise OutOfBounds("force_scale")
    rotation = read_rotation("rotation", m.rotation)
    axes = m.axes
    if not 1 <= axes <= 7:
        raise OutOfBounds("axes")
    stiffness_npm = m.stiffness_npm
    if not 0 <= stiffness_npm <= 1e12:
        raise OutOfBounds("stiffness_npm")
    mutual_damping_nspm = m.mutual_damping_nspm
    if not 0 <= mutual_damping_nspm <= 1e12:
        raise OutOfBounds("mutual_damping_nspm")
    damping_nspm = m.damping_nspm
    if not 0 <= damping_nspm <= 1e12:
        raise OutOfBounds("damping_nspm")
    period_us = m.period_us
    if not 1 <= period_us <= 10_000_000:
        raise OutOfBounds("period_us")
    turn_stiffness_nmprad = m.turn_stiffness_nmprad
    if not 0 <= turn_stiffness_nmprad <= 1e12:
        raise OutOfBounds("turn_stiffness_nmprad")
    turn_damping_nmsprad = m.turn_damping_nmsprad
    if not 0 <= turn_damping_nmsprad <= 1e12:
        raise OutOfBounds("turn_damping_nmsprad")
    grip_stiffness_npm = m.grip_stiffness_npm
    if not 0 <= grip_stiffness_npm <= 1e12:
        raise OutOfBounds("grip_stiffness_npm")
    grip_damping_nspm = m.grip_damping_nspm
    if not 0 <= grip_damping_nspm <= 1e12:
        raise OutOfBounds("grip_damping_nspm")
    drift_rate_per_s = m.drift_rate_per_s
    if not 0 <= drift_rate_per_s <= 1e12:
        raise OutOfBounds("drift_rate_per_s")
    rate = read_inner("rate", read_rate_control, m.rate) if m.HasField("rate") else None
    return Couple(
        device,
        channel,
        role,
        method,
        position_scale,
        force_scale,
        rotation,
        axes,
        stiffness_npm,
        mutual_damping_nspm,
        damping_nspm,
        m.adapt_to_delay,
        m.purse,
        period_us,
        m.absolute,
        turn_stiffness_nmprad,
        turn_damping_nmsprad,
        grip_stiffness_npm,
        grip_damping_nspm,
        drift_rate_per_s,
        rate,
    )


def write_couple(m: pb.Couple, value: Couple) -> None:
    m.device = value.device
    m.channel = value.channel
    m.role = value.role  # type: ignore[assignment]
    m.method = value.method  # type: ignore[assignment]
    m.position_scale = value.position_scale
    m.force_scale = value.force_scale
    write_rotation(m.rotation, value.rotation)
    m.axes = value.axes
    m.stiffness_npm = value.stiffness
    m.mutual_damping_nspm = value.mutual_damping
    m.damping_nspm = value.damping
    m.adapt_to_delay = value.adapt_to_delay
    m.purse = value.purse
    m.period_us = value.period_us
    if value.absolute:
        m.absolute = value.absolute
    m.turn_stiffness_nmprad = value.turn_stiffness
    m.turn_damping_nmsprad = value.turn_damping
    m.grip_stiffness_npm = value.grip_stiffness
    m.grip_damping_nspm = value.grip_damping
    m.drift_rate_per_s = value.drift_rate
    if value.rate is not None:
        m.rate.SetInParent()
        write_rate_control(m.rate, value.rate)


def read_engage(m: pb.Engage) -> Engage:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    return Engage(device)


def write_engage(m: pb.Engage, value: Engage) -> None:
    if value.device:
        m.device = value.device


def read_disengage(m: pb.Disengage) -> Disengage:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    return Disengage(device)


def write_disengage(m: pb.Disengage, value: Disengage) -> None:
    if value.device:
        m.device = value.device


def read_set_scale(m: pb.SetScale) -> SetScale:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    position_scale = m.position_scale
    if not 0.01 <= position_scale <= 100:
        raise OutOfBounds("position_scale")
    force_scale = m.force_scale
    if not 0.01 <= force_scale <= 100:
        raise OutOfBounds("force_scale")
    return SetScale(device, position_scale, force_scale)


def write_set_scale(m: pb.SetScale, value: SetScale) -> None:
    m.device = value.device
    m.position_scale = value.position_scale
    m.force_scale = value.force_scale


def read_set_share(m: pb.SetShare) -> SetShare:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    share = m.share
    if not 0 <= share <= 1:
        raise OutOfBounds("share")
    return SetShare(device, channel, share)


def write_set_share(m: pb.SetShare, value: SetShare) -> None:
    m.device = value.device
    m.channel = value.channel
    m.share = value.share


def read_vibration(m: pb.Vibration) -> Vibration:
    amplitude = m.amplitude
    if not 0 <= amplitude <= 1:
        raise OutOfBounds("amplitude")
    frequency_hz = m.frequency_hz
    if not 0 <= frequency_hz <= 1000:
        raise OutOfBounds("frequency_hz")
    if not (frequency_hz == 0 or frequency_hz >= 20):
        raise OutOfBounds("frequency_hz")
    duration_ms = m.duration_ms
    if duration_ms > 10_000:
        raise OutOfBounds("duration_ms")
    return Vibration(amplitude, frequency_hz, duration_ms)


def write_vibration(m: pb.Vibration, value: Vibration) -> None:
    m.amplitude = value.amplitude
    m.frequency_hz = value.frequency
    if value.duration_ms:
        m.duration_ms = value.duration_ms


def read_set_output(m: pb.SetOutput) -> SetOutput:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    case = m.WhichOneof("setting")
    if case is None:
        raise OutOfBounds("setting")
    output = m.output
    if output > 7:
        raise OutOfBounds("output")
    setting: LampColour | Vibration
    if case == "rgb":
        if m.rgb > 16_777_215:
            raise OutOfBounds("rgb")
        setting = LampColour(m.rgb)
    else:
        setting = read_inner("vibration", read_vibration, m.vibration)
    return SetOutput(device, output, setting)


def write_set_output(m: pb.SetOutput, value: SetOutput) -> None:
    m.device = value.device
    m.output = value.output
    if isinstance(value.setting, LampColour):
        m.rgb = value.setting.rgb
    else:
        m.vibration.SetInParent()
        write_vibration(m.vibration, value.setting)


def read_describe(m: pb.Describe) -> Describe:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    return Describe(device, m.handle)


def write_describe(m: pb.Describe, value: Describe) -> None:
    if value.device:
        m.device = value.device
    if value.handle:
        m.handle = value.handle


def read_take_lease(m: pb.TakeLease) -> TakeLease:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    return TakeLease(device, channel)


def write_take_lease(m: pb.TakeLease, value: TakeLease) -> None:
    if value.device:
        m.device = value.device
    if value.channel:
        m.channel = value.channel


def read_give_lease(m: pb.GiveLease) -> GiveLease:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    return GiveLease(device, channel)


def write_give_lease(m: pb.GiveLease, value: GiveLease) -> None:
    if value.device:
        m.device = value.device
    if value.channel:
        m.channel = value.channel


def read_lease_lost(m: pb.LeaseLost) -> LeaseLost:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    to = read_text("to", m.to, 64)
    return LeaseLost(device, channel, to)


def write_lease_lost(m: pb.LeaseLost, value: LeaseLost) -> None:
    if value.device:
        m.device = value.device
    if value.channel:
        m.channel = value.channel
    if value.to:
        m.to = clip(value.to, 64)


def read_channel_description(m: pb.ChannelDescription) -> ChannelDescription:
    name = read_text("name", m.name, 24)
    rule = _CHANNEL_RULE.get(m.rule)
    if rule is None:
        raise OutOfBounds("rule")
    lease_ms = m.lease_ms
    if lease_ms > 3_600_000:
        raise OutOfBounds("lease_ms")
    holder = read_text("holder", m.holder, 24)
    return ChannelDescription(name, rule, lease_ms, holder)


def write_channel_description(m: pb.ChannelDescription, value: ChannelDescription) -> None:
    m.name = clip(value.name, 24)
    m.rule = value.rule  # type: ignore[assignment]
    if value.lease_ms:
        m.lease_ms = value.lease_ms
    if value.holder:
        m.holder = clip(value.holder, 24)


def read_device_description(m: pb.DeviceDescription) -> DeviceDescription:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    name = read_text("name", m.name, 24)
    model = read_text("model", m.model, 64)
    position_dof = m.position_dof
    if not 1 <= position_dof <= 6:
        raise OutOfBounds("position_dof")
    force_dof = m.force_dof
    if not 1 <= force_dof <= 6:
        raise OutOfBounds("force_dof")
    workspace_min_m = read_vector("workspace_min_m", m.workspace_min_m) if m.HasField("workspace_min_m") else None
    workspace_max_m = read_vector("workspace_max_m", m.workspace_max_m) if m.HasField("workspace_max_m") else None
    max_force_n = m.max_force_n
    if not 0 <= max_force_n <= 1e12:
        raise OutOfBounds("max_force_n")
    continuous_force_n = m.continuous_force_n
    if not 0 <= continuous_force_n <= 1e12:
        raise OutOfBounds("continuous_force_n")
    max_stiffness_npm = m.max_stiffness_npm
    if not 0 <= max_stiffness_npm <= 1e12:
        raise OutOfBounds("max_stiffness_npm")
    position_resolution_m = m.position_resolution_m
    if not 0 <= position_resolution_m <= 1e12:
        raise OutOfBounds("position_resolution_m")
    loop_hz = m.loop_hz
    if not 1 <= loop_hz <= 1_000_000:
        raise OutOfBounds("loop_hz")
    channels = read_each("channels", m.channels, 1, 8, read_channel_description)
    return DeviceDescription(
        device,
        name,
        model,
        position_dof,
        force_dof,
        read_box("workspace_min_m", workspace_min_m, workspace_max_m),
        max_force_n,
        continuous_force_n,
        max_stiffness_npm,
        position_resolution_m,
        loop_hz,
        channels,
    )


def write_device_description(m: pb.DeviceDescription, value: DeviceDescription) -> None:
    m.device = value.device
    m.name = clip(value.name, 24)
    m.model = clip(value.model, 64)
    m.position_dof = value.position_dof
    m.force_dof = value.force_dof
    if value.workspace is not None:
        write_vector(m.workspace_min_m, value.workspace[0])
        write_vector(m.workspace_max_m, value.workspace[1])
    m.max_force_n = value.max_force
    m.continuous_force_n = value.continuous_force
    m.max_stiffness_npm = value.max_stiffness
    m.position_resolution_m = value.position_resolution
    m.loop_hz = value.loop_hz
    for channel in value.channels[:8]:
        write_channel_description(m.channels.add(), channel)


def read_output_description(m: pb.OutputDescription) -> OutputDescription:
    name = read_text("name", m.name, 24)
    kind = _OUTPUT_KIND.get(m.kind)
    if kind is None:
        raise OutOfBounds("kind")
    return OutputDescription(name, kind)


def write_output_description(m: pb.OutputDescription, value: OutputDescription) -> None:
    m.name = clip(value.name, 24)
    m.kind = value.kind  # type: ignore[assignment]


def read_handle_description(m: pb.HandleDescription) -> HandleDescription:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    operator_from_device = (
        read_rotation("operator_from_device", m.operator_from_device)
        if m.HasField("operator_from_device") else None
    )
    buttons = read_texts("buttons", m.buttons, 0, 16, 24)
    max_torque_nm = m.max_torque_nm
    if not 0 <= max_torque_nm <= 1e12:
        raise OutOfBounds("max_torque_nm")
    gripper_open_rad = m.gripper_open_rad if m.HasField("gripper_open_rad") else None
    if gripper_open_rad is not None and not 0 <= gripper_open_rad <= 1e12:
        raise OutOfBounds("gripper_open_rad")
    max_gripper_force_n = m.max_gripper_force_n
    if not 0 <= max_gripper_force_n <= 1e12:
        raise OutOfBounds("max_gripper_force_n")
    group = read_text("group", m.group, 24)
    hand = _HAND.get(m.hand)
    if hand is None:
        raise OutOfBounds("hand")
    joints = read_texts("joints", m.joints, 0, 8, 24)
    outputs = read_each("outputs", m.outputs, 0, 8, read_output_description)
    return HandleDescription(
        device,
        operator_from_device,
        buttons,
        m.orientation_measured,
        max_torque_nm,
        gripper_open_rad,
        max_gripper_force_n,
        group,
        hand,
        joints,
        outputs,
    )


def write_handle_description(m: pb.HandleDescription, value: HandleDescription) -> None:
    if value.device:
        m.device = value.device
    if value.operator_from_device is not None:
        write_rotation(m.operator_from_device, value.operator_from_device)
    m.buttons.extend(clip(text, 24) for text in value.buttons[:16])
    if value.orientation_measured:
        m.orientation_measured = value.orientation_measured
    m.max_torque_nm = value.max_torque
    if value.gripper_open is not None:
        m.gripper_open_rad = value.gripper_open
    m.max_gripper_force_n = value.max_gripper_force
    if value.group:
        m.group = clip(value.group, 24)
    m.hand = value.hand  # type: ignore[assignment]
    m.joints.extend(clip(text, 24) for text in value.joints[:8])
    for output in value.outputs[:8]:
        write_output_description(m.outputs.add(), output)


def read_control_ack(m: pb.ControlAck) -> ControlAck:
    id = m.id
    if id < 1:
        raise OutOfBounds("id")
    code = _CODE.get(m.code)
    if code is None:
        raise OutOfBounds("code")
    detail = read_text("detail", m.detail, 128)
    wait_ms = m.wait_ms
    if wait_ms > 3_600_000:
        raise OutOfBounds("wait_ms")
    device = read_device_description(m.device) if m.HasField("device") else None
    handle = read_handle_description(m.handle) if m.HasField("handle") else None
    return ControlAck(id, code, detail, wait_ms, device, handle)


def write_control_ack(m: pb.ControlAck, value: ControlAck) -> None:
    m.id = value.id
    m.code = value.code  # type: ignore[assignment]
    if value.detail:
        m.detail = clip(value.detail, 128)
    if value.wait_ms:
        m.wait_ms = value.wait_ms
    if value.device is not None:
        m.device.SetInParent()
        write_device_description(m.device, value.device)
    if value.handle is not None:
        m.handle.SetInParent()
        write_handle_description(m.handle, value.handle)


def read_bye(m: pb.Bye) -> Bye:
    code = _CODE.get(m.code)
    if code is None:
        raise OutOfBounds("code")
    reason = read_text("reason", m.reason, 128)
    return Bye(code, reason)


def write_bye(m: pb.Bye, value: Bye) -> None:
    m.code = value.code  # type: ignore[assignment]
    if value.reason:
        m.reason = clip(value.reason, 128)


def read_delays(m: pb.Delays) -> Delays:
    median_ns = m.median_ns
    if not -(2**60) <= median_ns <= 2**60:
        raise OutOfBounds("median_ns")
    p99_ns = m.p99_ns
    if not -(2**60) <= p99_ns <= 2**60:
        raise OutOfBounds("p99_ns")
    return Delays(median_ns, p99_ns)


def write_delays(m: pb.Delays, value: Delays) -> None:
    m.median_ns = value.median_ns
    m.p99_ns = value.p99_ns


def read_link_report(m: pb.LinkReport) -> LinkReport:
    number = m.number
    if number < 1:
        raise OutOfBounds("number")
    until_ns = m.until_ns
    if not -(2**60) <= until_ns <= 2**60:
        raise OutOfBounds("until_ns")
    span_ns = m.span_ns
    if span_ns > 2**60:
        raise OutOfBounds("span_ns")
    worst_late_ns = m.worst_late_ns
    if worst_late_ns > 2**60:
        raise OutOfBounds("worst_late_ns")
    longest_gap_ns = m.longest_gap_ns
    if longest_gap_ns > 2**60:
        raise OutOfBounds("longest_gap_ns")
    round_trip = read_delays(m.round_trip) if m.HasField("round_trip") else None
    to_server = read_delays(m.to_server) if m.HasField("to_server") else None
    to_client = read_delays(m.to_client) if m.HasField("to_client") else None
    clock_offset_ns = m.clock_offset_ns
    if not -(2**60) <= clock_offset_ns <= 2**60:
        raise OutOfBounds("clock_offset_ns")
    clock_drift_ppm = m.clock_drift_ppm
    if not -1e12 <= clock_drift_ppm <= 1e12:
        raise OutOfBounds("clock_drift_ppm")
    clock_error_ns = m.clock_error_ns
    if clock_error_ns > 2**60:
        raise OutOfBounds("clock_error_ns")
    words = read_text("words", m.words, 128)
    return LinkReport(
        number,
        until_ns,
        span_ns,
        m.forces,
        m.late_server,
        m.late_network,
        m.late_engine,
        worst_late_ns,
        longest_gap_ns,
        round_trip,
        to_server,
        to_client,
        clock_offset_ns,
        clock_drift_ppm,
        clock_error_ns,
        m.received,
        m.lost,
        m.reordered,
        m.duplicated,
        words,
        m.late_unknown,
        m.refused_not_finite,
        m.refused_out_of_bounds,
        m.refused_unknown_tick,
        m.refused_old_sequence,
    )


def write_link_report(m: pb.LinkReport, value: LinkReport) -> None:
    m.number = value.number
    m.until_ns = value.until_ns
    m.span_ns = value.span_ns
    m.forces = value.forces
    m.late_server = value.late_server
    m.late_network = value.late_network
    m.late_engine = value.late_engine
    m.worst_late_ns = value.worst_late_ns
    m.longest_gap_ns = value.longest_gap_ns
    if value.round_trip is not None:
        m.round_trip.SetInParent()
        write_delays(m.round_trip, value.round_trip)
    if value.to_server is not None:
        m.to_server.SetInParent()
        write_delays(m.to_server, value.to_server)
    if value.to_client is not None:
        m.to_client.SetInParent()
        write_delays(m.to_client, value.to_client)
    m.clock_offset_ns = value.clock_offset_ns
    m.clock_drift_ppm = value.clock_drift_ppm
    m.clock_error_ns = value.clock_error_ns
    m.received = value.received
    m.lost = value.lost
    m.reordered = value.reordered
    m.duplicated = value.duplicated
    m.words = clip(value.words, 128)
    if value.late_unknown:
        m.late_unknown = value.late_unknown
    if value.refused_not_finite:
        m.refused_not_finite = value.refused_not_finite
    if value.refused_out_of_bounds:
        m.refused_out_of_bounds = value.refused_out_of_bounds
    if value.refused_unknown_tick:
        m.refused_unknown_tick = value.refused_unknown_tick
    if value.refused_old_sequence:
        m.refused_old_sequence = value.refused_old_sequence


def read_port_surface(m: pb.PortSurface) -> PortSurface:
    normal = read_normal("normal", m.normal)
    offset_m = m.offset_m
    if not -1e12 <= offset_m <= 1e12:
        raise OutOfBounds("offset_m")
    stiffness_npm = m.stiffness_npm
    if not 0 <= stiffness_npm <= 1e12:
        raise OutOfBounds("stiffness_npm")
    return PortSurface(normal, offset_m, stiffness_npm)


def write_port_surface(m: pb.PortSurface, value: PortSurface) -> None:
    write_vector(m.normal, value.normal)
    m.offset_m = value.offset
    m.stiffness_npm = value.stiffness


def read_port_turn(m: pb.PortTurn) -> PortTurn:
    turn = read_rotation("turn", m.turn)
    angular_velocity_radps = read_vector("angular_velocity_radps", m.angular_velocity_radps)
    torque_nm = read_vector("torque_nm", m.torque_nm)
    return PortTurn(turn, angular_velocity_radps, torque_nm)


def write_port_turn(m: pb.PortTurn, value: PortTurn) -> None:
    write_rotation(m.turn, value.turn)
    write_vector(m.angular_velocity_radps, value.angular_velocity)
    write_vector(m.torque_nm, value.torque)


def read_port_grip(m: pb.PortGrip) -> PortGrip:
    opening_m = m.opening_m
    if not -1e12 <= opening_m <= 1e12:
        raise OutOfBounds("opening_m")
    velocity_mps = m.velocity_mps
    if not -1e12 <= velocity_mps <= 1e12:
        raise OutOfBounds("velocity_mps")
    force_n = m.force_n
    if not -1e12 <= force_n <= 1e12:
        raise OutOfBounds("force_n")
    account_j = m.account_j
    if not -1e3 <= account_j <= 1e3:
        raise OutOfBounds("account_j")
    need_j = m.need_j
    if not 0 <= need_j <= 1e3:
        raise OutOfBounds("need_j")
    given_j = m.given_j
    if not 0 <= given_j <= 1e6:
        raise OutOfBounds("given_j")
    taken_j = m.taken_j
    if not 0 <= taken_j <= 1e6:
        raise OutOfBounds("taken_j")
    return PortGrip(opening_m, velocity_mps, force_n, account_j, need_j, given_j, taken_j)


def write_port_grip(m: pb.PortGrip, value: PortGrip) -> None:
    m.opening_m = value.opening
    m.velocity_mps = value.velocity
    m.force_n = value.force
    m.account_j = value.account
    m.need_j = value.need
    m.given_j = value.given
    m.taken_j = value.taken


def read_port_state(m: pb.PortState) -> PortState:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    epoch = m.epoch
    if epoch < 1:
        raise OutOfBounds("epoch")
    sequence = m.sequence
    if sequence < 1:
        raise OutOfBounds("sequence")
    time_ns = m.time_ns
    if not -(2**60) <= time_ns <= 2**60:
        raise OutOfBounds("time_ns")
    round_trip_ns = m.round_trip_ns
    if round_trip_ns > 10_000_000_000:
        raise OutOfBounds("round_trip_ns")
    phase = _PORT_PHASE.get(m.phase)
    if phase is None:
        raise OutOfBounds("phase")
    position_m = read_vector("position_m", m.position_m)
    velocity_mps = read_vector("velocity_mps", m.velocity_mps)
    force_n = read_vector("force_n", m.force_n)
    contact_force_n = read_vector("contact_force_n", m.contact_force_n) if m.HasField("contact_force_n") else None
    account_j = m.account_j
    if not -1e3 <= account_j <= 1e3:
        raise OutOfBounds("account_j")
    need_j = m.need_j
    if not 0 <= need_j <= 1e3:
        raise OutOfBounds("need_j")
    given_j = m.given_j
    if not 0 <= given_j <= 1e6:
        raise OutOfBounds("given_j")
    taken_j = m.taken_j
    if not 0 <= taken_j <= 1e6:
        raise OutOfBounds("taken_j")
    wave_integral = read_vector("wave_integral", m.wave_integral) if m.HasField("wave_integral") else ZERO
    wave_energy_j = m.wave_energy_j
    if not 0 <= wave_energy_j <= 1e6:
        raise OutOfBounds("wave_energy_j")
    surface = read_port_surface(m.surface) if m.HasField("surface") else None
    turn = read_port_turn(m.turn) if m.HasField("turn") else None
    grip = read_port_grip(m.grip) if m.HasField("grip") else None
    energy_in_j = m.energy_in_j
    if not 0 <= energy_in_j <= 1e6:
        raise OutOfBounds("energy_in_j")
    share = m.share if m.HasField("share") else None
    if share is not None and not 0 <= share <= 1:
        raise OutOfBounds("share")
    position_scale = m.position_scale
    if not (0.01 <= position_scale <= 100 or position_scale == 0):
        raise OutOfBounds("position_scale")
    force_scale = m.force_scale
    if not (0.01 <= force_scale <= 100 or force_scale == 0):
        raise OutOfBounds("force_scale")
    return PortState(
        device,
        channel,
        epoch,
        sequence,
        m.answers_epoch,
        m.answers,
        time_ns,
        round_trip_ns,
        phase,
        m.engagement,
        m.buttons,
        position_m,
        velocity_mps,
        force_n,
        contact_force_n,
        account_j,
        need_j,
        given_j,
        taken_j,
        wave_integral,
        wave_energy_j,
        surface,
        turn,
        grip,
        energy_in_j,
        share,
        position_scale,
        force_scale,
        m.of_peer,
    )


def write_port_state(m: pb.PortState, value: PortState) -> None:
    m.device = value.device
    m.channel = value.channel
    m.epoch = value.epoch
    m.sequence = value.sequence
    m.answers_epoch = value.answers_epoch
    m.answers = value.answers
    m.time_ns = value.time_ns
    m.round_trip_ns = value.round_trip_ns
    m.phase = value.phase  # type: ignore[assignment]
    if value.engagement:
        m.engagement = value.engagement
    if value.buttons:
        m.buttons = value.buttons
    write_vector(m.position_m, value.position)
    write_vector(m.velocity_mps, value.velocity)
    write_vector(m.force_n, value.force)
    if value.contact_force is not None:
        write_vector(m.contact_force_n, value.contact_force)
    m.account_j = value.account
    m.need_j = value.need
    m.given_j = value.given
    m.taken_j = value.taken
    if any(value.wave_integral):
        write_vector(m.wave_integral, value.wave_integral)
    m.wave_energy_j = value.wave_energy
    if value.surface is not None:
        m.surface.SetInParent()
        write_port_surface(m.surface, value.surface)
    if value.turn is not None:
        m.turn.SetInParent()
        write_port_turn(m.turn, value.turn)
    if value.grip is not None:
        m.grip.SetInParent()
        write_port_grip(m.grip, value.grip)
    m.energy_in_j = value.energy_in
    if value.share is not None:
        m.share = value.share
    m.position_scale = value.position_scale
    m.force_scale = value.force_scale
    if value.of_peer:
        m.of_peer = value.of_peer


def read_device_report(m: pb.DeviceReport) -> DeviceReport:
    number = m.number
    if number < 1:
        raise OutOfBounds("number")
    until_ns = m.until_ns
    if not -(2**60) <= until_ns <= 2**60:
        raise OutOfBounds("until_ns")
    span_ns = m.span_ns
    if span_ns > 2**60:
        raise OutOfBounds("span_ns")
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    if not (m.overruns <= m.steps):
        raise OutOfBounds("overruns")
    if not (m.unseen <= m.steps):
        raise OutOfBounds("unseen")
    lateness_us_log2 = read_counts("lateness_us_log2", m.lateness_us_log2, 0, 24) if m.lateness_us_log2 else ()
    if not (sum(lateness_us_log2) <= m.steps):
        raise OutOfBounds("lateness_us_log2")
    safety = _SAFETY.get(m.safety)
    if safety is None:
        raise OutOfBounds("safety")
    fault = read_text("fault", m.fault, 128)
    degraded = read_text("degraded", m.degraded, 128)
    return DeviceReport(
        number,
        until_ns,
        span_ns,
        device,
        m.steps,
        m.missed,
        m.overruns,
        m.unseen,
        lateness_us_log2,
        safety,
        fault,
        degraded,
    )


def write_device_report(m: pb.DeviceReport, value: DeviceReport) -> None:
    m.number = value.number
    m.until_ns = value.until_ns
    m.span_ns = value.span_ns
    m.device = value.device
    m.steps = value.steps
    m.missed = value.missed
    m.overruns = value.overruns
    m.unseen = value.unseen
    m.lateness_us_log2.extend(value.lateness)
    m.safety = value.safety  # type: ignore[assignment]
    m.fault = clip(value.fault, 128)
    m.degraded = clip(value.degraded, 128)


def read_peer_report(m: pb.PeerReport) -> PeerReport:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    name = read_text("name", m.name, 64)
    state_one_in = m.state_one_in
    if not 1 <= state_one_in <= 1000:
        raise OutOfBounds("state_one_in")
    if not m.HasField("link"):
        raise OutOfBounds("link")
    link = read_link_report(m.link)
    error_n = m.error_n if m.HasField("error_n") else None
    if error_n is not None and not 0 <= error_n <= 1e12:
        raise OutOfBounds("error_n")
    way = read_text("way", m.way, 24)
    return PeerReport(device, channel, name, state_one_in, m.forces_refused, link, error_n, way)


def write_peer_report(m: pb.PeerReport, value: PeerReport) -> None:
    m.device = value.device
    m.channel = value.channel
    m.name = clip(value.name, 64)
    m.state_one_in = value.state_one_in
    m.forces_refused = value.forces_refused
    m.link.SetInParent()
    write_link_report(m.link, value.link)
    if value.error is not None:
        m.error_n = value.error
    if value.way:
        m.way = clip(value.way, 24)


def read_claim(m: pb.Claim) -> Claim:
    device = read_text("device", m.device, 24)
    channel = read_text("channel", m.channel, 24)
    role = _ROLE.get(m.role)
    if role is None:
        raise OutOfBounds("role")
    return Claim(role, device, channel)


def write_claim(m: pb.Claim, value: Claim) -> None:
    m.role = value.role  # type: ignore[assignment]
    if value.device:
        m.device = clip(value.device, 24)
    if value.channel:
        m.channel = clip(value.channel, 24)


def read_hello(m: pb.Hello) -> Hello:
    version_min = m.version_min
    if version_min < 1:
        raise OutOfBounds("version_min")
    if not (version_min <= m.version_max):
        raise OutOfBounds("version_min")
    role = _ROLE.get(m.role)
    if role is None:
        raise OutOfBounds("role")
    name = read_text("name", m.name, 64)
    features = read_texts("features", m.features, 0, 16, 32)
    claims = read_each("claims", m.claims, 0, 16, read_claim)
    ways = read_texts("ways", m.ways, 0, 8, 24)
    return Hello(role, name, features, version_min, m.version_max, claims, ways)


def write_hello(m: pb.Hello, value: Hello) -> None:
    m.role = value.role  # type: ignore[assignment]
    if value.name:
        m.name = clip(value.name, 64)
    m.features.extend(clip(text, 32) for text in value.features[:16])
    if value.version_min:
        m.version_min = value.version_min
    if value.version_max:
        m.version_max = value.version_max
    for claim in value.claims[:16]:
        write_claim(m.claims.add(), claim)
    m.ways.extend(clip(text, 24) for text in value.ways[:8])


def read_grant(m: pb.Grant) -> Grant:
    device = m.device
    if device > 15:
        raise OutOfBounds("device")
    channel = m.channel
    if channel > 7:
        raise OutOfBounds("channel")
    role = _ROLE.get(m.role)
    if role is None:
        raise OutOfBounds("role")
    return Grant(role, device, channel)


def write_grant(m: pb.Grant, value: Grant) -> None:
    m.role = value.role  # type: ignore[assignment]
    if value.device:
        m.device = value.device
    if value.channel:
        m.channel = value.channel


def read_welcome(m: pb.Welcome) -> Welcome:
    version = m.version
    if version < 1:
        raise OutOfBounds("version")
    features = read_texts("features", m.features, 0, 16, 32)
    role = _ROLE.get(m.role)
    if role is None:
        raise OutOfBounds("role")
    device_name = read_text("device_name", m.device_name, 64)
    max_force_n = m.max_force_n
    if not 0 <= max_force_n <= 1e12:
        raise OutOfBounds("max_force_n")
    position_resolution_m = m.position_resolution_m
    if not 0 <= position_resolution_m <= 1e12:
        raise OutOfBounds("position_resolution_m")
    loop_hz = m.loop_hz
    if not 1 <= loop_hz <= 1_000_000:
        raise OutOfBounds("loop_hz")
    timeout_ms = m.timeout_ms
    if not 1 <= timeout_ms <= 3_600_000:
        raise OutOfBounds("timeout_ms")
    server = read_text("server", m.server, 64)
    grants = read_each("grants", m.grants, 0, 16, read_grant)
    return Welcome(
        version,
        features,
        role,
        device_name,
        max_force_n,
        position_resolution_m,
        loop_hz,
        timeout_ms,
        server,
        grants,
    )


def write_welcome(m: pb.Welcome, value: Welcome) -> None:
    m.version = value.version
    m.features.extend(clip(text, 32) for text in value.features[:16])
    m.role = value.role  # type: ignore[assignment]
    m.device_name = clip(value.device_name, 64)
    m.max_force_n = value.max_force
    m.position_resolution_m = value.position_resolution
    m.loop_hz = value.loop_hz
    m.timeout_ms = value.timeout_ms
    m.server = clip(value.server, 64)
    for grant in value.grants[:16]:
        write_grant(m.grants.add(), grant)


def read_refused(m: pb.Refused) -> Refused:
    code = _CODE.get(m.code)
    if code is None:
        raise OutOfBounds("code")
    detail = read_text("detail", m.detail, 128)
    return Refused(code, detail, m.version_min, m.version_max)


def write_refused(m: pb.Refused, value: Refused) -> None:
    m.code = value.code  # type: ignore[assignment]
    if value.detail:
        m.detail = clip(value.detail, 128)
    if value.version_min:
        m.version_min = value.version_min
    if value.version_max:
        m.version_max = value.version_max


def read_frame(m: pb.Frame) -> PlainFrame | None:
    """None when it is another one, or of a newer peer."""
    case = m.WhichOneof("body")
    if case == "state":
        return read_device_state(m.state)
    if case == "force":
        return read_force_command(m.force)
    if case == "control_ack":
        return read_control_ack(m.control_ack)
    if case == "bye":
        return read_bye(m.bye)
    if case == "report":
        return read_link_report(m.report)
    if case == "device_report":
        return read_device_report(m.device_report)
    if case == "peer_report":
        return read_peer_report(m.peer_report)
    if case == "port_state":
        return read_port_state(m.port_state)
    if case == "field_brick":
        return read_field_brick(m.field_brick)
    if case == "field_status":
        return read_field_status(m.field_status)
    if case == "field_pose":
        return read_field_pose(m.field_pose)
    return None


def write_frame(m: pb.Frame, value: PlainFrame) -> None:
    if isinstance(value, DeviceState):
        m.state.SetInParent()
        write_device_state(m.state, value)
    elif isinstance(value, ForceCommand):
        m.force.SetInParent()
        write_force_command(m.force, value)
    elif isinstance(value, ControlAck):
        m.control_ack.SetInParent()
        write_control_ack(m.control_ack, value)
    elif isinstance(value, Bye):
        m.bye.SetInParent()
        write_bye(m.bye, value)
    elif isinstance(value, LinkReport):
        m.report.SetInParent()
        write_link_report(m.report, value)
    elif isinstance(value, DeviceReport):
        m.device_report.SetInParent()
        write_device_report(m.device_report, value)
    elif isinstance(value, PeerReport):
        m.peer_report.SetInParent()
        write_peer_report(m.peer_report, value)
    elif isinstance(value, PortState):
        m.port_state.SetInParent()
        write_port_state(m.port_state, value)
    elif isinstance(value, FieldBrick):
        m.field_brick.SetInParent()
        write_field_brick(m.field_brick, value)
    elif isinstance(value, FieldStatus):
        m.field_status.SetInParent()
        write_field_status(m.field_status, value)
    elif isinstance(value, FieldPose):
        m.field_pose.SetInParent()
        write_field_pose(m.field_pose, value)


def read_request(m: pb.Control) -> Request | None:
    """None when it is not known here."""
    case = m.WhichOneof("op")
    if case == "set_state_rate":
        return read_set_state_rate(m.set_state_rate)
    if case == "rearm":
        return read_rearm(m.rearm)
    if case == "describe":
        return read_describe(m.describe)
    if case == "take_lease":
        return read_take_lease(m.take_lease)
    if case == "give_lease":
        return read_give_lease(m.give_lease)
    if case == "lease_lost":
        return read_lease_lost(m.lease_lost)
    if case == "set_state_deadband":
        return read_set_state_deadband(m.set_state_deadband)
    if case == "disarm":
        return read_disarm(m.disarm)
    if case == "set_output":
        return read_set_output(m.set_output)
    if case == "couple":
        return read_couple(m.couple)
    if case == "engage":
        return read_engage(m.engage)
    if case == "disengage":
        return read_disengage(m.disengage)
    if case == "set_scale":
        return read_set_scale(m.set_scale)
    if case == "set_share":
        return read_set_share(m.set_share)
    if case == "offer_field":
        return read_offer_field(m.offer_field)
    if case == "use_field":
        return read_use_field(m.use_field)
    if case == "drop_field":
        return read_drop_field(m.drop_field)
    return None


def write_request(m: pb.Control, value: Request) -> None:
    if isinstance(value, SetStateRate):
        m.set_state_rate.SetInParent()
        write_set_state_rate(m.set_state_rate, value)
    elif isinstance(value, Rearm):
        m.rearm.SetInParent()
        write_rearm(m.rearm, value)
    elif isinstance(value, Describe):
        m.describe.SetInParent()
        write_describe(m.describe, value)
    elif isinstance(value, TakeLease):
        m.take_lease.SetInParent()
        write_take_lease(m.take_lease, value)
    elif isinstance(value, GiveLease):
        m.give_lease.SetInParent()
        write_give_lease(m.give_lease, value)
    elif isinstance(value, LeaseLost):
        m.lease_lost.SetInParent()
        write_lease_lost(m.lease_lost, value)
    elif isinstance(value, SetStateDeadband):
        m.set_state_deadband.SetInParent()
        write_set_state_deadband(m.set_state_deadband, value)
    elif isinstance(value, Disarm):
        m.disarm.SetInParent()
        write_disarm(m.disarm, value)
    elif isinstance(value, SetOutput):
        m.set_output.SetInParent()
        write_set_output(m.set_output, value)
    elif isinstance(value, Couple):
        m.couple.SetInParent()
        write_couple(m.couple, value)
    elif isinstance(value, Engage):
        m.engage.SetInParent()
        write_engage(m.engage, value)
    elif isinstance(value, Disengage):
        m.disengage.SetInParent()
        write_disengage(m.disengage, value)
    elif isinstance(value, SetScale):
        m.set_scale.SetInParent()
        write_set_scale(m.set_scale, value)
    elif isinstance(value, SetShare):
        m.set_share.SetInParent()
        write_set_share(m.set_share, value)
    elif isinstance(value, OfferField):
        m.offer_field.SetInParent()
        write_offer_field(m.offer_field, value)
    elif isinstance(value, UseField):
        m.use_field.SetInParent()
        write_use_field(m.use_field, value)
    elif isinstance(value, DropField):
        m.drop_field.SetInParent()
        write_drop_field(m.drop_field, value)


def read_answer(m: pb.Answer) -> Answer | None:
    """None when it is neither."""
    case = m.WhichOneof("body")
    if case == "welcome":
        return read_welcome(m.welcome)
    if case == "refused":
        return read_refused(m.refused)
    return None


def write_answer(m: pb.Answer, value: Answer) -> None:
    if isinstance(value, Welcome):
        m.welcome.SetInParent()
        write_welcome(m.welcome, value)
    elif isinstance(value, Refused):
        m.refused.SetInParent()
        write_refused(m.refused, value)

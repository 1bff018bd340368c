# SPDX-License-Identifier: Apache-2.0
"""The frames of a coupling (FEATURE_TELEOPERATION): values to protobuf messages and back."""

from __future__ import annotations

from math import hypot
from typing import cast

from .. import limits
from .. import tendon_pb2 as pb
from ..messages import (
    Couple,
    CouplingMethod,
    PortGrip,
    PortPhase,
    PortRole,
    PortState,
    PortSurface,
    PortTurn,
    RateControl,
    SetScale,
    SetShare,
    Vec3,
)
from . import fields

_PHASES: dict[int, PortPhase] = {int(phase): phase for phase in PortPhase}
_ROLES: dict[int, PortRole] = {int(role): role for role in PortRole}
_METHODS: dict[int, CouplingMethod] = {int(method): method for method in CouplingMethod}


def _within(value: float, least: float, most: float) -> float:
    if not least <= value <= most:  # nor is NaN
        raise fields.OutOfBounds
    return value


def _write_vector(vector: Vec3) -> pb.Vec3:
    return pb.Vec3(x=vector[0], y=vector[1], z=vector[2])


def _read_surface(message: pb.PortSurface) -> PortSurface:
    normal = fields.vector(message.normal)
    if not abs(hypot(*normal) - 1) <= limits.UNIT_TOLERANCE:
        raise fields.OutOfBounds
    offset = _within(message.offset_m, -limits.MAX_VALUE, limits.MAX_VALUE)
    return PortSurface(normal, offset, fields.magnitude(message.stiffness_npm))


def _write_surface(surface: PortSurface) -> pb.PortSurface:
    normal = _write_vector(surface.normal)
    return pb.PortSurface(normal=normal, offset_m=surface.offset, stiffness_npm=surface.stiffness)


def _read_turn(message: pb.PortTurn) -> PortTurn:
    angular_velocity = fields.vector(message.angular_velocity_radps)
    return PortTurn(fields.quaternion(message.turn), angular_velocity, fields.vector(message.torque_nm))


def _write_turn(turn: PortTurn) -> pb.PortTurn:
    w, x, y, z = turn.turn
    return pb.PortTurn(
        turn=pb.Quat(w=w, x=x, y=y, z=z),
        angular_velocity_radps=_write_vector(turn.angular_velocity),
        torque_nm=_write_vector(turn.torque),
    )


def _read_grip(message: pb.PortGrip) -> PortGrip:
    return PortGrip(
        opening=fields.number(message.opening_m),
        velocity=fields.number(message.velocity_mps),
        force=fields.number(message.force_n),
        account=_within(message.account_j, -limits.MAX_ACCOUNT, limits.MAX_ACCOUNT),
        need=_within(message.need_j, 0, limits.MAX_ACCOUNT),
        given=_within(message.given_j, 0, limits.MAX_TOTAL),
        taken=_within(message.taken_j, 0, limits.MAX_TOTAL),
    )


def _write_grip(grip: PortGrip) -> pb.PortGrip:
    return pb.PortGrip(
        opening_m=grip.opening,
        velocity_mps=grip.velocity,
        force_n=grip.force,
        account_j=grip.account,
        need_j=grip.need,
        given_j=grip.given,
        taken_j=grip.taken,
    )


def _read_scale(scale: float) -> float:
    """0: as in Couple."""
    return scale if scale == 0 else _within(scale, limits.MIN_SCALE, limits.MAX_SCALE)


def read_port(message: pb.PortState) -> PortState:
    contact = message.contact_force_n
    return PortState(
        device=fields.device(message.device),
        channel=fields.channel(message.channel),
        epoch=fields.whole(message.epoch, 1, 2**64),
        sequence=fields.whole(message.sequence, 1, 2**64),
        answers_epoch=message.answers_epoch,
        answers=message.answers,
        time_ns=fields.time(message.time_ns),
        round_trip_ns=fields.whole(message.round_trip_ns, 0, limits.MAX_ROUND_TRIP_NS),
        phase=fields.enum(_PHASES, message.phase),
        engagement=message.engagement,
        buttons=message.buttons,
        position=fields.vector(message.position_m),
        velocity=fields.vector(message.velocity_mps),
        force=fields.vector(message.force_n),
        contact_force=fields.vector(contact) if message.HasField("contact_force_n") else None,
        account=_within(message.account_j, -limits.MAX_ACCOUNT, limits.MAX_ACCOUNT),
        need=_within(message.need_j, 0, limits.MAX_ACCOUNT),
        given=_within(message.given_j, 0, limits.MAX_TOTAL),
        taken=_within(message.taken_j, 0, limits.MAX_TOTAL),
        wave_integral=fields.vector(message.wave_integral),
        wave_energy=_within(message.wave_energy_j, 0, limits.MAX_TOTAL),
        surface=_read_surface(message.surface) if message.HasField("surface") else None,
        turn=_read_turn(message.turn) if message.HasField("turn") else None,
        grip=_read_grip(message.grip) if message.HasField("grip") else None,
        energy_in=_within(message.energy_in_j, 0, limits.MAX_TOTAL),
        share=_within(message.share, 0, 1) if message.HasField("share") else None,
        position_scale=_read_scale(message.position_scale),
        force_scale=_read_scale(message.force_scale),
        of_peer=message.of_peer,
    )


def write_port(port: PortState) -> pb.PortState:
    return pb.PortState(
        device=port.device,
        channel=port.channel,
        epoch=port.epoch,
        sequence=port.sequence,
        answers_epoch=port.answers_epoch,
        answers=port.answers,
        time_ns=port.time_ns,
        round_trip_ns=port.round_trip_ns,
        phase=cast(pb.PortPhase, port.phase),
        engagement=port.engagement,
        buttons=port.buttons,
        position_m=_write_vector(port.position),
        velocity_mps=_write_vector(port.velocity),
        force_n=_write_vector(port.force),
        contact_force_n=None if port.contact_force is None else _write_vector(port.contact_force),
        account_j=port.account,
        need_j=port.need,
        given_j=port.given,
        taken_j=port.taken,
        wave_integral=_write_vector(port.wave_integral) if any(port.wave_integral) else None,
        wave_energy_j=port.wave_energy,
        surface=None if port.surface is None else _write_surface(port.surface),
        turn=None if port.turn is None else _write_turn(port.turn),
        grip=None if port.grip is None else _write_grip(port.grip),
        energy_in_j=port.energy_in,
        share=port.share,
        position_scale=port.position_scale,
        force_scale=port.force_scale,
        of_peer=port.of_peer,
    )


def _read_rate(message: pb.RateControl) -> RateControl:
    gain, max_speed = fields.magnitude(message.gain_per_s), fields.magnitude(message.max_speed_mps)
    if gain == 0 or max_speed == 0:
        raise fields.OutOfBounds
    return RateControl(fields.magnitude(message.dead_zone_m), gain, max_speed)


def _write_rate(rate: RateControl) -> pb.RateControl:
    return pb.RateControl(dead_zone_m=rate.dead_zone, gain_per_s=rate.gain, max_speed_mps=rate.max_speed)


def read_couple(message: pb.Couple) -> Couple:
    return Couple(
        device=fields.device(message.device),
        channel=fields.channel(message.channel),
        role=fields.enum(_ROLES, message.role),
        method=fields.enum(_METHODS, message.method),
        position_scale=_within(message.position_scale, limits.MIN_SCALE, limits.MAX_SCALE),
        force_scale=_within(message.force_scale, limits.MIN_SCALE, limits.MAX_SCALE),
        rotation=fields.quaternion(message.rotation),
        axes=fields.whole(message.axes, 1, 7),
        stiffness=fields.magnitude(message.stiffness_npm),
        mutual_damping=fields.magnitude(message.mutual_damping_nspm),
        damping=fields.magnitude(message.damping_nspm),
        adapt_to_delay=message.adapt_to_delay,
        purse=message.purse,
        period_us=fields.whole(message.period_us, 1, limits.MAX_VALID_FOR_US),
        absolute=message.absolute,
        turn_stiffness=fields.magnitude(message.turn_stiffness_nmprad),
        turn_damping=fields.magnitude(message.turn_damping_nmsprad),
        grip_stiffness=fields.magnitude(message.grip_stiffness_npm),
        grip_damping=fields.magnitude(message.grip_damping_nspm),
        drift_rate=fields.magnitude(message.drift_rate_per_s),
        rate=_read_rate(message.rate) if message.HasField("rate") else None,
    )


def write_couple(couple: Couple) -> pb.Couple:
    w, x, y, z = couple.rotation
    return pb.Couple(
        device=couple.device,
        channel=couple.channel,
        role=cast(pb.PortRole, couple.role),
        method=cast(pb.CouplingMethod, couple.method),
        position_scale=couple.position_scale,
        force_scale=couple.force_scale,
        rotation=pb.Quat(w=w, x=x, y=y, z=z),
        axes=couple.axes,
        stiffness_npm=couple.stiffness,
        mutual_damping_nspm=couple.mutual_damping,
        damping_nspm=couple.damping,
        adapt_to_delay=couple.adapt_to_delay,
        purse=couple.purse,
        period_us=couple.period_us,
        absolute=couple.absolute,
        turn_stiffness_nmprad=couple.turn_stiffness,
        turn_damping_nmsprad=couple.turn_damping,
        grip_stiffness_npm=couple.grip_stiffness,
        grip_damping_nspm=couple.grip_damping,
        drift_rate_per_s=couple.drift_rate,
        rate=None if couple.rate is None else _write_rate(couple.rate),
    )


def is_scale(wanted: SetScale) -> bool:
    """Whether a receiver accepts it."""
    scales = (wanted.position_scale, wanted.force_scale)
    return all(limits.MIN_SCALE <= scale <= limits.MAX_SCALE for scale in scales)


def is_share(wanted: SetShare) -> bool:
    """Whether a receiver accepts it."""
    return 0 <= wanted.channel < limits.MAX_CHANNELS and 0 <= wanted.share <= 1


def read_set_scale(message: pb.SetScale) -> SetScale:
    wanted = SetScale(fields.device(message.device), message.position_scale, message.force_scale)
    if not is_scale(wanted):
        raise fields.OutOfBounds
    return wanted


def read_set_share(message: pb.SetShare) -> SetShare:
    wanted = SetShare(fields.device(message.device), message.channel, message.share)
    if not is_share(wanted):
        raise fields.OutOfBounds
    return wanted

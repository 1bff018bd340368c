# SPDX-License-Identifier: Apache-2.0
"""The frames of a coupling (FEATURE_TELEOPERATION): values to protobuf messages and back."""

from __future__ import annotations

from math import hypot
from typing import cast

from .. import limits
from .. import tendon_pb2 as pb
from ..messages import Couple, CouplingMethod, PortPhase, PortRole, PortState, PortSurface, Vec3
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
    )


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
    )

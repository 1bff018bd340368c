# SPDX-License-Identifier: Apache-2.0
"""The frames of a coupling to protobuf and back."""

from __future__ import annotations

from typing import cast

from .. import limits
from .. import tendon_pb2 as pb
from ..messages import Couple, CouplingMethod, PortPhase, PortRole, PortState, Quat, Vec3
from . import fields


def _vector(vector: Vec3) -> pb.Vec3:
    return pb.Vec3(x=vector[0], y=vector[1], z=vector[2])


def _quaternion(q: Quat) -> pb.Quat:
    return pb.Quat(w=q[0], x=q[1], y=q[2], z=q[3])


def read_port(message: pb.PortState) -> PortState:
    most = limits.MAX_ACCOUNT_J
    contact = fields.vector(message.contact_force_n) if message.HasField("contact_force_n") else None
    return PortState(
        device=fields.device(message.device),
        channel=fields.channel(message.channel),
        epoch=fields.whole(message.epoch, 1, 2**64),
        sequence=fields.whole(message.sequence, 1, 2**64),
        answers_epoch=message.answers_epoch,
        answers=message.answers,
        time_ns=fields.time(message.time_ns),
        round_trip_ns=fields.whole(message.round_trip_ns, 0, limits.MAX_ROUND_TRIP_NS),
        phase=PortPhase(fields.whole(message.phase, min(PortPhase), max(PortPhase))),
        engagement=message.engagement,
        buttons=message.buttons,
        position=fields.vector(message.position_m),
        velocity=fields.vector(message.velocity_mps),
        force=fields.vector(message.force_n),
        contact_force=contact,
        account=fields.within(message.account_j, -most, most),
        need=fields.within(message.need_j, 0, most),
        given=fields.within(message.given_j, 0, limits.MAX_TOTAL_J),
        taken=fields.within(message.taken_j, 0, limits.MAX_TOTAL_J),
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
        position_m=_vector(port.position),
        velocity_mps=_vector(port.velocity),
        force_n=_vector(port.force),
        contact_force_n=None if port.contact_force is None else _vector(port.contact_force),
        account_j=port.account,
        need_j=port.need,
        given_j=port.given,
        taken_j=port.taken,
    )


def read_couple(message: pb.Couple) -> Couple:
    return Couple(
        role=PortRole(fields.whole(message.role, min(PortRole), max(PortRole))),
        method=CouplingMethod(fields.whole(message.method, min(CouplingMethod), max(CouplingMethod))),
        position_scale=fields.within(message.position_scale, limits.MIN_SCALE, limits.MAX_SCALE),
        force_scale=fields.within(message.force_scale, limits.MIN_SCALE, limits.MAX_SCALE),
        rotation=fields.quaternion(message.rotation),
        axes=fields.whole(message.axes, 1, 7),
        stiffness=fields.magnitude(message.stiffness_npm),
        mutual_damping=fields.magnitude(message.mutual_damping_nspm),
        damping=fields.magnitude(message.damping_nspm),
        adapt_to_delay=message.adapt_to_delay,
        purse=message.purse,
        period_us=fields.whole(message.period_us, 1, limits.MAX_VALID_FOR_US),
        device=fields.device(message.device),
        channel=fields.channel(message.channel),
    )


def write_couple(couple: Couple) -> pb.Couple:
    return pb.Couple(
        device=couple.device,
        channel=couple.channel,
        role=cast(pb.PortRole, couple.role),
        method=cast(pb.CouplingMethod, couple.method),
        position_scale=couple.position_scale,
        force_scale=couple.force_scale,
        rotation=_quaternion(couple.rotation),
        axes=couple.axes,
        stiffness_npm=couple.stiffness,
        mutual_damping_nspm=couple.mutual_damping,
        damping_nspm=couple.damping,
        adapt_to_delay=couple.adapt_to_delay,
        purse=couple.purse,
        period_us=couple.period_us,
    )

# SPDX-License-Identifier: Apache-2.0
"""What peers say to each other, as plain values.

The messages of tendon.proto come from `generated`. `codec` converts them to bytes and back. SI units, device base frame;
a force is what the device exerts **on the hand**, so a wall that resists motion along +x sends −x.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntFlag
from math import inf
from typing import Union

from .generated import *
from .generated import Contact, PlainFrame, Request, ZERO
from .limits import PROTOCOL_VERSION as PROTOCOL_VERSION

FEATURE_CHANNELS = "channels"
"""The client understands that a lease can be lost."""

FEATURE_LOCAL_MODEL = "local-model"
"""The client may send a local model with its forces, and the server follows the hand with it."""

FEATURE_HANDLE = "handle"
"""The client is told how the device lies before the operator, its buttons, orientation, gripper and torques, and may ask
for torque and grip force."""

FEATURE_JOINTS = "joints"
"""The client is told the angles of the device's joints in each state, and their names."""

FEATURE_OUTPUTS = "outputs"
"""The client is told the outputs of the device (lamps, vibration), and may set them."""

FEATURE_TELEOPERATION = "teleoperation"
"""The client may be the other end of a coupling: it says Couple, and PortStates go both ways."""

FEATURE_WAYS = "ways"
"""An engine names the ways in which it answers, and says of each force which one it was."""

FEATURE_DIAGNOSTICS = "diagnostics"
"""An observer is told the forces asked for, and the state of loops and engines (DeviceReport, PeerReport)."""


class Reason(IntFlag):
    """Why the device does not give out the force that was asked for. Bits nobody knows yet are kept."""

    ENERGY = 1
    MAX_FORCE = 2
    SLEW = 4
    RAMP_IN = 8
    HELD = 16
    DECAYING = 32
    SAFE_STOP = 64
    NOT_FINITE = 128
    FAULT = 256
    DEVICE_CLAMP = 512
    OVERRUN = 1024
    WATCHDOG = 2048
    UNSEEN = 4096
    DISARMED = 8192
    DAMPED = 16384
    ACCELERATION = 32768


@dataclass(frozen=True, slots=True)
class Control:
    """A request on its way."""

    id: int
    request: Request | None  # None if this version does not know it, or if it is invalid
    invalid: str = ""  # the name of the field that is out of bounds


Frame = Union[PlainFrame, Control]


Stiffness = Union[float, Sequence[float], Sequence[Sequence[float]]]


@dataclass(frozen=True, slots=True)
class Touch:
    """The physics engine's answer to one device state.

    `stiffness` is −∂force/∂position at the state's position, in N/m, a spring is positive: one number k
    for k·I, three for the diagonal, or the 3 × 3 matrix. With it the device loop follows the hand until
    the next force (when the server has agreed to FEATURE_LOCAL_MODEL). Any sequences will do, NumPy
    arrays among them. The rest is for engines that know it: protocol/WIRE.md says what the server makes of it.
    """

    force: Sequence[float] = ZERO  # N on the hand
    stiffness: Stiffness | None = None
    valid_radius: float = inf  # m, how far from the state's position the stiffness holds
    contact: Contact | None = None  # the surface, with the force at other depths in a table where that is known
    topology_changed: bool = False  # cut or torn since the previous answer: neither answer's stiffness and table are used
    error: float | None = None  # N, the engine's estimate of the error of the force
    # For a handle with more motors than those of its position (`client.handle`). A server that does not know
    # FEATURE_HANDLE is sent the force without them (`stats.left_out`).
    torque: Sequence[float] | None = None  # N·m on the hand, base frame axes, about the handle's position
    angular_stiffness: Stiffness | None = None  # N·m/rad, −∂torque/∂θ at the state's orientation, in the same forms
    grip_force: float | None = None  # N, on the fingers of the gripper; > 0 opens them
    # Which of `Config.ways` has answered, from 1 on; 0: not said. Left out where there is none of that number
    # (`stats.left_out`), and of a server that does not know FEATURE_WAYS.
    way: int = 0


@dataclass(slots=True)
class LinkStats:
    """Everything that is counted about one conversation.

    Each datagram received adds one to exactly one of `datagrams_received`, `duplicated`, `malformed`, `forged`,
    `old_key`.
    """

    datagrams_sent: int = 0
    datagrams_received: int = 0  # accepted ones
    lost: int = 0  # peer packet numbers never seen (so far)
    lost_outgoing: int = 0  # ours that the peer had not seen, as far as its ack vectors reach
    reordered: int = 0  # accepted, but older than one seen before
    duplicated: int = 0  # seen before, older than the window, or of the handshake: dropped
    malformed: int = 0  # not a datagram of this conversation: dropped
    forged: int = 0  # suite 1: did not open; forged, or damaged under way: dropped
    old_key: int = 0  # suite 1: of a key that is over, or far ahead: dropped
    invalid: int = 0  # well-formed, with a value out of bounds: frame dropped
    stale: int = 0  # state, force or report not newer than the newest one: frame dropped
    round_trip_ns: int = 0  # newest sample; 0 = none yet
    smoothed_round_trip_ns: int = 0  # RFC 6298 SRTT
    round_trip_variation_ns: int = 0  # RFC 6298 RTTVAR


NEVER = inf
"""An instant that does not come. All others are nanoseconds of a monotonic clock, as integers."""

Instant = Union[int, float]

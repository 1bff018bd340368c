# SPDX-License-Identifier: Apache-2.0
"""Messages between client and server as plain values.

The messages of tendon.proto are in `generated`, and `codec` converts them to bytes. SI units, device base frame.
Forces act **on the hand**, so a wall that resists motion along +x sends −x.
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
"""The client supports losing a lease."""

FEATURE_LOCAL_MODEL = "local-model"
"""The client may send a local model with its forces, with which the server extrapolates them."""

FEATURE_HANDLE = "handle"
"""The client receives the orientation of the device relative to the operator, its buttons, orientation, gripper and
torques, and may send torques and grip forces."""

FEATURE_JOINTS = "joints"
"""The client receives the names of the joints and their angles in each state."""

FEATURE_OUTPUTS = "outputs"
"""The client receives the outputs of the device (lamps, vibration) and may set them."""

FEATURE_TELEOPERATION = "teleoperation"
"""The client can be one of the ends of a coupling. It sends a Couple request, and both ends send PortStates."""

FEATURE_WAYS = "ways"
"""An engine names its methods, and each force contains the method that computed it."""

FEATURE_FIELDS = "fields"
"""The client can upload fields (OfferField), which the server renders at its own rate (UseField)."""

FEATURE_DIAGNOSTICS = "diagnostics"
"""An observer receives the forces of the engines before limiting, and the state of loops and engines (DeviceReport,
PeerReport)."""


class Reason(IntFlag):
    """The reasons why the force of the device is not the requested one. Unknown bits are kept."""

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
    """A request with its id."""

    id: int
    request: Request | None  # None if it is unknown in this version or invalid
    invalid: str = ""  # name of the field that is out of bounds


Frame = Union[PlainFrame, Control]


Stiffness = Union[float, Sequence[float], Sequence[Sequence[float]]]


@dataclass(frozen=True, slots=True)
class Touch:
    """The answer of a physics engine to one device state.

    `stiffness` is −∂force/∂position at the position of the state, in N/m, positive for a spring: a number k for
    k·I, three numbers for the diagonal, or a 3 × 3 matrix. The device loop uses it to extrapolate the force until
    the next answer, if FEATURE_LOCAL_MODEL is negotiated. All sequences are accepted, including NumPy arrays. The
    other fields are optional; protocol/WIRE.md describes their use.
    """

    force: Sequence[float] = ZERO  # N, acting on the hand
    stiffness: Stiffness | None = None
    valid_radius: float = inf  # m, distance from the state's position within which the stiffness is valid
    contact: Contact | None = None  # the contact surface, optionally with a table of force over depth
    topology_changed: bool = False  # cut or torn since the previous answer; the server discards both local models
    error: float | None = None  # N, the engine's estimate of the error of the force
    # For handles with additional actuators (`client.handle`). Servers without FEATURE_HANDLE are sent only the force
    # (`stats.left_out`).
    torque: Sequence[float] | None = None  # N·m on the hand, base frame axes, about the handle's position
    angular_stiffness: Stiffness | None = None  # N·m/rad, −∂torque/∂θ at the state's orientation, in the same forms
    grip_force: float | None = None  # N, on the fingers in the gripper; > 0 opens them
    # Index into `Config.ways` of the method that computed this answer, starting at 1; 0: unspecified. It is not sent
    # if the index is invalid (`stats.left_out`) or the server does not support FEATURE_WAYS.
    way: int = 0


@dataclass(slots=True)
class LinkStats:
    """Counters of one session.

    Each received datagram increments exactly one of `datagrams_received`, `duplicated`, `malformed`, `forged`,
    `old_key`.
    """

    datagrams_sent: int = 0
    datagrams_received: int = 0  # accepted
    lost: int = 0  # packet numbers of the peer that were never received (so far)
    lost_outgoing: int = 0  # packets that the peer had not received according to its ack vectors
    reordered: int = 0  # accepted, but older than a previous one
    duplicated: int = 0  # dropped: received before, older than the window, or of the handshake
    malformed: int = 0  # dropped: not a datagram of this session
    forged: int = 0  # dropped: authentication failed (suites 1 and 2)
    old_key: int = 0  # dropped: its key has expired or is far ahead (suites 1 and 2)
    invalid: int = 0  # frame dropped: a value is out of bounds
    stale: int = 0  # frame dropped: not newer than the newest state, force or report
    round_trip_ns: int = 0  # newest sample; 0: none yet
    smoothed_round_trip_ns: int = 0  # RFC 6298 SRTT
    round_trip_variation_ns: int = 0  # RFC 6298 RTTVAR


NEVER = inf
"""A time that is never reached. All other times are integers, in nanoseconds of a monotonic clock."""

Instant = Union[int, float]

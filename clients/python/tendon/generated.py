# SPDX-License-Identifier: Apache-2.0
# Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
"""The messages of tendon.proto as plain values; `messages` has them, too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import inf
from typing import Union

from .limits import PROTOCOL_VERSION

__all__ = [
    "Answer",
    "Bye",
    "ChannelDescription",
    "ChannelRule",
    "Claim",
    "Code",
    "Contact",
    "ControlAck",
    "Couple",
    "CouplingMethod",
    "Delays",
    "Describe",
    "DeviceDescription",
    "DeviceReport",
    "DeviceState",
    "Disarm",
    "Disengage",
    "DropField",
    "Echo",
    "Engage",
    "FieldBrick",
    "FieldDepthTable",
    "FieldFixture",
    "FieldFixtureKind",
    "FieldMaterial",
    "FieldPose",
    "FieldState",
    "FieldStatus",
    "ForceCommand",
    "ForceTable",
    "GiveLease",
    "Grant",
    "Grip",
    "Hand",
    "HandleDescription",
    "Hello",
    "Joints",
    "LampColour",
    "LeaseLost",
    "LinkReport",
    "LocalModel",
    "Mat3",
    "Mode",
    "OfferField",
    "OutputDescription",
    "OutputKind",
    "PeerReport",
    "PlainFrame",
    "PortGrip",
    "PortPhase",
    "PortRole",
    "PortState",
    "PortSurface",
    "PortTurn",
    "Quat",
    "RateControl",
    "Rearm",
    "Refused",
    "Request",
    "Role",
    "RotationModel",
    "Safety",
    "SetOutput",
    "SetScale",
    "SetShare",
    "SetStateDeadband",
    "SetStateRate",
    "TakeLease",
    "Torque",
    "Turning",
    "UseField",
    "Vec3",
    "Vibration",
    "Welcome",
    "ZERO",
]

Vec3 = tuple[float, float, float]
Mat3 = tuple[Vec3, Vec3, Vec3]

Quat = tuple[float, float, float, float]
"""A rotation as a unit quaternion (w, x, y, z) in Hamilton's convention: w + x i + y j + z k. q and −q are the same
rotation. A quaternion is refused if its norm is not 1 ± 0.001."""

ZERO: Vec3 = (0.0, 0.0, 0.0)


class Mode(IntEnum):
    """How the device renders the remote force."""

    IDLE = 1  # no force has arrived since the start or the last safe stop
    ACTIVE = 2  # a fresh force is rendered
    HOLDING = 3  # the force is older than its validity and is still held
    DECAYING = 4  # the old force fades
    SAFE_STOP = 5  # the force is zero until a fresh force arrives
    FAULT = 6  # latched: the force is zero until a Rearm


class FieldFixtureKind(IntEnum):
    """The shape of a fixture."""

    POINT = 1
    LINE = 2
    PLANE = 3


class PortRole(IntEnum):
    """The role of an end in a coupling."""

    LEADER = 1
    FOLLOWER = 2


class CouplingMethod(IntEnum):
    """How two handles are coupled."""

    POSITION_POSITION = 1  # springs and dampers between the handles at both ends
    # the follower is pulled by a spring, and the leader feels the contact force that is measured by the follower
    POSITION_FORCE = 2
    WAVES = 3  # wave variables with a playout buffer
    # the follower is pulled by a spring, and the leader feels a model of the surface that was found by the follower
    SURFACE = 4
    # the velocity is sent to the follower and the force to the leader, and each end pays with the energy that was
    # received by the other end
    PASSIVITY = 5
    SET_POSITION = 6  # springs to delayed positions, which are only stretched as far as the energy account allows
    RATE = 7  # the position of the leader commands the velocity of the follower


class OutputKind(IntEnum):
    """The kind of an output."""

    LAMP = 1
    VIBRATION = 2  # a separate vibrator that is not one of the motors of the axes


class Hand(IntEnum):
    """The hand that is used for holding a device."""

    ANY = 0
    LEFT = 1
    RIGHT = 2


class ChannelRule(IntEnum):
    """Describes how the forces of the channels of a device are combined. The result is the sum of the forces of all sum
    channels and of the first fresh force of the priority channels, in the order of their numbers."""

    SUM = 1  # the force is added to the others
    PRIORITY = 2  # later channels with this rule are silent while the force is fresh


class PortPhase(IntEnum):
    """The phase of an end of a coupling."""

    ALONE = 1  # no peer
    COUPLED = 2  # connected to the peer, but the operator has not engaged the coupling yet; no force
    ALIGNING = 3  # absolute maps: the leader is moved to the position of the follower
    ENGAGED = 4  # the handles are coupled
    CLUTCHED = 5  # the leader is free, the follower holds its position
    LOST = 6  # the peer fell silent during an engagement and the coupling must be engaged again
    FAULT = 7  # the device exerts no force


class Safety(IntEnum):
    """The state of a device and its safety layer."""

    ABSENT = 1  # not plugged in
    OPENING = 2  # being opened
    FIRMWARE = 3  # has no firmware yet, or is receiving it
    UNHOMED = 4  # does not know its position yet
    HOMED = 5  # ready, but must be armed first
    ARMED = 6  # exerts forces
    FAULT = 7  # disarmed because of a fault, and must be armed again
    UNGUARDED = 8  # ready, and there is no safety layer that can be armed


class Code(IntEnum):
    """Explains why a request was refused or a session was closed."""

    OK = 1
    INVALID = 2  # a value is out of bounds or does not make sense
    UNSUPPORTED = 3  # the request is not known or there is no common version
    BUSY = 4  # used by another client, such as another controller
    DENIED = 5  # not with this role
    SHUTDOWN = 6  # the server is shutting down
    TIMED_OUT = 7  # nothing was received until the timeout
    EXPIRED = 8  # the session of suite 1 or 2 is too old, and the handshake must be repeated
    REPLACED = 9  # replaced by another program with the same key; the client must not reconnect automatically


class Role(IntEnum):
    """The role of a client. Observers receive states, and controllers also send forces."""

    OBSERVER = 1  # receives device states
    CONTROLLER = 2  # also sends forces; one per channel


@dataclass(frozen=True, slots=True)
class Echo:
    """Acknowledges a datagram of the peer and measures the round trip: with T3 = tx_time_ns of the datagram that
    carries the echo and T4 = the time at which that datagram arrives, the round trip is (T4 − T1) − (T3 − T2)."""

    sent_ns: int  # T1: the tx_time_ns of that datagram, on the clock of the peer
    received_ns: int  # T2: the time at which that datagram arrived, on the clock of the sender of the echo; T2 ≤ T3
    packet_number: int  # packet number of that datagram
    # Bit i is set if the packet packet_number − 1 − i has also arrived. Malformed packets only count as arrived in
    # suites 1 and 2
    received_mask: int = 0


@dataclass(frozen=True, slots=True)
class Turning:
    """How the handle is turned."""

    # The rotation from the handle frame to the device base frame. If the handle is in its middle position, the stylus
    # or finger points along the −z axis of the handle frame, y is up, and x is to the right.
    orientation: Quat
    # rad/s. The angular velocity in the axes of the base frame. It is ignored if there is no orientation
    angular_velocity: Vec3 = ZERO


@dataclass(frozen=True, slots=True)
class Grip:
    """How far the gripper of the handle is open."""

    opening: float  # rad. The opening of the gripper, which is 0 if it is closed.
    velocity: float = 0.0  # rad/s. The velocity of the opening. It is ignored if there is no grip.opening


@dataclass(frozen=True, slots=True)
class Joints:
    """The joints that carry the handle, in the order of HandleDescription.joints."""

    # rad. The angles of the joints that carry the handle, in the order of HandleDescription.joints.
    angles: tuple[float, ...]
    # rad/s. The velocities of these joints. Missing entries are 0, and entries without an angle are ignored
    velocities: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class FieldState:
    """The field that is rendered."""

    # The generation of the rendered field (UseField.generation). If several channels use fields, this is the first one
    # with contact, or else the first one.
    generation: int
    depth: float = 0.0  # m, the distance from the proxy to the hand, or 0 if there is no contact
    proxy: Vec3 = ZERO  # m, the position of the proxy, which is ignored if there is no field


@dataclass(frozen=True, slots=True)
class DeviceState:
    """The state of a device at one haptic step. Server → client, unreliable; for each device the highest tick wins."""

    tick: int  # number of the haptic step
    sampled_ns: int  # the time at which the position was sampled, on the clock of the server
    position: Vec3  # m
    velocity: Vec3  # m/s
    force_applied: Vec3  # N, the actual force on the hand from this step on
    energy: float  # J, the energy that the device may still output, according to the energy ledger
    permitted_force: float  # N. The limiter's bound on the norm of the force, or +infinity if there is none
    reasons: int  # the reasons why the actual force differs from the requested one (bits of core/base/reason.h)
    force_sequence: int  # the sequence of the ForceCommand that is rendered, or 0
    force_age_ns: int  # the time since this ForceCommand has arrived
    mode: Mode
    device: int = 0
    # The channel of the force that is described by force_sequence, force_age_ns and mode. This is the freshest one. If
    # several are equally fresh, it is the one with the lowest number
    channel: int = 0
    # With the feature "diagnostics" only:
    # N. The force on the hand that is requested by the engines at this step, before it is limited. It may be held,
    # faded, or extrapolated using their models. None if it is not reported
    force_wanted: Vec3 | None = None
    # With the feature "diagnostics" only:
    # N/m, −∂force_wanted/∂position according to the models of the engines at this step, with the entries of
    # LocalModel.stiffness. None if there is no model
    stiffness_wanted: Mat3 | None = None
    buttons: int = 0  # bit i is set if button i is pressed, or if it was pressed since the previous state
    turning: Turning | None = None  # None if it is not measured
    # N·m. The actual torque on the hand about position from this step on, in the axes of the base frame. None if the
    # device cannot exert torques
    torque_applied: Vec3 | None = None
    grip: Grip | None = None  # None if there is no gripper
    # N. The actual force on the fingers from this step on. Positive values open them. None if the gripper has no motor
    grip_applied: float | None = None
    # N. The force of the hand ON THE HANDLE, as measured by a force sensor. None if there is no force sensor
    hand_force: Vec3 | None = None
    joints: Joints | None = None  # None if the device does not report joints
    field: FieldState | None = None  # None if no field is rendered


@dataclass(frozen=True, slots=True)
class ForceTable:
    """Forces along the normal. Entry i is for the tool at at − (first + i · step) · normal."""

    first: float  # m. The depth of entry 0. It is negative if the tool is farther out than at
    step: float  # m
    force: Sequence[float]  # N, the forces along +normal


@dataclass(frozen=True, slots=True)
class Contact:
    """A surface that is touched by the tool or is about to be touched. It can push but not pull, unless there is a
    table."""

    normal: Sequence[float]  # the direction from the body to the hand, which is pushed away by a force along +normal
    # m. The distance from the surface to the tool along the normal. It is negative if the tool is inside of the body
    gap: float
    table: ForceTable | None = None  # the forces along the normal if the tool is at other depths


@dataclass(frozen=True, slots=True)
class LocalModel:
    """A local model of the force. The device loop evaluates it at the hand's position x:
    F(x) = force − stiffness · (x − at)
    With a radius or a contact see WIRE.md, "The force between two answers". A server that does not know them uses this
    equation."""

    at: Vec3  # m, the position for which force was computed
    # N/m, −∂F/∂x. Springs are positive. A single entry k is k·I, three entries are the diagonal, and nine entries are
    # the matrix row by row. Engines that do not know the stiffness send a single 0
    stiffness: Mat3
    valid_radius: float = inf  # m. The distance from at up to which the model is valid. inf if it is unknown
    contact: Contact | None = None  # the surface that is touched by the tool or is about to be touched


@dataclass(frozen=True, slots=True)
class RotationModel:
    """A local model of the torque. The device loop evaluates it at the handle's orientation q. With p = (w, v) = q ·
    at⁻¹, the rotation from at to q, and K = stiffness, it is
    τ(q) = torque − 2 (w K v + v × K v)        which is torque − K θ for a small rotation vector θ"""

    at: Quat  # the orientation for which torque was computed; absent is refused
    # N·m/rad, −∂τ/∂θ in the axes of the base frame, with the entries of LocalModel.stiffness. Springs are positive
    stiffness: Mat3


@dataclass(frozen=True, slots=True)
class Torque:
    """On the hand, base frame axes, about the handle's position."""

    torque: Vec3  # N·m. The torque on the hand about the position of the handle, in the axes of the base frame.
    # The change of the torque when the handle turns. It does not require a `model`, and torque.torque is 0 if it is
    # missing
    model: RotationModel | None = None


@dataclass(frozen=True, slots=True)
class ForceCommand:
    """The force that is requested by a physics engine in response to a state. Client → server, unreliable; for each
    device and channel the highest sequence wins."""

    sequence: int  # 1, 2, 3 … per session, device and channel
    based_on_tick: int  # the DeviceState.tick of the state that was used for computing the force
    force: Vec3  # N. The force on the hand. A wall that resists motion along +x sends −x
    valid_for_us: int  # the time after its arrival during which the force is fresh
    model: LocalModel | None = None  # The change of the force when the hand moves. None if the force is constant
    device: int = 0
    channel: int = 0
    # If true, the body was cut or torn since the previous answer, so neither this model nor the previous one is used
    topology_changed: bool = False
    error: float | None = None  # N. The error of force, as estimated by the engine. None if it is unknown
    torque: Torque | None = None  # None if no torque is requested
    # N. The force on the fingers. Positive values open them. None if no force is requested
    grip_force: float | None = None
    # With the feature "ways" only:
    # The way in which the engine has computed this force, as an index in Hello.ways that starts at 1, or 0 if it is
    # unknown. Servers treat an index that is larger than the number of ways as 0
    way: int = 0
    # With the feature "fields" only:
    # If it is not 0, force is not rendered. It is the true force for the state `based_on_tick`, which is used for
    # correcting the field with this generation (UseField.generation). The model is ignored
    field: int = 0


@dataclass(frozen=True, slots=True)
class OfferField:
    """A part of the manifest of a field, which contains its primitives and a list of its bricks. Parts are sent in
    order."""

    field: bytes  # the BLAKE2b-256 hash of the manifest, which is used as the name of the field
    size: int  # the size of the whole manifest in bytes
    offset: int  # the offset of this part in the manifest in bytes
    part: bytes


@dataclass(frozen=True, slots=True)
class FieldMaterial:
    """A viscoelastic material: a spring in parallel with a Maxwell element, which is a spring in series with a damper,
    and Coulomb friction (core/field/material.h)."""

    stiffness: float  # N/m
    # N/m. The stiffness of the spring in series with the damper, or 0 if there is no damper
    branch_stiffness: float = 0.0
    relaxation: float = 0.0  # s. The time constant of the damper. It is ignored if there is no damper
    friction: float = 0.0  # the coefficient of friction


@dataclass(frozen=True, slots=True)
class FieldFixture:
    """A spring that pulls the hand to a point, a line or a plane, in the frame of the object (core/field/fixture.h)."""

    kind: FieldFixtureKind
    at: Vec3  # m, the position of the point, or of any point on the line or plane
    normal: Vec3  # The direction of the line or the normal of the plane. It is ignored if the fixture is a point
    stiffness: float  # N/m
    most_force: float | None = None  # N, the maximum force. None if the force is not limited


@dataclass(frozen=True, slots=True)
class FieldDepthTable:
    """This table is added to the force of the springs of a material. The correction is zero at the surface, and is
    interpolated linearly between the entries. The last entry is also used for all greater depths. The slope of the
    table must be at least −0.9 times the stiffness of the material. The sum of the slope and the stiffnesses must not
    exceed the maximum stiffness of the server."""

    material: int  # the number of the material
    step: float  # m, the spacing of the entries
    force: Sequence[float]  # N, entry i is for the depth (i + 1) · step


@dataclass(frozen=True, slots=True)
class UseField:
    """Uses a field in a channel instead of the previous one. The field must be complete on the server (FieldStatus),
    and the client must have the lease of the channel, as for a ForceCommand."""

    device: int
    channel: int
    generation: int  # A number that is increased with each UseField of a session, device and channel
    field: bytes  # the hash of the manifest
    materials: Sequence[FieldMaterial]  # the materials, which are numbered from 0 in the manifest
    fixtures: Sequence[FieldFixture] = ()
    tables: Sequence[FieldDepthTable] = ()  # the tables of the materials that have one


@dataclass(frozen=True, slots=True)
class DropField:
    """Removes a field from the server. If the field is used in a channel, it is no longer rendered. The bricks are kept
    in the cache of the server."""

    field: bytes  # the hash of the manifest


@dataclass(frozen=True, slots=True)
class FieldBrick:
    """The weights of a brick (core/field/brick_field.h). Client → server, unreliable."""

    hash: bytes  # the BLAKE2b-128 hash of the weights
    weights: bytes  # 8³ numbers (int16, little-endian), where x is the fastest index


@dataclass(frozen=True, slots=True)
class FieldStatus:
    """Reports which bricks of a field are missing on the server. Bit i % 8 of byte i / 8 is set if brick i of the
    manifest is missing. The last one of the 1024 bits is set if the manifest is incomplete, and the bits of unknown
    bricks are 0. Server → client, unreliable; for each field the newest one wins."""

    field: bytes  # the hash of the manifest
    missing: bytes  # the bits, where zeros at the end may be omitted


@dataclass(frozen=True, slots=True)
class FieldPose:
    """The pose of the object of a channel in the base frame of the device. The engine should send the pose that it
    expects at the time when the message arrives. The server uses the velocities to extrapolate the pose by at most 50
    ms. Client → server, unreliable; for each device and channel the highest sequence wins."""

    device: int
    channel: int
    sequence: int  # 1, 2, 3 … per session, device and channel
    time_ns: int  # The time of the pose, on the clock of the SERVER as in DeviceState.sampled_ns
    position: Vec3  # m, the position of the origin of the object, which must be within 10 m
    orientation: Quat  # the rotation from the frame of the object to the base frame
    velocity: Vec3 = ZERO  # m/s, the velocity of the origin of the object
    angular_velocity: Vec3 = ZERO  # rad/s, the angular velocity in the axes of the base frame


@dataclass(frozen=True, slots=True)
class SetStateRate:
    """Sets the number of states of a device that are sent to the client per second. Before the first request of this
    type, all loop_hz states per second are sent. After it, every k-th state is sent, where k = loop_hz / hz is rounded
    and at least 1. For example, if loop_hz is 1000, 300 Hz becomes 333 Hz and 2000 Hz becomes 1000 Hz."""

    hz: int  # if it is 0, the answer is Code.INVALID
    device: int = 0


@dataclass(frozen=True, slots=True)
class SetStateDeadband:
    """Suppresses states that can be predicted by the client. After a state with velocity v, the server sends the first
    state whose velocity differs from v by more than max(share · ‖v‖, floor), whose mode or buttons differ, or that is
    max_silence_us newer. Between two states the client extrapolates: x + v · (t − sampled_ns)."""

    # The fraction of the speed (Weber fraction). If it is not in 0 … 0.5, the answer is Code.INVALID
    share: float = 0.1
    # m/s. The smallest difference of the velocity. If it is not in 0 … 0.1, the answer is Code.INVALID
    floor: float = 1e-3
    # The maximum time without a state. If it is 0, every state is sent again. If it is not 0 or in 1000 … 20 000, the
    # answer is Code.INVALID
    max_silence_us: int = 20_000


@dataclass(frozen=True, slots=True)
class Rearm:
    """Clears a latched fault and revokes a Disarm. Can only be used by controllers of the device. If the device has a
    safety layer, this is a request of the operator to arm it."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class Disarm:
    """Sets the force to zero without a ramp, from the next haptic step until a Rearm. Can be used by any controller of
    the device, even if it does not hold the channel. This state does not end if there is a new force or a new session,
    or if only the dead man's button is pressed. The Safety of the device changes from armed to homed, and pending
    requests to arm it are withdrawn. A Disarm is not a fault and does not clear faults. If it is repeated, it has no
    effect. If the answer is Code.OK, the loop of the device will receive the order before its next step."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class RateControl:
    """Describes how the displacement of the leader's handle sets the speed of the follower. A spring pulls the handle
    to its center. All values use the scale of the leader."""

    dead_zone: float  # m. If the leader is closer to its center than this distance, the follower does not move
    gain: float  # 1/s, the speed of the follower per meter of displacement beyond the dead zone
    max_speed: float  # m/s, the maximum speed of the follower


@dataclass(frozen=True, slots=True)
class Couple:
    """Offers the sender's device as the other end of a coupling with this device, and describes that end. Can only be
    used by a client that has claimed the channel as a controller, and requires the feature "teleoperation". If the two
    ends match, the answer is Code.OK. After that, both peers send PortState frames, and the server does not send
    states. Code.INVALID is returned if the ends do not match, and the detail contains the first difference.
    Code.UNSUPPORTED is returned if this device cannot be coupled. Code.BUSY is returned if the channel is coupled with
    another client. A follower has one channel for each of its leaders."""

    device: int  # the device of the server
    channel: int  # the channel of the server
    role: PortRole  # The role of the sender. The device of the server has the other role
    method: CouplingMethod
    position_scale: float  # the follower's motion divided by the leader's
    force_scale: float  # the leader's force divided by the follower's
    rotation: Quat  # the rotation from the base frame of the leader to that of the follower; absent is refused
    axes: int  # bits 1, 2 and 4 are set if x, y and z of the leader's frame are coupled
    stiffness: float  # N/m, the stiffness between the handles, as felt by the leader
    mutual_damping: float  # N·s/m, the damping between the handles, as felt by the leader
    damping: float  # N·s/m, the damping of each handle, as felt by the leader
    adapt_to_delay: bool  # if true, the stiffness decreases when the round trip increases
    purse: bool  # if true, the ends exchange energy (core/teleoperation/energy_tank.h)
    period_us: int  # the period in which the sender sends PortState frames
    # If true, positions map to positions. The offsets are zero, and the ends are aligned before they are engaged
    absolute: bool = False
    # As felt by the leader. With a stiffness of 0 the part is not coupled:
    turn_stiffness: float = 0.0  # N·m/rad, the stiffness between the orientations
    turn_damping: float = 0.0  # N·m·s/rad, the damping between the orientations
    grip_stiffness: float = 0.0  # N/m, the stiffness between the grippers at the fingers of the leader
    grip_damping: float = 0.0  # N·s/m, the damping between the grippers
    # For one method only:
    drift_rate: float = 0.0  # 1/s. The rate at which the follower corrects its drift, for CouplingMethod.PASSIVITY
    rate: RateControl | None = None  # the parameters of CouplingMethod.RATE, which are absent for other methods


@dataclass(frozen=True, slots=True)
class Engage:
    """Engages the coupling on the command of the operator. Can only be used by controllers of the leader's device, at
    its server. If the answer is Code.OK, the loop of the device has received the order. Code.UNSUPPORTED is returned if
    the device is not coupled, or if it is the follower."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class Disengage:
    """Ends the engagement. Can be used at the server of either end, but only by controllers of its device."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class SetScale:
    """Sets the scales of the coupling. Can only be used by controllers of the leader's device, at its server. If the
    answer is Code.OK, the loop of the device has received the order. Code.BUSY is returned if the leader is engaged and
    its clutch is not held. Code.UNSUPPORTED is returned if the device is not coupled, or if it is the follower."""

    device: int
    position_scale: float  # as in Couple
    force_scale: float  # as in Couple


@dataclass(frozen=True, slots=True)
class SetShare:
    """Sets the weight of the leader of one channel if a follower has several leaders. Can only be used by controllers
    of the follower's device, at its server. The weight reaches the value within 0.5 s, and the ratios of the other
    weights do not change. Code.UNSUPPORTED is returned if the device is not coupled, if it only has one leader, or if
    it is a leader."""

    device: int
    channel: int
    share: float


@dataclass(frozen=True, slots=True)
class Vibration:
    """A vibration pulse. It stops after its duration, or if it is replaced by a new pulse."""

    amplitude: float = 0.0  # The fraction of the maximum of the output. If it is 0, the output is turned off
    frequency: float = 0.0  # Hz, either 0 or at least 20. If it is 0, the frequency is chosen by the output
    duration_ms: int = 0


@dataclass(frozen=True, slots=True)
class LampColour:
    """The colour of a lamp."""

    rgb: int = 0  # The color of a lamp as 0xRRGGBB. If it is 0, the lamp shows the state of the device


@dataclass(frozen=True, slots=True)
class SetOutput:
    """Sets a lamp of the device or starts a vibration pulse. Can only be used by a controller that holds one of the
    channels of the device, and requires the feature "outputs". An output is turned off if the client that has set it
    gives up or loses a channel of the device, or if the device is disarmed. Code.INVALID is returned if the device does
    not have this output, if the output is of the other kind, or if both `rgb` and `vibration` are missing."""

    device: int
    # The index in HandleDescription.outputs. If the device does not have this output, the answer is Code.INVALID
    output: int
    setting: LampColour | Vibration


@dataclass(frozen=True, slots=True)
class Describe:
    """Requests the DeviceDescription of a device, which does not need to be claimed."""

    device: int = 0  # if the server does not have this device, the answer is Code.INVALID
    handle: bool = False  # If true, the HandleDescription is requested instead. This requires the feature "handle"


@dataclass(frozen=True, slots=True)
class TakeLease:
    """Requests the lease of a channel. Can only be used by a client that has claimed the channel as a controller. If
    the answer is Code.OK, the client holds the lease and its forces are used. If another client holds the lease, the
    answer is Code.BUSY, and wait_ms is the time until the lease ends if it is not renewed."""

    device: int = 0
    channel: int = 0


@dataclass(frozen=True, slots=True)
class GiveLease:
    """Releases the lease of a channel."""

    device: int = 0
    channel: int = 0


@dataclass(frozen=True, slots=True)
class LeaseLost:
    """Notifies a client with the feature "channels" that the lease of the channel was taken by another client."""

    device: int = 0
    channel: int = 0
    to: str = ""  # the name of the new holder


@dataclass(frozen=True, slots=True)
class ChannelDescription:
    """The properties of a channel."""

    name: str  # the name that is used in a claim
    rule: ChannelRule
    # If the holder does not send a force for this time, another client can take the lease. It is 0 if the lease does
    # not expire
    lease_ms: int = 0
    holder: str = ""  # The first 24 bytes of the name of the holder. It is empty if there is no holder


@dataclass(frozen=True, slots=True)
class DeviceDescription:
    """The properties of a device."""

    device: int
    name: str  # the name of the device, which can be used in a claim
    model: str  # the kind of device, as in Welcome.device_name
    position_dof: int  # the number of axes that are measured
    force_dof: int  # the number of axes that have a motor
    workspace: tuple[Vec3, Vec3] | None  # None if the workspace is unknown
    max_force: float  # N, the maximum norm of the force, or 0 if it is unknown
    continuous_force: float  # N. The maximum norm of the force that has no time limit, or 0 if it is unknown
    max_stiffness: float  # N/m, the maximum stiffness that is rendered stably, or 0 if it is unknown
    position_resolution: float  # m. The size of an encoder count at the handle, or 0 if the position is exact
    loop_hz: int  # haptic steps per second
    channels: Sequence[ChannelDescription]  # The channels of the device, in the order of their numbers


@dataclass(frozen=True, slots=True)
class OutputDescription:
    """An output of a device, in addition to its forces."""

    name: str
    kind: OutputKind


@dataclass(frozen=True, slots=True)
class HandleDescription:
    """The properties of the handle of a device. Requires the feature "handle"."""

    device: int = 0
    # The rotation from the base frame of the device to the frame of the operator, where x is to the right, y is up, and
    # z is towards the user. None if it is unknown
    operator_from_device: Quat | None = None
    buttons: Sequence[str] = ()  # The name for each bit of DeviceState.buttons. Names can be empty
    orientation_measured: bool = False  # If true, all states contain an orientation. Otherwise, none of them do
    max_torque: float = 0.0  # N·m, the maximum norm of the torque, or 0 if the device cannot exert torques
    gripper_open: float | None = None  # rad. The opening of the gripper if it is open. None if there is no gripper
    max_gripper_force: float = 0.0  # N, the maximum force on the fingers, or 0 if the gripper has no motor
    # The name of a group of devices that belong together, such as two arms or five fingers. It is empty if the device
    # is not part of a group
    group: str = ""
    hand: Hand = Hand.ANY
    # With the feature "joints" only:
    joints: Sequence[str] = ()  # The names of the joints, in the order of DeviceState.joints.angles
    # With the feature "outputs" only:
    # The outputs that can be set using SetOutput, in the order of their numbers
    outputs: Sequence[OutputDescription] = ()


@dataclass(frozen=True, slots=True)
class ControlAck:
    """The answer to a Control."""

    id: int  # the id of the Control that is answered
    code: Code
    detail: str = ""  # explanation for people
    # If the answer to TakeLease is Code.BUSY, this is the time until the lease ends if it is not renewed, or 0 if it is
    # unknown
    wait_ms: int = 0
    device: DeviceDescription | None = None  # the answer to a Describe with Code.OK
    handle: HandleDescription | None = None  # the answer to a Describe with Code.OK if `handle` was set


@dataclass(frozen=True, slots=True)
class Bye:
    """The end of the session. Either way, sent three times."""

    code: Code  # reason for the end
    reason: str = ""  # explanation for people


@dataclass(frozen=True, slots=True)
class Delays:
    """Two quantiles of a delay. The delay can be negative if two clocks are compared."""

    median_ns: int
    p99_ns: int


@dataclass(frozen=True, slots=True)
class LinkReport:
    """Statistics of the forces and datagrams of a client, which show why forces were late and how the network
    performed. One-way delays depend on the estimated offset of the clocks. They have an error of up to ± clock_error_ns
    and can be negative. Server → client, unreliable; the highest number wins."""

    number: int  # 1, 2, 3 … per session
    until_ns: int  # end of the reported interval, server clock
    span_ns: int  # length of the interval
    # In the interval:
    forces: int  # the number of forces that have arrived
    late_server: int  # the number of forces that were late because a state was late
    late_network: int  # the number of forces that were late because of the network, in either direction
    late_engine: int  # the number of forces that were late because the engine was slower than usual
    worst_late_ns: int  # the maximum time for which the device did not have a valid force
    longest_gap_ns: int  # the maximum time without a datagram from the client
    round_trip: Delays | None  # None if it was not measured
    to_server: Delays | None  # one way; None if it was not measured
    to_client: Delays | None  # one way; None if it was not measured
    # Clocks:
    clock_offset_ns: int  # the clock of the client minus the clock of the server
    clock_drift_ppm: float  # the rate at which the offset increases
    clock_error_ns: int  # an upper bound of |true offset − clock_offset_ns|
    # Datagrams of the client since the session opened:
    received: int
    lost: int
    reordered: int
    duplicated: int
    # In the interval:
    words: str  # An explanation of late and refused forces that can be shown to the user. It is empty if there are none
    late_unknown: int = 0  # the number of forces that are late for an unknown reason, because the client is silent
    # Forces of the client, on all its channels, that could not be used in the interval:
    refused_not_finite: int = 0  # a number is NaN or infinite
    refused_out_of_bounds: int = 0  # a number is beyond its bound
    refused_unknown_tick: int = 0  # based_on_tick was unknown or more than 4096 ticks ago
    refused_old_sequence: int = 0  # the sequence was not increased even though the datagram is the newest


@dataclass(frozen=True, slots=True)
class PortSurface:
    """A flat elastic surface that is or was touched by the tool of the sender. It can push but not pull."""

    normal: Vec3  # the direction out of the surface
    offset: float  # m, the surface is where normal · position = offset
    stiffness: float  # N/m, the stiffness, or 0 if there is no surface


@dataclass(frozen=True, slots=True)
class PortTurn:
    """The rotation of a handle since its offset was set."""

    turn: Quat  # the rotation in the axes of the sender's base frame
    angular_velocity: Vec3 = ZERO  # rad/s, the angular velocity, which is zero if the rotation is frozen
    torque: Vec3 = ZERO  # N·m, the actual torque on the hand at the handle of the sender


@dataclass(frozen=True, slots=True)
class PortGrip:
    """The state of a gripper, measured at its fingers. The gripper has a separate energy account."""

    opening: float = 0.0  # m
    velocity: float = 0.0  # m/s
    force: float = 0.0  # N. The actual force on the fingers. Positive values open them
    account: float = 0.0  # J, as in PortState
    need: float = 0.0  # J, as in PortState
    given: float = 0.0  # J, as in PortState
    taken: float = 0.0  # J, as in PortState


@dataclass(frozen=True, slots=True)
class PortState:
    """The state of one end of a coupling, which is sent to the other end. Vectors use the base frame and the scale of
    the SENDER's device. For their use, see core/teleoperation/coupling.h. Either way, unreliable, with the feature
    "teleoperation" only; for each device, channel and end the highest sequence of the highest epoch wins. An observer
    of the device is sent both ends of its coupling."""

    device: int  # the device of the server of this session, in both directions
    channel: int  # the channel of the server of this session, in both directions
    epoch: int  # the epoch of the sender, which is increased if the sender is restarted
    sequence: int  # the number of the haptic step of the sender in this epoch: 1, 2, 3 …
    answers_epoch: int  # the epoch of the receiver for `answers`, given and taken, or 0
    answers: int  # the sequence of the receiver's newest PortState that is used, or 0
    time_ns: int  # The time on the clock of the sender, which is only used for computing differences
    round_trip_ns: int  # The round trip that was measured by the sender, or 0 if it was not measured yet
    phase: PortPhase
    engagement: int = 0  # the number of the engagement of the leader that the phase belongs to: 1, 2, 3 …, or 0
    buttons: int = 0  # bit i is set if button i is pressed
    position: Vec3 = ZERO  # m, the displacement of the handle from the offset of the sender
    velocity: Vec3 = ZERO  # m/s, the velocity of this displacement, which is zero if the displacement is frozen
    force: Vec3 = ZERO  # N, the actual force on the hand at the handle of the sender
    # N. The force of the environment on the tool of the sender. None if it is not measured
    contact_force: Vec3 | None = None
    account: float = 0.0  # J, the energy that the sender may still output, minus its payments
    need: float = 0.0  # J. The energy that the sender needs for its desired force, or 0 if it does not have a tank
    # J. The total energy that was paid to the receiver. It does not decrease until one of the epochs changes
    given: float = 0.0
    taken: float = 0.0  # J, the given of the receiver that was received last, in joules of the receiver
    # For CouplingMethod.WAVES, √W·s: the integral of the wave since the start of the epoch. Since this is a total, lost
    # frames have no lasting effect. Half the square of a wave is a power. 0 if nothing was sent yet
    wave_integral: Vec3 = ZERO
    wave_energy: float = 0.0  # J, ∫ ‖wave‖²/2 dt; it never decreases within an epoch
    # For CouplingMethod.SURFACE, from the follower. None if it has not touched a surface yet
    surface: PortSurface | None = None
    turn: PortTurn | None = None  # None if the orientations are not coupled
    grip: PortGrip | None = None  # None if the grippers are not coupled
    # J. For CouplingMethod.PASSIVITY, the energy that was received by the port of the sender in this epoch
    energy_in: float = 0.0
    # The weight of the receiver if the follower has several leaders. None if the receiver is the only leader
    share: float | None = None
    # From a leader, in use from this frame on; 0: as in Couple. An observer is always sent the values:
    position_scale: float = 0.0
    force_scale: float = 0.0
    # To an observer:
    of_peer: bool = False  # if true, this is the other end of the coupling of the device, as received by the server


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """Statistics of the loop of a device. All counts are for the reported interval. Server → client, unreliable, to an
    observer with the feature "diagnostics" only; for each device the highest number wins."""

    number: int  # 1, 2, 3 … per device
    until_ns: int  # end of the reported interval, server clock
    span_ns: int  # length of the interval
    device: int
    steps: int  # haptic steps
    missed: int  # the number of periods that were skipped because the previous step was late
    overruns: int  # the number of steps that started too late (reason overrun)
    unseen: int  # the number of steps without a position
    # The number of steps by their delay. Entry 0 counts the steps that were at most 1 µs late, entry i the steps that
    # were more than 2^(i−1) µs and at most 2^i µs late, and entry 23 all steps that were more than 2^22 µs late. Zeros
    # at the end are omitted. If the server was not able to count all steps, the sum is smaller than `steps`
    lateness: tuple[int, ...]
    safety: Safety
    # The reason why the device does not exert forces until it is armed or rearmed, as text for the user. It is empty if
    # there is no fault
    fault: str
    # The service that is currently reduced by the server, as text for the user. It is empty if there is none
    degraded: str


@dataclass(frozen=True, slots=True)
class PeerReport:
    """Statistics of the engine that holds the lease of a channel. Server → client, unreliable, to an observer with the
    feature "diagnostics" only; for each device and channel the highest number of its link wins."""

    device: int
    channel: int
    name: str  # the name of the engine in its Hello
    state_one_in: int  # One of this many requested states is sent to the engine, because its link is congested
    forces_refused: bool  # If true, the forces of the engine are ignored because its link has lost too many datagrams
    # The report about the link of the engine. The number and the counts of forces are per channel; absent is refused
    link: LinkReport
    # Of the force in the interval with the largest ForceCommand.error; if none states an error, of the newest:
    error: float | None = None  # N. The estimated error of this force. None if errors are not estimated
    way: str = ""  # The entry of Hello.ways for this force. It is empty if it is unknown


@dataclass(frozen=True, slots=True)
class Claim:
    """Claims a device or a channel."""

    role: Role
    device: str = ""  # the name of the device, or empty for device 0
    channel: str = ""  # the name of the channel if the role is controller, or empty for channel 0


@dataclass(frozen=True, slots=True)
class Hello:
    """The first message of a client."""

    role: Role  # if there are claims, this is the highest role of them
    name: str = ""  # name for logs
    features: Sequence[str] = ()  # The features that are offered. A feature is used if both peers name it
    # The lowest version that is supported by the client. The highest common version is used
    version_min: int = PROTOCOL_VERSION
    version_max: int = PROTOCOL_VERSION  # the highest version that is supported by the client
    # The devices and channels that are claimed, without duplicates. If this is empty, the client is granted device 0
    # and its channel 0 with `role`
    claims: Sequence[Claim] = ()
    # With the feature "ways" only:
    # The names of the ways in which this engine can compute forces, starting with the fastest. They are used by
    # ForceCommand.way
    ways: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Grant:
    """The numbers of a device and a channel that were claimed using their names."""

    # The role that was granted. It is Role.OBSERVER if a controller was claimed, but another client holds the lease
    # (TakeLease)
    role: Role
    device: int = 0  # the number of the device in all later messages
    channel: int = 0  # the number of the channel in all later messages


@dataclass(frozen=True, slots=True)
class Welcome:
    """The server accepts the client."""

    version: int  # the version of this session, which is in the range of the client
    features: Sequence[str]  # the features that were named by both peers
    role: Role  # granted role
    device_name: str  # the kind of device
    max_force: float  # N, the maximum norm of the force
    position_resolution: float  # m. The size of an encoder count at the handle, or 0 if the position is exact
    loop_hz: int  # haptic steps per second
    timeout_ms: int  # the server forgets the client if it is silent for this time
    server: str  # the name and the version of the server
    # One for each claim, in the same order. The fields device_name … loop_hz describe the device of the first one.
    # Servers that do not support claims do not send any, and ignore the claims of the Hello
    grants: Sequence[Grant] = ()


@dataclass(frozen=True, slots=True)
class Refused:
    """The server refuses the client."""

    code: Code  # why
    detail: str = ""  # a sentence for people
    version_min: int = 0  # the lowest version that is supported by the server
    version_max: int = 0  # the highest version that is supported by the server


Request = Union[
    SetStateRate,
    Rearm,
    Describe,
    TakeLease,
    GiveLease,
    LeaseLost,
    SetStateDeadband,
    Disarm,
    SetOutput,
    Couple,
    Engage,
    Disengage,
    SetScale,
    SetShare,
    OfferField,
    UseField,
    DropField,
]

PlainFrame = Union[
    DeviceState,
    ForceCommand,
    ControlAck,
    Bye,
    LinkReport,
    DeviceReport,
    PeerReport,
    PortState,
    FieldBrick,
    FieldStatus,
    FieldPose,
]
"""Every frame but Control."""

Answer = Union[Welcome, Refused]

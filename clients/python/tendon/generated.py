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
    "Echo",
    "Engage",
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
    "Vec3",
    "Vibration",
    "Welcome",
    "ZERO",
]

Vec3 = tuple[float, float, float]
Mat3 = tuple[Vec3, Vec3, Vec3]

Quat = tuple[float, float, float, float]
"""A rotation as a unit quaternion (w, x, y, z), Hamilton's: w + x i + y j + z k. q and −q are the same rotation. It is
refused unless its norm is 1 ± 0.001."""

ZERO: Vec3 = (0.0, 0.0, 0.0)


class Mode(IntEnum):
    """How the device renders the remote force."""

    IDLE = 1  # no force has arrived yet, or none since the last safe stop
    ACTIVE = 2  # a fresh force is rendered
    HOLDING = 3  # the force is older than its validity and is still held
    DECAYING = 4  # the old force fades
    SAFE_STOP = 5  # the force has faded to zero; only a fresh force ends this
    FAULT = 6  # latched: zero force until a Rearm


class PortRole(IntEnum):
    """Which end of a coupling."""

    LEADER = 1
    FOLLOWER = 2


class CouplingMethod(IntEnum):
    """How two handles are coupled."""

    POSITION_POSITION = 1  # a spring and a damper between the handles, at both ends
    POSITION_FORCE = 2  # a spring pulls the follower; the leader feels the contact force that the follower measures
    WAVES = 3  # wave variables, through a playout buffer
    SURFACE = 4  # a spring pulls the follower; the leader feels a model of the surface that the follower found
    # velocity to the follower and force to the leader, each paid from the energy that the other end took in
    PASSIVITY = 5
    SET_POSITION = 6  # springs to delayed positions, stretched only as far as the energy account allows
    RATE = 7  # the position of the leader commands the velocity of the follower


class OutputKind(IntEnum):
    """The kind of an output."""

    LAMP = 1
    VIBRATION = 2  # a separate vibrator, not the motors of the axes


class Hand(IntEnum):
    """Which hand holds a device."""

    ANY = 0
    LEFT = 1
    RIGHT = 2


class ChannelRule(IntEnum):
    """How a device combines the forces of its channels: it adds the forces of all sum channels and the first fresh
    force of the priority channels, in the order of their numbers."""

    SUM = 1  # its force is added to the others
    PRIORITY = 2  # it silences the later channels of this rule


class PortPhase(IntEnum):
    """Phase of one end of a coupling."""

    ALONE = 1  # no peer
    COUPLED = 2  # connected to the peer, and waiting for the operator's Engage; no force
    ALIGNING = 3  # absolute maps: the leader is moved to the position of the follower
    ENGAGED = 4  # the handles are coupled
    CLUTCHED = 5  # the leader is free, the follower holds its position
    LOST = 6  # the peer fell silent while engaged; only another Engage engages again
    FAULT = 7  # the device exerts no force


class Safety(IntEnum):
    """The state of a device between being plugged in and exerting forces."""

    ABSENT = 1  # not plugged in
    OPENING = 2  # being opened
    FIRMWARE = 3  # has no firmware yet, or is receiving it
    UNHOMED = 4  # does not know its position yet
    HOMED = 5  # ready, and waits to be armed
    ARMED = 6  # exerts forces
    FAULT = 7  # disarmed by a fault: no force until it is armed again
    UNGUARDED = 8  # ready; its scene has no safety layer that could be armed


class Code(IntEnum):
    """Why a request was refused, or why a session ended."""

    OK = 1
    INVALID = 2  # a value is out of bounds or makes no sense
    UNSUPPORTED = 3  # this peer does not know the request, or has no version in common
    BUSY = 4  # another client has it, such as another controller
    DENIED = 5  # not with this role
    SHUTDOWN = 6  # the server is shutting down
    TIMED_OUT = 7  # nothing was received for too long
    EXPIRED = 8  # the session of suite 1 or 2 is too old: repeat the handshake
    REPLACED = 9  # another program with the same key has taken over: do not reconnect without being asked to


class Role(IntEnum):
    """An observer receives states; a controller also sends forces."""

    OBSERVER = 1  # receives device states
    CONTROLLER = 2  # also sends forces; one per channel


@dataclass(frozen=True, slots=True)
class Echo:
    """Acknowledges a datagram of the peer and measures the round trip: with T3 = tx_time_ns of the datagram that
    carries the echo and T4 = the time at which that datagram arrives, the round trip is (T4 − T1) − (T3 − T2)."""

    sent_ns: int  # T1, tx_time_ns of that datagram, on the peer's clock
    received_ns: int  # T2, when that datagram arrived, on the clock of the sender of the echo; T2 ≤ T3
    packet_number: int  # packet number of that datagram
    # bit i: packet (packet_number − 1 − i) has arrived too. A malformed packet counts as arrived in suites 1 and 2 only
    received_mask: int = 0


@dataclass(frozen=True, slots=True)
class Turning:
    """How the handle is turned."""

    # rotation from the handle frame to the device base frame. In the handle frame, when the handle is in its middle
    # position, the stylus or finger points along −z, y is up, and x is to the right
    orientation: Quat
    angular_velocity: Vec3 = ZERO  # rad/s, angular velocity in base frame axes; ignored without an orientation


@dataclass(frozen=True, slots=True)
class Grip:
    """How far the gripper of the handle is open."""

    opening: float  # rad, opening of the gripper, 0 when it is closed
    velocity: float = 0.0  # rad/s, velocity of the opening; ignored without grip.opening


@dataclass(frozen=True, slots=True)
class Joints:
    """The joints that carry the handle, in the order of HandleDescription.joints."""

    # rad, angles of the joints that carry the handle, in the order of HandleDescription.joints.
    angles: tuple[float, ...]
    # rad/s, velocities of the same joints; a missing entry is 0, and an entry without an angle is ignored
    velocities: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class DeviceState:
    """The state of a device at one haptic step. Server → client, unreliable; for each device the highest tick wins."""

    tick: int  # number of the haptic step
    sampled_ns: int  # when the position was sampled, on the server's clock
    position: Vec3  # m
    velocity: Vec3  # m/s
    force_applied: Vec3  # N, actual force on the hand, from this step on
    energy: float  # J, energy that the device may still give out (the energy ledger)
    permitted_force: float  # N, the limiter's bound on the norm of the force; +infinity if there is none
    reasons: int  # why the actual force differs from the requested one (bits of core/base/reason.h)
    force_sequence: int  # sequence of the ForceCommand that is rendered; 0 if there is none
    force_age_ns: int  # time since that ForceCommand arrived
    mode: Mode
    device: int = 0
    # channel of the force that force_sequence, force_age_ns and mode describe: the freshest one, or the one with the
    # lowest channel if several are equally fresh
    channel: int = 0
    # With the feature "diagnostics" only:
    # N, force on the hand that the engines request at this step (held, faded, or extrapolated by their models), before
    # any limit; None: not reported
    force_wanted: Vec3 | None = None
    # With the feature "diagnostics" only:
    # N/m, −∂force_wanted/∂position of the engines' models at this step; entries as in LocalModel.stiffness. None: no
    # model
    stiffness_wanted: Mat3 | None = None
    buttons: int = 0  # bit i: button i is held. A press between two states is reported in the later one
    turning: Turning | None = None  # None: not measured
    # N·m, actual torque on the hand about position, in base frame axes, from this step on; None: no motors that turn
    torque_applied: Vec3 | None = None
    grip: Grip | None = None  # None: no gripper
    # N, actual force on the fingers, > 0 opens them, from this step on; None: the gripper has no motor
    grip_applied: float | None = None
    hand_force: Vec3 | None = None  # N, of the hand ON THE HANDLE, measured by a force sensor; None: no force sensor
    joints: Joints | None = None  # None: the device reports none


@dataclass(frozen=True, slots=True)
class ForceTable:
    """Forces along the normal. Entry i is for the tool at at − (first + i · step) · normal."""

    first: float  # m, depth of entry 0, negative if it is farther out than at
    step: float  # m
    force: Sequence[float]  # N, forces along +normal


@dataclass(frozen=True, slots=True)
class Contact:
    """A surface that the tool touches or is about to touch. It pushes and does not pull, unless it has a table."""

    normal: Sequence[float]  # direction out of the body, towards the hand: a force along +normal pushes the hand away
    gap: float  # m, distance from the surface to the tool along the normal, negative if the tool is pressed in
    table: ForceTable | None = None  # forces along the normal at other depths


@dataclass(frozen=True, slots=True)
class LocalModel:
    """A local model of the force. The device loop evaluates it at the hand's position x:
    F(x) = force − stiffness · (x − at)
    With a radius or a contact see WIRE.md, "The force between two answers". A server that does not know them uses this
    equation."""

    at: Vec3  # m, position that force was computed for
    # N/m, −∂F/∂x; a spring is positive. 1 entry k is k·I, 3 are the diagonal, 9 are the matrix row by row. An engine
    # that does not know the stiffness sends a single 0
    stiffness: Mat3
    valid_radius: float = inf  # m, radius around at in which the model is valid; inf: not known
    contact: Contact | None = None  # surface that the tool touches or is about to touch


@dataclass(frozen=True, slots=True)
class RotationModel:
    """A local model of the torque. The device loop evaluates it at the handle's orientation q. With p = (w, v) = q ·
    at⁻¹, the rotation from at to q, and K = stiffness, it is
    τ(q) = torque − 2 (w K v + v × K v)        which is torque − K θ for a small rotation vector θ"""

    at: Quat  # orientation that torque was computed for; absent is refused
    stiffness: Mat3  # N·m/rad, −∂τ/∂θ in base frame axes; a spring is positive; entries as in LocalModel.stiffness


@dataclass(frozen=True, slots=True)
class Torque:
    """On the hand, base frame axes, about the handle's position."""

    torque: Vec3  # N·m, torque on the hand about the handle's position, in base frame axes
    # how the torque changes as the handle turns. It does not need a `model`, and an absent torque.torque is 0 in it
    model: RotationModel | None = None


@dataclass(frozen=True, slots=True)
class ForceCommand:
    """The force that a physics engine requests, as the answer to one state. Client → server, unreliable; for each
    device and channel the highest sequence wins."""

    sequence: int  # 1, 2, 3 … per session, device and channel
    based_on_tick: int  # DeviceState.tick of the state that the force was computed from
    force: Vec3  # N, force on the hand: a wall that resists motion along +x sends −x
    valid_for_us: int  # time from its arrival during which the force is fresh
    model: LocalModel | None = None  # how the force changes as the hand moves; None: the force is constant
    device: int = 0
    channel: int = 0
    # the body has been cut or torn since the previous answer: neither this model nor the previous one is used
    topology_changed: bool = False
    error: float | None = None  # N, the engine's estimate of the error of force; None: not known
    torque: Torque | None = None  # None: none is requested
    grip_force: float | None = None  # N, force on the fingers, > 0 opens them; None: none is requested
    # With the feature "ways" only:
    # index, from 1, in Hello.ways: the way in which the engine computed this force; 0 if it is not stated. A server
    # treats an index beyond the last entry as 0
    way: int = 0


@dataclass(frozen=True, slots=True)
class SetStateRate:
    """Sets how many states of a device the client is sent per second. Before the first such request it is sent every
    state, loop_hz per second. After it, the client is sent every k-th state, where k = loop_hz / hz, rounded, at least
    1: with loop_hz 1000, 300 Hz become 333 and 2000 Hz become 1000."""

    hz: int  # at least 1; 0 is answered with Code.INVALID
    device: int = 0


@dataclass(frozen=True, slots=True)
class SetStateDeadband:
    """Suppresses the states that the client can predict. After a state with velocity v, the server sends the first
    state whose velocity differs from v by more than max(share · ‖v‖, floor), whose mode or buttons differ, or that is
    max_silence_us newer. Between two states the client extrapolates: x + v · (t − sampled_ns)."""

    share: float = 0.1  # fraction of the speed (Weber fraction); answered Code.INVALID beyond 0 … 0.5
    floor: float = 1e-3  # m/s, smallest difference of the velocity; answered Code.INVALID beyond 0 … 0.1
    # longest time without a state; 0: every state is sent again. Answered Code.INVALID beyond 0 and 1000 … 20 000
    max_silence_us: int = 20_000


@dataclass(frozen=True, slots=True)
class Rearm:
    """Clears a latched fault and revokes a Disarm; only from a controller of the device. If the device has a safety
    layer, this is the operator's request to arm."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class Disarm:
    """Sets the force to zero from the next haptic step on, without a ramp, until a Rearm; only from a controller of the
    device, whether or not it holds the channel. A new force, a new session or the dead man's button alone does not end
    it. The device's Safety changes from armed to homed, and a pending request to arm is withdrawn. Disarm is not a
    fault and clears no fault. Repeating it has no effect. Code.OK: the device's loop receives the order before its next
    step."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class RateControl:
    """How the displacement of the leader's handle, which a spring pulls back to its center, commands the speed of the
    follower. All values are in the leader's scale."""

    dead_zone: float  # m, distance of the leader from its center within which the follower stands still
    gain: float  # 1/s, speed of the follower per meter beyond the dead zone
    max_speed: float  # m/s, maximum speed of the follower


@dataclass(frozen=True, slots=True)
class Couple:
    """Offers the sender's device as the other end of a coupling with this device, and describes that end; only from the
    client that has claimed the channel as a controller, with the feature "teleoperation". Code.OK: the two ends fit;
    both peers then send PortState frames, and the server sends no states. Code.INVALID: they do not fit, and the detail
    names the first difference. Code.UNSUPPORTED: that device cannot be coupled. Code.BUSY: that channel is coupled with
    another client; a follower has one channel for each of its leaders."""

    device: int  # device of the server
    channel: int  # channel of the server
    role: PortRole  # role of the sender; the server's device has the other role
    method: CouplingMethod
    position_scale: float  # the follower's motion divided by the leader's
    force_scale: float  # the leader's force divided by the follower's
    rotation: Quat  # turns the leader's base frame into the follower's; absent is refused
    axes: int  # bits 1, 2, 4: x, y, z of the leader's frame are coupled
    stiffness: float  # N/m, stiffness between the handles, as felt by the leader
    mutual_damping: float  # N·s/m, damping between the handles, as felt by the leader
    damping: float  # N·s/m, damping of each handle, as felt by the leader
    adapt_to_delay: bool  # the stiffness decreases as the round trip increases
    purse: bool  # the ends exchange energy (core/teleoperation/energy_tank.h)
    period_us: int  # time between two PortState frames of the sender
    absolute: bool = False  # positions map to positions: the offsets are zero, and the ends align before they engage
    # As felt by the leader. With a stiffness of 0 the part is not coupled:
    turn_stiffness: float = 0.0  # N·m/rad, stiffness between the orientations
    turn_damping: float = 0.0  # N·m·s/rad, damping between the orientations
    grip_stiffness: float = 0.0  # N/m, stiffness between the grippers, at the leader's fingers
    grip_damping: float = 0.0  # N·s/m, damping between the grippers
    # For one method only:
    drift_rate: float = 0.0  # 1/s. CouplingMethod.PASSIVITY: rate at which the follower corrects its drift
    rate: RateControl | None = None  # CouplingMethod.RATE; absent with the other methods


@dataclass(frozen=True, slots=True)
class Engage:
    """Couples the handles, on the operator's command. Only the leader's server accepts it, from a controller of the
    device. Code.OK: the device's loop has the order. Code.UNSUPPORTED: that device has no coupling, or is the
    follower."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class Disengage:
    """Ends the engagement. Either end's server accepts it, only from a controller of the device."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class SetScale:
    """Sets the scales of the coupling. Only the leader's server accepts it, from a controller of the device. Code.OK:
    the device's loop has the order. Code.BUSY: the leader is engaged and does not hold its clutch. Code.UNSUPPORTED:
    that device has no coupling, or is the follower."""

    device: int
    position_scale: float  # as in Couple
    force_scale: float  # as in Couple


@dataclass(frozen=True, slots=True)
class SetShare:
    """Sets the weight of one channel's leader among the leaders of a follower. Only the follower's server accepts it,
    from a controller of the device. The weight reaches the value within 0.5 s; the other leaders share the rest in the
    same proportion as before. Code.UNSUPPORTED: that device has no coupling, has one leader only, or is a leader."""

    device: int
    channel: int
    share: float


@dataclass(frozen=True, slots=True)
class Vibration:
    """A vibration pulse. It stops after its duration, or when a new pulse replaces it."""

    amplitude: float = 0.0  # fraction of the output's maximum; 0 is off
    frequency: float = 0.0  # Hz, 0 or at least 20; 0 is the output's own frequency
    duration_ms: int = 0


@dataclass(frozen=True, slots=True)
class LampColour:
    """The colour of a lamp."""

    rgb: int = 0  # color of a lamp, 0xRRGGBB; 0 is off: the lamp then shows the state of the device


@dataclass(frozen=True, slots=True)
class SetOutput:
    """Sets a lamp of the device or starts a vibration pulse; only from a controller of the device that holds one of its
    channels, with the feature "outputs". An output is switched off when the client that set it gives up or loses a
    channel of the device, and when the device is disarmed. Code.INVALID: the device has no such output, or it is of the
    other kind, or neither `rgb` nor `vibration` is there."""

    device: int
    output: int  # number in HandleDescription.outputs; answered Code.INVALID beyond the device's last
    setting: LampColour | Vibration


@dataclass(frozen=True, slots=True)
class Describe:
    """Requests the DeviceDescription of a device, whether the client has claimed the device or not."""

    device: int = 0  # answered Code.INVALID beyond the server's last device
    handle: bool = False  # with the feature "handle" only: requests the HandleDescription instead


@dataclass(frozen=True, slots=True)
class TakeLease:
    """Asks that the channel take the client's forces; only from a client that has claimed the channel as a controller.
    Code.OK: the client holds the lease. Code.BUSY: another client does, and wait_ms is the time until that lease ends
    unless it is renewed."""

    device: int = 0
    channel: int = 0


@dataclass(frozen=True, slots=True)
class GiveLease:
    """Releases the lease of a channel."""

    device: int = 0
    channel: int = 0


@dataclass(frozen=True, slots=True)
class LeaseLost:
    """Tells a client with the feature "channels" that the channel now takes the forces of another client."""

    device: int = 0
    channel: int = 0
    to: str = ""  # name of the new lease holder


@dataclass(frozen=True, slots=True)
class ChannelDescription:
    """A channel of a device and its lease."""

    name: str  # the name that a claim uses
    rule: ChannelRule
    # time without a force after which another client may take the lease; 0 if the lease does not expire
    lease_ms: int = 0
    holder: str = ""  # first 24 bytes of the lease holder's name; empty if there is none


@dataclass(frozen=True, slots=True)
class DeviceDescription:
    """The properties of a device."""

    device: int
    name: str  # the server's name for the device, which a claim uses
    model: str  # the kind of device, as Welcome.device_name
    position_dof: int  # number of measured axes
    force_dof: int  # number of axes with a motor
    workspace: tuple[Vec3, Vec3] | None  # None: not known
    max_force: float  # N, norm of the peak force; 0 if it is not known
    continuous_force: float  # N, norm of the force for any length of time; 0 if it is not known
    max_stiffness: float  # N/m, largest stiffness that the device renders stably; 0 if it is not known
    position_resolution: float  # m, one encoder count at the handle; 0 if the position is exact
    loop_hz: int  # haptic steps per second
    channels: Sequence[ChannelDescription]  # channels of the device, by number


@dataclass(frozen=True, slots=True)
class OutputDescription:
    """An output of a device, in addition to its forces."""

    name: str
    kind: OutputKind


@dataclass(frozen=True, slots=True)
class HandleDescription:
    """The properties of a device's handle, with the feature "handle" only."""

    device: int = 0
    # rotation from the device base frame to the operator's frame: x to the right, y up, z towards the user; None: not
    # known
    operator_from_device: Quat | None = None
    buttons: Sequence[str] = ()  # names by bit of DeviceState.buttons; a name may be empty
    orientation_measured: bool = False  # true if every state has an orientation, false if none has
    max_torque: float = 0.0  # N·m, norm of the torque that the device can exert; 0 if it has no such motors
    gripper_open: float | None = None  # rad, opening of the open gripper; None: no gripper
    max_gripper_force: float = 0.0  # N, force on the fingers; 0 if the gripper has no motor
    # name that the devices of one body share (two arms, five fingers); empty if the device is by itself
    group: str = ""
    hand: Hand = Hand.ANY
    # With the feature "joints" only:
    joints: Sequence[str] = ()  # names of the joints, in the order of DeviceState.joints.angles
    # With the feature "outputs" only:
    outputs: Sequence[OutputDescription] = ()  # outputs that SetOutput can set, by number


@dataclass(frozen=True, slots=True)
class ControlAck:
    """The answer to a Control."""

    id: int  # id of the answered Control
    code: Code
    detail: str = ""  # explanation for people
    # with Code.BUSY of TakeLease: time until the lease ends, unless its holder renews it; 0 if it is not known
    wait_ms: int = 0
    device: DeviceDescription | None = None  # with Code.OK of Describe
    handle: HandleDescription | None = None  # with Code.OK of Describe, if it requested the handle


@dataclass(frozen=True, slots=True)
class Bye:
    """The end of the session. Either way, sent three times."""

    code: Code  # reason for the end
    reason: str = ""  # explanation for people


@dataclass(frozen=True, slots=True)
class Delays:
    """Two quantiles of a delay. A one-way delay can be negative, because it compares two clocks."""

    median_ns: int
    p99_ns: int


@dataclass(frozen=True, slots=True)
class LinkReport:
    """Statistics of a client's forces and datagrams: why forces were late, and how the network performed. One-way
    delays depend on the estimated clock offset: they are accurate to ± clock_error_ns and can be negative. Server →
    client, unreliable; the highest number wins."""

    number: int  # 1, 2, 3 … per session
    until_ns: int  # end of the reported interval, server clock
    span_ns: int  # length of the interval
    # In the interval:
    forces: int  # forces that arrived
    late_server: int  # forces that were late because the server sent a state late
    late_network: int  # forces that were late because of the network, in either direction
    late_engine: int  # forces that were late because the engine took longer than usual
    worst_late_ns: int  # longest time that the device was without a valid force
    longest_gap_ns: int  # longest time without a datagram from the client
    round_trip: Delays | None  # None: not measured
    to_server: Delays | None  # one way; None: not measured
    to_client: Delays | None  # one way; None: not measured
    # Clocks:
    clock_offset_ns: int  # the client's clock minus the server's
    clock_drift_ppm: float  # rate at which the offset grows
    clock_error_ns: int  # upper bound of |true offset − clock_offset_ns|
    # Datagrams of the client since the session opened:
    received: int
    lost: int
    reordered: int
    duplicated: int
    # In the interval:
    words: str  # explanation of late and refused forces, for people; empty if there are none
    late_unknown: int = 0  # forces that are late for an unknown reason, because nothing is received from the client
    # Forces of the client, on all its channels, that could not be used in the interval:
    refused_not_finite: int = 0  # a number is NaN or infinite
    refused_out_of_bounds: int = 0  # a number is beyond its bound
    refused_unknown_tick: int = 0  # no step had the number based_on_tick, or it was more than 4096 ticks ago
    refused_old_sequence: int = 0  # sequence has not grown, although the datagram is the newest


@dataclass(frozen=True, slots=True)
class PortSurface:
    """A flat elastic surface that the sender's tool touches, or was the last to touch. It pushes and does not pull."""

    normal: Vec3  # direction out of the surface
    offset: float  # m, the surface is where normal · position = offset
    stiffness: float  # N/m, stiffness; 0 if the surface is gone


@dataclass(frozen=True, slots=True)
class PortTurn:
    """The rotation of a handle since its offset was taken."""

    turn: Quat  # rotation in the axes of the sender's base frame
    angular_velocity: Vec3 = ZERO  # rad/s, angular velocity; zero while the rotation is frozen
    torque: Vec3 = ZERO  # N·m, actual torque on the hand at the sender's handle


@dataclass(frozen=True, slots=True)
class PortGrip:
    """State of a gripper, measured at its fingers. The gripper has its own energy account."""

    opening: float = 0.0  # m
    velocity: float = 0.0  # m/s
    force: float = 0.0  # N, actual force on the fingers, > 0 opens them
    account: float = 0.0  # J, as in PortState
    need: float = 0.0  # J, as in PortState
    given: float = 0.0  # J, as in PortState
    taken: float = 0.0  # J, as in PortState


@dataclass(frozen=True, slots=True)
class PortState:
    """The state of one end of a coupling, sent to the other end. Vectors are in the base frame and the scale of the
    SENDER's device. core/teleoperation/coupling.h describes their use. Either way, unreliable, with the feature
    "teleoperation" only; for each device, channel and end the highest sequence of the highest epoch wins. An observer
    of the device is sent both ends of its coupling."""

    device: int  # device of the session's server, in both directions
    channel: int  # channel of the session's server, in both directions
    epoch: int  # epoch of the sender, which increases when the sender restarts
    sequence: int  # 1, 2, 3 … within an epoch: the sender's haptic steps
    answers_epoch: int  # epoch of the receiver that `answers`, given and taken belong to; 0: none yet
    answers: int  # sequence of the receiver's newest PortState in use; 0: none yet
    time_ns: int  # time on the sender's clock; only differences are used
    round_trip_ns: int  # round trip measured by the sender; 0 before the first measurement
    phase: PortPhase
    engagement: int = 0  # number of the leader's engagement that the phase belongs to: 1, 2, 3 …; 0: none yet
    buttons: int = 0  # bit i: button i is held
    position: Vec3 = ZERO  # m, displacement of the handle from the sender's offset
    velocity: Vec3 = ZERO  # m/s, velocity of that displacement; zero while the displacement is frozen
    force: Vec3 = ZERO  # N, actual force on the hand at the sender's handle
    contact_force: Vec3 | None = None  # N, force of the environment on the sender's tool; None: not measured
    account: float = 0.0  # J, energy that the sender may still give out, after its payments
    need: float = 0.0  # J, energy that the sender needs for its desired force; 0: it has no tank
    given: float = 0.0  # J, total paid to the receiver; it never decreases while both epochs last
    taken: float = 0.0  # J, the receiver's given, as last received, in joules of the receiver
    # CouplingMethod.WAVES: √W·s, ∫ wave dt since the epoch began: a total, so a lost frame has no lasting effect; half
    # the square of a wave is a power. 0: nothing sent yet
    wave_integral: Vec3 = ZERO
    wave_energy: float = 0.0  # J, ∫ ‖wave‖²/2 dt; it never decreases within an epoch
    surface: PortSurface | None = None  # CouplingMethod.SURFACE, from the follower; None: no surface was touched yet
    turn: PortTurn | None = None  # None: the orientations are not coupled
    grip: PortGrip | None = None  # None: the grippers are not coupled
    energy_in: float = 0.0  # J. CouplingMethod.PASSIVITY: energy that the sender's port took in during this epoch
    # weight of the receiver among the leaders of a follower; None: the receiver is the only leader
    share: float | None = None
    # From a leader, in use from this frame on; 0: as in Couple. An observer is always sent the values:
    position_scale: float = 0.0
    force_scale: float = 0.0
    # To an observer:
    of_peer: bool = False  # true if this is the other end of the device's coupling, as the server received it


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """Performance of a device's loop. All counts are for the reported interval. Server → client, unreliable, to an
    observer with the feature "diagnostics" only; for each device the highest number wins."""

    number: int  # 1, 2, 3 … per device
    until_ns: int  # end of the reported interval, server clock
    span_ns: int  # length of the interval
    device: int
    steps: int  # haptic steps
    missed: int  # periods without a step, because the previous step was late
    overruns: int  # steps that began too long after the previous one (reason overrun)
    unseen: int  # steps in which the device reported no position
    # how late the loop woke: entry 0 counts the steps that were at most 1 µs late, entry i those more than 2^(i−1) µs
    # and at most 2^i µs late, entry 23 all those more than 2^22 µs late. Trailing zeros are omitted. The sum is less
    # than `steps` only if the server failed to count some
    lateness: tuple[int, ...]
    safety: Safety
    fault: str  # why the device exerts no force until it is armed or rearmed, for people; empty if there is no fault
    degraded: str  # service that the server reduces at present, for people; empty if there is none


@dataclass(frozen=True, slots=True)
class PeerReport:
    """Performance of the engine that holds the lease of a channel. Server → client, unreliable, to an observer with the
    feature "diagnostics" only; for each device and channel the highest number of its link wins."""

    device: int
    channel: int
    name: str  # name of the engine, as in its Hello
    state_one_in: int  # the engine is sent one in this many of its requested states, because its link is full
    forces_refused: bool  # the server ignores its forces, because its link loses too many datagrams
    link: LinkReport  # report on the engine's link; number and the counts of forces are per channel; absent is refused
    # Of the force in the interval with the largest ForceCommand.error; if none states an error, of the newest:
    error: float | None = None  # N, estimated error of that force; None: no force states an error
    way: str = ""  # entry of Hello.ways for that force; empty if it is not stated


@dataclass(frozen=True, slots=True)
class Claim:
    """A device or a channel that the client wants."""

    role: Role
    device: str = ""  # name of the device; empty: device 0
    channel: str = ""  # name of the channel, from a controller; empty: channel 0


@dataclass(frozen=True, slots=True)
class Hello:
    """The first message of a client."""

    role: Role  # with claims, the highest role among them
    name: str = ""  # name for logs
    features: Sequence[str] = ()  # offered features; a feature is used if both peers name it
    version_min: int = PROTOCOL_VERSION  # lowest version that the client speaks; the highest common version is used
    version_max: int = PROTOCOL_VERSION  # highest version that the client speaks
    # claimed devices and channels, each once. Without claims, the client is granted device 0 and its channel 0 with
    # `role`
    claims: Sequence[Claim] = ()
    # With the feature "ways" only:
    # names of the ways in which this engine computes forces, the fastest first; ForceCommand.way is an index in it
    ways: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Grant:
    """The numbers of a device and a channel that were claimed by name."""

    role: Role  # granted role; Role.OBSERVER for a controller's claim if another client holds the lease (TakeLease)
    device: int = 0  # number of the device in all later messages
    channel: int = 0  # number of the channel in all later messages


@dataclass(frozen=True, slots=True)
class Welcome:
    """The server accepts the client."""

    version: int  # version of the session, within the client's range
    features: Sequence[str]  # features that both peers named
    role: Role  # granted role
    device_name: str  # the kind of device
    max_force: float  # N, norm of the force that the device can exert
    position_resolution: float  # m, one encoder count at the handle; 0 if the position is exact
    loop_hz: int  # haptic steps per second
    timeout_ms: int  # silence after which the server forgets this client
    server: str  # name and version of the server
    # one for each claim, in the claims' order; device_name … loop_hz are those of the first grant's device. A server
    # that does not know claims sends none, and treats the Hello as one without claims
    grants: Sequence[Grant] = ()


@dataclass(frozen=True, slots=True)
class Refused:
    """The server refuses the client."""

    code: Code  # why
    detail: str = ""  # a sentence for people
    version_min: int = 0  # lowest version that the server speaks
    version_max: int = 0  # highest version that the server speaks


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
]

PlainFrame = Union[DeviceState, ForceCommand, ControlAck, Bye, LinkReport, DeviceReport, PeerReport, PortState]
"""Every frame but Control."""

Answer = Union[Welcome, Refused]

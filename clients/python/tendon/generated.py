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
"""A rotation as a unit quaternion (w, x, y, z), Hamilton's: w + x i + y j + z k. q and −q are the same rotation. Its
norm is 1 ± 0.001, or it is refused."""

ZERO: Vec3 = (0.0, 0.0, 0.0)


class Mode(IntEnum):
    """How the device renders the remote force."""

    IDLE = 1  # no force has come yet, or none since the last safe stop
    ACTIVE = 2  # a fresh force is rendered
    HOLDING = 3  # it has outlived its validity and is held a little longer
    DECAYING = 4  # … and now fades
    SAFE_STOP = 5  # … and is now zero; only a fresh force re-engages
    FAULT = 6  # latched: zero force until a Rearm


class PortRole(IntEnum):
    """Which end of a coupling."""

    LEADER = 1
    FOLLOWER = 2


class CouplingMethod(IntEnum):
    """How two handles are coupled."""

    POSITION_POSITION = 1  # a spring and a damper at both ends
    POSITION_FORCE = 2  # the follower's spring; the leader feels the contact that the follower measures
    WAVES = 3  # wave variables, played out
    SURFACE = 4  # the leader feels a model of the surface that the follower found
    PASSIVITY = 5  # velocity there and force back, each paid from what the other took in
    SET_POSITION = 6  # springs to late positions, stretched only as far as the account pays
    RATE = 7  # the position of the leader is the speed of the follower


class OutputKind(IntEnum):
    """The kind of an output."""

    LAMP = 1
    VIBRATION = 2  # not by the motors of the position


class Hand(IntEnum):
    """Which hand holds a device."""

    ANY = 0
    LEFT = 1
    RIGHT = 2


class ChannelRule(IntEnum):
    """How a device makes one force of its channels': those of the sum, and the first fresh one of those with a
    priority, in the order of their numbers."""

    SUM = 1  # its force is added to the others
    PRIORITY = 2  # it silences the channels of this rule that come after it


class PortPhase(IntEnum):
    """Where an end of a coupling stands."""

    ALONE = 1  # it has no peer
    COUPLED = 2  # it hears its peer, and waits for the operator's act; no force
    ALIGNING = 3  # absolute maps: the leader is led to where the follower is
    ENGAGED = 4  # the law
    CLUTCHED = 5  # the leader is free, the follower stays where it is
    LOST = 6  # it was engaged, and its peer fell silent; engaged again only by another act
    FAULT = 7  # its device gives no force


class Safety(IntEnum):
    """Where a device stands between the plug and the force."""

    ABSENT = 1  # not plugged in
    OPENING = 2  # being opened
    FIRMWARE = 3  # has, or is being given, no firmware yet
    UNHOMED = 4  # does not know where it is yet
    HOMED = 5  # ready, and waiting to be armed
    ARMED = 6  # gives forces
    FAULT = 7  # was armed, and something happened: no force until it is armed again
    UNGUARDED = 8  # ready; its scene lists no safety layer, so that there is nothing to arm


class Code(IntEnum):
    """The reason for a refusal or an end."""

    OK = 1
    INVALID = 2  # the value makes no sense
    UNSUPPORTED = 3  # this peer does not know that request or version
    BUSY = 4  # somebody else has it: a second controller
    DENIED = 5  # not with this role
    SHUTDOWN = 6  # the server is going down
    TIMED_OUT = 7  # nothing was heard for too long
    EXPIRED = 8  # a session of suite 1 has reached its age: shake hands again
    REPLACED = 9  # another program with the same key has taken this place: do not come back unasked


class Role(IntEnum):
    OBSERVER = 1  # sees device states
    CONTROLLER = 2  # … and sends forces; one per channel


@dataclass(frozen=True, slots=True)
class Echo:
    """The newest datagram received from the other side. With T3 = tx_time_ns of the datagram that carries it and T4 =
    its arrival, the round trip is (T4 − T1) − (T3 − T2)."""

    sent_ns: int  # T1, its tx_time_ns: the RECEIVER's clock
    received_ns: int  # T2, when it arrived
    packet_number: int
    received_mask: int = 0  # bit i: packet (packet_number − 1 − i) has arrived too


@dataclass(frozen=True, slots=True)
class Turning:
    """How the handle is turned."""

    orientation: Quat  # turns the handle frame into the base frame
    angular_velocity: Vec3 = ZERO  # rad/s, only with an orientation


@dataclass(frozen=True, slots=True)
class Grip:
    """How far the gripper of the handle is open."""

    opening: float  # rad, opening, 0 = closed
    velocity: float = 0.0  # rad/s, only with an opening


@dataclass(frozen=True, slots=True)
class Joints:
    """The joints that carry the handle, in the order of HandleDescription.joints."""

    # rad. Only to a client that named the feature "joints", in the order of HandleDescription.joints. None: the device
    # tells none. A velocity that is absent is 0, one without an angle says nothing.
    angles: tuple[float, ...]
    velocities: tuple[float, ...]  # rad/s


@dataclass(frozen=True, slots=True)
class DeviceState:
    """A device at one haptic step. Server → client, unreliable, of each device the newest tick wins."""

    tick: int  # number of the haptic step
    sampled_ns: int  # when the position was sampled; integrate with its differences
    position: Vec3  # m
    velocity: Vec3  # m/s
    force_applied: Vec3  # N, on the hand, as the device really exerts it from this step on
    energy: float  # J, the energy ledger: what the device may still give out
    permitted_force: float  # N, the limiter's bound on the norm; +infinity: no bound
    reasons: int  # bits of core/base/reason.h: why the force is not what was asked for
    force_sequence: int  # ForceCommand rendered now; 0 = none
    force_age_ns: int  # its age since it arrived
    mode: Mode
    device: int = 0
    channel: int = 0  # of the force that force_sequence, force_age_ns and mode are about
    # N. What the engines ask for at this step, held, faded or led on by their local models, before any limit. None: not
    # told; only to an observer that named the feature "diagnostics"
    force_wanted: Vec3 | None = None
    # N/m, −∂force_wanted/∂position, N/m, as the engines' models say it at this step; its entries as those of
    # LocalModel.stiffness. None: no model. To whom force_wanted is told
    stiffness_wanted: Mat3 | None = None
    buttons: int = 0  # bit i: button i is held; a press between two states of a client is in the next one
    turning: Turning | None = None  # None: not measured
    torque_applied: Vec3 | None = None  # N·m, about position, from this step on; None: no motors that turn
    grip: Grip | None = None  # None: no gripper
    grip_applied: float | None = None  # N, on the fingers, > 0 opens them; None: no motor
    hand_force: Vec3 | None = None  # N, of the hand ON THE HANDLE; None: no force sensor
    joints: Joints | None = None  # None: the device tells none


@dataclass(frozen=True, slots=True)
class ForceTable:
    """The force along the normal, at the depths first + i · step below at: at − depth · normal."""

    first: float  # m, below 0: nearer to the hand
    step: float  # m
    force: Sequence[float]  # N, along +normal


@dataclass(frozen=True, slots=True)
class Contact:
    """A surface that the tool touches or is about to. It only pushes, unless a table says otherwise."""

    normal: Sequence[float]  # out of the body, to the hand; of length 1 ± 0.001
    gap: float  # m, from the surface to the tool along the normal; below 0: so deep is it pressed in
    table: ForceTable | None = None


@dataclass(frozen=True, slots=True)
class LocalModel:
    """The remote environment near one position, so that the device loop can follow the hand:
    F(x) = force − stiffness · (x − at)
    What else it can say WIRE.md describes. A server that does not know the rest follows the stiffness."""

    at: Vec3  # m
    # N/m, −∂F/∂x; a spring is positive. 1 entry k: k·I. 3 entries: the diagonal. 9: the matrix, row by row. Any other
    # number is refused.
    stiffness: Mat3
    valid_radius: float = inf  # m, how far from at it holds; inf: not said
    contact: Contact | None = None


@dataclass(frozen=True, slots=True)
class RotationModel:
    """The torque near one orientation, so that the device loop can follow the hand's turns. With p = (w, v) = the
    rotation from at to the handle's orientation, q · at⁻¹, and K = stiffness:
    τ(q) = torque − 2 (w K v + v × K v)        −K θ for a small turn θ"""

    at: Quat  # absent is refused
    stiffness: Mat3  # N·m/rad, −∂τ/∂θ, base frame axes; its entries as those of stiffness.


@dataclass(frozen=True, slots=True)
class Torque:
    """On the hand, base frame axes, about the handle's position."""

    torque: Vec3  # N·m, on the hand, about the handle's position
    model: RotationModel | None = None


@dataclass(frozen=True, slots=True)
class ForceCommand:
    """The force that the physics engine wants. Client → server, unreliable, of each device and channel the newest
    sequence wins."""

    sequence: int  # 1, 2, 3 … per session, device and channel
    based_on_tick: int  # DeviceState.tick of that device it was computed from: the loop's true age needs no clock
    force: Vec3  # N, on the hand: a wall that resists motion along +x sends −x
    valid_for_us: int  # counted from arrival
    model: LocalModel | None = None
    device: int = 0
    channel: int = 0
    topology_changed: bool = False  # cut or torn since the answer before this one: neither's model is relied on
    error: float | None = None  # N, how wrong the engine thinks force may be; None: not said
    torque: Torque | None = None  # None: none is asked for
    grip_force: float | None = None  # N, on the fingers, > 0 opens them; None: none is asked for
    # Only to a server that granted the feature "ways": which of Hello.ways has answered, from 1 on; 0: not said
    way: int = 0


@dataclass(frozen=True, slots=True)
class SetStateRate:
    """How many states of a device per second the client wants."""

    hz: int
    device: int = 0


@dataclass(frozen=True, slots=True)
class SetStateDeadband:
    """Leave out the states that this client can foretell: after a state with velocity v the next one that is sent is
    the first whose velocity differs from v by more than max(share · ‖v‖, floor), whose mode or buttons differ, or which
    comes max_silence_us later. In between the client goes on along the line: x + v · (t − sampled_ns)."""

    share: float = 0.1  # Weber's; a server grants 0 … 0.5
    floor: float = 1e-3  # m/s, a server grants 0 … 0.1
    max_silence_us: int = 20_000  # a server grants 1000 … 20 000; 0 = every state is sent, as before this was asked


@dataclass(frozen=True, slots=True)
class Rearm:
    """Clears a latched fault, and takes a Disarm back. With a safety layer it is the operator's request to arm. Only
    from a controller of the device."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class Disarm:
    """No force from the next haptic step on, without a ramp, whatever engines ask for, until a Rearm: neither a new
    force nor a new session ends it, nor the dead man's button by itself. Safety goes from armed to homed, and a pending
    request to arm is withdrawn. It is no fault, and clears none. Asking twice is asking once. Only from a controller of
    the device, whether it holds the channel or not. Code.OK: the device's loop has the order before its next step."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class RateControl:
    """The leader's handle, pulled back to its centre, says how fast the follower moves."""

    dead_zone: float  # m, the follower stands while the leader is nearer than this to its centre
    gain: float  # 1/s, speed of the follower, in the leader's scale, for each metre beyond that
    max_speed: float  # m/s, of the follower, in the leader's scale


@dataclass(frozen=True, slots=True)
class Couple:
    """My device is the other end of this one: what my end is like. From whoever has claimed the channel as a
    controller, to a server that granted "teleoperation". Code.OK: they fit; the client is sent no states any more but
    PortStates, and sends them. Code.INVALID: the first thing that differs, in words. Code.UNSUPPORTED: that device is
    not to be coupled. Code.BUSY: that channel is coupled with another client; a follower with several leaders has one
    for each channel."""

    device: int
    channel: int
    role: PortRole  # of the sender: the other end has the other one
    method: CouplingMethod
    position_scale: float  # follower over leader
    force_scale: float  # leader over follower
    rotation: Quat  # turns the leader's base frame into the follower's; absent is refused
    axes: int  # bits 1, 2, 4: x, y, z of the leader's frame are coupled
    stiffness: float  # N/m, these as the leader feels them
    mutual_damping: float  # N·s/m
    damping: float  # N·s/m
    adapt_to_delay: bool
    purse: bool  # it pays and is paid
    period_us: int  # between two PortStates
    # a place of the leader is a place of the follower: offsets are zero, and the two align first
    absolute: bool = False
    # As the leader feels them; a stiffness of 0: that part of the handle is not coupled:
    turn_stiffness: float = 0.0  # N·m/rad, of the orientations
    turn_damping: float = 0.0  # N·m·s/rad
    grip_stiffness: float = 0.0  # N/m, of the grippers, at the fingers
    grip_damping: float = 0.0  # N·s/m
    drift_rate: float = 0.0  # 1/s. CouplingMethod.PASSIVITY
    rate: RateControl | None = None  # CouplingMethod.RATE; absent with the others


@dataclass(frozen=True, slots=True)
class Engage:
    """The operator's act: couples the handles, at the leader's server. Only from a controller of the device. Code.OK:
    the device's loop has the order. Code.UNSUPPORTED: that device has no coupling, or is the follower."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class Disengage:
    """Ends that, at either end. Only from a controller of the device."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class SetScale:
    """The scales of the coupling from now on, at the leader's server. Only from a controller of the device, while the
    leader is not engaged or holds its clutch: else Code.BUSY. Code.OK: the device's loop has the order.
    Code.UNSUPPORTED: that device has no coupling, or is the follower."""

    device: int
    position_scale: float  # follower over leader
    force_scale: float  # leader over follower


@dataclass(frozen=True, slots=True)
class SetShare:
    """How much the leader of that channel counts among the leaders of a follower, at the follower's server. It gets
    there within 0.5 s, and the others share what is left as they did. Only from a controller of the device.
    Code.UNSUPPORTED: that device has no coupling, or one leader only, or is a leader."""

    device: int
    channel: int
    share: float


@dataclass(frozen=True, slots=True)
class Vibration:
    """A pulse. It ends by itself; another one takes its place at once."""

    amplitude: float = 0.0  # of the strongest that the output can; 0 = off
    frequency: float = 0.0  # at least 20, or 0: the output's own
    duration_ms: int = 0


@dataclass(frozen=True, slots=True)
class LampColour:
    """The colour of a lamp."""

    rgb: int = 0  # of a lamp, 0xRRGGBB; 0 = off: it shows what the device itself shows


@dataclass(frozen=True, slots=True)
class SetOutput:
    """Sets a lamp of the device, or makes it vibrate: from a controller of the device that holds one of its channels.
    To a server that granted the feature "outputs". An output is off again when the client that set it gives a channel
    of the device up or loses it, and when the device is disarmed. Code.INVALID: the device has no such output, or not
    of that kind."""

    device: int
    output: int  # number in HandleDescription.outputs
    setting: LampColour | Vibration


@dataclass(frozen=True, slots=True)
class Describe:
    """What a device is and can do: answered with a DeviceDescription. Of any device that the server has, claimed or
    not."""

    device: int = 0
    handle: bool = False  # answered with a HandleDescription instead


@dataclass(frozen=True, slots=True)
class TakeLease:
    """I want to be the one whose forces this channel takes. From whoever has claimed it as a controller. Code.OK: you
    are, from now on. Code.BUSY: another one is; wait_ms says for how much longer its lease lasts unless renewed."""

    device: int = 0
    channel: int = 0


@dataclass(frozen=True, slots=True)
class GiveLease:
    """I do not want to be it any more."""

    device: int = 0
    channel: int = 0


@dataclass(frozen=True, slots=True)
class LeaseLost:
    """You are not it any more. Only to a client that named the feature "channels"."""

    device: int = 0
    channel: int = 0
    to: str = ""  # name of the one that is


@dataclass(frozen=True, slots=True)
class ChannelDescription:
    name: str
    rule: ChannelRule
    # A holder that sends no force for so long may be followed by another; 0 = it stays until it leaves. ≤ 3 600 000
    lease_ms: int = 0
    holder: str = ""  # name of the client whose forces it takes, its first 24 bytes; empty = nobody's


@dataclass(frozen=True, slots=True)
class DeviceDescription:
    """What a device is and can do."""

    device: int
    name: str  # as the server calls it
    model: str  # what it is
    position_dof: int  # axes that are measured …
    force_dof: int  # … and those with a motor
    workspace: tuple[Vec3, Vec3] | None  # None: not known
    max_force: float  # N, norm of the force the device can give out
    continuous_force: float  # N, … for ever; 0 = not known
    max_stiffness: float  # N/m, what it can render stably; 0 = not known
    position_resolution: float  # m, one encoder count at the handle; 0 = exact
    loop_hz: int  # haptic steps per second
    channels: Sequence[ChannelDescription]  # by number


@dataclass(frozen=True, slots=True)
class OutputDescription:
    """An output of a device, beside its forces."""

    name: str
    kind: OutputKind


@dataclass(frozen=True, slots=True)
class HandleDescription:
    """What the handle of a device is and can do. To a client of a server that granted the feature "handle"."""

    device: int = 0
    # Turns the base frame into the operator's: x right, y up, z to the user; None: not known
    operator_from_device: Quat | None = None
    buttons: Sequence[str] = ()  # names by bit of DeviceState.buttons
    orientation_measured: bool = False  # else no state has an orientation
    max_torque: float = 0.0  # N·m, norm of the torque the device can give out; 0 = none
    gripper_open: float | None = None  # rad, the opening of the open gripper; None: no gripper
    max_gripper_force: float = 0.0  # N, on the fingers; 0 = it has no motor
    group: str = ""  # devices of one body (two arms, five fingers) have the same; empty: by itself
    hand: Hand = Hand.ANY
    # Only to a client that named the feature "joints": names of the joints, in the order of DeviceState.joints.angles
    joints: Sequence[str] = ()
    # Only to a client that named the feature "outputs": what SetOutput can set, by number
    outputs: Sequence[OutputDescription] = ()


@dataclass(frozen=True, slots=True)
class ControlAck:
    """The answer to a Control."""

    id: int  # of the Control that is answered
    code: Code
    detail: str = ""
    wait_ms: int = 0  # with Code.BUSY of TakeLease: ms; 0 = nobody knows
    device: DeviceDescription | None = None  # with Code.OK of Describe
    handle: HandleDescription | None = None  # with Code.OK of Describe that asks for the handle


@dataclass(frozen=True, slots=True)
class Bye:
    """Either way, said three times."""

    code: Code
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Delays:
    """Two quantiles of a delay. They can be below zero if two clocks had to be compared."""

    median_ns: int
    p99_ns: int


@dataclass(frozen=True, slots=True)
class LinkReport:
    """What became of a client's forces and datagrams, as the server saw it: why a force was late, and what the network
    did. Times of one way hold as far as the clocks are known, ± clock_error_ns: they may be below zero. Server →
    client, unreliable, newest number wins."""

    number: int  # 1, 2, 3 … per session
    until_ns: int  # end of the time it tells of
    span_ns: int  # … and its length
    # In that time:
    forces: int  # that came
    late_server: int  # late ones, because the server sent a state late
    late_network: int  # … because of the way there and back
    late_engine: int  # … because the engine took longer than usual
    worst_late_ns: int  # longest time that the device was without a valid force
    longest_gap_ns: int  # longest time that nothing was heard of the client
    round_trip: Delays | None  # None: not measured; the same for the next two
    to_server: Delays | None
    to_client: Delays | None
    clock_offset_ns: int  # the client's clock less the server's
    clock_drift_ppm: float  # how fast that grows
    clock_error_ns: int  # |true offset − clock_offset_ns| is at most this
    # Datagrams of the client since the session opened:
    received: int
    lost: int
    reordered: int
    duplicated: int
    words: str  # why forces were late or refused, for people; empty when none was
    # In the time that it tells of:
    late_unknown: int = 0  # late forces whose cause is not known yet: nothing is heard of the client
    # Forces of the client, on all its channels, that could not be used:
    refused_not_finite: int = 0  # a number is NaN or infinite
    refused_out_of_bounds: int = 0  # a number is beyond its bound
    refused_unknown_tick: int = 0  # based_on_tick never was, or was more than 4096 ticks ago
    refused_old_sequence: int = 0  # sequence has not grown, though the datagram is the newest


@dataclass(frozen=True, slots=True)
class PortSurface:
    """A flat, springy surface that the sender's tool touches, or touched last. It only pushes."""

    normal: Vec3  # out of the surface; of length 1 ± 0.001
    offset: float  # m, the surface is where normal · position is this
    stiffness: float  # N/m, 0: there is none any more


@dataclass(frozen=True, slots=True)
class PortTurn:
    """How a handle has turned since its offset was taken."""

    turn: Quat  # in the axes of the sender's base frame; of length 1 ± 0.001
    angular_velocity: Vec3 = ZERO  # rad/s
    torque: Vec3 = ZERO  # N·m, on whoever holds the handle, really applied


@dataclass(frozen=True, slots=True)
class PortGrip:
    """A gripper, measured at its fingers. It is a port of its own, with an account of its own."""

    opening: float = 0.0  # m
    velocity: float = 0.0  # m/s
    force: float = 0.0  # N, on the fingers, > 0 opens them; really applied
    account: float = 0.0  # J, these four as in PortState
    need: float = 0.0  # J
    given: float = 0.0  # J
    taken: float = 0.0  # J


@dataclass(frozen=True, slots=True)
class PortState:
    """One end of a coupling of two devices, told to the other. Vectors are in the base frame and the scale of the
    SENDER's device. How it is used core/teleoperation/coupling.h says. Only between peers that both named the feature
    "teleoperation", either way, unreliable: of each device, channel and end the highest sequence of the highest epoch
    wins. To an observer of the device, both ends of its coupling."""

    device: int  # of the server of the session, whichever way this goes
    channel: int
    epoch: int  # of the sender; above every one before when it starts anew
    sequence: int  # 1, 2, 3 … within an epoch: its haptic steps
    answers_epoch: int  # the receiver's epoch that the next one, given and taken belong to; 0: none yet
    answers: int  # sequence of the receiver's newest state in use; 0: none yet
    time_ns: int  # of the sender's clock; only differences are used
    round_trip_ns: int  # that the sender has measured; 0: not yet
    phase: PortPhase
    engagement: int = 0  # number of the leader's act that the phase belongs to; 0: none yet
    buttons: int = 0  # bit i: button i is held
    position: Vec3 = ZERO  # m, from the sender's offset
    velocity: Vec3 = ZERO  # m/s, zero while the position is frozen
    force: Vec3 = ZERO  # N, on whoever holds its handle, really applied
    contact_force: Vec3 | None = None  # N, of the surroundings on its tool; None: not measured
    account: float = 0.0  # J, its account after giving
    need: float = 0.0  # J, what it needs for the force that it wants; 0: it has no purse
    given: float = 0.0  # J, total given to the receiver; never falls within two epochs
    taken: float = 0.0  # J, the receiver's total that was heard of, in the receiver's joules
    # CouplingMethod.WAVES: sums since the epoch began, so that no loss is permanent. 0: nothing sent yet. √W·s: ∫ wave
    # dt; half the square of a wave is a power
    wave_integral: Vec3 = ZERO
    wave_energy: float = 0.0  # J, ∫ ‖wave‖²/2 dt; never falls within an epoch
    surface: PortSurface | None = None  # CouplingMethod.SURFACE, of a follower; None: it has touched nothing yet
    turn: PortTurn | None = None  # None: the orientations are not coupled
    grip: PortGrip | None = None  # None: the grippers are not coupled
    energy_in: float = 0.0  # J. CouplingMethod.PASSIVITY: total that its port took in, in this epoch
    share: float | None = None  # of a follower: how much this leader counts; None: it is the only one
    # Of a leader, in use from this state on. 0: as in Couple. An observer has seen no Couple, and is told them.
    position_scale: float = 0.0
    force_scale: float = 0.0
    of_peer: bool = False  # to an observer: of the other end of the device's coupling, as it came to the server


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """How a device's loop does. Numbers of things are of the time that the report tells of. Server → client,
    unreliable, of each device the newest number wins."""

    number: int  # 1, 2, 3 … of the device
    until_ns: int  # end of the time it tells of
    span_ns: int  # … and its length
    device: int
    steps: int  # haptic steps
    missed: int  # periods without a step, because the one before came so late
    overruns: int  # steps so long after the one before that it is a reason (REASON overrun)
    unseen: int  # steps in which the device gave no position
    # How late the loop woke: entry 0 counts steps at most 1 µs after they were due, entry i later than 2^(i−1) µs and
    # at most 2^i µs, entry 23 all that were later than 2^22 µs. Zeros at the end are left out; together at most
    # `steps`, and fewer only where the server lost count of some.
    lateness: tuple[int, ...]
    safety: Safety
    fault: str  # why it gives no force until it is armed or rearmed, for people; empty: no fault
    degraded: str  # what the server does less of at present, for people; empty: nothing


@dataclass(frozen=True, slots=True)
class PeerReport:
    """How the engine does whose forces a channel takes. Server → client, unreliable, of each device and channel the
    newest number wins."""

    device: int
    channel: int
    name: str  # of the engine
    state_one_in: int  # of the states that it wants, it is sent one in so many: its way is full
    forces_refused: bool  # its forces are not taken: its way loses too much
    link: LinkReport  # number: 1, 2, 3 … of the channel; the forces are the channel's; absent is refused
    # Of the force of that time that is least sure, by its ForceCommand.error; the newest where none says an error:
    error: float | None = None  # N, None: none says it
    way: str = ""  # of Hello.ways, the one by which it was answered; empty: not said


@dataclass(frozen=True, slots=True)
class Claim:
    """What a client wants. With claims, `role` of the Hello is the highest among them."""

    role: Role
    device: str = ""  # its name; empty: device 0
    channel: str = ""  # of a controller: its name; empty: channel 0


@dataclass(frozen=True, slots=True)
class Hello:
    """The first words of a client."""

    role: Role
    name: str = ""  # for logs
    features: Sequence[str] = ()  # offered; the intersection is used
    version_min: int = PROTOCOL_VERSION  # 1 ≤ version_min ≤ version_max; the highest common version is used
    version_max: int = PROTOCOL_VERSION
    claims: Sequence[Claim] = ()  # what is wanted, each once. None: device 0, its channel 0, and `role`
    # With the feature "ways": how this engine may answer, from the fastest on. ForceCommand.way is the place in it
    ways: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Grant:
    """The numbers of a device and a channel that were claimed by name."""

    role: Role  # Role.OBSERVER for a controller's claim: another one holds the lease, see TakeLease
    device: int = 0  # the numbers that stand for the names of the claim from now on
    channel: int = 0


@dataclass(frozen=True, slots=True)
class Welcome:
    """The server's yes."""

    version: int  # within the range of the Hello
    features: Sequence[str]  # those both ends know
    role: Role
    device_name: str
    max_force: float  # N, norm of the force the device can give out
    position_resolution: float  # m, one encoder count at the handle; 0 = exact
    loop_hz: int  # haptic steps per second
    timeout_ms: int  # silence after which the server forgets this client
    server: str  # name and version
    grants: Sequence[Grant] = ()  # one for each Claim, in order; fields 4 … 7 are about the first


@dataclass(frozen=True, slots=True)
class Refused:
    """The server's no."""

    code: Code
    detail: str = ""
    version_min: int = 0  # what the server speaks
    version_max: int = 0


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

# SPDX-License-Identifier: Apache-2.0
"""What peers say to each other, as plain values.

`codec` turns them into bytes and back. SI units, device base frame; a force is what the device exerts
**on the hand**, so a wall that resists motion along +x sends −x.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from math import inf
from typing import Union

Vec3 = tuple[float, float, float]
Mat3 = tuple[Vec3, Vec3, Vec3]

Quat = tuple[float, float, float, float]
"""A rotation as a unit quaternion (w, x, y, z), Hamilton's. q and −q are the same rotation."""

ZERO: Vec3 = (0.0, 0.0, 0.0)

PROTOCOL_VERSION = 1
"""The version of the wire that this package speaks."""

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


class Role(IntEnum):
    OBSERVER = 1  # sees device states
    CONTROLLER = 2  # … and sends forces; one per channel


class Code(IntEnum):
    """Why something was refused or ended."""

    OK = 1
    INVALID = 2  # the value makes no sense
    UNSUPPORTED = 3  # this peer does not know that request or version
    BUSY = 4  # somebody else has it: a second controller
    DENIED = 5  # not with this role
    SHUTDOWN = 6  # the server is going down
    TIMED_OUT = 7  # nothing was heard for too long
    EXPIRED = 8  # a session of suite 1 has reached its age: shake hands again
    REPLACED = 9  # another program with the same key has taken this place: do not come back unasked


class Mode(IntEnum):
    """How the device renders the remote force."""

    IDLE = 1  # no force has come yet, or none since the last safe stop
    ACTIVE = 2  # a fresh force is rendered
    HOLDING = 3  # it has outlived its validity and is held a little longer
    DECAYING = 4  # … and now fades
    SAFE_STOP = 5  # … and is now zero; only a fresh force re-engages
    FAULT = 6  # latched: zero force until `rearm`


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
class Turning:
    """How the handle is turned."""

    orientation: Quat  # turns the handle frame into the base frame
    angular_velocity: Vec3 = ZERO  # rad/s, base frame axes


@dataclass(frozen=True, slots=True)
class Grip:
    """How far the gripper of the handle is open."""

    opening: float  # rad; 0 = closed
    velocity: float = 0.0  # rad/s


@dataclass(frozen=True, slots=True)
class Joints:
    """The joints that carry the handle, in the order of HandleDescription.joints."""

    angles: tuple[float, ...]  # rad
    velocities: tuple[float, ...]  # rad/s


@dataclass(frozen=True, slots=True)
class DeviceState:
    """Server → client, newest wins: the device at one haptic step."""

    tick: int  # number of the haptic step
    sampled_ns: int  # when the position was sampled, server clock: its differences are the dt to integrate with
    position: Vec3  # m
    velocity: Vec3  # m/s
    force_applied: Vec3  # N on the hand, what the device really gives out from this step on
    energy: float  # J, the energy ledger: what the device may still give out
    permitted_force: float  # N, the limiter's bound on the norm; inf when there is none
    reasons: int  # bits of `Reason`
    force_sequence: int  # of the ForceCommand rendered now; 0 = none
    force_age_ns: int  # since it arrived
    mode: Mode
    device: int = 0
    channel: int = 0  # of the force that force_sequence, force_age_ns and mode are about
    force_wanted: Vec3 | None = None  # N, asked for by the engines, before any limit; None: not told (FEATURE_DIAGNOSTICS)
    stiffness_wanted: Mat3 | None = None  # N/m, −∂force_wanted/∂position as the engines' models say it; None: no model
    buttons: int = 0  # bit i is set while button i is held; a press between two states is in the next (FEATURE_HANDLE)
    # None: the device has it not, or the server does not know FEATURE_HANDLE.
    turning: Turning | None = None
    torque_applied: Vec3 | None = None  # N·m on the hand, what the device really gives out from this step on
    grip: Grip | None = None
    grip_applied: float | None = None  # N on the fingers, > 0 opens them; likewise
    hand_force: Vec3 | None = None  # N, of the hand on the handle, as a force sensor measures it
    joints: Joints | None = None  # None: the device tells none, or nobody asked (FEATURE_JOINTS)


@dataclass(frozen=True, slots=True)
class ForceTable:
    """The force along a contact's normal at other depths. Entry i is for the tool `first + i · step` deeper than
    `at`, that is at `at − depth · normal`. Linear between entries; constant beyond the ends."""

    first: float  # m; below 0: nearer to the hand
    step: float  # m, above 0
    force: Sequence[float]  # N along +normal, 2 … 16 entries


@dataclass(frozen=True, slots=True)
class Contact:
    """A surface that the tool touches or is about to. It only pushes, unless a table says otherwise."""

    normal: Sequence[float]  # unit vector, out of the body, to the hand
    gap: float  # m, from the surface to the tool along the normal; below 0: the tool is that deep in the body
    table: ForceTable | None = None


@dataclass(frozen=True, slots=True)
class LocalModel:
    """The remote environment near one position: F(x) = force − stiffness · (x − at)."""

    at: Vec3  # m
    stiffness: Mat3  # N/m, row by row
    valid_radius: float = inf  # m, how far from `at` the stiffness holds
    contact: Contact | None = None


@dataclass(frozen=True, slots=True)
class RotationModel:
    """The torque near one orientation. With p = (w, v) the turn from `at` to the handle's orientation, q · at⁻¹, and
    K = stiffness: torque − 2 (w K v + v × K v), which is torque − K θ for a small turn θ."""

    at: Quat
    stiffness: Mat3  # N·m/rad, row by row, base frame axes


@dataclass(frozen=True, slots=True)
class Torque:
    """On the hand, base frame axes, about the handle's position."""

    torque: Vec3  # N·m
    model: RotationModel | None = None


@dataclass(frozen=True, slots=True)
class ForceCommand:
    """Client → server, newest wins: the force that the physics engine wants."""

    sequence: int  # 1, 2, 3 … per session, device and channel
    based_on_tick: int  # `DeviceState.tick` it was computed from
    force: Vec3  # N, on the hand
    valid_for_us: int  # counted from arrival
    model: LocalModel | None = None
    device: int = 0
    channel: int = 0
    topology_changed: bool = False  # cut or torn since the previous answer: the server uses the model of neither
    error: float | None = None  # N, the engine's estimate of the error of `force`
    torque: Torque | None = None  # only to a server that has agreed to FEATURE_HANDLE; so is the next
    grip_force: float | None = None  # N, on the fingers of the gripper; > 0 opens them
    way: int = 0  # which of `Hello.ways` has answered, from 1 on; 0: not said. Only to a server that agreed to FEATURE_WAYS


@dataclass(frozen=True, slots=True)
class SetStateRate:
    """Client → server, reliable: how many states of a device per second this client wants."""

    hz: int
    device: int = 0


@dataclass(frozen=True, slots=True)
class Rearm:
    """Client → server, reliable: clears a latched fault, and takes a Disarm back. Only from a controller of the device."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class Disarm:
    """Client → server, reliable: no force from the next step on, until a Rearm. Only from a controller of the device."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class Describe:
    """Client → server, reliable: asks for the description of a device; answered with a DeviceDescription, or with a
    HandleDescription. The latter only of a server that has agreed to FEATURE_HANDLE."""

    device: int = 0
    handle: bool = False


@dataclass(frozen=True, slots=True)
class TakeLease:
    """Client → server, reliable: asks for the channel's lease, so that it takes this client's forces."""

    device: int = 0
    channel: int = 0


@dataclass(frozen=True, slots=True)
class GiveLease:
    """Client → server, reliable: gives the channel's lease up."""

    device: int = 0
    channel: int = 0


@dataclass(frozen=True, slots=True)
class LeaseLost:
    """Server → client, reliable: the client has lost the channel's lease."""

    device: int = 0
    channel: int = 0
    to: str = ""  # name of the new holder


@dataclass(frozen=True, slots=True)
class SetStateDeadband:
    """Client → server, reliable: leave out the states that this client can predict (`foretell`).

    After a state with velocity v the next one that is sent is the first whose velocity differs from v by more than
    max(share · ‖v‖, floor), whose mode or buttons differ, or which comes `max_silence_us` later. So it is with the
    velocities of rotation and gripper, with floor / 0.05 m in rad/s.
    """

    share: float = 0.1  # of the speed: 0 … 0.5
    floor: float = 1e-3  # m/s: 0 … 0.1
    max_silence_us: int = 20_000  # 1000 … 20 000; 0 = every state is sent, as before this was asked


class PortRole(IntEnum):
    """Which end of a coupling."""

    LEADER = 1
    FOLLOWER = 2


class CouplingMethod(IntEnum):
    """How two handles are coupled."""

    POSITION_POSITION = 1  # a spring and a damper at both ends
    POSITION_FORCE = 2  # the follower's spring; the leader feels the contact that the follower measures
    WAVES = 3  # wave variables, played out
    SURFACE = 4  # as POSITION_FORCE, but the leader feels a model of the surface that the follower found
    PASSIVITY = 5  # velocity there, force back, each paid from what the other took in
    SET_POSITION = 6  # springs to late positions, stretched only as far as the account pays
    RATE = 7  # the leader's place says how fast the follower moves


class PortPhase(IntEnum):
    """Where an end of a coupling stands."""

    ALONE = 1  # it has no peer
    COUPLED = 2  # it hears its peer, and waits for the operator's act; no force
    ALIGNING = 3  # absolute maps: the leader is led to where the follower is
    ENGAGED = 4  # the law
    CLUTCHED = 5  # the leader is free, the follower stays where it is
    LOST = 6  # it was engaged, and its peer fell silent; engaged again only by another act
    FAULT = 7  # its device gives no force


@dataclass(frozen=True, slots=True)
class PortSurface:
    """A flat, springy surface that a follower's tool touches, or touched last. It only pushes."""

    normal: Vec3  # out of the surface, of length 1
    offset: float  # m: the surface is where normal · position is this
    stiffness: float  # N/m; 0: there is none any more


@dataclass(frozen=True, slots=True)
class PortTurn:
    """How a handle has turned since its offset was taken."""

    turn: Quat  # in the axes of the sender's base frame, of length 1
    angular_velocity: Vec3 = ZERO  # rad/s, zero while `turn` is frozen
    torque: Vec3 = ZERO  # N·m, on whoever holds the sender's handle, really applied


@dataclass(frozen=True, slots=True)
class PortGrip:
    """A gripper, measured at its fingers. It is a port of its own, with an account of its own."""

    opening: float = 0.0  # m
    velocity: float = 0.0  # m/s
    force: float = 0.0  # N, on the fingers, > 0 opens them; really applied
    account: float = 0.0  # J, these four as in PortState
    need: float = 0.0
    given: float = 0.0
    taken: float = 0.0


@dataclass(frozen=True, slots=True)
class PortState:
    """Either way, newest wins (the highest sequence of the highest epoch of a device, channel and end): one end of a
    coupling, told to the other; both ends, told to an observer. Vectors are in the base frame and the scale of the sender's
    device (FEATURE_TELEOPERATION)."""

    device: int  # of the server of the session, whichever way this goes
    channel: int
    epoch: int  # of the sender, > 0; above every one before when it starts anew
    sequence: int  # 1, 2, 3 … within an epoch
    answers_epoch: int  # the receiver's epoch that `answers`, `given` and `taken` belong to; 0: none yet
    answers: int  # sequence of the receiver's newest state in use; 0: none yet
    time_ns: int  # the sender's clock: only differences are used
    round_trip_ns: int  # as the sender has measured it; 0: not yet
    phase: PortPhase
    engagement: int = 0  # number of the leader's act that the phase belongs to; 0: none yet
    buttons: int = 0  # bit i is set while button i is held
    position: Vec3 = ZERO  # m, from the sender's offset
    velocity: Vec3 = ZERO  # m/s, zero while the position is frozen
    force: Vec3 = ZERO  # N, on whoever holds the sender's handle, really applied
    contact_force: Vec3 | None = None  # N, of the surroundings on its tool; None: not measured, which is not zero
    account: float = 0.0  # J, what it may still give out, after paying
    need: float = 0.0  # J, for the force that it wants; 0: it has no purse
    given: float = 0.0  # J, total paid to the receiver
    taken: float = 0.0  # J, the receiver's total that was heard of, in the receiver's joules
    wave_integral: Vec3 = ZERO  # √W·s, of WAVES: the sum of the waves sent
    wave_energy: float = 0.0  # J, of WAVES: the sum of their energies
    surface: PortSurface | None = None  # of SURFACE; None: the tool has touched nothing yet
    turn: PortTurn | None = None  # None: the orientations are not coupled
    grip: PortGrip | None = None  # None: the grippers are not coupled
    energy_in: float = 0.0  # J, of PASSIVITY: total that its port took in, in this epoch
    share: float | None = None  # 0 … 1, of a follower: how much this leader counts; None: it is the only one
    position_scale: float = 0.0  # of a leader, in use from this state on: 0.01 … 100; 0: as in Couple
    force_scale: float = 0.0
    of_peer: bool = False  # to an observer: of the other end of the device's coupling


@dataclass(frozen=True, slots=True)
class RateControl:
    """RATE: the leader's handle, pulled back to its centre, says how fast the follower moves. In the leader's scale."""

    dead_zone: float  # m: nearer to its centre the follower stands
    gain: float  # 1/s, > 0: speed for each metre beyond that
    max_speed: float  # m/s, > 0


@dataclass(frozen=True, slots=True)
class Couple:
    """Client → server, reliable: my device is the other end of this one, and my end is like this. Only from one that claimed
    the channel, and to a server that has agreed to FEATURE_TELEOPERATION."""

    device: int
    channel: int
    role: PortRole  # of the sender
    method: CouplingMethod
    position_scale: float  # follower over leader: 0.01 … 100
    force_scale: float  # leader over follower: 0.01 … 100
    rotation: Quat  # turns the leader's base frame into the follower's
    axes: int  # bits 1, 2, 4: x, y, z of the leader's frame are coupled
    stiffness: float  # N/m, as the leader feels it; so are the next two
    mutual_damping: float  # N·s/m, between the handles
    damping: float  # N·s/m, of each handle by itself
    adapt_to_delay: bool
    purse: bool  # it pays and is paid
    period_us: int  # between two PortStates
    absolute: bool = False  # a place of the leader is a place of the follower: the two align first
    turn_stiffness: float = 0.0  # N·m/rad, as the leader feels it; 0: the orientations are not coupled
    turn_damping: float = 0.0  # N·m·s/rad
    grip_stiffness: float = 0.0  # N/m, at the leader's fingers; 0: the grippers are not coupled
    grip_damping: float = 0.0  # N·s/m
    drift_rate: float = 0.0  # 1/s, of PASSIVITY
    rate: RateControl | None = None  # of RATE


@dataclass(frozen=True, slots=True)
class Engage:
    """Client → server, reliable: the operator's act, which couples the handles. Only from a controller of the device."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class Disengage:
    """Client → server, reliable: the end of that. Only from a controller of the device."""

    device: int = 0


@dataclass(frozen=True, slots=True)
class SetScale:
    """Client → server, reliable: the scales of a coupling from now on. Only from a controller of the leader's device, while
    it is not engaged or its clutch is held."""

    device: int
    position_scale: float  # follower over leader: 0.01 … 100
    force_scale: float  # leader over follower: 0.01 … 100


@dataclass(frozen=True, slots=True)
class SetShare:
    """Client → server, reliable: how much the leader of that channel counts among several. Only from a controller of the
    follower's device."""

    device: int
    channel: int
    share: float  # 0 … 1


class OutputKind(IntEnum):
    """What an output is."""

    LAMP = 1
    VIBRATION = 2  # not by the motors of the position


@dataclass(frozen=True, slots=True)
class OutputDescription:
    """What a device shows or does beside its forces."""

    name: str
    kind: OutputKind


@dataclass(frozen=True, slots=True)
class LampColour:
    """The colour of a lamp."""

    rgb: int = 0  # 0xRRGGBB; 0 = off: it shows what the device itself shows


@dataclass(frozen=True, slots=True)
class Vibration:
    """A pulse, which ends by itself."""

    amplitude: float = 0.0  # 0 … 1 of the strongest that the output can; 0 = off
    frequency: float = 0.0  # Hz, 20 … 1000; 0 = the output's own
    duration_ms: int = 0  # 0 … 10 000


@dataclass(frozen=True, slots=True)
class SetOutput:
    """Client → server, reliable: sets a lamp, or starts a pulse. Only from a controller of the device that holds a
    channel of it, to a server that has agreed to FEATURE_OUTPUTS."""

    device: int
    output: int  # its number in HandleDescription.outputs
    setting: LampColour | Vibration


Request = Union[
    SetStateRate,
    Rearm,
    Disarm,
    Describe,
    TakeLease,
    GiveLease,
    LeaseLost,
    SetStateDeadband,
    Couple,
    Engage,
    Disengage,
    SetOutput,
    SetScale,
    SetShare,
]


class ChannelRule(IntEnum):
    """What a device makes of a channel's force."""

    SUM = 1  # it is added to the others
    PRIORITY = 2  # it silences the channels of this rule that come after it


@dataclass(frozen=True, slots=True)
class ChannelDescription:
    name: str
    rule: ChannelRule
    lease_ms: int = 0  # a holder that sends no force for so long may be followed by another; 0 = it stays until it leaves
    holder: str = ""  # name of the client whose forces it takes; empty = nobody


@dataclass(frozen=True, slots=True)
class DeviceDescription:
    """Description of a device. 0 = not known, where a value cannot be 0."""

    device: int
    name: str  # as the server calls it
    model: str  # what it is
    position_dof: int  # axes that are measured
    force_dof: int  # axes with a motor
    workspace: tuple[Vec3, Vec3] | None  # m, two corners of a box that the handle stays in
    max_force: float  # N
    continuous_force: float  # N, for ever
    max_stiffness: float  # N/m, what it can render stably
    position_resolution: float  # m, one encoder count; 0 = exact
    loop_hz: int
    channels: Sequence[ChannelDescription]


class Hand(IntEnum):
    """Which hand holds a device."""

    ANY = 0
    LEFT = 1
    RIGHT = 2


@dataclass(frozen=True, slots=True)
class HandleDescription:
    """What the handle of a device is and can do (FEATURE_HANDLE)."""

    device: int = 0
    operator_from_device: Quat | None = None
    """Turns the base frame into the operator's: x right, y up, z to the user; None: not known."""
    buttons: Sequence[str] = ()
    """Names by bit of DeviceState.buttons."""
    orientation_measured: bool = False
    """Else no state has `turning`."""
    max_torque: float = 0.0
    """N·m, norm of the torque that the device can give out; 0 = none."""
    gripper_open: float | None = None
    """rad, the opening of the open gripper; None: no gripper."""
    max_gripper_force: float = 0.0
    """N, on the fingers; 0 = the gripper has no motor."""
    group: str = ""
    """Devices of one body (two arms, five fingers) have the same; empty: by itself."""
    hand: Hand = Hand.ANY
    joints: Sequence[str] = ()
    """Names of the joints, in the order of DeviceState.joints; empty: none is told (FEATURE_JOINTS)."""
    outputs: Sequence[OutputDescription] = ()
    """What SetOutput sets, by number; empty: there are none, or nobody asked (FEATURE_OUTPUTS)."""


@dataclass(frozen=True, slots=True)
class Control:
    """A request on its way."""

    id: int
    request: Request | None  # None: one that this version does not know


@dataclass(frozen=True, slots=True)
class ControlAck:
    """The answer to a request."""

    id: int
    code: Code
    detail: str = ""
    wait_ms: int = 0  # with Code.BUSY of TakeLease; 0 = nobody knows
    device: DeviceDescription | None = None  # with Code.OK of Describe
    handle: HandleDescription | None = None  # … that asks for the handle


@dataclass(frozen=True, slots=True)
class Bye:
    code: Code
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Delays:
    """Two quantiles of a delay; below zero only where two clocks had to be compared."""

    median_ns: int
    p99_ns: int


@dataclass(frozen=True, slots=True)
class LinkReport:
    """Server → client, newest wins: why forces were late, and what the network did. Once a second while forces come.

    A delay is None where nothing was measured; those of one way are known ± `clock_error_ns`.
    """

    number: int  # 1, 2, 3 … per session
    until_ns: int  # end of the time it tells of, server clock
    span_ns: int  # … and its length
    # In that time:
    forces: int  # that came
    late_server: int  # late ones, because the server sent a state late
    late_network: int  # … because of the way there and back
    late_engine: int  # … because the engine took longer than usual
    worst_late_ns: int  # longest time that the device was without a valid force
    longest_gap_ns: int  # longest time that nothing was heard of this client
    round_trip: Delays | None
    to_server: Delays | None
    to_client: Delays | None
    clock_offset_ns: int  # this client's clock less the server's
    clock_drift_ppm: float  # how fast that grows
    clock_error_ns: int  # |true offset − clock_offset_ns| is at most this
    # Datagrams of this client since the session opened:
    received: int
    lost: int
    reordered: int
    duplicated: int
    words: str  # why forces were late or refused, for people; empty when none was
    # In the time that it tells of:
    late_unknown: int = 0  # late forces whose cause is not known yet: nothing is heard of this client
    # Forces of this client, on all its channels, that could not be used:
    refused_not_finite: int = 0  # a number is NaN or infinite
    refused_out_of_bounds: int = 0  # … or beyond its bound
    refused_unknown_tick: int = 0  # the tick that it answers never was, or was more than 4096 ticks ago
    refused_old_sequence: int = 0  # the sequence number has not grown, though the datagram is the newest


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


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """Server → client, newest wins for each device: how its loop does. Counts are of the reported time."""

    number: int  # 1, 2, 3 … of the device
    until_ns: int  # end of the time it tells of, server clock
    span_ns: int  # … and its length
    device: int
    steps: int  # haptic steps
    missed: int  # periods without a step, because the one before came so late
    overruns: int  # steps so late after the one before that Reason.OVERRUN is set
    unseen: int  # steps in which the device gave no position
    # Steps by how late the loop woke: [0] at most 1 µs, [i] later than 2^(i−1) µs and at most 2^i µs, [23] all later ones.
    # Zeros at the end are left out; together at most `steps`.
    lateness: tuple[int, ...]
    safety: Safety
    fault: str  # why it gives no force until it is armed or rearmed, for people; empty: no fault
    degraded: str  # what the server does less of at present, for people; empty: nothing


@dataclass(frozen=True, slots=True)
class PeerReport:
    """Server → client, newest wins for each device and channel: the engine whose forces the channel takes."""

    device: int
    channel: int
    name: str  # of the engine
    state_one_in: int  # it is sent one in so many of the states it wants, because its link is full
    forces_refused: bool  # its forces are not used, because its link loses too much
    link: LinkReport  # number: 1, 2, 3 … of the channel; the forces are the channel's
    # Of the force of that time that is least sure, by its `ForceCommand.error`; the newest where none says an error:
    error: float | None = None  # N; None: none says it
    way: str = ""  # of `Hello.ways`, the one by which it was answered; empty: not said


Frame = Union[DeviceState, ForceCommand, Control, ControlAck, Bye, LinkReport, DeviceReport, PeerReport, PortState]


@dataclass(frozen=True, slots=True)
class Claim:
    """What a client wants: a device by name, and as a controller a channel by name; empty = number 0."""

    role: Role
    device: str = ""
    channel: str = ""


@dataclass(frozen=True, slots=True)
class Grant:
    """The numbers that stand for the names of a Claim. OBSERVER for a controller's: another one holds the lease."""

    role: Role
    device: int = 0
    channel: int = 0


@dataclass(frozen=True, slots=True)
class Hello:
    """The first words of a client."""

    role: Role
    name: str = ""
    features: Sequence[str] = ()
    version_min: int = PROTOCOL_VERSION
    version_max: int = PROTOCOL_VERSION
    claims: Sequence[Claim] = ()  # none: device 0, its channel 0, and `role`, which is the highest of the claims'
    ways: Sequence[str] = ()  # with FEATURE_WAYS: how this engine may answer


@dataclass(frozen=True, slots=True)
class Welcome:
    """The server's yes."""

    version: int
    features: Sequence[str]  # those both ends know
    role: Role
    device_name: str
    max_force: float  # N
    position_resolution: float  # m
    loop_hz: int  # haptic steps per second
    timeout_ms: int  # silence after which the server forgets this client
    server: str  # name and version of the server
    grants: Sequence[Grant] = ()  # one for each Claim, in their order


@dataclass(frozen=True, slots=True)
class Refused:
    """The server's no."""

    code: Code
    detail: str = ""
    version_min: int = 0
    version_max: int = 0


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

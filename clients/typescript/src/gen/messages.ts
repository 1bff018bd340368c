// SPDX-License-Identifier: Apache-2.0
// Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
// The messages of tendon.proto as plain values.
import { ChannelRule, Code, CouplingMethod, Hand, Mode, PortPhase, PortRole, Role, Safety } from "./tendon_pb.js";
import type { Quat, Stiffness, Vec3 } from "../messages.js";
import type { Nanoseconds } from "../time.js";

export { ChannelRule, Code, CouplingMethod, Hand, Mode, PortPhase, PortRole, Role, Safety };

/** The kind of an output. */
export enum OutputKind {
  LAMP = 1,
  /** Not by the motors of the position */
  VIBRATION = 2,
}

/**
 * The newest datagram received from the other side. With T3 = txTimeNs of the datagram that carries it and T4 = its
 * arrival, the round trip is (T4 − T1) − (T3 − T2).
 */
export interface Echo {
  /** T1, its txTimeNs: the RECEIVER's clock */
  readonly sent: Nanoseconds;
  /** T2, when it arrived */
  readonly received: Nanoseconds;
  readonly packetNumber: bigint;
  /** Bit i: packet (packetNumber − 1 − i) has arrived too */
  readonly receivedMask: number;
}

/** How the handle is turned. */
export interface Turning {
  /** Turns the handle frame into the base frame */
  readonly orientation: Quat;
  /** rad/s, only with an orientation */
  readonly angularVelocity: Vec3;
}

/** How far the gripper of the handle is open. */
export interface Grip {
  /** rad, opening, 0 = closed */
  readonly opening: number;
  /** rad/s, only with an opening */
  readonly velocity: number;
}

/** The joints that carry the handle, in the order of HandleDescription.joints. */
export interface Joints {
  /**
   * rad. Only to a client that named the feature "joints", in the order of HandleDescription.joints. None: the device
   * tells none. A velocity that is absent is 0, one without an angle says nothing.
   */
  readonly angles: readonly number[];
  /** rad/s */
  readonly velocities: readonly number[];
}

/** A device at one haptic step. Server → client, unreliable, of each device the newest tick wins. */
export interface DeviceState {
  /** Number of the haptic step */
  readonly tick: bigint;
  /** When the position was sampled; integrate with its differences */
  readonly sampledNs: Nanoseconds;
  /** m */
  readonly position: Vec3;
  /** m/s */
  readonly velocity: Vec3;
  /** N, on the hand, as the device really exerts it from this step on */
  readonly forceApplied: Vec3;
  /** J, the energy ledger: what the device may still give out */
  readonly energy: number;
  /** N, the limiter's bound on the norm; +infinity: no bound */
  readonly permittedForce: number;
  /** Bits of core/base/reason.h: why the force is not what was asked for */
  readonly reasons: number;
  /** ForceCommand rendered now; 0 = none */
  readonly forceSequence: bigint;
  /** Its age since it arrived */
  readonly forceAgeNs: Nanoseconds;
  readonly mode: Mode;
  readonly device: number;
  /** Of the force that forceSequence, forceAgeNs and mode are about */
  readonly channel: number;
  /**
   * N. What the engines ask for at this step, held, faded or led on by their local models, before any limit. Absent:
   * not told; only to an observer that named the feature "diagnostics"
   */
  readonly forceWanted?: Vec3 | undefined;
  /**
   * N/m, −∂forceWanted/∂position, N/m, as the engines' models say it at this step; its entries as those of
   * LocalModel.stiffness. Absent: no model. To whom forceWanted is told
   */
  readonly stiffnessWanted?: Stiffness | undefined;
  /** Bit i: button i is held; a press between two states of a client is in the next one */
  readonly buttons: number;
  /** Absent: not measured */
  readonly turning?: Turning | undefined;
  /** N·m, about position, from this step on; absent: no motors that turn */
  readonly torqueApplied?: Vec3 | undefined;
  /** Absent: no gripper */
  readonly grip?: Grip | undefined;
  /** N, on the fingers, > 0 opens them; absent: no motor */
  readonly gripApplied?: number | undefined;
  /** N, of the hand ON THE HANDLE; absent: no force sensor */
  readonly handForce?: Vec3 | undefined;
  /** Absent: the device tells none */
  readonly joints?: Joints | undefined;
}

/** On the hand, base frame axes, about the handle's position. */
export interface Torque {
  /** N·m, on the hand, about the handle's position */
  readonly torque: Vec3;
  readonly model?: RotationModel | undefined;
}

/**
 * The force that the physics engine wants. Client → server, unreliable, of each device and channel the newest sequence
 * wins.
 */
export interface ForceCommand {
  /** 1, 2, 3 … per session, device and channel */
  readonly sequence: bigint;
  /** DeviceState.tick of that device it was computed from: the loop's true age needs no clock */
  readonly basedOnTick: bigint;
  /** N, on the hand: a wall that resists motion along +x sends −x */
  readonly force: Vec3;
  readonly model?: LocalModel | undefined;
  /** Counted from arrival */
  readonly validForUs: number;
  readonly device: number;
  readonly channel: number;
  /** Cut or torn since the answer before this one: neither's model is relied on */
  readonly topologyChanged?: boolean | undefined;
  /** N, how wrong the engine thinks force may be; absent: not said */
  readonly error?: number | undefined;
  /** Absent: none is asked for */
  readonly torque?: Torque | undefined;
  /** N, on the fingers, > 0 opens them; absent: none is asked for */
  readonly gripForce?: number | undefined;
  /** Only to a server that granted the feature "ways": which of Hello.ways has answered, from 1 on; 0: not said */
  readonly way?: number | undefined;
}

/**
 * The torque near one orientation, so that the device loop can follow the hand's turns. With p = (w, v) = the rotation
 * from at to the handle's orientation, q · at⁻¹, and K = stiffness:
 * τ(q) = torque − 2 (w K v + v × K v)        −K θ for a small turn θ
 */
export interface RotationModel {
  /** Absent is refused */
  readonly at: Quat;
  /** N·m/rad, −∂τ/∂θ, base frame axes; its entries as those of stiffness. */
  readonly stiffness: Stiffness;
}

/**
 * The remote environment near one position, so that the device loop can follow the hand:
 * F(x) = force − stiffness · (x − at)
 * What else it can say WIRE.md describes. A server that does not know the rest follows the stiffness.
 */
export interface LocalModel {
  /** m */
  readonly at: Vec3;
  /**
   * N/m, −∂F/∂x; a spring is positive. 1 entry k: k·I. 3 entries: the diagonal. 9: the matrix, row by row. Any other
   * number is refused.
   */
  readonly stiffness: Stiffness;
  /** M, how far from at it holds; absent: not said */
  readonly validRadius?: number | undefined;
  readonly contact?: Contact | undefined;
}

/** A surface that the tool touches or is about to. It only pushes, unless a table says otherwise. */
export interface Contact {
  /** Out of the body, to the hand; of length 1 ± 0.001 */
  readonly normal: Vec3;
  /** M, from the surface to the tool along the normal; below 0: so deep is it pressed in */
  readonly gap: number;
  readonly table?: ForceTable | undefined;
}

/** The force along the normal, at the depths first + i · step below at: at − depth · normal. */
export interface ForceTable {
  /** M, below 0: nearer to the hand */
  readonly first: number;
  /** m */
  readonly step: number;
  /** N, along +normal */
  readonly force: readonly number[];
}

/** How many states of a device per second the client wants. */
export interface SetStateRate {
  readonly hz: number;
  readonly device: number;
}

/**
 * Leave out the states that this client can foretell: after a state with velocity v the next one that is sent is the
 * first whose velocity differs from v by more than max(share · ‖v‖, floor), whose mode or buttons differ, or which
 * comes maxSilenceUs later. In between the client goes on along the line: x + v · (t − sampledNs).
 */
export interface StateDeadband {
  /** Weber's; a server grants 0 … 0.5 */
  readonly share: number;
  /** m/s, a server grants 0 … 0.1 */
  readonly floor: number;
  /** A server grants 1000 … 20 000; 0 = every state is sent, as before this was asked */
  readonly maxSilenceUs: number;
}

/**
 * Clears a latched fault, and takes a Disarm back. With a safety layer it is the operator's request to arm. Only from a
 * controller of the device.
 */
export interface Rearm {
  readonly device: number;
}

/**
 * No force from the next haptic step on, without a ramp, whatever engines ask for, until a Rearm: neither a new force
 * nor a new session ends it, nor the dead man's button by itself. Safety goes from armed to homed, and a pending
 * request to arm is withdrawn. It is no fault, and clears none. Asking twice is asking once. Only from a controller of
 * the device, whether it holds the channel or not. Code.OK: the device's loop has the order before its next step.
 */
export interface Disarm {
  readonly device: number;
}

/**
 * My device is the other end of this one: what my end is like. From whoever has claimed the channel as a controller, to
 * a server that granted "teleoperation". Code.OK: they fit; the client is sent no states any more but PortStates, and
 * sends them. Code.INVALID: the first thing that differs, in words. Code.UNSUPPORTED: that device is not to be coupled.
 * Code.BUSY: that channel is coupled with another client; a follower with several leaders has one for each channel.
 */
export interface Couple {
  readonly device: number;
  readonly channel: number;
  /** Of the sender: the other end has the other one */
  readonly role: PortRole;
  readonly method: CouplingMethod;
  /** Follower over leader */
  readonly positionScale: number;
  /** Leader over follower */
  readonly forceScale: number;
  /** Turns the leader's base frame into the follower's; absent is refused */
  readonly rotation: Quat;
  /** Bits 1, 2, 4: x, y, z of the leader's frame are coupled */
  readonly axes: number;
  /** N/m, these as the leader feels them */
  readonly stiffness: number;
  /** N·s/m */
  readonly mutualDamping: number;
  /** N·s/m */
  readonly damping: number;
  readonly adaptToDelay: boolean;
  /** It pays and is paid */
  readonly purse: boolean;
  /** Between two PortStates */
  readonly periodUs: number;
  /** A place of the leader is a place of the follower: offsets are zero, and the two align first */
  readonly absolute?: boolean | undefined;
  // As the leader feels them; a stiffness of 0: that part of the handle is not coupled:
  /** N·m/rad, of the orientations */
  readonly turnStiffness?: number | undefined;
  /** N·m·s/rad */
  readonly turnDamping?: number | undefined;
  /** N/m, of the grippers, at the fingers */
  readonly gripStiffness?: number | undefined;
  /** N·s/m */
  readonly gripDamping?: number | undefined;
  /** 1/s. CouplingMethod.PASSIVITY */
  readonly driftRate?: number | undefined;
  /** CouplingMethod.RATE; absent with the others */
  readonly rate?: RateControl | undefined;
}

/** The leader's handle, pulled back to its centre, says how fast the follower moves. */
export interface RateControl {
  /** M, the follower stands while the leader is nearer than this to its centre */
  readonly deadZone: number;
  /** 1/s, speed of the follower, in the leader's scale, for each metre beyond that */
  readonly gain: number;
  /** m/s, of the follower, in the leader's scale */
  readonly maxSpeed: number;
}

/**
 * The operator's act: couples the handles, at the leader's server. Only from a controller of the device. Code.OK: the
 * device's loop has the order. Code.UNSUPPORTED: that device has no coupling, or is the follower.
 */
export interface Engage {
  readonly device: number;
}

/** Ends that, at either end. Only from a controller of the device. */
export interface Disengage {
  readonly device: number;
}

/**
 * The scales of the coupling from now on, at the leader's server. Only from a controller of the device, while the
 * leader is not engaged or holds its clutch: else Code.BUSY. Code.OK: the device's loop has the order.
 * Code.UNSUPPORTED: that device has no coupling, or is the follower.
 */
export interface SetScale {
  readonly device: number;
  /** Follower over leader */
  readonly positionScale: number;
  /** Leader over follower */
  readonly forceScale: number;
}

/**
 * How much the leader of that channel counts among the leaders of a follower, at the follower's server. It gets there
 * within 0.5 s, and the others share what is left as they did. Only from a controller of the device. Code.UNSUPPORTED:
 * that device has no coupling, or one leader only, or is a leader.
 */
export interface SetShare {
  readonly device: number;
  readonly channel: number;
  readonly share: number;
}

/** The colour of a lamp. */
export interface LampColour {
  /** Of a lamp, 0xRRGGBB; 0 = off: it shows what the device itself shows */
  readonly rgb: number;
}

/**
 * Sets a lamp of the device, or makes it vibrate: from a controller of the device that holds one of its channels. To a
 * server that granted the feature "outputs". An output is off again when the client that set it gives a channel of the
 * device up or loses it, and when the device is disarmed. Code.INVALID: the device has no such output, or not of that
 * kind.
 */
export interface SetOutput {
  readonly device: number;
  /** Number in HandleDescription.outputs */
  readonly output: number;
  readonly setting: LampColour | Vibration;
}

/** A pulse. It ends by itself; another one takes its place at once. */
export interface Vibration {
  /** Of the strongest that the output can; 0 = off */
  readonly amplitude: number;
  /** At least 20, or 0: the output's own */
  readonly frequency: number;
  readonly durationMs: number;
}

/**
 * What a device is and can do: answered with a DeviceDescription. Of any device that the server has, claimed or not.
 */
export interface Describe {
  readonly device: number;
  /** Answered with a HandleDescription instead */
  readonly handle?: boolean | undefined;
}

/**
 * I want to be the one whose forces this channel takes. From whoever has claimed it as a controller. Code.OK: you are,
 * from now on. Code.BUSY: another one is; waitMs says for how much longer its lease lasts unless renewed.
 */
export interface TakeLease {
  readonly device: number;
  readonly channel: number;
}

/** I do not want to be it any more. */
export interface GiveLease {
  readonly device: number;
  readonly channel: number;
}

/** You are not it any more. Only to a client that named the feature "channels". */
export interface LeaseLost {
  readonly device: number;
  readonly channel: number;
  /** Name of the one that is */
  readonly to: string;
}

/** The answer to a Control. */
export interface ControlAck {
  /** Of the Control that is answered */
  readonly id: number;
  readonly code: Code;
  readonly detail: string;
  /** With Code.BUSY of TakeLease: ms; 0 = nobody knows */
  readonly waitMs?: number | undefined;
  /** With Code.OK of Describe */
  readonly device?: DeviceDescription | undefined;
  /** With Code.OK of Describe that asks for the handle */
  readonly handle?: HandleDescription | undefined;
}

/** What a device is and can do. */
export interface DeviceDescription {
  readonly device: number;
  /** As the server calls it */
  readonly name: string;
  /** What it is */
  readonly model: string;
  /** Axes that are measured … */
  readonly positionDof: number;
  /** … and those with a motor */
  readonly forceDof: number;
  /** Absent: not known */
  readonly workspace: { readonly min: Vec3; readonly max: Vec3 } | undefined;
  /** N, norm of the force the device can give out */
  readonly maxForce: number;
  /** N, … for ever; 0 = not known */
  readonly continuousForce: number;
  /** N/m, what it can render stably; 0 = not known */
  readonly maxStiffness: number;
  /** M, one encoder count at the handle; 0 = exact */
  readonly positionResolution: number;
  /** Haptic steps per second */
  readonly loopHz: number;
  /** By number */
  readonly channels: readonly ChannelDescription[];
}

/** What the handle of a device is and can do. To a client of a server that granted the feature "handle". */
export interface HandleDescription {
  readonly device: number;
  /** Turns the base frame into the operator's: x right, y up, z to the user; absent: not known */
  readonly operatorFromDevice?: Quat | undefined;
  /** Names by bit of DeviceState.buttons */
  readonly buttons: readonly string[];
  /** Else no state has an orientation */
  readonly orientationMeasured: boolean;
  /** N·m, norm of the torque the device can give out; 0 = none */
  readonly maxTorque: number;
  /** rad, the opening of the open gripper; absent: no gripper */
  readonly gripperOpen?: number | undefined;
  /** N, on the fingers; 0 = it has no motor */
  readonly maxGripperForce: number;
  /** Devices of one body (two arms, five fingers) have the same; empty: by itself */
  readonly group: string;
  readonly hand: Hand;
  /**
   * Only to a client that named the feature "joints": names of the joints, in the order of DeviceState.joints.angles
   */
  readonly joints?: readonly string[] | undefined;
  /** Only to a client that named the feature "outputs": what SetOutput can set, by number */
  readonly outputs?: readonly OutputDescription[] | undefined;
}

/** An output of a device, beside its forces. */
export interface OutputDescription {
  readonly name: string;
  readonly kind: OutputKind;
}

export interface ChannelDescription {
  readonly name: string;
  readonly rule: ChannelRule;
  /** A holder that sends no force for so long may be followed by another; 0 = it stays until it leaves. ≤ 3 600 000 */
  readonly leaseMs: number;
  /** Name of the client whose forces it takes, its first 24 bytes; empty = nobody's */
  readonly holder: string;
}

/** Either way, said three times. */
export interface Bye {
  readonly code: Code;
  readonly reason: string;
}

/**
 * What became of a client's forces and datagrams, as the server saw it: why a force was late, and what the network did.
 * Times of one way hold as far as the clocks are known, ± clockErrorNs: they may be below zero. Server → client,
 * unreliable, newest number wins.
 */
export interface LinkReport {
  /** 1, 2, 3 … per session */
  readonly number: bigint;
  /** End of the time it tells of */
  readonly untilNs: Nanoseconds;
  /** … and its length */
  readonly spanNs: Nanoseconds;
  // In that time:
  /** That came */
  readonly forces: bigint;
  /** Late ones, because the server sent a state late */
  readonly lateServer: bigint;
  /** … because of the way there and back */
  readonly lateNetwork: bigint;
  /** … because the engine took longer than usual */
  readonly lateEngine: bigint;
  /** Longest time that the device was without a valid force */
  readonly worstLateNs: Nanoseconds;
  /** Longest time that nothing was heard of the client */
  readonly longestGapNs: Nanoseconds;
  /** Absent: not measured; the same for the next two */
  readonly roundTrip: Delays | undefined;
  readonly toServer: Delays | undefined;
  readonly toClient: Delays | undefined;
  /** The client's clock less the server's */
  readonly clockOffsetNs: Nanoseconds;
  /** How fast that grows */
  readonly clockDriftPpm: number;
  /** |true offset − clockOffsetNs| is at most this */
  readonly clockErrorNs: Nanoseconds;
  // Datagrams of the client since the session opened:
  readonly received: bigint;
  readonly lost: bigint;
  readonly reordered: bigint;
  readonly duplicated: bigint;
  /** Why forces were late or refused, for people; empty when none was */
  readonly words: string;
  // In the time that it tells of:
  /** Late forces whose cause is not known yet: nothing is heard of the client */
  readonly lateUnknown: bigint;
  // Forces of the client, on all its channels, that could not be used:
  /** A number is NaN or infinite */
  readonly refusedNotFinite: bigint;
  /** A number is beyond its bound */
  readonly refusedOutOfBounds: bigint;
  /** basedOnTick never was, or was more than 4096 ticks ago */
  readonly refusedUnknownTick: bigint;
  /** Sequence has not grown, though the datagram is the newest */
  readonly refusedOldSequence: bigint;
}

/** Two quantiles of a delay. They can be below zero if two clocks had to be compared. */
export interface Delays {
  readonly medianNs: Nanoseconds;
  readonly p99Ns: Nanoseconds;
}

/**
 * One end of a coupling of two devices, told to the other. Vectors are in the base frame and the scale of the SENDER's
 * device. How it is used core/teleoperation/coupling.h says. Only between peers that both named the feature
 * "teleoperation", either way, unreliable: of each device, channel and end the highest sequence of the highest epoch
 * wins. To an observer of the device, both ends of its coupling.
 */
export interface PortState {
  /** Of the server of the session, whichever way this goes */
  readonly device: number;
  readonly channel: number;
  /** Of the sender; above every one before when it starts anew */
  readonly epoch: bigint;
  /** 1, 2, 3 … within an epoch: its haptic steps */
  readonly sequence: bigint;
  /** The receiver's epoch that the next one, given and taken belong to; 0: none yet */
  readonly answersEpoch: bigint;
  /** Sequence of the receiver's newest state in use; 0: none yet */
  readonly answers: bigint;
  /** Of the sender's clock; only differences are used */
  readonly timeNs: Nanoseconds;
  /** That the sender has measured; 0: not yet */
  readonly roundTripNs: Nanoseconds;
  readonly phase: PortPhase;
  /** Number of the leader's act that the phase belongs to; 0: none yet */
  readonly engagement: bigint;
  /** Bit i: button i is held */
  readonly buttons: number;
  /** M, from the sender's offset */
  readonly position: Vec3;
  /** m/s, zero while the position is frozen */
  readonly velocity: Vec3;
  /** N, on whoever holds its handle, really applied */
  readonly force: Vec3;
  /** N, of the surroundings on its tool; absent: not measured */
  readonly contactForce?: Vec3 | undefined;
  /** J, its account after giving */
  readonly account: number;
  /** J, what it needs for the force that it wants; 0: it has no purse */
  readonly need: number;
  /** J, total given to the receiver; never falls within two epochs */
  readonly given: number;
  /** J, the receiver's total that was heard of, in the receiver's joules */
  readonly taken: number;
  /**
   * CouplingMethod.WAVES: sums since the epoch began, so that no loss is permanent. Absent: nothing sent yet. √W·s: ∫
   * wave dt; half the square of a wave is a power
   */
  readonly waveIntegral?: Vec3 | undefined;
  /** J, ∫ ‖wave‖²/2 dt; never falls within an epoch */
  readonly waveEnergy?: number | undefined;
  /** CouplingMethod.SURFACE, of a follower; absent: it has touched nothing yet */
  readonly surface?: PortSurface | undefined;
  /** Absent: the orientations are not coupled */
  readonly turn?: PortTurn | undefined;
  /** Absent: the grippers are not coupled */
  readonly grip?: PortGrip | undefined;
  /** J. CouplingMethod.PASSIVITY: total that its port took in, in this epoch */
  readonly energyIn?: number | undefined;
  /** Of a follower: how much this leader counts; absent: it is the only one */
  readonly share?: number | undefined;
  /** Of a leader, in use from this state on. 0: as in Couple. An observer has seen no Couple, and is told them. */
  readonly positionScale?: number | undefined;
  readonly forceScale?: number | undefined;
  /** To an observer: of the other end of the device's coupling, as it came to the server */
  readonly ofPeer?: boolean | undefined;
}

/** How a handle has turned since its offset was taken. */
export interface PortTurn {
  /** In the axes of the sender's base frame; of length 1 ± 0.001 */
  readonly turn: Quat;
  /** rad/s */
  readonly angularVelocity: Vec3;
  /** N·m, on whoever holds the handle, really applied */
  readonly torque: Vec3;
}

/** A gripper, measured at its fingers. It is a port of its own, with an account of its own. */
export interface PortGrip {
  /** m */
  readonly opening: number;
  /** m/s */
  readonly velocity: number;
  /** N, on the fingers, > 0 opens them; really applied */
  readonly force: number;
  /** J, these four as in PortState */
  readonly account: number;
  /** J */
  readonly need: number;
  /** J */
  readonly given: number;
  /** J */
  readonly taken: number;
}

/** A flat, springy surface that the sender's tool touches, or touched last. It only pushes. */
export interface PortSurface {
  /** Out of the surface; of length 1 ± 0.001 */
  readonly normal: Vec3;
  /** M, the surface is where normal · position is this */
  readonly offset: number;
  /** N/m, 0: there is none any more */
  readonly stiffness: number;
}

/**
 * How a device's loop does. Numbers of things are of the time that the report tells of. Server → client, unreliable, of
 * each device the newest number wins.
 */
export interface DeviceReport {
  /** 1, 2, 3 … of the device */
  readonly number: bigint;
  /** End of the time it tells of */
  readonly untilNs: Nanoseconds;
  /** … and its length */
  readonly spanNs: Nanoseconds;
  readonly device: number;
  /** Haptic steps */
  readonly steps: bigint;
  /** Periods without a step, because the one before came so late */
  readonly missed: bigint;
  /** Steps so long after the one before that it is a reason (REASON overrun) */
  readonly overruns: bigint;
  /** Steps in which the device gave no position */
  readonly unseen: bigint;
  /**
   * How late the loop woke: entry 0 counts steps at most 1 µs after they were due, entry i later than 2^(i−1) µs and at
   * most 2^i µs, entry 23 all that were later than 2^22 µs. Zeros at the end are left out; together at most `steps`,
   * and fewer only where the server lost count of some.
   */
  readonly lateness: readonly bigint[];
  readonly safety: Safety;
  /** Why it gives no force until it is armed or rearmed, for people; empty: no fault */
  readonly fault: string;
  /** What the server does less of at present, for people; empty: nothing */
  readonly degraded: string;
}

/**
 * How the engine does whose forces a channel takes. Server → client, unreliable, of each device and channel the newest
 * number wins.
 */
export interface PeerReport {
  readonly device: number;
  readonly channel: number;
  /** Of the engine */
  readonly name: string;
  /** Of the states that it wants, it is sent one in so many: its way is full */
  readonly stateOneIn: number;
  /** Its forces are not taken: its way loses too much */
  readonly forcesRefused: boolean;
  /** Number: 1, 2, 3 … of the channel; the forces are the channel's; absent is refused */
  readonly link: LinkReport;
  // Of the force of that time that is least sure, by its ForceCommand.error; the newest where none says an error:
  /** N, absent: none says it */
  readonly error?: number | undefined;
  /** Of Hello.ways, the one by which it was answered; empty: not said */
  readonly way?: string | undefined;
}

/** The first words of a client. */
export interface Hello {
  /** 1 ≤ versionMin ≤ versionMax; the highest common version is used */
  readonly versionMin: number;
  readonly versionMax: number;
  readonly role: Role;
  /** For logs */
  readonly name: string;
  /** Offered; the intersection is used */
  readonly features: readonly string[];
  /** What is wanted, each once. None: device 0, its channel 0, and `role` */
  readonly claims?: readonly Claim[] | undefined;
  /** With the feature "ways": how this engine may answer, from the fastest on. ForceCommand.way is the place in it */
  readonly ways?: readonly string[] | undefined;
}

/** What a client wants. With claims, `role` of the Hello is the highest among them. */
export interface Claim {
  /** Its name; empty: device 0 */
  readonly device: string;
  /** Of a controller: its name; empty: channel 0 */
  readonly channel: string;
  readonly role: Role;
}

/** The server's yes. */
export interface Welcome {
  /** Within the range of the Hello */
  readonly version: number;
  /** Those both ends know */
  readonly features: readonly string[];
  readonly role: Role;
  readonly deviceName: string;
  /** N, norm of the force the device can give out */
  readonly maxForce: number;
  /** M, one encoder count at the handle; 0 = exact */
  readonly positionResolution: number;
  /** Haptic steps per second */
  readonly loopHz: number;
  /** Silence after which the server forgets this client */
  readonly timeoutMs: number;
  /** Name and version */
  readonly server: string;
  /** One for each Claim, in order; fields 4 … 7 are about the first */
  readonly grants?: readonly Grant[] | undefined;
}

/** The numbers of a device and a channel that were claimed by name. */
export interface Grant {
  /** The numbers that stand for the names of the claim from now on */
  readonly device: number;
  readonly channel: number;
  /** Role.OBSERVER for a controller's claim: another one holds the lease, see TakeLease */
  readonly role: Role;
}

/** The server's no. */
export interface Refused {
  readonly code: Code;
  readonly detail: string;
  /** What the server speaks */
  readonly versionMin: number;
  readonly versionMax: number;
}

/** Reliable: the names of the fields of Control. */
export type Request =
  | ({ readonly kind: "setStateRate" } & SetStateRate)
  | ({ readonly kind: "rearm" } & Rearm)
  | ({ readonly kind: "describe" } & Describe)
  | ({ readonly kind: "takeLease" } & TakeLease)
  | ({ readonly kind: "giveLease" } & GiveLease)
  | ({ readonly kind: "leaseLost" } & LeaseLost)
  | ({ readonly kind: "setStateDeadband" } & StateDeadband)
  | ({ readonly kind: "disarm" } & Disarm)
  | ({ readonly kind: "setOutput" } & SetOutput)
  | ({ readonly kind: "couple" } & Couple)
  | ({ readonly kind: "engage" } & Engage)
  | ({ readonly kind: "disengage" } & Disengage)
  | ({ readonly kind: "setScale" } & SetScale)
  | ({ readonly kind: "setShare" } & SetShare);

/** Every frame but Control. */
export type PlainFrame =
  | { readonly kind: "state"; readonly value: DeviceState }
  | { readonly kind: "force"; readonly value: ForceCommand }
  | { readonly kind: "controlAck"; readonly value: ControlAck }
  | { readonly kind: "bye"; readonly value: Bye }
  | { readonly kind: "report"; readonly value: LinkReport }
  | { readonly kind: "deviceReport"; readonly value: DeviceReport }
  | { readonly kind: "peerReport"; readonly value: PeerReport }
  | { readonly kind: "port"; readonly value: PortState };

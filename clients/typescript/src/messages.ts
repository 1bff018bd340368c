// SPDX-License-Identifier: Apache-2.0
// What peers say to each other, as plain values; protocol/WIRE.md has the same nouns as bytes. SI units, device base
// frame. A force is what the device exerts ON THE HAND: a wall that resists motion along +x sends −x.
import { ChannelRule, Code, CouplingMethod, Hand, Mode, PortPhase, PortRole, Role, Safety } from "./gen/tendon_pb.js";
import type { Nanoseconds } from "./time.js";

export { ChannelRule, Code, CouplingMethod, Hand, Mode, PortPhase, PortRole, Role, Safety };

/** The version of the wire that this client speaks. */
export const kProtocolVersion = 1;
/** A feature: the client may send a local model with its forces, and the server follows the hand with it. */
export const kFeatureLocalModel = "local-model";

/** A feature: the client understands that a lease can be lost. */
export const kFeatureChannels = "channels";

/**
 * A feature: the client is told how the device lies before the operator, its buttons, orientation, gripper and torques,
 * and may ask for torque and grip force.
 */
export const kFeatureHandle = "handle";

/** Whoever offers this is told the joints of the device, with `joints` of a client's config. */
export const kFeatureJoints = "joints";
/** Whoever offers this is told the outputs of the device, with `outputs` of a client's config, and may set them. */
export const kFeatureOutputs = "outputs";

/** A feature: the client may be the other end of a coupling: it says Couple, and PortStates go both ways. */
export const kFeatureTeleoperation = "teleoperation";

/** A feature: an engine names the ways in which it answers, and says of each force which one it was. */
export const kFeatureWays = "ways";

/** A feature: an observer wants to be told what the engines ask for, how the loop does, and how each engine does. */
export const kFeatureDiagnostics = "diagnostics";

/** Any object with x, y and z will do: the vector of your engine too. */
export interface Vec3 {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

/** A rotation as a unit quaternion, Hamilton's. q and −q are the same rotation. */
export interface Quat extends Vec3 {
  readonly w: number;
}

/** N/m, −∂force/∂position; a spring is positive. 1 entry k: k·I. 3: the diagonal. 9: the matrix, row by row. */
export type Stiffness = readonly number[];

/** How the handle is turned. */
export interface Turning {
  /** Turns the handle frame into the base frame. */
  readonly orientation: Quat;
  /** rad/s, base frame axes */
  readonly angularVelocity: Vec3;
}

/** How far the gripper of the handle is open. */
export interface Grip {
  /** rad; 0 = closed. */
  readonly opening: number;
  /** rad/s */
  readonly velocity: number;
}

/** The joints that carry the handle, in the order of HandleDescription.joints. */
export interface Joints {
  /** rad */
  readonly angles: readonly number[];
  /** rad/s, as many */
  readonly velocities: readonly number[];
}

/** The device at one haptic step. */
export interface DeviceState {
  /** Number of the haptic step. */
  readonly tick: bigint;
  /** When the position was sampled, on the server's clock: its differences are the dt to integrate with. */
  readonly sampledNs: Nanoseconds;
  /** m */
  readonly position: Vec3;
  /** m/s */
  readonly velocity: Vec3;
  /** N on the hand, what the device really gives out from this step on. */
  readonly forceApplied: Vec3;
  /** J, the energy ledger: what the device may still give out. */
  readonly energy: number;
  /** N, the limiter's bound on the norm; Infinity when there is none. */
  readonly permittedForce: number;
  /** Bits, why the force is not what was asked for; reasonNames() spells them out. */
  readonly reasons: number;
  /** Sequence number of the force rendered now; 0 = none. */
  readonly forceSequence: bigint;
  /** Time since that force arrived at the server. */
  readonly forceAgeNs: Nanoseconds;
  readonly mode: Mode;
  readonly device: number;
  /** Of the force that forceSequence, forceAgeNs and mode are about. */
  readonly channel: number;
  /** N, asked for by the engines, before any limit; absent: not told, see DeviceReport. */
  readonly forceWanted?: Vec3 | undefined;
  /** N/m, −∂forceWanted/∂position as the engines' models say it, told with forceWanted; absent: no model. */
  readonly stiffnessWanted?: Stiffness | undefined;
  /** Bit i is set while button i is held. A press between two states is in the next one. */
  readonly buttons: number;
  /** Absent, as all below: the device has it not, or the server does not know kFeatureHandle. */
  readonly turning?: Turning | undefined;
  /** N·m on the hand, about the position, what the device really gives out from this step on. */
  readonly torqueApplied?: Vec3 | undefined;
  readonly grip?: Grip | undefined;
  /** N on the fingers, > 0 opens them; likewise. */
  readonly gripApplied?: number | undefined;
  /** N of the hand on the handle, as a force sensor measures it. */
  readonly handForce?: Vec3 | undefined;
  /** Absent: the device tells none, or nobody asked (kFeatureJoints). */
  readonly joints?: Joints | undefined;
}

/**
 * The force along a contact's normal at other depths. Entry i is for the tool `first + i · step` deeper than `at`, that
 * is at `at − depth · normal`. Linear between entries; constant beyond the ends.
 */
export interface ForceTable {
  /** m; below 0: nearer to the hand. */
  readonly first: number;
  /** m, above 0. */
  readonly step: number;
  /** N along +normal, 2 … 16 entries. */
  readonly force: readonly number[];
}

/** A surface that the tool touches or is about to. It only pushes, unless a table says otherwise. */
export interface Contact {
  /** Unit vector, out of the body, to the hand. */
  readonly normal: Vec3;
  /** m, from the surface to the tool along the normal; below 0: the tool is that deep in the body. */
  readonly gap: number;
  readonly table?: ForceTable | undefined;
}

/** F(x) = force − stiffness · (x − at): what the force becomes when the hand moves on. */
export interface LocalModel {
  /** m, the position that the force was computed for. */
  readonly at: Vec3;
  readonly stiffness: Stiffness;
  /** m, how far from `at` the stiffness holds; absent: nobody says. */
  readonly validRadius?: number | undefined;
  readonly contact?: Contact | undefined;
}

/**
 * The torque near one orientation. With p = (w, v) the turn from `at` to the handle's orientation, q · at⁻¹, and
 * K = stiffness: torque − 2 (w K v + v × K v), which is torque − K θ for a small turn θ.
 */
export interface RotationModel {
  readonly at: Quat;
  /** N·m/rad, base frame axes. */
  readonly stiffness: Stiffness;
}

/** On the hand, base frame axes, about the handle's position. */
export interface Torque {
  /** N·m */
  readonly torque: Vec3;
  readonly model?: RotationModel | undefined;
}

/** The force that the physics wants. */
export interface ForceCommand {
  /** 1, 2, 3 … per session, device and channel. */
  readonly sequence: bigint;
  /** The state it was computed from. */
  readonly basedOnTick: bigint;
  /** N on the hand */
  readonly force: Vec3;
  readonly model?: LocalModel | undefined;
  /** Counted from its arrival; 1 … 10 000 000. */
  readonly validForUs: number;
  readonly device: number;
  readonly channel: number;
  /** Cut or torn since the previous answer: the model of neither is used. */
  readonly topologyChanged?: boolean | undefined;
  /** N, the engine's estimate of the error of the force. */
  readonly error?: number | undefined;
  /** Only to a server that has agreed to kFeatureHandle; so is the next. */
  readonly torque?: Torque | undefined;
  /** N on the fingers of the gripper; > 0 opens them. */
  readonly gripForce?: number | undefined;
  /** Which of Hello.ways has answered, from 1 on; absent: not said. Only to a server that has agreed to kFeatureWays. */
  readonly way?: number | undefined;
}

/**
 * Leave out the states that this client can predict. After a state with velocity v, the next state sent is the first
 * whose velocity differs from v by more than max(share · ‖v‖, floor), whose mode or buttons differ, or which comes
 * maxSilenceUs later. So it is with the velocities of rotation and gripper, with floor / 0.05 m in rad/s.
 */
export interface StateDeadband {
  /** Of the speed: 0 … 0.5. */
  readonly share: number;
  /** m/s: 0 … 0.1. */
  readonly floor: number;
  /** 1000 … 20 000; 0 = every state is sent, as before this was asked. */
  readonly maxSilenceUs: number;
}

/**
 * Either way, newest wins (the highest sequence of the highest epoch of a device, channel and end): one end of a coupling,
 * told to the other; both ends, told to an observer. Vectors are in the base frame and the scale of the sender's device.
 */
export interface PortState {
  /** Of the server of the session, whichever way this goes. */
  readonly device: number;
  readonly channel: number;
  /** Of the sender, > 0: above every one before when it starts anew. */
  readonly epoch: bigint;
  /** 1, 2, 3 … within an epoch. */
  readonly sequence: bigint;
  /** The receiver's epoch that `answers`, `given` and `taken` belong to; 0: none yet. */
  readonly answersEpoch: bigint;
  /** Sequence of the receiver's newest state in use; 0: none yet. */
  readonly answers: bigint;
  /** The sender's clock: only differences are used. */
  readonly timeNs: Nanoseconds;
  /** As the sender has measured it; 0: not yet. */
  readonly roundTripNs: Nanoseconds;
  readonly phase: PortPhase;
  /** Number of the leader's act that the phase belongs to; 0: none yet. */
  readonly engagement: bigint;
  /** Bit i is set while button i is held. */
  readonly buttons: number;
  /** m, from the sender's offset, and m/s: zero while the position is frozen. */
  readonly position: Vec3;
  readonly velocity: Vec3;
  /** N, on whoever holds the sender's handle, really applied. */
  readonly force: Vec3;
  /** N, of the surroundings on its tool; absent: not measured, which is not zero. */
  readonly contactForce?: Vec3 | undefined;
  /** J, what it may still give out, after paying, and what it needs for the force that it wants; 0: it has no purse. */
  readonly account: number;
  readonly need: number;
  /** J, total paid to the receiver, and the receiver's total that was heard of, in the receiver's joules. */
  readonly given: number;
  readonly taken: number;
  /** √W·s and J, of CouplingMethod.WAVES: the sums of the waves sent and of their energies; absent: none sent yet. */
  readonly waveIntegral?: Vec3 | undefined;
  readonly waveEnergy?: number | undefined;
  /** Of CouplingMethod.SURFACE; absent: the tool has touched nothing yet. */
  readonly surface?: PortSurface | undefined;
  /** Absent: the orientations are not coupled. */
  readonly turn?: PortTurn | undefined;
  /** Absent: the grippers are not coupled. */
  readonly grip?: PortGrip | undefined;
  /** J, of CouplingMethod.PASSIVITY: total that its port took in, in this epoch; absent: 0. */
  readonly energyIn?: number | undefined;
  /** 0 … 1, of a follower: how much this leader counts; absent: it is the only one, which is not 0. */
  readonly share?: number | undefined;
  /** Of a leader, in use from this state on: 0.01 … 100; absent: as in Couple. */
  readonly positionScale?: number | undefined;
  readonly forceScale?: number | undefined;
  /** To an observer: of the other end of the device's coupling. */
  readonly ofPeer?: boolean | undefined;
}

/** How a handle has turned since its offset was taken. */
export interface PortTurn {
  /** In the axes of the sender's base frame, of length 1. */
  readonly turn: Quat;
  /** rad/s: zero while `turn` is frozen. */
  readonly angularVelocity: Vec3;
  /** N·m, on whoever holds the sender's handle, really applied. */
  readonly torque: Vec3;
}

/** A gripper, measured at its fingers. It is a port of its own, with an account of its own. */
export interface PortGrip {
  /** m, and m/s. */
  readonly opening: number;
  readonly velocity: number;
  /** N, on the fingers, > 0 opens them; really applied. */
  readonly force: number;
  /** J, these four as in PortState. */
  readonly account: number;
  readonly need: number;
  readonly given: number;
  readonly taken: number;
}

/** A flat, springy surface that a follower's tool touches, or touched last. It only pushes. */
export interface PortSurface {
  /** Out of the surface, of length 1. */
  readonly normal: Vec3;
  /** m: the surface is where normal · position is this. */
  readonly offset: number;
  /** N/m; 0: there is none any more. */
  readonly stiffness: number;
}

/** What the sender's end of a coupling is like. Only to a server that has agreed to kFeatureTeleoperation. */
export interface Couple {
  readonly device: number;
  readonly channel: number;
  /** Of the sender. */
  readonly role: PortRole;
  readonly method: CouplingMethod;
  /** Follower over leader, and leader over follower: 0.01 … 100. */
  readonly positionScale: number;
  readonly forceScale: number;
  /** Turns the leader's base frame into the follower's. */
  readonly rotation: Quat;
  /** Bits 1, 2, 4: x, y, z of the leader's frame are coupled. */
  readonly axes: number;
  /** N/m and N·s/m, as the leader feels them: of the spring and the damper between the handles, and of each by itself. */
  readonly stiffness: number;
  readonly mutualDamping: number;
  readonly damping: number;
  readonly adaptToDelay: boolean;
  /** It pays and is paid. */
  readonly purse: boolean;
  /** Between two PortStates. */
  readonly periodUs: number;
  /** A place of the leader is a place of the follower: the two align before they engage. */
  readonly absolute?: boolean | undefined;
  /** N·m/rad and N·m·s/rad, as the leader feels them; absent: the orientations are not coupled. */
  readonly turnStiffness?: number | undefined;
  readonly turnDamping?: number | undefined;
  /** N/m and N·s/m, at the leader's fingers; absent: the grippers are not coupled. */
  readonly gripStiffness?: number | undefined;
  readonly gripDamping?: number | undefined;
  /** 1/s, of CouplingMethod.PASSIVITY. */
  readonly driftRate?: number | undefined;
  /** Of CouplingMethod.RATE. */
  readonly rate?: RateControl | undefined;
}

/** The leader's handle, pulled back to its centre, says how fast the follower moves. In the leader's scale. */
export interface RateControl {
  /** m: nearer to its centre the follower stands. */
  readonly deadZone: number;
  /** 1/s, > 0: speed for each metre beyond that. */
  readonly gain: number;
  /** m/s, > 0. */
  readonly maxSpeed: number;
}

/** The scales of a coupling from now on. */
export interface SetScale {
  readonly device: number;
  /** Follower over leader, and leader over follower: 0.01 … 100. */
  readonly positionScale: number;
  readonly forceScale: number;
}

/** How much the leader of that channel counts among the leaders of a follower. */
export interface SetShare {
  readonly device: number;
  readonly channel: number;
  /** 0 … 1. */
  readonly share: number;
}

/** What an output is: a lamp, or vibration by something else than the motors of the position. */
export enum OutputKind {
  LAMP = 1,
  VIBRATION = 2,
}

/** What a device shows or does beside its forces. */
export interface OutputDescription {
  readonly name: string;
  readonly kind: OutputKind;
}

/** 0xRRGGBB; 0 = off: the lamp shows what the device itself shows. */
export interface LampColour {
  readonly rgb: number;
}

/** A pulse, which ends by itself. */
export interface Vibration {
  /** 0 … 1 of the strongest that the output can; 0 = off. */
  readonly amplitude: number;
  /** Hz, 20 … 1000; 0 = the output's own. */
  readonly frequency: number;
  /** 0 … 10 000. */
  readonly durationMs: number;
}

/** Sets the output of this number in HandleDescription.outputs. */
export interface SetOutput {
  readonly device: number;
  readonly output: number;
  readonly setting: LampColour | Vibration;
}

/**
 * Reliable. Client → server: set the rate of a device's states; clear a latched fault; no force until then;
 * describe the device; take or give up a channel's lease; set the deadband of states; set a lamp or start a pulse; be the other end
 * of a device; the operator's act that couples the handles, and its end; the scales of a coupling, and the share of a
 * leader. Server → client: a lease is lost.
 */
export type Request =
  | { readonly kind: "setStateRate"; readonly hz: number; readonly device: number }
  | { readonly kind: "rearm" | "disarm" | "engage" | "disengage"; readonly device: number }
  | ({ readonly kind: "couple" } & Couple)
  /** From a controller of the leader's device, while it is not engaged or its clutch is held. */
  | ({ readonly kind: "setScale" } & SetScale)
  /** From a controller of the device of a follower with several leaders. */
  | ({ readonly kind: "setShare" } & SetShare)
  /** From whoever holds a channel of the device, to a server that has agreed to kFeatureOutputs. */
  | ({ readonly kind: "setOutput" } & SetOutput)
  /** With `handle` the answer is a HandleDescription. Only for a server that has agreed to kFeatureHandle. */
  | { readonly kind: "describe"; readonly device: number; readonly handle?: boolean }
  | { readonly kind: "takeLease" | "giveLease"; readonly device: number; readonly channel: number }
  | { readonly kind: "leaseLost"; readonly device: number; readonly channel: number; readonly to: string }
  | ({ readonly kind: "setStateDeadband" } & StateDeadband);

export interface ChannelDescription {
  readonly name: string;
  readonly rule: ChannelRule;
  /** A holder that sends no force for so long may be followed by another; 0 = it stays until it leaves. */
  readonly leaseMs: number;
  /** Name of the client whose forces it takes; empty = nobody. */
  readonly holder: string;
}

/** Description of a device. 0 = not known, where a value cannot be 0. */
export interface DeviceDescription {
  readonly device: number;
  /** As the server calls it, and what it is. */
  readonly name: string;
  readonly model: string;
  /** Axes that are measured, and those with a motor. */
  readonly positionDof: number;
  readonly forceDof: number;
  /** m, a box that the handle stays in. */
  readonly workspace: { readonly min: Vec3; readonly max: Vec3 } | undefined;
  /** N, the norm, and for ever. */
  readonly maxForce: number;
  readonly continuousForce: number;
  /** N/m, what it can render stably. */
  readonly maxStiffness: number;
  /** m, one encoder count at the handle; 0 = exact. */
  readonly positionResolution: number;
  readonly loopHz: number;
  readonly channels: readonly ChannelDescription[];
}

/** What the handle of a device is and can do. */
export interface HandleDescription {
  readonly device: number;
  /** Turns the base frame into the operator's: x right, y up, z to the user. Absent: not known. */
  readonly operatorFromDevice?: Quat | undefined;
  /** Names by bit of DeviceState.buttons. */
  readonly buttons: readonly string[];
  /** Else no state has `turning`. */
  readonly orientationMeasured: boolean;
  /** N·m, norm of the torque that the device can give out; 0 = none. */
  readonly maxTorque: number;
  /** rad, the opening of the open gripper; absent: no gripper. */
  readonly gripperOpen?: number | undefined;
  /** N on the fingers; 0 = the gripper has no motor. */
  readonly maxGripperForce: number;
  /** Devices of one body (two arms, five fingers) have the same; empty: by itself. */
  readonly group: string;
  readonly hand: Hand;
  /** Names of the joints, in the order of DeviceState.joints; absent: none is told (kFeatureJoints). */
  readonly joints?: readonly string[] | undefined;
  /** What SetOutput sets, by number; absent: there are none, or nobody asked (kFeatureOutputs). */
  readonly outputs?: readonly OutputDescription[] | undefined;
}

/** Two quantiles of a delay; below zero only where two clocks had to be compared. */
export interface Delays {
  readonly medianNs: Nanoseconds;
  readonly p99Ns: Nanoseconds;
}

/**
 * Why forces were late, and what the network did: from the server, once a second while forces come. A delay is
 * absent where nothing was measured; one-way delays are known ± clockErrorNs.
 */
export interface LinkReport {
  /** 1, 2, 3 … per session. */
  readonly number: bigint;
  /** End of the time it tells of, on the server's clock, and its length. */
  readonly untilNs: Nanoseconds;
  readonly spanNs: Nanoseconds;
  /** Forces that came in that time. */
  readonly forces: bigint;
  /** Late ones: the server sent a state late; the way there and back; the engine took longer than usual. */
  readonly lateServer: bigint;
  readonly lateNetwork: bigint;
  readonly lateEngine: bigint;
  /** Longest time that the device was without a valid force. */
  readonly worstLateNs: Nanoseconds;
  /** Longest time that nothing was heard of this client. */
  readonly longestGapNs: Nanoseconds;
  readonly roundTrip: Delays | undefined;
  readonly toServer: Delays | undefined;
  readonly toClient: Delays | undefined;
  /** This client's clock less the server's, how fast that grows, and how far it is off at most. */
  readonly clockOffsetNs: Nanoseconds;
  readonly clockDriftPpm: number;
  readonly clockErrorNs: Nanoseconds;
  /** Datagrams of this client since the session opened. */
  readonly received: bigint;
  readonly lost: bigint;
  readonly reordered: bigint;
  readonly duplicated: bigint;
  /** Why forces were late or refused, for people; empty when none was. */
  readonly words: string;
  /** Late forces of that time whose cause is not known yet: nothing is heard of this client. */
  readonly lateUnknown: bigint;
  /** Forces of this client in that time, on all its channels, that could not be used: a number is NaN or infinite. */
  readonly refusedNotFinite: bigint;
  /** A number is beyond its bound. */
  readonly refusedOutOfBounds: bigint;
  /** The tick that it answers never was, or was more than 4096 ticks ago. */
  readonly refusedUnknownTick: bigint;
  /** The sequence number has not grown, though the datagram is the newest. */
  readonly refusedOldSequence: bigint;
}

/**
 * How a device's loop does. Only to an observer that named the feature "diagnostics". Counts are of the
 * reported time.
 */
export interface DeviceReport {
  /** 1, 2, 3 … of the device. */
  readonly number: bigint;
  /** End of the time it tells of, on the server's clock, and its length. */
  readonly untilNs: Nanoseconds;
  readonly spanNs: Nanoseconds;
  readonly device: number;
  /** Haptic steps. */
  readonly steps: bigint;
  /** Periods without a step, because the one before came so late. */
  readonly missed: bigint;
  /** Steps so late after the one before that the overrun reason is set. */
  readonly overruns: bigint;
  /** Steps in which the device gave no position. */
  readonly unseen: bigint;
  /**
   * Steps by how late the loop woke: [0] at most 1 µs, [i] later than 2^(i−1) µs and at most 2^i µs, [23] all later ones. Zeros
   * at the end are left out; together at most `steps`.
   */
  readonly lateness: readonly bigint[];
  readonly safety: Safety;
  /** Why it gives no force until it is armed or rearmed, for people; empty: no fault. */
  readonly fault: string;
  /** What the server does less of at present, for people; empty: nothing. */
  readonly degraded: string;
}

/** How the engine does whose forces a channel takes. Only to an observer that named the feature "diagnostics". */
export interface PeerReport {
  readonly device: number;
  readonly channel: number;
  /** Of the engine. */
  readonly name: string;
  /** It is sent one in so many of the states it wants, because its link is full. */
  readonly stateOneIn: number;
  /** Its forces are not used, because its link loses too much. */
  readonly forcesRefused: boolean;
  /** Its number counts those of the channel, and the forces are the channel's. */
  readonly link: LinkReport;
  /** N, the largest ForceCommand.error of its forces of that time; absent: none says it. */
  readonly error?: number | undefined;
  /** Of Hello.ways, the one by which that force was answered, or the newest where none says an error; absent: not said. */
  readonly way?: string | undefined;
}

/** What a client wants: a device by name, and as a controller a channel by name; empty = number 0. */
export interface Claim {
  readonly device: string;
  readonly channel: string;
  readonly role: Role;
}
/** The numbers that stand for the names of a Claim. OBSERVER for a controller's: another one holds the lease. */
export interface Grant {
  readonly device: number;
  readonly channel: number;
  readonly role: Role;
}

/** The first words of a client. */
export interface Hello {
  readonly versionMin: number;
  readonly versionMax: number;
  readonly role: Role;
  readonly name: string;
  readonly features: readonly string[];
  /** None: device 0, its channel 0, and `role`, which is the highest of the claims'. */
  readonly claims?: readonly Claim[] | undefined;
  /** With kFeatureWays: how this engine may answer. */
  readonly ways?: readonly string[] | undefined;
}

/** The server's yes. */
export interface Welcome {
  readonly version: number;
  readonly features: readonly string[];
  readonly role: Role;
  readonly deviceName: string;
  /** N, norm of the force that the device can give out. */
  readonly maxForce: number;
  /** m, one encoder count at the handle; 0 = exact. */
  readonly positionResolution: number;
  /** Haptic steps per second. */
  readonly loopHz: number;
  /** Silence after which the server forgets this client. */
  readonly timeoutMs: number;
  /** Name and version of the server. */
  readonly server: string;
  /** One for each Claim, in their order. */
  readonly grants?: readonly Grant[] | undefined;
}

/** The server's no, with the reason. */
export interface Refused {
  readonly code: Code;
  readonly detail: string;
  readonly versionMin: number;
  readonly versionMax: number;
}

const kReasons = [
  "energy", "max force", "slew", "ramp-in", "held", "decaying", "safe stop", "not finite", "fault", "device clamp",
  "overrun", "watchdog", "position unseen", "disarmed",
  "damped", "acceleration",
] as const;

/** The names of the bits of DeviceState.reasons. */
export function reasonNames(reasons: number): string[] {
  return kReasons.filter((_, bit) => (reasons & (1 << bit)) !== 0);
}

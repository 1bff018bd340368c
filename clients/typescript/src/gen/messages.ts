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
  /** A separate vibrator, not the motors of the axes */
  VIBRATION = 2,
}

/**
 * Acknowledges a datagram of the peer and measures the round trip: with T3 = txTimeNs of the datagram that carries the
 * echo and T4 = the time at which that datagram arrives, the round trip is (T4 − T1) − (T3 − T2).
 */
export interface Echo {
  /** T1, txTimeNs of that datagram, on the peer's clock */
  readonly sent: Nanoseconds;
  /** T2, when that datagram arrived, on the clock of the sender of the echo; T2 ≤ T3 */
  readonly received: Nanoseconds;
  /** Packet number of that datagram */
  readonly packetNumber: bigint;
  /**
   * Bit i: packet (packetNumber − 1 − i) has arrived too. A malformed packet counts as arrived in suites 1 and 2 only
   */
  readonly receivedMask: number;
}

/** How the handle is turned. */
export interface Turning {
  /**
   * Rotation from the handle frame to the device base frame. In the handle frame, when the handle is in its middle
   * position, the stylus or finger points along −z, y is up, and x is to the right
   */
  readonly orientation: Quat;
  /** rad/s, angular velocity in base frame axes; ignored without an orientation */
  readonly angularVelocity: Vec3;
}

/** How far the gripper of the handle is open. */
export interface Grip {
  /** rad, opening of the gripper, 0 when it is closed */
  readonly opening: number;
  /** rad/s, velocity of the opening; ignored without grip.opening */
  readonly velocity: number;
}

/** The joints that carry the handle, in the order of HandleDescription.joints. */
export interface Joints {
  /** rad, angles of the joints that carry the handle, in the order of HandleDescription.joints. */
  readonly angles: readonly number[];
  /** rad/s, velocities of the same joints; a missing entry is 0, and an entry without an angle is ignored */
  readonly velocities: readonly number[];
}

/** The state of a device at one haptic step. Server → client, unreliable; for each device the highest tick wins. */
export interface DeviceState {
  /** Number of the haptic step */
  readonly tick: bigint;
  /** When the position was sampled, on the server's clock */
  readonly sampledNs: Nanoseconds;
  /** m */
  readonly position: Vec3;
  /** m/s */
  readonly velocity: Vec3;
  /** N, actual force on the hand, from this step on */
  readonly forceApplied: Vec3;
  /** J, energy that the device may still give out (the energy ledger) */
  readonly energy: number;
  /** N, the limiter's bound on the norm of the force; +infinity if there is none */
  readonly permittedForce: number;
  /** Why the actual force differs from the requested one (bits of core/base/reason.h) */
  readonly reasons: number;
  /** Sequence of the ForceCommand that is rendered; 0 if there is none */
  readonly forceSequence: bigint;
  /** Time since that ForceCommand arrived */
  readonly forceAgeNs: Nanoseconds;
  readonly mode: Mode;
  readonly device: number;
  /**
   * Channel of the force that forceSequence, forceAgeNs and mode describe: the freshest one, or the one with the lowest
   * channel if several are equally fresh
   */
  readonly channel: number;
  // With the feature "diagnostics" only:
  /**
   * N, force on the hand that the engines request at this step (held, faded, or extrapolated by their models), before
   * any limit; absent: not reported
   */
  readonly forceWanted?: Vec3 | undefined;
  // With the feature "diagnostics" only:
  /**
   * N/m, −∂forceWanted/∂position of the engines' models at this step; entries as in LocalModel.stiffness. Absent: no
   * model
   */
  readonly stiffnessWanted?: Stiffness | undefined;
  /** Bit i: button i is held. A press between two states is reported in the later one */
  readonly buttons: number;
  /** Absent: not measured */
  readonly turning?: Turning | undefined;
  /**
   * N·m, actual torque on the hand about position, in base frame axes, from this step on; absent: no motors that turn
   */
  readonly torqueApplied?: Vec3 | undefined;
  /** Absent: no gripper */
  readonly grip?: Grip | undefined;
  /** N, actual force on the fingers, > 0 opens them, from this step on; absent: the gripper has no motor */
  readonly gripApplied?: number | undefined;
  /** N, of the hand ON THE HANDLE, measured by a force sensor; absent: no force sensor */
  readonly handForce?: Vec3 | undefined;
  /** Absent: the device reports none */
  readonly joints?: Joints | undefined;
}

/** On the hand, base frame axes, about the handle's position. */
export interface Torque {
  /** N·m, torque on the hand about the handle's position, in base frame axes */
  readonly torque: Vec3;
  /** How the torque changes as the handle turns. It does not need a `model`, and an absent torque.torque is 0 in it */
  readonly model?: RotationModel | undefined;
}

/**
 * The force that a physics engine requests, as the answer to one state. Client → server, unreliable; for each device
 * and channel the highest sequence wins.
 */
export interface ForceCommand {
  /** 1, 2, 3 … per session, device and channel */
  readonly sequence: bigint;
  /** DeviceState.tick of the state that the force was computed from */
  readonly basedOnTick: bigint;
  /** N, force on the hand: a wall that resists motion along +x sends −x */
  readonly force: Vec3;
  /** How the force changes as the hand moves; absent: the force is constant */
  readonly model?: LocalModel | undefined;
  /** Time from its arrival during which the force is fresh */
  readonly validForUs: number;
  readonly device: number;
  readonly channel: number;
  /** The body has been cut or torn since the previous answer: neither this model nor the previous one is used */
  readonly topologyChanged?: boolean | undefined;
  /** N, the engine's estimate of the error of force; absent: not known */
  readonly error?: number | undefined;
  /** Absent: none is requested */
  readonly torque?: Torque | undefined;
  /** N, force on the fingers, > 0 opens them; absent: none is requested */
  readonly gripForce?: number | undefined;
  // With the feature "ways" only:
  /**
   * Index, from 1, in Hello.ways: the way in which the engine computed this force; 0 if it is not stated. A server
   * treats an index beyond the last entry as 0
   */
  readonly way?: number | undefined;
}

/**
 * A local model of the torque. The device loop evaluates it at the handle's orientation q. With p = (w, v) = q · at⁻¹,
 * the rotation from at to q, and K = stiffness, it is
 * τ(q) = torque − 2 (w K v + v × K v)        which is torque − K θ for a small rotation vector θ
 */
export interface RotationModel {
  /** Orientation that torque was computed for; absent is refused */
  readonly at: Quat;
  /** N·m/rad, −∂τ/∂θ in base frame axes; a spring is positive; entries as in LocalModel.stiffness */
  readonly stiffness: Stiffness;
}

/**
 * A local model of the force. The device loop evaluates it at the hand's position x:
 * F(x) = force − stiffness · (x − at)
 * With a radius or a contact see WIRE.md, "The force between two answers". A server that does not know them uses this
 * equation.
 */
export interface LocalModel {
  /** M, position that force was computed for */
  readonly at: Vec3;
  /**
   * N/m, −∂F/∂x; a spring is positive. 1 entry k is k·I, 3 are the diagonal, 9 are the matrix row by row. An engine
   * that does not know the stiffness sends a single 0
   */
  readonly stiffness: Stiffness;
  /** M, radius around at in which the model is valid; absent: not known */
  readonly validRadius?: number | undefined;
  /** Surface that the tool touches or is about to touch */
  readonly contact?: Contact | undefined;
}

/** A surface that the tool touches or is about to touch. It pushes and does not pull, unless it has a table. */
export interface Contact {
  /** Direction out of the body, towards the hand: a force along +normal pushes the hand away */
  readonly normal: Vec3;
  /** M, distance from the surface to the tool along the normal, negative if the tool is pressed in */
  readonly gap: number;
  /** Forces along the normal at other depths */
  readonly table?: ForceTable | undefined;
}

/** Forces along the normal. Entry i is for the tool at at − (first + i · step) · normal. */
export interface ForceTable {
  /** M, depth of entry 0, negative if it is farther out than at */
  readonly first: number;
  /** m */
  readonly step: number;
  /** N, forces along +normal */
  readonly force: readonly number[];
}

/**
 * Sets how many states of a device the client is sent per second. Before the first such request it is sent every state,
 * loopHz per second. After it, the client is sent every k-th state, where k = loopHz / hz, rounded, at least 1: with
 * loopHz 1000, 300 Hz become 333 and 2000 Hz become 1000.
 */
export interface SetStateRate {
  /** At least 1; 0 is answered with Code.INVALID */
  readonly hz: number;
  readonly device: number;
}

/**
 * Suppresses the states that the client can predict. After a state with velocity v, the server sends the first state
 * whose velocity differs from v by more than max(share · ‖v‖, floor), whose mode or buttons differ, or that is
 * maxSilenceUs newer. Between two states the client extrapolates: x + v · (t − sampledNs).
 */
export interface StateDeadband {
  /** Fraction of the speed (Weber fraction); answered Code.INVALID beyond 0 … 0.5 */
  readonly share: number;
  /** m/s, smallest difference of the velocity; answered Code.INVALID beyond 0 … 0.1 */
  readonly floor: number;
  /** Longest time without a state; 0: every state is sent again. Answered Code.INVALID beyond 0 and 1000 … 20 000 */
  readonly maxSilenceUs: number;
}

/**
 * Clears a latched fault and revokes a Disarm; only from a controller of the device. If the device has a safety layer,
 * this is the operator's request to arm.
 */
export interface Rearm {
  readonly device: number;
}

/**
 * Sets the force to zero from the next haptic step on, without a ramp, until a Rearm; only from a controller of the
 * device, whether or not it holds the channel. A new force, a new session or the dead man's button alone does not end
 * it. The device's Safety changes from armed to homed, and a pending request to arm is withdrawn. Disarm is not a fault
 * and clears no fault. Repeating it has no effect. Code.OK: the device's loop receives the order before its next step.
 */
export interface Disarm {
  readonly device: number;
}

/**
 * Offers the sender's device as the other end of a coupling with this device, and describes that end; only from the
 * client that has claimed the channel as a controller, with the feature "teleoperation". Code.OK: the two ends fit;
 * both peers then send PortState frames, and the server sends no states. Code.INVALID: they do not fit, and the detail
 * names the first difference. Code.UNSUPPORTED: that device cannot be coupled. Code.BUSY: that channel is coupled with
 * another client; a follower has one channel for each of its leaders.
 */
export interface Couple {
  /** Device of the server */
  readonly device: number;
  /** Channel of the server */
  readonly channel: number;
  /** Role of the sender; the server's device has the other role */
  readonly role: PortRole;
  readonly method: CouplingMethod;
  /** The follower's motion divided by the leader's */
  readonly positionScale: number;
  /** The leader's force divided by the follower's */
  readonly forceScale: number;
  /** Turns the leader's base frame into the follower's; absent is refused */
  readonly rotation: Quat;
  /** Bits 1, 2, 4: x, y, z of the leader's frame are coupled */
  readonly axes: number;
  /** N/m, stiffness between the handles, as felt by the leader */
  readonly stiffness: number;
  /** N·s/m, damping between the handles, as felt by the leader */
  readonly mutualDamping: number;
  /** N·s/m, damping of each handle, as felt by the leader */
  readonly damping: number;
  /** The stiffness decreases as the round trip increases */
  readonly adaptToDelay: boolean;
  /** The ends exchange energy (core/teleoperation/energy_tank.h) */
  readonly purse: boolean;
  /** Time between two PortState frames of the sender */
  readonly periodUs: number;
  /** Positions map to positions: the offsets are zero, and the ends align before they engage */
  readonly absolute?: boolean | undefined;
  // As felt by the leader. With a stiffness of 0 the part is not coupled:
  /** N·m/rad, stiffness between the orientations */
  readonly turnStiffness?: number | undefined;
  /** N·m·s/rad, damping between the orientations */
  readonly turnDamping?: number | undefined;
  /** N/m, stiffness between the grippers, at the leader's fingers */
  readonly gripStiffness?: number | undefined;
  /** N·s/m, damping between the grippers */
  readonly gripDamping?: number | undefined;
  // For one method only:
  /** 1/s. CouplingMethod.PASSIVITY: rate at which the follower corrects its drift */
  readonly driftRate?: number | undefined;
  /** CouplingMethod.RATE; absent with the other methods */
  readonly rate?: RateControl | undefined;
}

/**
 * How the displacement of the leader's handle, which a spring pulls back to its center, commands the speed of the
 * follower. All values are in the leader's scale.
 */
export interface RateControl {
  /** M, distance of the leader from its center within which the follower stands still */
  readonly deadZone: number;
  /** 1/s, speed of the follower per meter beyond the dead zone */
  readonly gain: number;
  /** m/s, maximum speed of the follower */
  readonly maxSpeed: number;
}

/**
 * Couples the handles, on the operator's command. Only the leader's server accepts it, from a controller of the device.
 * Code.OK: the device's loop has the order. Code.UNSUPPORTED: that device has no coupling, or is the follower.
 */
export interface Engage {
  readonly device: number;
}

/** Ends the engagement. Either end's server accepts it, only from a controller of the device. */
export interface Disengage {
  readonly device: number;
}

/**
 * Sets the scales of the coupling. Only the leader's server accepts it, from a controller of the device. Code.OK: the
 * device's loop has the order. Code.BUSY: the leader is engaged and does not hold its clutch. Code.UNSUPPORTED: that
 * device has no coupling, or is the follower.
 */
export interface SetScale {
  readonly device: number;
  /** As in Couple */
  readonly positionScale: number;
  /** As in Couple */
  readonly forceScale: number;
}

/**
 * Sets the weight of one channel's leader among the leaders of a follower. Only the follower's server accepts it, from
 * a controller of the device. The weight reaches the value within 0.5 s; the other leaders share the rest in the same
 * proportion as before. Code.UNSUPPORTED: that device has no coupling, has one leader only, or is a leader.
 */
export interface SetShare {
  readonly device: number;
  readonly channel: number;
  readonly share: number;
}

/** The colour of a lamp. */
export interface LampColour {
  /** Color of a lamp, 0xRRGGBB; 0 is off: the lamp then shows the state of the device */
  readonly rgb: number;
}

/**
 * Sets a lamp of the device or starts a vibration pulse; only from a controller of the device that holds one of its
 * channels, with the feature "outputs". An output is switched off when the client that set it gives up or loses a
 * channel of the device, and when the device is disarmed. Code.INVALID: the device has no such output, or it is of the
 * other kind, or neither `rgb` nor `vibration` is there.
 */
export interface SetOutput {
  readonly device: number;
  /** Number in HandleDescription.outputs; answered Code.INVALID beyond the device's last */
  readonly output: number;
  readonly setting: LampColour | Vibration;
}

/** A vibration pulse. It stops after its duration, or when a new pulse replaces it. */
export interface Vibration {
  /** Fraction of the output's maximum; 0 is off */
  readonly amplitude: number;
  /** Hz, 0 or at least 20; 0 is the output's own frequency */
  readonly frequency: number;
  readonly durationMs: number;
}

/** Requests the DeviceDescription of a device, whether the client has claimed the device or not. */
export interface Describe {
  /** Answered Code.INVALID beyond the server's last device */
  readonly device: number;
  /** With the feature "handle" only: requests the HandleDescription instead */
  readonly handle?: boolean | undefined;
}

/**
 * Asks that the channel take the client's forces; only from a client that has claimed the channel as a controller.
 * Code.OK: the client holds the lease. Code.BUSY: another client does, and waitMs is the time until that lease ends
 * unless it is renewed.
 */
export interface TakeLease {
  readonly device: number;
  readonly channel: number;
}

/** Releases the lease of a channel. */
export interface GiveLease {
  readonly device: number;
  readonly channel: number;
}

/** Tells a client with the feature "channels" that the channel now takes the forces of another client. */
export interface LeaseLost {
  readonly device: number;
  readonly channel: number;
  /** Name of the new lease holder */
  readonly to: string;
}

/** The answer to a Control. */
export interface ControlAck {
  /** Id of the answered Control */
  readonly id: number;
  readonly code: Code;
  /** Explanation for people */
  readonly detail: string;
  /** With Code.BUSY of TakeLease: time until the lease ends, unless its holder renews it; 0 if it is not known */
  readonly waitMs?: number | undefined;
  /** With Code.OK of Describe */
  readonly device?: DeviceDescription | undefined;
  /** With Code.OK of Describe, if it requested the handle */
  readonly handle?: HandleDescription | undefined;
}

/** The properties of a device. */
export interface DeviceDescription {
  readonly device: number;
  /** The server's name for the device, which a claim uses */
  readonly name: string;
  /** The kind of device, as Welcome.deviceName */
  readonly model: string;
  /** Number of measured axes */
  readonly positionDof: number;
  /** Number of axes with a motor */
  readonly forceDof: number;
  /** Absent: not known */
  readonly workspace: { readonly min: Vec3; readonly max: Vec3 } | undefined;
  /** N, norm of the peak force; 0 if it is not known */
  readonly maxForce: number;
  /** N, norm of the force for any length of time; 0 if it is not known */
  readonly continuousForce: number;
  /** N/m, largest stiffness that the device renders stably; 0 if it is not known */
  readonly maxStiffness: number;
  /** M, one encoder count at the handle; 0 if the position is exact */
  readonly positionResolution: number;
  /** Haptic steps per second */
  readonly loopHz: number;
  /** Channels of the device, by number */
  readonly channels: readonly ChannelDescription[];
}

/** The properties of a device's handle, with the feature "handle" only. */
export interface HandleDescription {
  readonly device: number;
  /**
   * Rotation from the device base frame to the operator's frame: x to the right, y up, z towards the user; absent: not
   * known
   */
  readonly operatorFromDevice?: Quat | undefined;
  /** Names by bit of DeviceState.buttons; a name may be empty */
  readonly buttons: readonly string[];
  /** True if every state has an orientation, false if none has */
  readonly orientationMeasured: boolean;
  /** N·m, norm of the torque that the device can exert; 0 if it has no such motors */
  readonly maxTorque: number;
  /** rad, opening of the open gripper; absent: no gripper */
  readonly gripperOpen?: number | undefined;
  /** N, force on the fingers; 0 if the gripper has no motor */
  readonly maxGripperForce: number;
  /** Name that the devices of one body share (two arms, five fingers); empty if the device is by itself */
  readonly group: string;
  readonly hand: Hand;
  // With the feature "joints" only:
  /** Names of the joints, in the order of DeviceState.joints.angles */
  readonly joints?: readonly string[] | undefined;
  // With the feature "outputs" only:
  /** Outputs that SetOutput can set, by number */
  readonly outputs?: readonly OutputDescription[] | undefined;
}

/** An output of a device, in addition to its forces. */
export interface OutputDescription {
  readonly name: string;
  readonly kind: OutputKind;
}

/** A channel of a device and its lease. */
export interface ChannelDescription {
  /** The name that a claim uses */
  readonly name: string;
  readonly rule: ChannelRule;
  /** Time without a force after which another client may take the lease; 0 if the lease does not expire */
  readonly leaseMs: number;
  /** First 24 bytes of the lease holder's name; empty if there is none */
  readonly holder: string;
}

/** The end of the session. Either way, sent three times. */
export interface Bye {
  /** Reason for the end */
  readonly code: Code;
  /** Explanation for people */
  readonly reason: string;
}

/**
 * Statistics of a client's forces and datagrams: why forces were late, and how the network performed. One-way delays
 * depend on the estimated clock offset: they are accurate to ± clockErrorNs and can be negative. Server → client,
 * unreliable; the highest number wins.
 */
export interface LinkReport {
  /** 1, 2, 3 … per session */
  readonly number: bigint;
  /** End of the reported interval, server clock */
  readonly untilNs: Nanoseconds;
  /** Length of the interval */
  readonly spanNs: Nanoseconds;
  // In the interval:
  /** Forces that arrived */
  readonly forces: bigint;
  /** Forces that were late because the server sent a state late */
  readonly lateServer: bigint;
  /** Forces that were late because of the network, in either direction */
  readonly lateNetwork: bigint;
  /** Forces that were late because the engine took longer than usual */
  readonly lateEngine: bigint;
  /** Longest time that the device was without a valid force */
  readonly worstLateNs: Nanoseconds;
  /** Longest time without a datagram from the client */
  readonly longestGapNs: Nanoseconds;
  /** Absent: not measured */
  readonly roundTrip: Delays | undefined;
  /** One way; absent: not measured */
  readonly toServer: Delays | undefined;
  /** One way; absent: not measured */
  readonly toClient: Delays | undefined;
  // Clocks:
  /** The client's clock minus the server's */
  readonly clockOffsetNs: Nanoseconds;
  /** Rate at which the offset grows */
  readonly clockDriftPpm: number;
  /** Upper bound of |true offset − clockOffsetNs| */
  readonly clockErrorNs: Nanoseconds;
  // Datagrams of the client since the session opened:
  readonly received: bigint;
  readonly lost: bigint;
  readonly reordered: bigint;
  readonly duplicated: bigint;
  // In the interval:
  /** Explanation of late and refused forces, for people; empty if there are none */
  readonly words: string;
  /** Forces that are late for an unknown reason, because nothing is received from the client */
  readonly lateUnknown: bigint;
  // Forces of the client, on all its channels, that could not be used in the interval:
  /** A number is NaN or infinite */
  readonly refusedNotFinite: bigint;
  /** A number is beyond its bound */
  readonly refusedOutOfBounds: bigint;
  /** No step had the number basedOnTick, or it was more than 4096 ticks ago */
  readonly refusedUnknownTick: bigint;
  /** Sequence has not grown, although the datagram is the newest */
  readonly refusedOldSequence: bigint;
}

/** Two quantiles of a delay. A one-way delay can be negative, because it compares two clocks. */
export interface Delays {
  readonly medianNs: Nanoseconds;
  readonly p99Ns: Nanoseconds;
}

/**
 * The state of one end of a coupling, sent to the other end. Vectors are in the base frame and the scale of the
 * SENDER's device. core/teleoperation/coupling.h describes their use. Either way, unreliable, with the feature
 * "teleoperation" only; for each device, channel and end the highest sequence of the highest epoch wins. An observer of
 * the device is sent both ends of its coupling.
 */
export interface PortState {
  /** Device of the session's server, in both directions */
  readonly device: number;
  /** Channel of the session's server, in both directions */
  readonly channel: number;
  /** Epoch of the sender, which increases when the sender restarts */
  readonly epoch: bigint;
  /** 1, 2, 3 … within an epoch: the sender's haptic steps */
  readonly sequence: bigint;
  /** Epoch of the receiver that `answers`, given and taken belong to; 0: none yet */
  readonly answersEpoch: bigint;
  /** Sequence of the receiver's newest PortState in use; 0: none yet */
  readonly answers: bigint;
  /** Time on the sender's clock; only differences are used */
  readonly timeNs: Nanoseconds;
  /** Round trip measured by the sender; 0 before the first measurement */
  readonly roundTripNs: Nanoseconds;
  readonly phase: PortPhase;
  /** Number of the leader's engagement that the phase belongs to: 1, 2, 3 …; 0: none yet */
  readonly engagement: bigint;
  /** Bit i: button i is held */
  readonly buttons: number;
  /** M, displacement of the handle from the sender's offset */
  readonly position: Vec3;
  /** m/s, velocity of that displacement; zero while the displacement is frozen */
  readonly velocity: Vec3;
  /** N, actual force on the hand at the sender's handle */
  readonly force: Vec3;
  /** N, force of the environment on the sender's tool; absent: not measured */
  readonly contactForce?: Vec3 | undefined;
  /** J, energy that the sender may still give out, after its payments */
  readonly account: number;
  /** J, energy that the sender needs for its desired force; 0: it has no tank */
  readonly need: number;
  /** J, total paid to the receiver; it never decreases while both epochs last */
  readonly given: number;
  /** J, the receiver's given, as last received, in joules of the receiver */
  readonly taken: number;
  /**
   * CouplingMethod.WAVES: √W·s, ∫ wave dt since the epoch began: a total, so a lost frame has no lasting effect; half
   * the square of a wave is a power. Absent: nothing sent yet
   */
  readonly waveIntegral?: Vec3 | undefined;
  /** J, ∫ ‖wave‖²/2 dt; it never decreases within an epoch */
  readonly waveEnergy?: number | undefined;
  /** CouplingMethod.SURFACE, from the follower; absent: no surface was touched yet */
  readonly surface?: PortSurface | undefined;
  /** Absent: the orientations are not coupled */
  readonly turn?: PortTurn | undefined;
  /** Absent: the grippers are not coupled */
  readonly grip?: PortGrip | undefined;
  /** J. CouplingMethod.PASSIVITY: energy that the sender's port took in during this epoch */
  readonly energyIn?: number | undefined;
  /** Weight of the receiver among the leaders of a follower; absent: the receiver is the only leader */
  readonly share?: number | undefined;
  // From a leader, in use from this frame on; 0: as in Couple. An observer is always sent the values:
  readonly positionScale?: number | undefined;
  readonly forceScale?: number | undefined;
  // To an observer:
  /** True if this is the other end of the device's coupling, as the server received it */
  readonly ofPeer?: boolean | undefined;
}

/** The rotation of a handle since its offset was taken. */
export interface PortTurn {
  /** Rotation in the axes of the sender's base frame */
  readonly turn: Quat;
  /** rad/s, angular velocity; zero while the rotation is frozen */
  readonly angularVelocity: Vec3;
  /** N·m, actual torque on the hand at the sender's handle */
  readonly torque: Vec3;
}

/** State of a gripper, measured at its fingers. The gripper has its own energy account. */
export interface PortGrip {
  /** m */
  readonly opening: number;
  /** m/s */
  readonly velocity: number;
  /** N, actual force on the fingers, > 0 opens them */
  readonly force: number;
  /** J, as in PortState */
  readonly account: number;
  /** J, as in PortState */
  readonly need: number;
  /** J, as in PortState */
  readonly given: number;
  /** J, as in PortState */
  readonly taken: number;
}

/** A flat elastic surface that the sender's tool touches, or was the last to touch. It pushes and does not pull. */
export interface PortSurface {
  /** Direction out of the surface */
  readonly normal: Vec3;
  /** M, the surface is where normal · position = offset */
  readonly offset: number;
  /** N/m, stiffness; 0 if the surface is gone */
  readonly stiffness: number;
}

/**
 * Performance of a device's loop. All counts are for the reported interval. Server → client, unreliable, to an observer
 * with the feature "diagnostics" only; for each device the highest number wins.
 */
export interface DeviceReport {
  /** 1, 2, 3 … per device */
  readonly number: bigint;
  /** End of the reported interval, server clock */
  readonly untilNs: Nanoseconds;
  /** Length of the interval */
  readonly spanNs: Nanoseconds;
  readonly device: number;
  /** Haptic steps */
  readonly steps: bigint;
  /** Periods without a step, because the previous step was late */
  readonly missed: bigint;
  /** Steps that began too long after the previous one (reason overrun) */
  readonly overruns: bigint;
  /** Steps in which the device reported no position */
  readonly unseen: bigint;
  /**
   * How late the loop woke: entry 0 counts the steps that were at most 1 µs late, entry i those more than 2^(i−1) µs
   * and at most 2^i µs late, entry 23 all those more than 2^22 µs late. Trailing zeros are omitted. The sum is less
   * than `steps` only if the server failed to count some
   */
  readonly lateness: readonly bigint[];
  readonly safety: Safety;
  /** Why the device exerts no force until it is armed or rearmed, for people; empty if there is no fault */
  readonly fault: string;
  /** Service that the server reduces at present, for people; empty if there is none */
  readonly degraded: string;
}

/**
 * Performance of the engine that holds the lease of a channel. Server → client, unreliable, to an observer with the
 * feature "diagnostics" only; for each device and channel the highest number of its link wins.
 */
export interface PeerReport {
  readonly device: number;
  readonly channel: number;
  /** Name of the engine, as in its Hello */
  readonly name: string;
  /** The engine is sent one in this many of its requested states, because its link is full */
  readonly stateOneIn: number;
  /** The server ignores its forces, because its link loses too many datagrams */
  readonly forcesRefused: boolean;
  /** Report on the engine's link; number and the counts of forces are per channel; absent is refused */
  readonly link: LinkReport;
  // Of the force in the interval with the largest ForceCommand.error; if none states an error, of the newest:
  /** N, estimated error of that force; absent: no force states an error */
  readonly error?: number | undefined;
  /** Entry of Hello.ways for that force; empty if it is not stated */
  readonly way?: string | undefined;
}

/** The first message of a client. */
export interface Hello {
  /** Lowest version that the client speaks; the highest common version is used */
  readonly versionMin: number;
  /** Highest version that the client speaks */
  readonly versionMax: number;
  /** With claims, the highest role among them */
  readonly role: Role;
  /** Name for logs */
  readonly name: string;
  /** Offered features; a feature is used if both peers name it */
  readonly features: readonly string[];
  /**
   * Claimed devices and channels, each once. Without claims, the client is granted device 0 and its channel 0 with
   * `role`
   */
  readonly claims?: readonly Claim[] | undefined;
  // With the feature "ways" only:
  /** Names of the ways in which this engine computes forces, the fastest first; ForceCommand.way is an index in it */
  readonly ways?: readonly string[] | undefined;
}

/** A device or a channel that the client wants. */
export interface Claim {
  /** Name of the device; empty: device 0 */
  readonly device: string;
  /** Name of the channel, from a controller; empty: channel 0 */
  readonly channel: string;
  readonly role: Role;
}

/** The server accepts the client. */
export interface Welcome {
  /** Version of the session, within the client's range */
  readonly version: number;
  /** Features that both peers named */
  readonly features: readonly string[];
  /** Granted role */
  readonly role: Role;
  /** The kind of device */
  readonly deviceName: string;
  /** N, norm of the force that the device can exert */
  readonly maxForce: number;
  /** M, one encoder count at the handle; 0 if the position is exact */
  readonly positionResolution: number;
  /** Haptic steps per second */
  readonly loopHz: number;
  /** Silence after which the server forgets this client */
  readonly timeoutMs: number;
  /** Name and version of the server */
  readonly server: string;
  /**
   * One for each claim, in the claims' order; deviceName … loopHz are those of the first grant's device. A server that
   * does not know claims sends none, and treats the Hello as one without claims
   */
  readonly grants?: readonly Grant[] | undefined;
}

/** The numbers of a device and a channel that were claimed by name. */
export interface Grant {
  /** Number of the device in all later messages */
  readonly device: number;
  /** Number of the channel in all later messages */
  readonly channel: number;
  /** Granted role; Role.OBSERVER for a controller's claim if another client holds the lease (TakeLease) */
  readonly role: Role;
}

/** The server refuses the client. */
export interface Refused {
  /** why */
  readonly code: Code;
  /** A sentence for people */
  readonly detail: string;
  /** Lowest version that the server speaks */
  readonly versionMin: number;
  /** Highest version that the server speaks */
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

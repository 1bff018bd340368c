// SPDX-License-Identifier: Apache-2.0
// Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
// The messages of tendon.proto as plain values.
import {
  ChannelRule,
  Code,
  CouplingMethod,
  FieldFixtureKind,
  Hand,
  Mode,
  PortPhase,
  PortRole,
  Role,
  Safety,
} from "./tendon_pb.js";
import type { Quat, Stiffness, Vec3 } from "../messages.js";
import type { Nanoseconds } from "../time.js";

export { ChannelRule, Code, CouplingMethod, FieldFixtureKind, Hand, Mode, PortPhase, PortRole, Role, Safety };

/** The kind of an output. */
export enum OutputKind {
  LAMP = 1,
  /** A separate vibrator that is not one of the motors of the axes */
  VIBRATION = 2,
}

/**
 * Acknowledges a datagram of the peer and measures the round trip: with T3 = txTimeNs of the datagram that carries the
 * echo and T4 = the time at which that datagram arrives, the round trip is (T4 − T1) − (T3 − T2).
 */
export interface Echo {
  /** T1: the txTimeNs of that datagram, on the clock of the peer */
  readonly sent: Nanoseconds;
  /** T2: the time at which that datagram arrived, on the clock of the sender of the echo; T2 ≤ T3 */
  readonly received: Nanoseconds;
  /** Packet number of that datagram */
  readonly packetNumber: bigint;
  /**
   * Bit i is set if the packet packetNumber − 1 − i has also arrived. Malformed packets only count as arrived in suites
   * 1 and 2
   */
  readonly receivedMask: number;
}

/** How the handle is turned. */
export interface Turning {
  /**
   * The rotation from the handle frame to the device base frame. If the handle is in its middle position, the stylus or
   * finger points along the −z axis of the handle frame, y is up, and x is to the right.
   */
  readonly orientation: Quat;
  /** rad/s. The angular velocity in the axes of the base frame. It is ignored if there is no orientation */
  readonly angularVelocity: Vec3;
}

/** How far the gripper of the handle is open. */
export interface Grip {
  /** rad. The opening of the gripper, which is 0 if it is closed. */
  readonly opening: number;
  /** rad/s. The velocity of the opening. It is ignored if there is no grip.opening */
  readonly velocity: number;
}

/** The joints that carry the handle, in the order of HandleDescription.joints. */
export interface Joints {
  /** rad. The angles of the joints that carry the handle, in the order of HandleDescription.joints. */
  readonly angles: readonly number[];
  /** rad/s. The velocities of these joints. Missing entries are 0, and entries without an angle are ignored */
  readonly velocities: readonly number[];
}

/** The field that is rendered. */
export interface FieldState {
  /**
   * The generation of the rendered field (UseField.generation). If several channels use fields, this is the first one
   * with contact, or else the first one.
   */
  readonly generation: number;
  /** m, the distance from the proxy to the hand, or 0 if there is no contact */
  readonly depth: number;
  /** m, the position of the proxy, which is ignored if there is no field */
  readonly proxy: Vec3;
}

/** The state of a device at one haptic step. Server → client, unreliable; for each device the highest tick wins. */
export interface DeviceState {
  /** Number of the haptic step */
  readonly tick: bigint;
  /** The time at which the position was sampled, on the clock of the server */
  readonly sampledNs: Nanoseconds;
  /** m */
  readonly position: Vec3;
  /** m/s */
  readonly velocity: Vec3;
  /** N, the actual force on the hand from this step on */
  readonly forceApplied: Vec3;
  /** J, the energy that the device may still output, according to the energy ledger */
  readonly energy: number;
  /** N. The limiter's bound on the norm of the force, or +infinity if there is none */
  readonly permittedForce: number;
  /** The reasons why the actual force differs from the requested one (bits of core/base/reason.h) */
  readonly reasons: number;
  /** The sequence of the ForceCommand that is rendered, or 0 */
  readonly forceSequence: bigint;
  /** The time since this ForceCommand has arrived */
  readonly forceAgeNs: Nanoseconds;
  readonly mode: Mode;
  readonly device: number;
  /**
   * The channel of the force that is described by forceSequence, forceAgeNs and mode. This is the freshest one. If
   * several are equally fresh, it is the one with the lowest number
   */
  readonly channel: number;
  // With the feature "diagnostics" only:
  /**
   * N. The force on the hand that is requested by the engines at this step, before it is limited. It may be held,
   * faded, or extrapolated using their models. Absent if it is not reported
   */
  readonly forceWanted?: Vec3 | undefined;
  // With the feature "diagnostics" only:
  /**
   * N/m, −∂forceWanted/∂position according to the models of the engines at this step, with the entries of
   * LocalModel.stiffness. Absent if there is no model
   */
  readonly stiffnessWanted?: Stiffness | undefined;
  /** Bit i is set if button i is pressed, or if it was pressed since the previous state */
  readonly buttons: number;
  /** Absent if it is not measured */
  readonly turning?: Turning | undefined;
  /**
   * N·m. The actual torque on the hand about position from this step on, in the axes of the base frame. Absent if the
   * device cannot exert torques
   */
  readonly torqueApplied?: Vec3 | undefined;
  /** Absent if there is no gripper */
  readonly grip?: Grip | undefined;
  /**
   * N. The actual force on the fingers from this step on. Positive values open them. Absent if the gripper has no motor
   */
  readonly gripApplied?: number | undefined;
  /** N. The force of the hand ON THE HANDLE, as measured by a force sensor. Absent if there is no force sensor */
  readonly handForce?: Vec3 | undefined;
  /** Absent if the device does not report joints */
  readonly joints?: Joints | undefined;
  /** Absent if no field is rendered */
  readonly field?: FieldState | undefined;
}

/** On the hand, base frame axes, about the handle's position. */
export interface Torque {
  /** N·m. The torque on the hand about the position of the handle, in the axes of the base frame. */
  readonly torque: Vec3;
  /**
   * The change of the torque when the handle turns. It does not require a `model`, and torque.torque is 0 if it is
   * missing
   */
  readonly model?: RotationModel | undefined;
}

/**
 * The force that is requested by a physics engine in response to a state. Client → server, unreliable; for each device
 * and channel the highest sequence wins.
 */
export interface ForceCommand {
  /** 1, 2, 3 … per session, device and channel */
  readonly sequence: bigint;
  /** The DeviceState.tick of the state that was used for computing the force */
  readonly basedOnTick: bigint;
  /** N. The force on the hand. A wall that resists motion along +x sends −x */
  readonly force: Vec3;
  /** The change of the force when the hand moves. Absent if the force is constant */
  readonly model?: LocalModel | undefined;
  /** The time after its arrival during which the force is fresh */
  readonly validForUs: number;
  readonly device: number;
  readonly channel: number;
  /** If true, the body was cut or torn since the previous answer, so neither this model nor the previous one is used */
  readonly topologyChanged?: boolean | undefined;
  /** N. The error of force, as estimated by the engine. Absent if it is unknown */
  readonly error?: number | undefined;
  /** Absent if no torque is requested */
  readonly torque?: Torque | undefined;
  /** N. The force on the fingers. Positive values open them. Absent if no force is requested */
  readonly gripForce?: number | undefined;
  // With the feature "ways" only:
  /**
   * The way in which the engine has computed this force, as an index in Hello.ways that starts at 1, or 0 if it is
   * unknown. Servers treat an index that is larger than the number of ways as 0
   */
  readonly way?: number | undefined;
  // With the feature "fields" only:
  /**
   * If it is not 0, force is not rendered. It is the true force for the state `basedOnTick`, which is used for
   * correcting the field with this generation (UseField.generation). The model is ignored
   */
  readonly field?: number | undefined;
}

/**
 * A local model of the torque. The device loop evaluates it at the handle's orientation q. With p = (w, v) = q · at⁻¹,
 * the rotation from at to q, and K = stiffness, it is
 * τ(q) = torque − 2 (w K v + v × K v)        which is torque − K θ for a small rotation vector θ
 */
export interface RotationModel {
  /** The orientation for which torque was computed; absent is refused */
  readonly at: Quat;
  /** N·m/rad, −∂τ/∂θ in the axes of the base frame, with the entries of LocalModel.stiffness. Springs are positive */
  readonly stiffness: Stiffness;
}

/**
 * A local model of the force. The device loop evaluates it at the hand's position x:
 * F(x) = force − stiffness · (x − at)
 * With a radius or a contact see WIRE.md, "The force between two answers". A server that does not know them uses this
 * equation.
 */
export interface LocalModel {
  /** m, the position for which force was computed */
  readonly at: Vec3;
  /**
   * N/m, −∂F/∂x. Springs are positive. A single entry k is k·I, three entries are the diagonal, and nine entries are
   * the matrix row by row. Engines that do not know the stiffness send a single 0
   */
  readonly stiffness: Stiffness;
  /** m. The distance from at up to which the model is valid. Absent if it is unknown */
  readonly validRadius?: number | undefined;
  /** The surface that is touched by the tool or is about to be touched */
  readonly contact?: Contact | undefined;
}

/**
 * A surface that is touched by the tool or is about to be touched. It can push but not pull, unless there is a table.
 */
export interface Contact {
  /** The direction from the body to the hand, which is pushed away by a force along +normal */
  readonly normal: Vec3;
  /** m. The distance from the surface to the tool along the normal. It is negative if the tool is inside of the body */
  readonly gap: number;
  /** The forces along the normal if the tool is at other depths */
  readonly table?: ForceTable | undefined;
}

/** Forces along the normal. Entry i is for the tool at at − (first + i · step) · normal. */
export interface ForceTable {
  /** m. The depth of entry 0. It is negative if the tool is farther out than at */
  readonly first: number;
  /** m */
  readonly step: number;
  /** N, the forces along +normal */
  readonly force: readonly number[];
}

/**
 * A part of the manifest of a field, which contains its primitives and a list of its bricks. Parts are sent in order.
 */
export interface OfferField {
  /** The BLAKE2b-256 hash of the manifest, which is used as the name of the field */
  readonly field: Uint8Array;
  /** The size of the whole manifest in bytes */
  readonly size: number;
  /** The offset of this part in the manifest in bytes */
  readonly offset: number;
  readonly part: Uint8Array;
}

/**
 * Uses a field in a channel instead of the previous one. The field must be complete on the server (FieldStatus), and
 * the client must have the lease of the channel, as for a ForceCommand.
 */
export interface UseField {
  readonly device: number;
  readonly channel: number;
  /** A number that is increased with each UseField of a session, device and channel */
  readonly generation: number;
  /** The hash of the manifest */
  readonly field: Uint8Array;
  /** The materials, which are numbered from 0 in the manifest */
  readonly materials: readonly FieldMaterial[];
  readonly fixtures?: readonly FieldFixture[] | undefined;
  /** The tables of the materials that have one */
  readonly tables?: readonly FieldDepthTable[] | undefined;
}

/**
 * Removes a field from the server. If the field is used in a channel, it is no longer rendered. The bricks are kept in
 * the cache of the server.
 */
export interface DropField {
  /** The hash of the manifest */
  readonly field: Uint8Array;
}

/**
 * A viscoelastic material: a spring in parallel with a Maxwell element, which is a spring in series with a damper, and
 * Coulomb friction (core/field/material.h).
 */
export interface FieldMaterial {
  /** N/m */
  readonly stiffness: number;
  /** N/m. The stiffness of the spring in series with the damper, or 0 if there is no damper */
  readonly branchStiffness?: number | undefined;
  /** s. The time constant of the damper. It is ignored if there is no damper */
  readonly relaxation?: number | undefined;
  /** The coefficient of friction */
  readonly friction?: number | undefined;
}

/**
 * This table is added to the force of the springs of a material. The correction is zero at the surface, and is
 * interpolated linearly between the entries. The last entry is also used for all greater depths. The slope of the table
 * must be at least −0.9 times the stiffness of the material. The sum of the slope and the stiffnesses must not exceed
 * the maximum stiffness of the server.
 */
export interface FieldDepthTable {
  /** The number of the material */
  readonly material: number;
  /** m, the spacing of the entries */
  readonly step: number;
  /** N, entry i is for the depth (i + 1) · step */
  readonly force: readonly number[];
}

/** A spring that pulls the hand to a point, a line or a plane, in the frame of the object (core/field/fixture.h). */
export interface FieldFixture {
  readonly kind: FieldFixtureKind;
  /** m, the position of the point, or of any point on the line or plane */
  readonly at: Vec3;
  /** The direction of the line or the normal of the plane. It is ignored if the fixture is a point */
  readonly normal: Vec3;
  /** N/m */
  readonly stiffness: number;
  /** N, the maximum force. Absent if the force is not limited */
  readonly mostForce?: number | undefined;
}

/** The weights of a brick (core/field/brick_field.h). Client → server, unreliable. */
export interface FieldBrick {
  /** The BLAKE2b-128 hash of the weights */
  readonly hash: Uint8Array;
  /** 8³ numbers (int16, little-endian), where x is the fastest index */
  readonly weights: Uint8Array;
}

/**
 * Reports which bricks of a field are missing on the server. Bit i % 8 of byte i / 8 is set if brick i of the manifest
 * is missing. The last one of the 1024 bits is set if the manifest is incomplete, and the bits of unknown bricks are 0.
 * Server → client, unreliable; for each field the newest one wins.
 */
export interface FieldStatus {
  /** The hash of the manifest */
  readonly field: Uint8Array;
  /** The bits, where zeros at the end may be omitted */
  readonly missing: Uint8Array;
}

/**
 * The pose of the object of a channel in the base frame of the device. The engine should send the pose that it expects
 * at the time when the message arrives. The server uses the velocities to extrapolate the pose by at most 50 ms. Client
 * → server, unreliable; for each device and channel the highest sequence wins.
 */
export interface FieldPose {
  readonly device: number;
  readonly channel: number;
  /** 1, 2, 3 … per session, device and channel */
  readonly sequence: bigint;
  /** The time of the pose, on the clock of the SERVER as in DeviceState.sampledNs */
  readonly timeNs: Nanoseconds;
  /** m, the position of the origin of the object, which must be within 10 m */
  readonly position: Vec3;
  /** The rotation from the frame of the object to the base frame */
  readonly orientation: Quat;
  /** m/s, the velocity of the origin of the object */
  readonly velocity: Vec3;
  /** rad/s, the angular velocity in the axes of the base frame */
  readonly angularVelocity: Vec3;
}

/**
 * Sets the number of states of a device that are sent to the client per second. Before the first request of this type,
 * all loopHz states per second are sent. After it, every k-th state is sent, where k = loopHz / hz is rounded and at
 * least 1. For example, if loopHz is 1000, 300 Hz becomes 333 Hz and 2000 Hz becomes 1000 Hz.
 */
export interface SetStateRate {
  /** If it is 0, the answer is Code.INVALID */
  readonly hz: number;
  readonly device: number;
}

/**
 * Suppresses states that can be predicted by the client. After a state with velocity v, the server sends the first
 * state whose velocity differs from v by more than max(share · ‖v‖, floor), whose mode or buttons differ, or that is
 * maxSilenceUs newer. Between two states the client extrapolates: x + v · (t − sampledNs).
 */
export interface StateDeadband {
  /** The fraction of the speed (Weber fraction). If it is not in 0 … 0.5, the answer is Code.INVALID */
  readonly share: number;
  /** m/s. The smallest difference of the velocity. If it is not in 0 … 0.1, the answer is Code.INVALID */
  readonly floor: number;
  /**
   * The maximum time without a state. If it is 0, every state is sent again. If it is not 0 or in 1000 … 20 000, the
   * answer is Code.INVALID
   */
  readonly maxSilenceUs: number;
}

/**
 * Clears a latched fault and revokes a Disarm. Can only be used by controllers of the device. If the device has a
 * safety layer, this is a request of the operator to arm it.
 */
export interface Rearm {
  readonly device: number;
}

/**
 * Sets the force to zero without a ramp, from the next haptic step until a Rearm. Can be used by any controller of the
 * device, even if it does not hold the channel. This state does not end if there is a new force or a new session, or if
 * only the dead man's button is pressed. The Safety of the device changes from armed to homed, and pending requests to
 * arm it are withdrawn. A Disarm is not a fault and does not clear faults. If it is repeated, it has no effect. If the
 * answer is Code.OK, the loop of the device will receive the order before its next step.
 */
export interface Disarm {
  readonly device: number;
}

/**
 * Offers the sender's device as the other end of a coupling with this device, and describes that end. Can only be used
 * by a client that has claimed the channel as a controller, and requires the feature "teleoperation". If the two ends
 * match, the answer is Code.OK. After that, both peers send PortState frames, and the server does not send states.
 * Code.INVALID is returned if the ends do not match, and the detail contains the first difference. Code.UNSUPPORTED is
 * returned if this device cannot be coupled. Code.BUSY is returned if the channel is coupled with another client. A
 * follower has one channel for each of its leaders.
 */
export interface Couple {
  /** The device of the server */
  readonly device: number;
  /** The channel of the server */
  readonly channel: number;
  /** The role of the sender. The device of the server has the other role */
  readonly role: PortRole;
  readonly method: CouplingMethod;
  /** The follower's motion divided by the leader's */
  readonly positionScale: number;
  /** The leader's force divided by the follower's */
  readonly forceScale: number;
  /** The rotation from the base frame of the leader to that of the follower; absent is refused */
  readonly rotation: Quat;
  /** Bits 1, 2 and 4 are set if x, y and z of the leader's frame are coupled */
  readonly axes: number;
  /** N/m, the stiffness between the handles, as felt by the leader */
  readonly stiffness: number;
  /** N·s/m, the damping between the handles, as felt by the leader */
  readonly mutualDamping: number;
  /** N·s/m, the damping of each handle, as felt by the leader */
  readonly damping: number;
  /** If true, the stiffness decreases when the round trip increases */
  readonly adaptToDelay: boolean;
  /** If true, the ends exchange energy (core/teleoperation/energy_tank.h) */
  readonly purse: boolean;
  /** The period in which the sender sends PortState frames */
  readonly periodUs: number;
  /** If true, positions map to positions. The offsets are zero, and the ends are aligned before they are engaged */
  readonly absolute?: boolean | undefined;
  // As felt by the leader. With a stiffness of 0 the part is not coupled:
  /** N·m/rad, the stiffness between the orientations */
  readonly turnStiffness?: number | undefined;
  /** N·m·s/rad, the damping between the orientations */
  readonly turnDamping?: number | undefined;
  /** N/m, the stiffness between the grippers at the fingers of the leader */
  readonly gripStiffness?: number | undefined;
  /** N·s/m, the damping between the grippers */
  readonly gripDamping?: number | undefined;
  // For one method only:
  /** 1/s. The rate at which the follower corrects its drift, for CouplingMethod.PASSIVITY */
  readonly driftRate?: number | undefined;
  /** The parameters of CouplingMethod.RATE, which are absent for other methods */
  readonly rate?: RateControl | undefined;
}

/**
 * Describes how the displacement of the leader's handle sets the speed of the follower. A spring pulls the handle to
 * its center. All values use the scale of the leader.
 */
export interface RateControl {
  /** m. If the leader is closer to its center than this distance, the follower does not move */
  readonly deadZone: number;
  /** 1/s, the speed of the follower per meter of displacement beyond the dead zone */
  readonly gain: number;
  /** m/s, the maximum speed of the follower */
  readonly maxSpeed: number;
}

/**
 * Engages the coupling on the command of the operator. Can only be used by controllers of the leader's device, at its
 * server. If the answer is Code.OK, the loop of the device has received the order. Code.UNSUPPORTED is returned if the
 * device is not coupled, or if it is the follower.
 */
export interface Engage {
  readonly device: number;
}

/** Ends the engagement. Can be used at the server of either end, but only by controllers of its device. */
export interface Disengage {
  readonly device: number;
}

/**
 * Sets the scales of the coupling. Can only be used by controllers of the leader's device, at its server. If the answer
 * is Code.OK, the loop of the device has received the order. Code.BUSY is returned if the leader is engaged and its
 * clutch is not held. Code.UNSUPPORTED is returned if the device is not coupled, or if it is the follower.
 */
export interface SetScale {
  readonly device: number;
  /** As in Couple */
  readonly positionScale: number;
  /** As in Couple */
  readonly forceScale: number;
}

/**
 * Sets the weight of the leader of one channel if a follower has several leaders. Can only be used by controllers of
 * the follower's device, at its server. The weight reaches the value within 0.5 s, and the ratios of the other weights
 * do not change. Code.UNSUPPORTED is returned if the device is not coupled, if it only has one leader, or if it is a
 * leader.
 */
export interface SetShare {
  readonly device: number;
  readonly channel: number;
  readonly share: number;
}

/** The colour of a lamp. */
export interface LampColour {
  /** The color of a lamp as 0xRRGGBB. If it is 0, the lamp shows the state of the device */
  readonly rgb: number;
}

/**
 * Sets a lamp of the device or starts a vibration pulse. Can only be used by a controller that holds one of the
 * channels of the device, and requires the feature "outputs". An output is turned off if the client that has set it
 * gives up or loses a channel of the device, or if the device is disarmed. Code.INVALID is returned if the device does
 * not have this output, if the output is of the other kind, or if both `rgb` and `vibration` are missing.
 */
export interface SetOutput {
  readonly device: number;
  /** The index in HandleDescription.outputs. If the device does not have this output, the answer is Code.INVALID */
  readonly output: number;
  readonly setting: LampColour | Vibration;
}

/** A vibration pulse. It stops after its duration, or if it is replaced by a new pulse. */
export interface Vibration {
  /** The fraction of the maximum of the output. If it is 0, the output is turned off */
  readonly amplitude: number;
  /** Hz, either 0 or at least 20. If it is 0, the frequency is chosen by the output */
  readonly frequency: number;
  readonly durationMs: number;
}

/** Requests the DeviceDescription of a device, which does not need to be claimed. */
export interface Describe {
  /** If the server does not have this device, the answer is Code.INVALID */
  readonly device: number;
  /** If true, the HandleDescription is requested instead. This requires the feature "handle" */
  readonly handle?: boolean | undefined;
}

/**
 * Requests the lease of a channel. Can only be used by a client that has claimed the channel as a controller. If the
 * answer is Code.OK, the client holds the lease and its forces are used. If another client holds the lease, the answer
 * is Code.BUSY, and waitMs is the time until the lease ends if it is not renewed.
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

/** Notifies a client with the feature "channels" that the lease of the channel was taken by another client. */
export interface LeaseLost {
  readonly device: number;
  readonly channel: number;
  /** The name of the new holder */
  readonly to: string;
}

/** The answer to a Control. */
export interface ControlAck {
  /** The id of the Control that is answered */
  readonly id: number;
  readonly code: Code;
  /** Explanation for people */
  readonly detail: string;
  /**
   * If the answer to TakeLease is Code.BUSY, this is the time until the lease ends if it is not renewed, or 0 if it is
   * unknown
   */
  readonly waitMs?: number | undefined;
  /** The answer to a Describe with Code.OK */
  readonly device?: DeviceDescription | undefined;
  /** The answer to a Describe with Code.OK if `handle` was set */
  readonly handle?: HandleDescription | undefined;
}

/** The properties of a device. */
export interface DeviceDescription {
  readonly device: number;
  /** The name of the device, which can be used in a claim */
  readonly name: string;
  /** The kind of device, as in Welcome.deviceName */
  readonly model: string;
  /** The number of axes that are measured */
  readonly positionDof: number;
  /** The number of axes that have a motor */
  readonly forceDof: number;
  /** Absent if the workspace is unknown */
  readonly workspace: { readonly min: Vec3; readonly max: Vec3 } | undefined;
  /** N, the maximum norm of the force, or 0 if it is unknown */
  readonly maxForce: number;
  /** N. The maximum norm of the force that has no time limit, or 0 if it is unknown */
  readonly continuousForce: number;
  /** N/m, the maximum stiffness that is rendered stably, or 0 if it is unknown */
  readonly maxStiffness: number;
  /** m. The size of an encoder count at the handle, or 0 if the position is exact */
  readonly positionResolution: number;
  /** Haptic steps per second */
  readonly loopHz: number;
  /** The channels of the device, in the order of their numbers */
  readonly channels: readonly ChannelDescription[];
}

/** The properties of the handle of a device. Requires the feature "handle". */
export interface HandleDescription {
  readonly device: number;
  /**
   * The rotation from the base frame of the device to the frame of the operator, where x is to the right, y is up, and
   * z is towards the user. Absent if it is unknown
   */
  readonly operatorFromDevice?: Quat | undefined;
  /** The name for each bit of DeviceState.buttons. Names can be empty */
  readonly buttons: readonly string[];
  /** If true, all states contain an orientation. Otherwise, none of them do */
  readonly orientationMeasured: boolean;
  /** N·m, the maximum norm of the torque, or 0 if the device cannot exert torques */
  readonly maxTorque: number;
  /** rad. The opening of the gripper if it is open. Absent if there is no gripper */
  readonly gripperOpen?: number | undefined;
  /** N, the maximum force on the fingers, or 0 if the gripper has no motor */
  readonly maxGripperForce: number;
  /**
   * The name of a group of devices that belong together, such as two arms or five fingers. It is empty if the device is
   * not part of a group
   */
  readonly group: string;
  readonly hand: Hand;
  // With the feature "joints" only:
  /** The names of the joints, in the order of DeviceState.joints.angles */
  readonly joints?: readonly string[] | undefined;
  // With the feature "outputs" only:
  /** The outputs that can be set using SetOutput, in the order of their numbers */
  readonly outputs?: readonly OutputDescription[] | undefined;
}

/** An output of a device, in addition to its forces. */
export interface OutputDescription {
  readonly name: string;
  readonly kind: OutputKind;
}

/** The properties of a channel. */
export interface ChannelDescription {
  /** The name that is used in a claim */
  readonly name: string;
  readonly rule: ChannelRule;
  /**
   * If the holder does not send a force for this time, another client can take the lease. It is 0 if the lease does not
   * expire
   */
  readonly leaseMs: number;
  /** The first 24 bytes of the name of the holder. It is empty if there is no holder */
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
 * Statistics of the forces and datagrams of a client, which show why forces were late and how the network performed.
 * One-way delays depend on the estimated offset of the clocks. They have an error of up to ± clockErrorNs and can be
 * negative. Server → client, unreliable; the highest number wins.
 */
export interface LinkReport {
  /** 1, 2, 3 … per session */
  readonly number: bigint;
  /** End of the reported interval, server clock */
  readonly untilNs: Nanoseconds;
  /** Length of the interval */
  readonly spanNs: Nanoseconds;
  // In the interval:
  /** The number of forces that have arrived */
  readonly forces: bigint;
  /** The number of forces that were late because a state was late */
  readonly lateServer: bigint;
  /** The number of forces that were late because of the network, in either direction */
  readonly lateNetwork: bigint;
  /** The number of forces that were late because the engine was slower than usual */
  readonly lateEngine: bigint;
  /** The maximum time for which the device did not have a valid force */
  readonly worstLateNs: Nanoseconds;
  /** The maximum time without a datagram from the client */
  readonly longestGapNs: Nanoseconds;
  /** Absent if it was not measured */
  readonly roundTrip: Delays | undefined;
  /** One way; absent if it was not measured */
  readonly toServer: Delays | undefined;
  /** One way; absent if it was not measured */
  readonly toClient: Delays | undefined;
  // Clocks:
  /** The clock of the client minus the clock of the server */
  readonly clockOffsetNs: Nanoseconds;
  /** The rate at which the offset increases */
  readonly clockDriftPpm: number;
  /** An upper bound of |true offset − clockOffsetNs| */
  readonly clockErrorNs: Nanoseconds;
  // Datagrams of the client since the session opened:
  readonly received: bigint;
  readonly lost: bigint;
  readonly reordered: bigint;
  readonly duplicated: bigint;
  // In the interval:
  /** An explanation of late and refused forces that can be shown to the user. It is empty if there are none */
  readonly words: string;
  /** The number of forces that are late for an unknown reason, because the client is silent */
  readonly lateUnknown: bigint;
  // Forces of the client, on all its channels, that could not be used in the interval:
  /** A number is NaN or infinite */
  readonly refusedNotFinite: bigint;
  /** A number is beyond its bound */
  readonly refusedOutOfBounds: bigint;
  /** basedOnTick was unknown or more than 4096 ticks ago */
  readonly refusedUnknownTick: bigint;
  /** The sequence was not increased even though the datagram is the newest */
  readonly refusedOldSequence: bigint;
}

/** Two quantiles of a delay. The delay can be negative if two clocks are compared. */
export interface Delays {
  readonly medianNs: Nanoseconds;
  readonly p99Ns: Nanoseconds;
}

/**
 * The state of one end of a coupling, which is sent to the other end. Vectors use the base frame and the scale of the
 * SENDER's device. For their use, see core/teleoperation/coupling.h. Either way, unreliable, with the feature
 * "teleoperation" only; for each device, channel and end the highest sequence of the highest epoch wins. An observer of
 * the device is sent both ends of its coupling.
 */
export interface PortState {
  /** The device of the server of this session, in both directions */
  readonly device: number;
  /** The channel of the server of this session, in both directions */
  readonly channel: number;
  /** The epoch of the sender, which is increased if the sender is restarted */
  readonly epoch: bigint;
  /** The number of the haptic step of the sender in this epoch: 1, 2, 3 … */
  readonly sequence: bigint;
  /** The epoch of the receiver for `answers`, given and taken, or 0 */
  readonly answersEpoch: bigint;
  /** The sequence of the receiver's newest PortState that is used, or 0 */
  readonly answers: bigint;
  /** The time on the clock of the sender, which is only used for computing differences */
  readonly timeNs: Nanoseconds;
  /** The round trip that was measured by the sender, or 0 if it was not measured yet */
  readonly roundTripNs: Nanoseconds;
  readonly phase: PortPhase;
  /** The number of the engagement of the leader that the phase belongs to: 1, 2, 3 …, or 0 */
  readonly engagement: bigint;
  /** Bit i is set if button i is pressed */
  readonly buttons: number;
  /** m, the displacement of the handle from the offset of the sender */
  readonly position: Vec3;
  /** m/s, the velocity of this displacement, which is zero if the displacement is frozen */
  readonly velocity: Vec3;
  /** N, the actual force on the hand at the handle of the sender */
  readonly force: Vec3;
  /** N. The force of the environment on the tool of the sender. Absent if it is not measured */
  readonly contactForce?: Vec3 | undefined;
  /** J, the energy that the sender may still output, minus its payments */
  readonly account: number;
  /** J. The energy that the sender needs for its desired force, or 0 if it does not have a tank */
  readonly need: number;
  /** J. The total energy that was paid to the receiver. It does not decrease until one of the epochs changes */
  readonly given: number;
  /** J, the given of the receiver that was received last, in joules of the receiver */
  readonly taken: number;
  /**
   * For CouplingMethod.WAVES, √W·s: the integral of the wave since the start of the epoch. Since this is a total, lost
   * frames have no lasting effect. Half the square of a wave is a power. Absent if nothing was sent yet
   */
  readonly waveIntegral?: Vec3 | undefined;
  /** J, ∫ ‖wave‖²/2 dt; it never decreases within an epoch */
  readonly waveEnergy?: number | undefined;
  /** For CouplingMethod.SURFACE, from the follower. Absent if it has not touched a surface yet */
  readonly surface?: PortSurface | undefined;
  /** Absent if the orientations are not coupled */
  readonly turn?: PortTurn | undefined;
  /** Absent if the grippers are not coupled */
  readonly grip?: PortGrip | undefined;
  /** J. For CouplingMethod.PASSIVITY, the energy that was received by the port of the sender in this epoch */
  readonly energyIn?: number | undefined;
  /** The weight of the receiver if the follower has several leaders. Absent if the receiver is the only leader */
  readonly share?: number | undefined;
  // From a leader, in use from this frame on; 0: as in Couple. An observer is always sent the values:
  readonly positionScale?: number | undefined;
  readonly forceScale?: number | undefined;
  // To an observer:
  /** If true, this is the other end of the coupling of the device, as received by the server */
  readonly ofPeer?: boolean | undefined;
}

/** The rotation of a handle since its offset was set. */
export interface PortTurn {
  /** The rotation in the axes of the sender's base frame */
  readonly turn: Quat;
  /** rad/s, the angular velocity, which is zero if the rotation is frozen */
  readonly angularVelocity: Vec3;
  /** N·m, the actual torque on the hand at the handle of the sender */
  readonly torque: Vec3;
}

/** The state of a gripper, measured at its fingers. The gripper has a separate energy account. */
export interface PortGrip {
  /** m */
  readonly opening: number;
  /** m/s */
  readonly velocity: number;
  /** N. The actual force on the fingers. Positive values open them */
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

/** A flat elastic surface that is or was touched by the tool of the sender. It can push but not pull. */
export interface PortSurface {
  /** The direction out of the surface */
  readonly normal: Vec3;
  /** m, the surface is where normal · position = offset */
  readonly offset: number;
  /** N/m, the stiffness, or 0 if there is no surface */
  readonly stiffness: number;
}

/**
 * Statistics of the loop of a device. All counts are for the reported interval. Server → client, unreliable, to an
 * observer with the feature "diagnostics" only; for each device the highest number wins.
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
  /** The number of periods that were skipped because the previous step was late */
  readonly missed: bigint;
  /** The number of steps that started too late (reason overrun) */
  readonly overruns: bigint;
  /** The number of steps without a position */
  readonly unseen: bigint;
  /**
   * The number of steps by their delay. Entry 0 counts the steps that were at most 1 µs late, entry i the steps that
   * were more than 2^(i−1) µs and at most 2^i µs late, and entry 23 all steps that were more than 2^22 µs late. Zeros
   * at the end are omitted. If the server was not able to count all steps, the sum is smaller than `steps`
   */
  readonly lateness: readonly bigint[];
  readonly safety: Safety;
  /**
   * The reason why the device does not exert forces until it is armed or rearmed, as text for the user. It is empty if
   * there is no fault
   */
  readonly fault: string;
  /** The service that is currently reduced by the server, as text for the user. It is empty if there is none */
  readonly degraded: string;
}

/**
 * Statistics of the engine that holds the lease of a channel. Server → client, unreliable, to an observer with the
 * feature "diagnostics" only; for each device and channel the highest number of its link wins.
 */
export interface PeerReport {
  readonly device: number;
  readonly channel: number;
  /** The name of the engine in its Hello */
  readonly name: string;
  /** One of this many requested states is sent to the engine, because its link is congested */
  readonly stateOneIn: number;
  /** If true, the forces of the engine are ignored because its link has lost too many datagrams */
  readonly forcesRefused: boolean;
  /** The report about the link of the engine. The number and the counts of forces are per channel; absent is refused */
  readonly link: LinkReport;
  // Of the force in the interval with the largest ForceCommand.error; if none states an error, of the newest:
  /** N. The estimated error of this force. Absent if errors are not estimated */
  readonly error?: number | undefined;
  /** The entry of Hello.ways for this force. It is empty if it is unknown */
  readonly way?: string | undefined;
}

/** The first message of a client. */
export interface Hello {
  /** The lowest version that is supported by the client. The highest common version is used */
  readonly versionMin: number;
  /** The highest version that is supported by the client */
  readonly versionMax: number;
  /** If there are claims, this is the highest role of them */
  readonly role: Role;
  /** Name for logs */
  readonly name: string;
  /** The features that are offered. A feature is used if both peers name it */
  readonly features: readonly string[];
  /**
   * The devices and channels that are claimed, without duplicates. If this is empty, the client is granted device 0 and
   * its channel 0 with `role`
   */
  readonly claims?: readonly Claim[] | undefined;
  // With the feature "ways" only:
  /**
   * The names of the ways in which this engine can compute forces, starting with the fastest. They are used by
   * ForceCommand.way
   */
  readonly ways?: readonly string[] | undefined;
}

/** Claims a device or a channel. */
export interface Claim {
  /** The name of the device, or empty for device 0 */
  readonly device: string;
  /** The name of the channel if the role is controller, or empty for channel 0 */
  readonly channel: string;
  readonly role: Role;
}

/** The server accepts the client. */
export interface Welcome {
  /** The version of this session, which is in the range of the client */
  readonly version: number;
  /** The features that were named by both peers */
  readonly features: readonly string[];
  /** Granted role */
  readonly role: Role;
  /** The kind of device */
  readonly deviceName: string;
  /** N, the maximum norm of the force */
  readonly maxForce: number;
  /** m. The size of an encoder count at the handle, or 0 if the position is exact */
  readonly positionResolution: number;
  /** Haptic steps per second */
  readonly loopHz: number;
  /** The server forgets the client if it is silent for this time */
  readonly timeoutMs: number;
  /** The name and the version of the server */
  readonly server: string;
  /**
   * One for each claim, in the same order. The fields deviceName … loopHz describe the device of the first one. Servers
   * that do not support claims do not send any, and ignore the claims of the Hello
   */
  readonly grants?: readonly Grant[] | undefined;
}

/** The numbers of a device and a channel that were claimed using their names. */
export interface Grant {
  /** The number of the device in all later messages */
  readonly device: number;
  /** The number of the channel in all later messages */
  readonly channel: number;
  /**
   * The role that was granted. It is Role.OBSERVER if a controller was claimed, but another client holds the lease
   * (TakeLease)
   */
  readonly role: Role;
}

/** The server refuses the client. */
export interface Refused {
  /** why */
  readonly code: Code;
  /** A sentence for people */
  readonly detail: string;
  /** The lowest version that is supported by the server */
  readonly versionMin: number;
  /** The highest version that is supported by the server */
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
  | ({ readonly kind: "setShare" } & SetShare)
  | ({ readonly kind: "offerField" } & OfferField)
  | ({ readonly kind: "useField" } & UseField)
  | ({ readonly kind: "dropField" } & DropField);

/** Every frame but Control. */
export type PlainFrame =
  | { readonly kind: "state"; readonly value: DeviceState }
  | { readonly kind: "force"; readonly value: ForceCommand }
  | { readonly kind: "controlAck"; readonly value: ControlAck }
  | { readonly kind: "bye"; readonly value: Bye }
  | { readonly kind: "report"; readonly value: LinkReport }
  | { readonly kind: "deviceReport"; readonly value: DeviceReport }
  | { readonly kind: "peerReport"; readonly value: PeerReport }
  | { readonly kind: "port"; readonly value: PortState }
  | { readonly kind: "fieldBrick"; readonly value: FieldBrick }
  | { readonly kind: "fieldStatus"; readonly value: FieldStatus }
  | { readonly kind: "fieldPose"; readonly value: FieldPose };

// SPDX-License-Identifier: Apache-2.0
// Messages between client and server as plain values (protocol/WIRE.md). SI units, device base frame. Forces act ON
// THE HAND: a wall that resists motion along +x sends −x.
export * from "./gen/messages.js";

export const kProtocolVersion = 1;
/** Feature: the client may send a local model with its forces, with which the server extrapolates them. */
export const kFeatureLocalModel = "local-model";

/** Feature: the client supports losing a lease. */
export const kFeatureChannels = "channels";

/**
 * Feature: the client receives the orientation of the device relative to the operator, its buttons, orientation,
 * gripper and torques, and may send torques and grip forces.
 */
export const kFeatureHandle = "handle";

/** Feature: the client receives the joints of the device (`joints` in the config). */
export const kFeatureJoints = "joints";
/** Feature: the client receives the outputs of the device and can set them (`outputs` in the config). */
export const kFeatureOutputs = "outputs";

/** Feature: the client can be one end of a coupling. It sends Couple, and both ends send PortStates. */
export const kFeatureTeleoperation = "teleoperation";

/** Feature: an engine names its methods, and each force contains the method that computed it. */
export const kFeatureWays = "ways";

/** Feature: the client can upload fields (OfferField), which the server renders at its own rate (UseField). */
export const kFeatureFields = "fields";

/** Feature: an observer receives the forces before limiting, and reports on the loop and the engines. */
export const kFeatureDiagnostics = "diagnostics";

/** Any object with x, y and z, for example the vector type of your engine. */
export interface Vec3 {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

/** A rotation as a unit quaternion (Hamilton convention). q and −q are the same rotation. */
export interface Quat extends Vec3 {
  readonly w: number;
}

/**
 * N/m, −∂force/∂position, positive for a spring. 1 entry k: k·I. 3 entries: the diagonal. 9 entries: row-major matrix.
 */
export type Stiffness = readonly number[];

const kReasons = [
  "energy", "max force", "slew", "ramp-in", "held", "decaying", "safe stop", "not finite", "fault", "device clamp",
  "overrun", "watchdog", "position unseen", "disarmed",
  "damped", "acceleration",
] as const;

/** Returns the names of the bits in DeviceState.reasons. */
export function reasonNames(reasons: number): string[] {
  return kReasons.filter((_, bit) => (reasons & (1 << bit)) !== 0);
}

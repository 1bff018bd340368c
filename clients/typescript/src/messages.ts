// SPDX-License-Identifier: Apache-2.0
// What peers say to each other, as plain values; protocol/WIRE.md has the same nouns as bytes. SI units, device base
// frame. A force is what the device exerts ON THE HAND: a wall that resists motion along +x sends −x.
export * from "./gen/messages.js";

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

const kReasons = [
  "energy", "max force", "slew", "ramp-in", "held", "decaying", "safe stop", "not finite", "fault", "device clamp",
  "overrun", "watchdog", "position unseen", "disarmed",
  "damped", "acceleration",
] as const;

/** The names of the bits of DeviceState.reasons. */
export function reasonNames(reasons: number): string[] {
  return kReasons.filter((_, bit) => (reasons & (1 << bit)) !== 0);
}

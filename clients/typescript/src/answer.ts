// SPDX-License-Identifier: Apache-2.0
// The result of a haptic function, its validation, and the part of it that a server supports.
import { isBounded, isError, isRadius, isStiffness, isVec3 } from "./bounds.js";
import { isContact } from "./codec.js";
import {
  kFeatureHandle, kFeatureLocalModel, type Contact, type DeviceState, type ForceCommand, type Stiffness, type Vec3,
} from "./messages.js";

/** The answer of a physics engine to one device state. */
export interface Touch {
  /** The force on the hand, N. If a wall resists motion along +x, its force is along −x. */
  readonly force: Vec3;
  /**
   * N/m, −∂force/∂position at the state's position; a wall with normal n: k·n·nᵀ. The device loop uses it to
   * extrapolate the force until the next answer, if the server supports it.
   */
  readonly stiffness?: Stiffness | undefined;
  /** The stiffness is valid within this distance from the position of the state, m. */
  readonly validRadius?: number | undefined;
  /** The contact surface, optionally with a table of force over depth. */
  readonly contact?: Contact | undefined;
  /** The body has been cut or torn since the previous answer. The server then discards both local models. */
  readonly topologyChanged?: boolean | undefined;
  /** The error of the force as estimated by the engine, N. */
  readonly error?: number | undefined;
  /**
   * The torque on the hand about the position of the handle, in base frame axes, N·m. It requires a handle with
   * additional actuators (`handle`). Otherwise, this and the next two fields are not sent (ClientStats.leftOut).
   */
  readonly torque?: Vec3 | undefined;
  /**
   * N·m/rad, −∂torque/∂θ at the state's orientation, positive for a spring. The device loop uses it to extrapolate
   * the torque. Only valid if the state has an orientation.
   */
  readonly angularStiffness?: Stiffness | undefined;
  /** The force on the fingers in the gripper, N. If it is positive, it opens them. */
  readonly gripForce?: number | undefined;
  /**
   * Index into `ways` of the config of the method that computed this answer, starting at 1; absent: unspecified. It
   * is not sent if the index is invalid (ClientStats.leftOut) or the server does not support kFeatureWays.
   */
  readonly way?: number | undefined;
}

const objectionTo = (what: string, { x, y, z }: Vec3, unit: string): string =>
  [x, y, z].every(Number.isFinite)
    ? `the ${what} exceeds 1e12 ${unit}`
    : `the ${what} is not finite (NaN or infinity)`;

/** Returns why an answer is unusable, or an empty string. */
export function objection(touch: Touch): string {
  const { force, stiffness, validRadius, contact, error, torque, angularStiffness, gripForce } = touch;
  if (!isVec3(force)) return objectionTo("force", force, "N");
  if (torque && !isVec3(torque)) return objectionTo("torque", torque, "N·m");
  if (angularStiffness && !isStiffness(angularStiffness)) {
    return "its angular stiffness is not finite, or out of the bounds in WIRE.md";
  }
  if (gripForce !== undefined && !isBounded(gripForce)) {
    return "the grip force is not finite, or exceeds 1e12 N";
  }
  const good = (!stiffness || isStiffness(stiffness)) && isRadius(validRadius) && (!contact || isContact(contact)) &&
    isError(error);
  return good ? "" : "its stiffness, radius, contact or error is not finite, or out of the bounds in WIRE.md";
}

/** Returns the part of an answer that a server with these features supports, and what was omitted. */
export function usable(
  touch: Touch, hand: DeviceState, features: readonly string[],
): { readonly answer: Pick<ForceCommand, "force" | "model" | "torque" | "gripForce">; readonly leftOut: string } {
  const { force, stiffness, validRadius, contact, torque, angularStiffness, gripForce } = touch;
  const withModel = (stiffness ?? contact) && features.includes(kFeatureLocalModel);
  const model = withModel ? { at: hand.position, stiffness: stiffness ?? [0], validRadius, contact } : undefined;
  const turns = torque !== undefined || angularStiffness !== undefined;
  if (!turns && gripForce === undefined) return { answer: { force, model }, leftOut: "" };
  if (!features.includes(kFeatureHandle)) {
    return { answer: { force, model }, leftOut: "torque and grip force: the server does not support them" };
  }
  const at = hand.turning?.orientation;
  const turned = angularStiffness && at && { at, stiffness: angularStiffness };
  return {
    answer: {
      force, model, gripForce, torque: turns ? { torque: torque ?? { x: 0, y: 0, z: 0 }, model: turned } : undefined,
    },
    leftOut: angularStiffness && !at ? "angular stiffness: the device does not measure its orientation" : "",
  };
}

// SPDX-License-Identifier: Apache-2.0
// What a haptic function returns, why it cannot be sent, and what of it a server takes.
import { isBounded, isError, isRadius, isStiffness, isVec3 } from "./bounds.js";
import { isContact } from "./codec.js";
import { kMaxValue } from "./limits.js";
import {
  kFeatureHandle, kFeatureLocalModel, type Contact, type DeviceState, type ForceCommand, type Stiffness, type Vec3,
} from "./messages.js";

/** The physics engine's answer to one device state. */
export interface Touch {
  /** N, on the hand: a wall that resists motion along +x sends −x. */
  readonly force: Vec3;
  /**
   * N/m, −∂force/∂position at the state's position, so that the device loop can follow the hand until the next force;
   * a wall with normal n: k·n·nᵀ. Used when the server has agreed to it.
   */
  readonly stiffness?: Stiffness | undefined;
  /** m, how far from there the stiffness holds. */
  readonly validRadius?: number | undefined;
  /** The surface, with the force at other depths in a table where that is known. */
  readonly contact?: Contact | undefined;
  /** The body has been cut or torn since the previous answer: neither answer's stiffness and table are used. */
  readonly topologyChanged?: boolean | undefined;
  /** N, the engine's estimate of the error of the force. */
  readonly error?: number | undefined;
  /**
   * N·m on the hand, base frame axes, about the handle's position. For a device whose handle has more motors than those
   * of its position (`handle`). A server that does not know this is sent the force without it and without the next two
   * (ClientStats.leftOut).
   */
  readonly torque?: Vec3 | undefined;
  /**
   * N·m/rad, −∂torque/∂θ at the state's orientation, so that the device loop can follow the turning hand; a spring is
   * positive. Only in answer to a state with an orientation.
   */
  readonly angularStiffness?: Stiffness | undefined;
  /** N on the fingers of the gripper; > 0 opens them. */
  readonly gripForce?: number | undefined;
  /**
   * Which of the config's `ways` has answered, from 1 on; absent: not said. Left out where there is none of that number
   * (ClientStats.leftOut), and of a server that does not know kFeatureWays.
   */
  readonly way?: number | undefined;
}

const objectionTo = (what: string, { x, y, z }: Vec3, unit: string): string =>
  [x, y, z].every(Number.isFinite)
    ? `the ${what} is beyond ${kMaxValue} ${unit}`
    : `the ${what} is not finite (NaN or infinity)`;

/** Why an answer cannot be used; empty when it can. */
export function objection(touch: Touch): string {
  const { force, stiffness, validRadius, contact, error, torque, angularStiffness, gripForce } = touch;
  if (!isVec3(force)) return objectionTo("force", force, "N");
  if (torque && !isVec3(torque)) return objectionTo("torque", torque, "N·m");
  if (angularStiffness && !isStiffness(angularStiffness)) {
    return "its angular stiffness is not finite, or out of the bounds of WIRE.md";
  }
  if (gripForce !== undefined && !isBounded(gripForce)) {
    return `the grip force is not finite, or beyond ${kMaxValue} N`;
  }
  const good = (!stiffness || isStiffness(stiffness)) && isRadius(validRadius) && (!contact || isContact(contact)) &&
    isError(error);
  return good ? "" : "its stiffness, radius, contact or error is not finite, or out of the bounds of WIRE.md";
}

/** What a server with these features takes of an answer, and what it does not; empty: all of it. */
export function usable(
  touch: Touch, hand: DeviceState, features: readonly string[],
): { readonly answer: Pick<ForceCommand, "force" | "model" | "torque" | "gripForce">; readonly leftOut: string } {
  const { force, stiffness, validRadius, contact, torque, angularStiffness, gripForce } = touch;
  const withModel = (stiffness ?? contact) && features.includes(kFeatureLocalModel);
  const model = withModel ? { at: hand.position, stiffness: stiffness ?? [0], validRadius, contact } : undefined;
  const turns = torque !== undefined || angularStiffness !== undefined;
  if (!turns && gripForce === undefined) return { answer: { force, model }, leftOut: "" };
  if (!features.includes(kFeatureHandle)) {
    return { answer: { force, model }, leftOut: "torque and grip force: the server does not know them" };
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

// SPDX-License-Identifier: Apache-2.0
// Deadbands that omit indistinguishable forces and predictable states (protocol/SESSION.md, "Deadbands").
import { expect } from "./expect.js";
import type { DeviceState, ForceCommand, Quat, StateDeadband, Vec3 } from "./messages.js";
import { fromMilliseconds, type Nanoseconds } from "./time.js";

/**
 * Omits a force, with its torque and grip force, unless it differs from the last one sent by more than max(share ·
 * its norm, floor), or that one was sent longestSilenceMs ago (Weber's law; Hinterseer et al., IEEE TSP 56(2), 2008).
 */
export interface ForceDeadband {
  /** 0 … 1, typically 0.1. The just noticeable difference of force is 7 to 15 %. */
  readonly share: number;
  /** N, typically 0.05. Smaller changes are omitted, but only for the longest silence. */
  readonly floor: number;
  /** Typically 20. This limits how long an old force is rendered by the device after a packet loss. */
  readonly longestSilenceMs: number;
}

export function checkForceDeadband({ share, floor, longestSilenceMs }: ForceDeadband): void {
  expect(share >= 0 && share <= 1, "deadband.share", share, "0 to 1");
  expect(floor >= 0, "deadband.floor", floor, "0 or more");
  expect(longestSilenceMs > 0, "deadband.longestSilenceMs", longestSilenceMs, "more than 0");
}

/** Throws a RangeError if no server would accept the deadband. */
export function checkStateDeadband({ share, floor, maxSilenceUs }: StateDeadband): void {
  if (maxSilenceUs === 0) return;
  expect(share >= 0 && share <= 0.5, "stateDeadband.share", share, "0 to 0.5");
  expect(floor >= 0 && floor <= 0.1, "stateDeadband.floor", floor, "0 to 0.1 m/s");
  const possible = Number.isInteger(maxSilenceUs) && maxSilenceUs >= 1000 && maxSilenceUs <= 20_000;
  expect(possible, "stateDeadband.maxSilenceUs", maxSilenceUs, "0, or a whole number from 1000 to 20000");
}

/** The length of a handle from its center, m. It converts the floor of a force (N) to that of a torque (N·m). */
const kHandleLever = 0.05;
const kZero: Vec3 = { x: 0, y: 0, z: 0 };

/** The force deadband of one session, including torques and grip forces. */
export class Deadband {
  readonly #config: ForceDeadband;
  #sent: { readonly at: Nanoseconds; readonly force: Vec3; readonly torque: Vec3 | undefined; readonly grip: Vec3 | undefined } | undefined;

  constructor(config: ForceDeadband) {
    this.#config = config;
  }

  /** Returns true if one of the values must be sent or has (dis)appeared. All of them are then recorded as sent. */
  passes(now: Nanoseconds, value: Pick<ForceCommand, "force" | "torque" | "gripForce">): boolean {
    const { floor, longestSilenceMs } = this.#config;
    const { x, y, z } = value.force;
    const next = {
      at: now, force: { x, y, z }, torque: value.torque && { ...value.torque.torque },
      grip: value.gripForce === undefined ? undefined : { x: value.gripForce, y: 0, z: 0 },
    };
    const sent = this.#sent;
    const alike = sent && now - sent.at < fromMilliseconds(longestSilenceMs) && !next.torque === !sent.torque &&
      !next.grip === !sent.grip && this.#alike(next.force, sent.force, floor) &&
      this.#alike(next.torque ?? kZero, sent.torque ?? kZero, floor * kHandleLever) &&
      this.#alike(next.grip ?? kZero, sent.grip ?? kZero, floor);
    if (!alike) this.#sent = next;
    return !alike;
  }

  #alike({ x, y, z }: Vec3, { x: x0, y: y0, z: z0 }: Vec3, floor: number): boolean {
    return Math.hypot(x - x0, y - y0, z - z0) <= Math.max(this.#config.share * Math.hypot(x0, y0, z0), floor);
  }
}

/** Rotates q with a constant angular velocity and normalizes it. */
function turned({ w, x, y, z }: Quat, { x: b, y: c, z: d }: Vec3, seconds: number): Quat {
  const speed = Math.hypot(b, c, d);
  const half = (speed * seconds) / 2;
  const s = speed > 0 ? Math.sin(half) / speed : 0;
  const [p, i, j, k] = [Math.cos(half), s * b, s * c, s * d];
  const q = {
    w: p * w - i * x - j * y - k * z,
    x: p * x + i * w + j * z - k * y,
    y: p * y - i * z + j * w + k * x,
    z: p * z + i * y - j * x + k * w,
  };
  const length = Math.hypot(q.w, q.x, q.y, q.z);
  return { w: q.w / length, x: q.x / length, y: q.y / length, z: q.z / length };
}

/** Predicts the state `later` after `sent`, in whole periods, with constant velocities of all parts. */
export function predict(sent: DeviceState, later: Nanoseconds, hapticPeriod: Nanoseconds): DeviceState {
  const periods = later > 0n ? later / hapticPeriod : 0n;
  const seconds = Number(periods * hapticPeriod) / 1e9;
  const { position: p, velocity: v, turning, grip } = sent;
  return {
    ...sent,
    tick: sent.tick + periods,
    sampledNs: sent.sampledNs + periods * hapticPeriod,
    position: { x: p.x + v.x * seconds, y: p.y + v.y * seconds, z: p.z + v.z * seconds },
    ...(turning && periods > 0n && {
      turning: { ...turning, orientation: turned(turning.orientation, turning.angularVelocity, seconds) },
    }),
    ...(grip && { grip: { ...grip, opening: grip.opening + grip.velocity * seconds } }),
  };
}

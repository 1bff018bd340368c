// SPDX-License-Identifier: Apache-2.0
// Deadbands drop forces that a hand cannot tell apart, and states that their receiver can predict
// (protocol/SESSION.md, "Deadbands").
import { expect } from "./expect.js";
import type { DeviceState, StateDeadband, Vec3 } from "./messages.js";
import { fromMilliseconds, type Nanoseconds } from "./time.js";

/**
 * Leaves out a force unless it differs from the last one sent by more than max(share · its norm, floor), or that one was sent
 * longestSilenceMs ago (Weber's law; Hinterseer et al., IEEE TSP 56(2), 2008).
 */
export interface ForceDeadband {
  /** 0 … 1; the just noticeable difference of force is 7 to 15 %: 0.1. */
  readonly share: number;
  /** N; a smaller change is left out until the longest silence: 0.05. */
  readonly floor: number;
  /** Bounds how long the device renders an old force after a loss: 20. */
  readonly longestSilenceMs: number;
}

/** Refuses an impossible deadband of forces with a RangeError. */
export function checkForceDeadband({ share, floor, longestSilenceMs }: ForceDeadband): void {
  expect(share >= 0 && share <= 1, "deadband.share", share, "0 to 1");
  expect(floor >= 0, "deadband.floor", floor, "0 or more");
  expect(longestSilenceMs > 0, "deadband.longestSilenceMs", longestSilenceMs, "more than 0");
}

/** Refuses a deadband of states that no server grants with a RangeError. */
export function checkStateDeadband({ share, floor, maxSilenceUs }: StateDeadband): void {
  if (maxSilenceUs === 0) return;
  expect(share >= 0 && share <= 0.5, "stateDeadband.share", share, "0 to 0.5");
  expect(floor >= 0 && floor <= 0.1, "stateDeadband.floor", floor, "0 to 0.1 m/s");
  const possible = Number.isInteger(maxSilenceUs) && maxSilenceUs >= 1000 && maxSilenceUs <= 20_000;
  expect(possible, "stateDeadband.maxSilenceUs", maxSilenceUs, "0, or a whole number from 1000 to 20000");
}

/** The deadband of forces in one session. */
export class Deadband {
  readonly #config: ForceDeadband;
  #sent: { readonly at: Nanoseconds; readonly value: Vec3 } | undefined;

  constructor(config: ForceDeadband) {
    this.#config = config;
  }

  /** Whether `value` is worth sending; if so it counts as sent. */
  passes(now: Nanoseconds, { x, y, z }: Vec3): boolean {
    const { share, floor, longestSilenceMs } = this.#config;
    const sent = this.#sent;
    if (sent && now - sent.at < fromMilliseconds(longestSilenceMs)) {
      const { x: x0, y: y0, z: z0 } = sent.value;
      if (Math.hypot(x - x0, y - y0, z - z0) <= Math.max(share * Math.hypot(x0, y0, z0), floor)) return false;
    }
    this.#sent = { at: now, value: { x, y, z } };
    return true;
  }
}

/** The device's position `later` after `sent` at constant velocity, in whole haptic periods. */
export function foretell(sent: DeviceState, later: Nanoseconds, hapticPeriod: Nanoseconds): DeviceState {
  const periods = later > 0n ? later / hapticPeriod : 0n;
  const seconds = Number(periods * hapticPeriod) / 1e9;
  const { position: p, velocity: v } = sent;
  return {
    ...sent,
    tick: sent.tick + periods,
    sampledNs: sent.sampledNs + periods * hapticPeriod,
    position: { x: p.x + v.x * seconds, y: p.y + v.y * seconds, z: p.z + v.z * seconds },
  };
}

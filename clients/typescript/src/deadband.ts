// SPDX-License-Identifier: Apache-2.0
// What need not be sent: forces that a hand cannot tell apart, and states that their receiver can foretell
// (protocol/SESSION.md, "Deadbands").
import type { DeviceState, StateDeadband, Vec3 } from "./messages.js";
import { fromMilliseconds, type Nanoseconds } from "./time.js";

/**
 * Leaves out a force unless it differs from the last one sent by more than max(share · its norm, floor), or that one was sent
 * longestSilenceMs ago (Weber's law; Hinterseer et al., IEEE TSP 56(2), 2008).
 */
export interface ForceDeadband {
  /** 0 … 1; the just noticeable difference of force is 7 to 15 %: 0.1. */
  readonly share: number;
  /** N, below it everything counts as nothing: 0.05. */
  readonly floor: number;
  /** So that a force that was lost does not stay wrong: 20. */
  readonly longestSilenceMs: number;
}

/** What is impossible about it; empty when nothing is. */
export function forceDeadbandObjection({ share, floor, longestSilenceMs }: ForceDeadband): string {
  if (!(share >= 0 && share <= 1)) return "share: expected 0 to 1";
  if (!(floor >= 0)) return "floor: must not be negative";
  return longestSilenceMs > 0 ? "" : "longestSilenceMs: must be above zero";
}

/** What a server will not grant; empty when it will. */
export function stateDeadbandObjection({ share, floor, maxSilenceUs }: StateDeadband): string {
  if (maxSilenceUs === 0) return "";
  if (!(share >= 0 && share <= 0.5)) return "share: expected 0 to 0.5";
  if (!(floor >= 0 && floor <= 0.1)) return "floor: expected 0 to 0.1 m/s";
  const possible = Number.isInteger(maxSilenceUs) && maxSilenceUs >= 1000 && maxSilenceUs <= 20_000;
  return possible ? "" : "maxSilenceUs: expected 0, or a whole number from 1000 to 20000";
}

/** Of one session. */
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

/** Where the device is `later` after `sent`, on the line that it was on, in whole haptic periods. */
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

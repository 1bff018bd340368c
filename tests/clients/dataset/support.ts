// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { TestContext } from "node:test";
import { CouplingEpisodes, type Episode } from "../../../clients/dataset/src/episodes.js";
import type { Quat, Vec3 } from "../../../clients/dataset/src/geometry.js";
import { mapOf } from "../../../clients/dataset/src/recording.js";

export function scratch(test: TestContext): string {
  const folder = mkdtempSync(join(tmpdir(), "tendon-dataset-"));
  test.after(() => rmSync(folder, { recursive: true }));
  return folder;
}

export const near = (a: number, b: number): void => assert.ok(Math.abs(a - b) < 1e-6, `${a} is not ${b}`);

/** A rotation about z. */
export const about = (rad: number): Quat => [Math.cos(rad / 2), 0, 0, Math.sin(rad / 2)];

export interface Situation {
  readonly fps?: number;
  readonly contact?: boolean;
  /** Table teleoperation.map of the scene. */
  readonly map?: string;
  /** Scale that the leader has set, 0 for that of the scene. */
  readonly positionScale?: number;
  /** Orientations and grippers are coupled. */
  readonly whole?: boolean;
  /** The number of steps by which the messages of the leader are delayed in the file. */
  readonly late?: number;
  /** The recording of the follower has no messages in this interval, s. */
  readonly gap?: readonly [number, number];
  /** The recording of the leader ends at this time, s. */
  readonly leaderEnds?: number;
}

/**
 * Simulates a recording of six seconds with 1000 steps per second. The follower is engaged from 1 s to 3 s and from 4 s to
 * 6 s. The leader moves along its x axis and rotates about its z axis, and the follower is slower.
 */
export function episodes(situation: Situation = {}): Episode[] {
  const { fps = 50, contact = true, map = "", positionScale = 0, whole = false, late = 0, gap = [9, 9], leaderEnds = 9 } = situation;
  const made = new CouplingEpisodes(fps);
  made.map(mapOf(`[teleoperation]\nrole = "leader"\n[teleoperation.map]\n${map}`));
  made.clockError(2e-4);
  made.clockError(1e-4);
  const actAt = (t: number) => ({ engagement: t < 1 ? 0n : t < 4 ? 1n : 2n, phase: (t >= 1 && t < 3) || t >= 4 ? 4 : 2 });
  const still = { position: [0, 0, 0] as Vec3, velocity: [0, 0, 0] as Vec3, torque: [0, 0, 0.001] as Vec3 };
  for (let ms = 0; ms < 6000 + late; ++ms) {
    const l = (ms - late) * 1e-3;
    if (ms >= late && l < leaderEnds) {
      made.port("leader", l, actAt(l), () => (
        { ...actAt(l), displacement: [0.01 * l, 0, 0], positionScale, ...(whole && { turn: about(0.1 * l), opening: 0.03 - 0.004 * l }) }));
      made.step("leader", l, () => ({ ...still, force: [0.5 * l, 0, 0] }));
    }
    const t = ms * 1e-3;
    if (ms >= 6000 || (t >= gap[0] && t < gap[1])) continue;
    made.port("follower", t, actAt(t), () => (
      { ...actAt(t), displacement: [0.009 * t, 0, 0], positionScale: 0, ...(whole && { turn: about(0.09 * t), opening: 0.03 - 0.003 * t }) }));
    made.step("follower", t, () => ({
      ...still, position: [1 + 0.009 * t, 2, 3], velocity: [0.009, 0, 0], contact: contact ? [-t, 0, 0.5] : undefined, force: [0, 0, 0],
      orientation: whole ? about(0.5 + 0.09 * t) : undefined,
    }));
  }
  return made.finish();
}

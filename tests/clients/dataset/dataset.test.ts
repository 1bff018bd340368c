// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { describe, it, type TestContext } from "node:test";
import { episodesOf } from "../../../clients/dataset/src/episodes.js";
import { writeDataset } from "../../../clients/dataset/src/lerobot.js";
import { mapOf, readCoupling, type Coupling, type Vec3 } from "../../../clients/dataset/src/recording.js";
import { readJson, readLines, readParquetFile } from "./read_back.js";

function scratch(test: TestContext): string {
  const folder = mkdtempSync(join(tmpdir(), "tendon-dataset-"));
  test.after(() => rmSync(folder, { recursive: true }));
  return folder;
}

const scene = (map: string): string => `[teleoperation]\nrole = "leader"\n[teleoperation.map]\n${map}`;

/** Six seconds at 1 kHz: engaged from 1 to 3 s and, by another act, from 4 to 6 s; the leader moves along its x. */
function coupling({ contact = true, map = "" } = {}): Coupling {
  const leader = { steps: [], ports: [] } as Coupling["leader"];
  const follower = { steps: [], ports: [] } as Coupling["follower"];
  for (let ms = 0; ms < 6000; ++ms) {
    const t = ms * 1e-3;
    const engagement = t < 1 ? 0n : t < 4 ? 1n : 2n;
    const phase = (t >= 1 && t < 3) || t >= 4 ? 4 : 2;
    const tick = BigInt(ms + 1);
    const u: Vec3 = [0.01 * t, 0, 0];
    leader.ports.push({ t, tick, phase, engagement, displacement: u });
    follower.ports.push({ t, tick, phase, engagement, displacement: [0.009 * t, 0, 0] });
    follower.steps.push({
      t, tick, position: [1 + 0.009 * t, 2, 3], velocity: [0.009, 0, 0], contact: contact ? [-t, 0, 0.5] : undefined,
    });
  }
  return { leader, follower, map: mapOf(scene(map)) };
}

const near = (a: number, b: number): void => assert.ok(Math.abs(a - b) < 1e-6, `${a} is not ${b}`);

describe("episodesOf", () => {
  it("begins an episode with each act, and takes frames at the rate", () => {
    const episodes = episodesOf(coupling(), 50);
    assert.equal(episodes.length, 2);
    assert.ok(Math.abs(episodes[0]!.frames.length - 100) <= 1);
    const frame = episodes[0]!.frames[50]!;
    near(frame.state[0]!, 1.018);
    near(frame.state[3]!, 0.009);
    near(frame.contact![0], -2);
    // The offset of the follower is (1, 2, 3): where the operator wants the tool to be.
    frame.action.forEach((value, i) => near(value, [1.02, 2, 3][i]!));
  });

  it("maps the leader's wish as the scene does", () => {
    const map = "position_scale = 0.5\nrotation_deg = [0, 0, 90]\n";
    const frame = episodesOf(coupling({ map }), 50)[0]!.frames[50]!;
    frame.action.forEach((value, i) => near(value, [1, 2 + 0.5 * 0.02, 3][i]!));
  });
});

describe("writeDataset", () => {
  const config = { fps: 50, task: "press the wall", robot: "arm" };

  it("writes what another reader of Parquet reads", (test) => {
    const out = join(scratch(test), "set");
    const episodes = episodesOf(coupling(), 50);
    const frames = writeDataset(episodes, { out, ...config });
    const info = readJson(join(out, "meta/info.json"));
    assert.equal(info.codebase_version, "v2.1");
    assert.equal(info.total_episodes, 2);
    assert.equal(info.total_frames, frames);
    let whole = 0;
    episodes.forEach((episode, number) => {
      const columns = readParquetFile(join(out, `data/chunk-000/episode_00000${number}.parquet`));
      assert.deepEqual([...columns.keys()], Object.keys(info.features));
      const action = columns.get("action")!;
      assert.match(action.type, /List<Float32>/);
      assert.match(columns.get("index")!.type, /Int64/);
      assert.match(columns.get("timestamp")!.type, /Float32/);
      assert.equal(action.values.length, episode.frames.length);
      episode.frames.forEach((frame, k) => {
        (action.values[k] as number[]).forEach((value, i) => near(value, frame.action[i]!));
        (columns.get("observation.state")!.values[k] as number[]).forEach((value, i) => near(value, frame.state[i]!));
        (columns.get("observation.contact_force")!.values[k] as number[]).forEach((value, i) => near(value, frame.contact![i]!));
        near(columns.get("timestamp")!.values[k] as number, k / 50);
        assert.equal(columns.get("index")!.values[k], whole++);
        assert.equal(columns.get("frame_index")!.values[k], k);
        assert.equal(columns.get("episode_index")!.values[k], number);
      });
    });
    assert.deepEqual(readLines(join(out, "meta/tasks.jsonl")), [{ task_index: 0, task: "press the wall" }]);
    const [, second] = readLines(join(out, "meta/episodes.jsonl"));
    assert.deepEqual(second, { episode_index: 1, tasks: ["press the wall"], length: episodes[1]!.frames.length });
    const [stats] = readLines(join(out, "meta/episodes_stats.jsonl"));
    near(stats.stats.action.min[0], 1.01);
    near(stats.stats.action.mean[1], 2);
    near(stats.stats.action.std[1], 0);
    assert.deepEqual(stats.stats.action.count, [episodes[0]!.frames.length]);
  });

  it("says nothing of a contact that nobody measured", (test) => {
    const out = join(scratch(test), "set");
    writeDataset(episodesOf(coupling({ contact: false }), 10), { out, ...config });
    assert.ok(!("observation.contact_force" in readJson(join(out, "meta/info.json")).features));
  });

  it("overwrites nothing, and makes no dataset of nothing", (test) => {
    const out = scratch(test);
    assert.throws(() => writeDataset([], { out, ...config }), /no episode/);
    writeFileSync(join(out, "mine"), "x");
    assert.throws(() => writeDataset(episodesOf(coupling(), 10), { out, ...config }), /expected an empty folder/);
  });
});

describe("readCoupling", () => {
  it("refuses a file that is no merged recording, by name", async (test) => {
    const file = join(scratch(test), "no.mcap");
    writeFileSync(file, "nothing of this kind");
    await assert.rejects(readCoupling(file), new RegExp("no\\.mcap: "));
  });
});

// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { describe, it, type TestContext } from "node:test";
import { readDemonstration, type Moment } from "../../../clients/dataset/src/demonstration.js";
import { episodesOf, episodesOfRobot } from "../../../clients/dataset/src/episodes.js";
import { writeDataset } from "../../../clients/dataset/src/lerobot.js";
import { mapOf, readCoupling, type Coupling, type Vec3 } from "../../../clients/dataset/src/recording.js";
import { kRoot } from "../typescript/support/paths.js";
import { readJson, readLines, readParquetFile } from "./read_back.js";

function scratch(test: TestContext): string {
  const folder = mkdtempSync(join(tmpdir(), "tendon-dataset-"));
  test.after(() => rmSync(folder, { recursive: true }));
  return folder;
}

const scene = (map: string): string => `[teleoperation]\nrole = "leader"\n[teleoperation.map]\n${map}`;

/** Six seconds at 1 kHz, engaged from 1 s to 3 s and from 4 s to 6 s. The leader moves along its x axis. */
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
    // The action is the tool position that the operator requests; the offset of the follower is (1, 2, 3).
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
    assert.throws(() => writeDataset([], { out, ...config }), /at least one episode/);
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

/**
 * The recording has 100 Hz. The follower is engaged from tick 51 on, and clutched from tick 151 to tick 200. The target
 * moves by 0.5/4096 m per tick. A test in tests/clients/python writes the same bytes.
 */
const kDemonstration = join(kRoot, "tests/clients/demonstration.jsonl");

describe("episodesOfRobot", () => {
  it("makes of a robot's own file what another reader of Parquet reads", async (test) => {
    const out = join(scratch(test), "set");
    const episodes = episodesOfRobot(await readDemonstration(kDemonstration), 50);
    assert.equal(episodes.length, 1, "a clutch ends nothing");
    const frames = writeDataset(episodes, { out, fps: 50, task: "press", robot: "arm" });
    assert.equal(frames, 125);
    const columns = readParquetFile(join(out, "data/chunk-000/episode_000000.parquet"));
    const step = 0.5 / 4096;
    const row = (name: string, k: number): readonly number[] => columns.get(name)!.values[k] as readonly number[];
    for (let k = 0; k < 50; ++k) {
      // At tick 51 + 2k the tool is at the target of the previous tick.
      near(row("action", k)[0]!, 0.25 + 2 * k * step);
      near(row("observation.state", k)[0]!, 0.25 + Math.max(2 * k - 1, 0) * step);
      near(row("observation.state", k)[2]!, 0.125);
      near(row("observation.contact_force", k)[2]!, (51 + 2 * k) / 64);
    }
    near(row("observation.state", 0)[3]!, 0);
    near(row("observation.state", 20)[3]!, 100 * step);
    for (const k of [50, 60, 74]) near(row("action", k)[0]!, 0.25 + 99 * step);
    near(row("observation.state", 70)[3]!, 0);
    near(row("action", 124)[0]!, 0.25 + (99 + 98) * step);
    near(columns.get("timestamp")!.values[124] as number, 2.48);
  });

  it("gives the velocity of a robot whose loop has another rate", () => {
    for (const hz of [31, 40, 50, 60, 100, 1000]) {
      const moments = Array.from({ length: 3 * hz }, (_, k): Moment => {
        const position: Vec3 = [(0.06 * k) / hz, 0, 0.1];
        return { t: Math.round((k * 1e9) / hz) / 1e9, phase: "engaged", position, target: position };
      });
      const { frames } = episodesOfRobot(moments, 60)[0]!;
      assert.equal(frames[0]!.state[3], 0);
      const first = frames.findIndex(({ state }) => state[3] !== 0);
      assert.ok(first === 1 || hz < 60, `${hz} Hz`);
      for (const { state } of frames.slice(first)) assert.ok(Math.abs(state[3]! - 0.06) < 1e-6, `${hz} Hz: ${state[3]}`);
    }
  });

  it("ends an episode where the robot stands or hears nothing", () => {
    const moment = (t: number, phase: string): Moment => ({ t, phase, position: [t, 0, 0], target: [t, 0, 0] });
    const parts = (moments: Moment[]): number[] => episodesOfRobot(moments, 10).map(({ frames }) => frames.length);
    const engaged = (from: number, to: number): Moment[] => Array.from({ length: to - from }, (_, i) => moment((from + i) / 100, "engaged"));
    assert.deepEqual(parts([...engaged(0, 101), ...engaged(200, 251)]), [11, 6], "silence");
    assert.deepEqual(parts([...engaged(0, 101), moment(1.01, "coupled"), ...engaged(102, 153)]), [11, 6]);
    assert.deepEqual(parts([...engaged(300, 401), ...engaged(0, 51)]), [11, 6], "the server has started anew");
    assert.deepEqual(parts([moment(0, "clutched"), moment(0.2, "clutched"), moment(0.3, "coupled")]), [], "no act");
  });
});

describe("readDemonstration", () => {
  const file = (test: TestContext, text: string): string => {
    const path = join(scratch(test), "press.jsonl");
    writeFileSync(path, text);
    return path;
  };
  const kHead = '{"kind":"tendon demonstration","version":1}\n';
  const kLine = '{"tick":2,"sampled_ns":20000000,"phase":"engaged","position_m":[1,0,0],"target_m":null}\n';

  it("leaves out a last line that was cut off", async (test) => {
    assert.deepEqual(await readDemonstration(file(test, `${kHead}${kLine}${kLine.slice(0, 30)}`)), [
      { t: 0.02, phase: "engaged", position: [1, 0, 0], target: undefined, contact: undefined },
    ]);
  });

  it("skips a byte order mark and blank lines", async (test) => {
    const text = `\uFEFF${kHead}\r\n${kLine}\n\n`;
    assert.equal((await readDemonstration(file(test, text))).length, 1);
  });

  it("names file and line of what it does not understand", async (test) => {
    const refuses = (text: string, why: RegExp) => assert.rejects(readDemonstration(file(test, text)), why);
    await refuses("", /press\.jsonl: expected a demonstration, found an empty file/);
    await refuses(kLine, /line 1: expected \{"kind":"tendon demonstration","version":1\}/);
    await refuses(`${kHead}${kLine.replace("[1,0,0]", "[1,0]")}`, /line 2: position_m: expected three numbers/);
    await refuses(`${kHead}{"tick":\n${kLine}`, /line 2: /);
    await refuses(`${kHead}${kLine}${kHead}`, /line 3: expected one demonstration in a file, found a second/);
  });
});

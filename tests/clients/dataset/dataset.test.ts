// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { describe, it, type TestContext } from "node:test";
import { writeDataset } from "../../../clients/dataset/src/dataset.js";
import { readDemonstration, type Moment } from "../../../clients/dataset/src/demonstration.js";
import { CouplingEpisodes, episodesOfRobot } from "../../../clients/dataset/src/episodes.js";
import type { Vec3 } from "../../../clients/dataset/src/geometry.js";
import { readCoupling } from "../../../clients/dataset/src/recording.js";
import { kRoot } from "../typescript/support/paths.js";
import { readJson, readLines, readParquetFile } from "./read_back.js";
import { about, episodes, near, scratch, type Situation } from "./support.js";

describe("CouplingEpisodes", () => {
  const frame50 = (situation: Situation) => episodes(situation)[0]!.frames[50]!;

  it("begins an episode with each act, and takes frames at the rate", () => {
    const made = episodes();
    assert.equal(made.length, 2);
    assert.ok(Math.abs(made[0]!.frames.length - 100) <= 1);
    const frame = made[0]!.frames[50]!;
    near(frame.pose.position[0], 1.018);
    near(frame.velocity[0], 0.009);
    near(frame.contact!.force[0], -2);
    near(frame.hand!.force[0], 1);
    // The action is the tool position that the operator requests; the offset of the follower is (1, 2, 3).
    frame.action.position.forEach((value, i) => near(value, [1.02, 2, 3][i]!));
    assert.equal(frame.sender, "operator");
    assert.equal(made[0]!.clockError, 2e-4, "the largest bound");
  });

  it("maps the leader's wish as the scene does", () => {
    const map = "position_scale = 0.5\nrotation_deg = [0, 0, 90]\n";
    frame50({ map }).action.position.forEach((value, i) => near(value, [1, 2 + 0.5 * 0.02, 3][i]!));
  });

  it("uses the scale that the leader has set since", () => {
    near(frame50({ map: "position_scale = 0.5\n", positionScale: 3 }).action.position[0], 1.06);
  });

  it("maps the wish for orientation and grip, if they are coupled", () => {
    const { pose, action } = frame50({ whole: true });
    pose.orientation!.forEach((value, i) => near(value, about(0.68)[i]!));
    action.orientation!.forEach((value, i) => near(value, about(0.7)[i]!));
    near(pose.grip!, 0.024);
    near(action.grip!, 0.022);
    // If z of the leader is x of the follower, a rotation about z becomes a rotation about x.
    const turned = frame50({ whole: true, map: "rotation_deg = [0, 90, 0]\n" }).action.orientation!;
    assert.ok(turned[1] > 0.09 && Math.abs(Math.hypot(...turned) - 1) < 1e-9, String(turned));
    assert.equal(frame50({}).pose.orientation, undefined);
  });

  it("makes the same episodes if one end is late in the file", () => {
    const made = episodes({ whole: true });
    assert.deepEqual(episodes({ whole: true, late: 300 }), made);
    assert.deepEqual(episodes({ whole: true, late: 1 }), made);
  });

  it("ends an episode at a gap, and holds the wish of a leader that ended", () => {
    const lengths = (situation: Situation) => episodes({ fps: 10, ...situation }).map(({ frames }) => frames.length);
    assert.deepEqual(lengths({}), [20, 20]);
    assert.deepEqual(lengths({ gap: [1.505, 2.205] }), [6, 8, 20]);
    assert.deepEqual(lengths({ gap: [1.505, 1.905] }), [20, 20]);
    assert.deepEqual(lengths({ leaderEnds: 5 }), [20, 20]);
    near(episodes({ fps: 10, leaderEnds: 5 })[1]!.frames[19]!.action.position[0], 1 + 0.01 * 4.999);
  });
});

describe("writeDataset", () => {
  const config = { fps: 50, task: "press the wall", robot: "arm" };

  it("writes v2.1, which another reader of Parquet reads", (test) => {
    const out = join(scratch(test), "set");
    const made = episodes();
    const frames = writeDataset(made, { out, ...config, layout: "v2.1" });
    const info = readJson(join(out, "meta/info.json"));
    assert.equal(info.codebase_version, "v2.1");
    assert.equal(info.total_episodes, 2);
    assert.equal(info.total_frames, frames);
    let whole = 0;
    made.forEach((episode, number) => {
      const columns = readParquetFile(join(out, `data/chunk-000/episode_00000${number}.parquet`));
      assert.deepEqual([...columns.keys()], Object.keys(info.features));
      const action = columns.get("action")!;
      assert.match(action.type, /List<Float32>/);
      assert.match(columns.get("index")!.type, /Int64/);
      assert.match(columns.get("timestamp")!.type, /Float32/);
      assert.equal(action.values.length, episode.frames.length);
      episode.frames.forEach((frame, k) => {
        const row = (name: string): readonly number[] => columns.get(name)!.values[k] as readonly number[];
        row("action").forEach((value, i) => near(value, frame.action.position[i]!));
        row("observation.state").forEach((value, i) => near(value, [...frame.pose.position, ...frame.velocity][i]!));
        row("observation.contact_force").forEach((value, i) => near(value, frame.contact!.force[i]!));
        near(columns.get("timestamp")!.values[k] as number, k / 50);
        assert.equal(columns.get("index")!.values[k], whole++);
        assert.equal(columns.get("frame_index")!.values[k], k);
        assert.equal(columns.get("episode_index")!.values[k], number);
      });
    });
    assert.deepEqual(readLines(join(out, "meta/tasks.jsonl")), [{ task_index: 0, task: "press the wall" }]);
    const [, second] = readLines(join(out, "meta/episodes.jsonl"));
    assert.deepEqual(second, { episode_index: 1, tasks: ["press the wall"], length: made[1]!.frames.length });
    const [stats] = readLines(join(out, "meta/episodes_stats.jsonl"));
    near(stats.stats.action.min[0], 1.01);
    near(stats.stats.action.mean[1], 2);
    near(stats.stats.action.std[1], 0);
    assert.deepEqual(stats.stats.action.count, [made[0]!.frames.length]);
  });

  it("overwrites nothing, and makes no dataset of nothing", (test) => {
    const out = scratch(test);
    assert.throws(() => writeDataset([], { out, ...config }), /at least one episode/);
    writeFileSync(join(out, "mine"), "x");
    assert.throws(() => writeDataset(episodes(), { out, ...config }), /expected an empty folder/);
  });
});

describe("readCoupling", () => {
  it("refuses a file that is no merged recording, by name", async (test) => {
    const file = join(scratch(test), "no.mcap");
    writeFileSync(file, "nothing of this kind");
    await assert.rejects(readCoupling(file, new CouplingEpisodes(30)), new RegExp("no\\.mcap: "));
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
    const made = episodesOfRobot(await readDemonstration(kDemonstration), 50);
    assert.equal(made.length, 1, "a clutch ends nothing");
    const frames = writeDataset(made, { out, fps: 50, task: "press", robot: "arm" });
    assert.equal(frames, 125);
    const columns = readParquetFile(join(out, "data/chunk-000/file-000.parquet"));
    const step = 0.5 / 4096;
    const row = (name: string, k: number): readonly number[] => columns.get(name)!.values[k] as readonly number[];
    for (let k = 0; k < 50; ++k) {
      // At tick 51 + 2k the tool is at the target of the previous tick.
      near(row("action", k)[0]!, 0.25 + 2 * k * step);
      near(row("observation.state", k)[0]!, 0.25 + Math.max(2 * k - 1, 0) * step);
      near(row("observation.state", k)[2]!, 0.125);
      near(row("observation.wrench", k)[2]!, (51 + 2 * k) / 64);
    }
    near(row("observation.velocity", 0)[0]!, 0);
    near(row("observation.velocity", 20)[0]!, 100 * step);
    for (const k of [50, 60, 74]) near(row("action", k)[0]!, 0.25 + 99 * step);
    near(row("observation.velocity", 70)[0]!, 0);
    near(row("action", 124)[0]!, 0.25 + (99 + 98) * step);
    near(columns.get("timestamp")!.values[124] as number, 2.48);
    assert.deepEqual(columns.get("tendon.sender")!.values, made[0]!.frames.map((_, k) => (k < 50 || k >= 75 ? 1 : 0)), "held by the clutch");
  });

  it("gives the velocity of a robot whose loop has another rate", () => {
    for (const hz of [31, 40, 50, 60, 100, 1000]) {
      const moments = Array.from({ length: 3 * hz }, (_, k): Moment => {
        const position: Vec3 = [(0.06 * k) / hz, 0, 0.1];
        return { t: Math.round((k * 1e9) / hz) / 1e9, phase: "engaged", pose: { position }, target: { position }, sender: "operator" };
      });
      const { frames } = episodesOfRobot(moments, 60)[0]!;
      assert.equal(frames[0]!.velocity[0], 0);
      const first = frames.findIndex(({ velocity }) => velocity[0] !== 0);
      assert.ok(first === 1 || hz < 60, `${hz} Hz`);
      for (const { velocity: [x] } of frames.slice(first)) assert.ok(Math.abs(x - 0.06) < 1e-6, `${hz} Hz: ${x}`);
    }
  });

  it("ends an episode where the robot stands or hears nothing", () => {
    const moment = (t: number, phase: string): Moment => {
      const pose = { position: [t, 0, 0] as Vec3 };
      return { t, phase, pose, target: pose, sender: "operator" };
    };
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
      {
        t: 0.02, phase: "engaged", pose: { position: [1, 0, 0], orientation: undefined, grip: undefined }, target: undefined,
        sender: "operator", contact: undefined,
      },
    ]);
  });

  it("reads what a robot with six axes and a gripper adds", async (test) => {
    const more = '"target_m":[2,0,0],"orientation":[1,0,0,0],"grip":0.5,"target_orientation":[0,1,0,0],"target_grip":0.25,"contact_n":[0,0,1],"contact_nm":[0,1,0],"sender":"policy"';
    const [moment] = await readDemonstration(file(test, `${kHead}${kLine.replace('"target_m":null', more)}`));
    assert.deepEqual(moment, {
      t: 0.02, phase: "engaged", sender: "policy", contact: { force: [0, 0, 1], torque: [0, 1, 0] },
      pose: { position: [1, 0, 0], orientation: [1, 0, 0, 0], grip: 0.5 },
      target: { position: [2, 0, 0], orientation: [0, 1, 0, 0], grip: 0.25 },
    });
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
    await refuses(`${kHead}${kLine.replace("null", 'null,"orientation":[1,0,0]')}`, /line 2: orientation: expected four numbers/);
    await refuses(`${kHead}${kLine.replace("null", '[1,1,1],"target_grip":"wide"')}`, /line 2: target_grip: expected a number/);
    await refuses(`${kHead}${kLine.replace("null", 'null,"sender":7')}`, /line 2: sender: expected a text/);
    await refuses(`${kHead}{"tick":\n${kLine}`, /line 2: /);
    await refuses(`${kHead}${kLine}${kHead}`, /line 3: expected one demonstration in a file, found a second/);
  });
});

// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { renameSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { describe, it } from "node:test";
import { check } from "../../../clients/dataset/src/check.js";
import { writeDataset } from "../../../clients/dataset/src/dataset.js";
import { openTable, TableWriter, type Cell } from "../../../clients/dataset/src/parquet.js";
import { kRoot } from "../typescript/support/paths.js";
import { readJson } from "./read_back.js";
import { episodes, scratch } from "./support.js";

const kData = "data/chunk-000/file-000.parquet";
const kEpisodes = "meta/episodes/chunk-000/file-000.parquet";
const kTasks = "meta/tasks.parquet";

type Rows = Record<string, Cell>[];
interface Rewrite {
  readonly change?: (rows: Rows) => unknown;
  readonly groups?: readonly number[];
  readonly metadata?: Record<string, string>;
  readonly without?: string;
}

/** Writes a table again, with a fault. */
async function rewrite(path: string, { change, groups, metadata, without }: Rewrite): Promise<void> {
  const table = await openTable(path);
  const rows = (await table.rows()) as Rows;
  change?.(rows);
  const columns = new Map([...table.columns].filter(([name]) => name !== without));
  const writer = new TableWriter(path, columns, metadata ?? table.metadata);
  let first = 0;
  for (const length of groups ?? table.groups) {
    const part = rows.slice(first, (first += length));
    writer.append(new Map([...columns.keys()].map((name) => [name, part.map((row) => row[name]!)])));
  }
  writer.close();
}

const json = (file: string, change: (content: any) => unknown) => (out: string): void => {
  const content = readJson(join(out, file));
  change(content);
  writeFileSync(join(out, file), JSON.stringify(content));
};
const table = (file: string, how: Rewrite) => (out: string): Promise<void> => rewrite(join(out, file), how);
const set = (row: number, name: string, value: Cell) => ({ change: (rows: Rows): unknown => (rows[row]![name] = value) });
const component = (row: number, name: string, value: number) => ({ change: (rows: Rows): unknown => ((rows[row]![name] as number[])[0] = value) });

/** Each entry contains the name of a fault, a function that causes it, and the expected message. */
const kFaults: readonly (readonly [string, (out: string) => unknown, RegExp])[] = [
  ["the version is another", json("meta/info.json", (info) => (info.codebase_version = "v2.1")), /^meta\/info\.json: codebase_version: expected "v3\.0", got "v2\.1"/],
  ["a total is wrong", json("meta/info.json", (info) => (info.total_frames += 1)), /^meta\/info\.json: total_frames: expected \d+, got \d+/],
  ["a name has a slash", json("meta/info.json", (info) => (info.features["a/b"] = info.features.action)), /feature "a\/b": expected a name without/],
  ["a shape is wrong", json("meta/info.json", (info) => (info.features.action.shape = [4])), /action of episode 0, frame 0: expected 4 finite numbers/],
  ["a column is missing", table(kData, { without: "tendon.sender" }), /column "tendon\.sender": expected/],
  ["a column is not described", json("meta/info.json", (info) => delete info.features["observation.velocity"]), /column "observation\.velocity": not in meta\/info\.json/],
  ["the index of the tasks is lost", table(kTasks, { metadata: {} }), /^meta\/tasks\.parquet: expected the key "pandas"/],
  ["a task is not in the table", table(kData, set(3, "task_index", 1)), /task_index of episode 0, frame 3: expected less than 1, got 1/],
  ["an episode begins elsewhere", table(kEpisodes, set(1, "dataset_from_index", 7)), /dataset_from_index of episode 1: expected \d+, got 7/],
  ["an episode is in another file", table(kEpisodes, set(1, "data/file_index", 1)), /^data\/chunk-000\/file-001\.parquet: missing/],
  ["a file has no episode", (out) => writeFileSync(join(out, "data/chunk-000/file-009.parquet"), "x"), /file-009\.parquet: no episode is in this file/],
  ["a row group has two episodes", (out) => rewrite(join(out, kData), { groups: [40] }), /row groups, one for each episode: expected \[20,20\], got \[40\]/],
  ["a time is wrong", table(kData, set(5, "timestamp", 0.51)), /timestamp of episode 0, frame 5: expected frame_index \/ 10 s, got 0\.5/],
  ["a frame is there twice", table(kData, set(5, "frame_index", 4)), /frame_index of episode 0, frame 5/],
  ["a value is not finite", table(kData, component(25, "observation.wrench", NaN)), /observation\.wrench of episode 1, frame 5: expected 6 finite numbers/],
  ["a sender has no name", table(kData, set(30, "tendon.sender", 2)), /tendon\.sender of episode 1, frame 10: expected an index of \["held","operator"\], got 2/],
  ["the statistics are of other frames", table(kData, component(5, "action", 9)), /stats\/action\/max of episode 0: expected \[9,/],
  ["the sum of the statistics is wrong", json("meta/stats.json", (stats) => (stats.action.std[0] *= 2)), /^meta\/stats\.json: action\/std: expected/],
  ["a quantile is out of range", json("meta/stats.json", (stats) => (stats.action.q99[0] = 50)), /action\/q99/],
  ["a file of v2.1 remains", (out) => writeFileSync(join(out, "meta/tasks.jsonl"), ""), /^meta\/tasks\.jsonl: expected no file of v2\.1/],
  ["a file is cut off", (out) => writeFileSync(join(out, kData), "PAR1"), /^data\/chunk-000\/file-000\.parquet: cannot be read/],
  ["a file is missing", (out) => rmSync(join(out, "meta/stats.json")), /^meta\/stats\.json: missing/],
  ["the description is no JSON", (out) => writeFileSync(join(out, "meta/info.json"), "{"), /^meta\/info\.json: cannot be read/],
  ["the description is empty", (out) => writeFileSync(join(out, "meta/info.json"), "{}"), /^meta\/info\.json: fps: expected a positive number/],
];

describe("check", () => {
  for (const [name, plant, expected] of kFaults) {
    it(`finds that ${name}`, async (test) => {
      const out = join(scratch(test), "set");
      writeDataset(episodes({ fps: 10 }), { out, fps: 10, task: "press", robot: "arm" });
      assert.deepEqual(await check(out), [], "nothing before");
      await plant(out);
      const said = (await check(out)).map(({ file, what }) => `${file}: ${what}`);
      assert.ok(said.some((line) => expected.test(line)), said.join("\n") || "nothing was found");
    });
  }

  it("is a command, whose exit status tells the result", (test) => {
    const out = join(scratch(test), "set");
    writeDataset(episodes({ fps: 10 }), { out, fps: 10, task: "press", robot: "arm" });
    const run = (...args: string[]) => spawnSync("node", [join(kRoot, "clients/dataset/dist/main.js"), ...args], { encoding: "utf8" });
    assert.deepEqual([run("--check", out).status, run("--check", out).stdout], [0, `${out}: nothing found\n`]);
    renameSync(join(out, "data"), join(out, "other"));
    const { status, stdout } = run("--check", out, "--json");
    assert.equal(status, 1);
    assert.deepEqual(JSON.parse(stdout).findings, [{ file: kData, what: "missing" }]);
    assert.equal(run("--check", out, "x.mcap").status, 2);
    assert.match(run("--check", join(out, "nowhere")).stderr, /tendon-dataset: .*nowhere/);
  });
});

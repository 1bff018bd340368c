// SPDX-License-Identifier: Apache-2.0
// Reads datasets of the layout v3.0 with two other implementations of Parquet. LeRobot itself is not run.
import assert from "node:assert/strict";
import { existsSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { describe, it, type TestContext } from "node:test";
import { check } from "../../../clients/dataset/src/check.js";
import { writeDataset } from "../../../clients/dataset/src/dataset.js";
import type { Episode } from "../../../clients/dataset/src/episodes.js";
import { aggregate, statsOf } from "../../../clients/dataset/src/stats.js";
import { duckdb, readJson, readParquetFile, type Cell } from "./read_back.js";
import { episodes, near, scratch } from "./support.js";

const config = { fps: 50, task: 'press "the wall", fest', robot: "arm" };
const kData = "data/chunk-000/file-000.parquet";
const kEpisodes = "meta/episodes/chunk-000/file-000.parquet";

function written(test: TestContext, made: readonly Episode[], more: object = {}): string {
  const out = join(scratch(test), "set");
  writeDataset(made, { out, ...config, ...more });
  return out;
}

describe("layout v3.0", () => {
  it("two other readers agree on every value of every file", async (test) => {
    const query = await duckdb();
    if (!query) return test.skip("DuckDB has no library for this machine");
    const out = written(test, episodes({ whole: true }));
    let values = 0;
    for (const file of [kData, kEpisodes, "meta/tasks.parquet"]) {
      const columns = readParquetFile(join(out, file));
      const rows = await query(`select * from '${join(out, file)}'`);
      assert.deepEqual([...rows[0]!.keys()], [...columns.keys()]);
      rows.forEach((row, k) => {
        for (const [name, { values: column }] of columns) {
          assert.deepEqual(column[k], row.get(name), `${file}, ${name}, row ${k}`);
          values += [column[k]].flat().length;
        }
      });
    }
    assert.ok(values > 200 * 30, `${values} values`);
  });

  it("the frames are those of the episodes, in one file", (test) => {
    const made = episodes({ whole: true });
    const out = written(test, made);
    const columns = readParquetFile(join(out, kData));
    const info = readJson(join(out, "meta/info.json"));
    assert.equal(info.codebase_version, "v3.0");
    assert.deepEqual([...columns.keys()], Object.keys(info.features));
    assert.match(columns.get("action")!.type, /List<Float32>/);
    const names = ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "grip"];
    for (const name of ["observation.state", "action"]) assert.deepEqual(info.features[name], { ...info.features[name], shape: [8], names });
    assert.deepEqual(info.features["tendon.sender"].info, { senders: ["held", "operator"] });
    assert.deepEqual(info.features["action"].info, { clock_error_s: 2e-4 });
    const same = (cell: Cell, expected: readonly number[]): void => expected.forEach((value, i) => near((cell as number[])[i]!, value));
    made.flatMap(({ frames }) => frames).forEach((frame, k) => {
      const row = (name: string): Cell => columns.get(name)!.values[k]!;
      same(row("observation.state"), [...frame.pose.position, ...frame.pose.orientation!, frame.pose.grip!]);
      same(row("action"), [...frame.action.position, ...frame.action.orientation!, frame.action.grip!]);
      same(row("observation.velocity"), frame.velocity);
      same(row("observation.wrench"), [...frame.contact!.force, 0, 0, 0]);
      same(row("tendon.hand_wrench"), [...frame.hand!.force, 0, 0, 0.001]);
      assert.equal(row("tendon.sender"), 1);
      assert.equal(row("index"), k);
    });
  });

  it("each episode has a row group, and its place in the metadata", async (test) => {
    const query = await duckdb();
    if (!query) return test.skip("DuckDB has no library for this machine");
    const made = episodes();
    const out = written(test, made);
    const groups = await query(`select distinct row_group_id id, row_group_num_rows n from parquet_metadata('${join(out, kData)}') order by id`);
    assert.deepEqual(groups.map((row) => row.get("n")), made.map(({ frames }) => frames.length));
    const rows = await query(`select * from '${join(out, kEpisodes)}'`);
    let first = 0;
    rows.forEach((row, k) => {
      const { length } = made[k]!.frames;
      const expected = { episode_index: k, tasks: [config.task], length, dataset_from_index: first, dataset_to_index: first += length };
      for (const [name, value] of Object.entries(expected)) assert.deepEqual(row.get(name), value, name);
      for (const name of ["data/chunk_index", "data/file_index", "meta/episodes/chunk_index"]) assert.equal(row.get(name), 0);
      assert.deepEqual(row.get("stats/index/count"), [length]);
    });
  });

  it("the text of a task is the index of a pandas table", async (test) => {
    const query = await duckdb();
    if (!query) return test.skip("DuckDB has no library for this machine");
    const file = join(written(test, episodes()), "meta/tasks.parquet");
    const [row] = await query(`select decode(value) as value from parquet_kv_metadata('${file}') where decode(key) = 'pandas'`);
    const pandas = JSON.parse(row!.get("value") as string);
    assert.deepEqual(pandas.index_columns, ["task"]);
    assert.deepEqual(pandas.columns.map(({ field_name: name }: { field_name: string }) => name), ["task_index", "task"]);
    assert.deepEqual([...(await query(`select * from '${file}'`))[0]!], [["task_index", 0], ["task", config.task]]);
  });

  it("splits large data between episodes, as the checker expects", async (test) => {
    const made = Array.from({ length: 6 }, () => episodes({ fps: 100 })).flat();
    const out = written(test, made, { fps: 100, fileSizeMib: 0.04 });
    const files = readdirSync(join(out, "data/chunk-000"));
    assert.ok(files.length > 2, String(files));
    const rows = files.map((file) => readParquetFile(join(out, "data/chunk-000", file)).get("episode_index")!.values);
    assert.equal(rows.reduce((sum, of) => sum + new Set(of).size, 0), made.length, "no episode is in two files");
    assert.deepEqual(await check(out), []);
  });

  it("leaves out what nobody measured, and leaves no file of v2.1", async (test) => {
    const out = written(test, episodes({ contact: false }));
    const { features } = readJson(join(out, "meta/info.json"));
    assert.ok(!("observation.wrench" in features) && features.action.shape[0] === 3);
    for (const file of ["meta/tasks.jsonl", "meta/episodes.jsonl"]) assert.ok(!existsSync(join(out, file)));
    assert.deepEqual(await check(out), []);
  });
});

describe("statistics", () => {
  it("of episodes are those of LeRobot's definitions", () => {
    const rows = Array.from({ length: 101 }, (_, k) => [(k * 37) % 101, 5]);
    const stats = statsOf(rows);
    assert.deepEqual([stats["min"], stats["max"], stats["mean"], stats["count"]], [[0, 5], [100, 5], [50, 5], [101]]);
    near(stats["std"]![0]!, Math.sqrt((101 ** 2 - 1) / 12));
    assert.deepEqual(["q01", "q10", "q50", "q90", "q99"].map((q) => stats[q]![0]), [1, 10, 50, 90, 99]);
  });

  it("of the dataset are those of all frames, and its quantiles are bounds", () => {
    const parts = [[[1], [2], [6]], [[-4], [10]], [[3]]];
    const [total, whole] = [aggregate(parts.map((part) => statsOf(part))), statsOf(parts.flat())];
    for (const name of ["min", "max", "mean", "std", "count"]) near(total[name]![0]!, whole[name]![0]!);
    assert.ok(total["q10"]![0]! <= whole["q10"]![0]! && total["q90"]![0]! >= whole["q90"]![0]!);
  });
});

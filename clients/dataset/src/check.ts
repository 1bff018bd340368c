// SPDX-License-Identifier: Apache-2.0
// Finds errors in a dataset with the layout of LeRobot v3.0 (layout_v30.ts).
import { existsSync, readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { dataFile, kDataPath, kEpisodes, kTasks } from "./layout_v30.js";
import { openTable, type Cell, type Row, type Table } from "./parquet.js";
import { aggregate, kStatNames, statsOf, type Stats } from "./stats.js";

export interface Finding {
  /** Relative to the folder. */
  readonly file: string;
  readonly what: string;
}

interface FeatureInfo { readonly dtype: string; readonly shape: readonly number[]; readonly info?: { readonly senders?: readonly string[] } }
interface Info {
  readonly codebase_version: string;
  readonly fps: number;
  readonly total_episodes: number;
  readonly total_frames: number;
  readonly total_tasks: number;
  readonly data_path: string;
  readonly features: Readonly<Record<string, FeatureInfo>>;
}

const kInfo = "meta/info.json";
const kStats = "meta/stats.json";
/** These columns are required by LeRobot. */
const kIndices: Readonly<Record<string, string>> = {
  timestamp: "float32", frame_index: "int64", episode_index: "int64", index: "int64", task_index: "int64",
};
const kTypes: Readonly<Record<string, string>> = { float32: "FLOAT", float64: "DOUBLE", int64: "INT64" };

class Checker {
  readonly findings: Finding[] = [];
  readonly #folder: string;

  constructor(folder: string) {
    this.#folder = folder;
  }

  #expect(file: string, what: string, got: unknown, expected: unknown): boolean {
    const same = JSON.stringify(got) === JSON.stringify(expected);
    if (!same) this.#found(file, `${what}: expected ${JSON.stringify(expected)}, got ${JSON.stringify(got)}`);
    return same;
  }

  #found(file: string, what: string): void {
    this.findings.push({ file, what });
  }

  /** Undefined with a finding if the file cannot be read. */
  async #read<T>(file: string, read: (path: string) => T | Promise<T>): Promise<T | undefined> {
    const path = join(this.#folder, file);
    if (!existsSync(path)) return void this.#found(file, "missing");
    try {
      return await read(path);
    } catch (error) {
      return void this.#found(file, `cannot be read: ${error instanceof Error ? error.message : String(error)}`);
    }
  }

  async run(): Promise<void> {
    const files = readdirSync(this.#folder, { recursive: true, encoding: "utf8" });
    for (const file of files) if (/^meta\/[^/]*\.jsonl$/.test(file)) this.#found(file, "expected no file of v2.1");
    const json = <T>(path: string): T => JSON.parse(readFileSync(path, "utf8")) as T;
    const info = await this.#read(kInfo, json<Info>);
    if (!info || !this.#isUsable(info)) return;
    const tasks = await this.#read(kTasks, async (path) => this.#tasks(await openTable(path), info));
    const episodes = await this.#read(kEpisodes, async (path) => (await openTable(path)).rows());
    if (!tasks || !episodes || !this.#areInOrder(info, episodes, tasks)) return;
    const stats = await this.#data(info, episodes, tasks.length, files.filter((file) => /^data\/.*\.parquet$/.test(file)));
    const total = await this.#read(kStats, json<Record<string, Stats>>);
    if (!total || stats.length !== episodes.length) return;
    for (const name of Object.keys(info.features)) {
      this.#areNear(kStats, name, (stat) => total[name]?.[stat], aggregate(stats.map((of) => of.get(name)!)));
    }
  }

  #isUsable(info: Info): boolean {
    const before = this.findings.length;
    this.#expect(kInfo, "codebase_version", info.codebase_version, "v3.0");
    this.#expect(kInfo, "data_path", info.data_path, kDataPath);
    if (!(info.fps > 0)) this.#found(kInfo, `fps: expected a positive number, got ${JSON.stringify(info.fps)}`);
    for (const [name, { dtype, shape }] of Object.entries(info.features ?? {})) {
      if (name.includes("/")) this.#found(kInfo, `feature "${name}": expected a name without "/"`);
      if (!kTypes[dtype] || !(Array.isArray(shape) && shape.length === 1 && shape[0]! >= 1)) {
        this.#found(kInfo, `feature "${name}": expected ${Object.keys(kTypes).join(", ")} and the shape [n], got ${dtype} ${JSON.stringify(shape)}`);
      }
    }
    for (const [name, dtype] of Object.entries(kIndices)) this.#expect(kInfo, `feature "${name}"`, info.features?.[name]?.dtype, dtype);
    return this.findings.length === before;
  }

  /** Returns the texts of the tasks. They are the index of a pandas table, which is not visible in the columns. */
  async #tasks(table: Table, info: Info): Promise<string[]> {
    const { index_columns: index } = JSON.parse(table.metadata["pandas"] ?? "{}") as { index_columns?: unknown };
    if (JSON.stringify(index) !== '["task"]') {
      this.#found(kTasks, 'expected the key "pandas" with the index "task"; without it, LeRobot uses numbers as the texts of the tasks');
    }
    const rows = await table.rows();
    this.#expect(kTasks, "task_index", rows.map((row) => row["task_index"]), rows.map((_, k) => k));
    this.#expect(kInfo, "total_tasks", info.total_tasks, rows.length);
    return rows.map((row) => String(row["task"]));
  }

  #areInOrder(info: Info, episodes: readonly Row[], tasks: readonly string[]): boolean {
    const before = this.findings.length;
    let first = 0;
    episodes.forEach((row, k) => {
      this.#expect(kEpisodes, `episode_index of row ${k}`, row["episode_index"], k);
      this.#expect(kEpisodes, `dataset_from_index of episode ${k}`, row["dataset_from_index"], first);
      if (!(Number(row["length"]) >= 1)) this.#found(kEpisodes, `length of episode ${k}: expected at least 1, got ${String(row["length"])}`);
      first += Number(row["length"]);
      this.#expect(kEpisodes, `dataset_to_index of episode ${k}`, row["dataset_to_index"], first);
      for (const task of (row["tasks"] ?? []) as string[]) {
        if (!tasks.includes(task)) this.#found(kEpisodes, `tasks of episode ${k}: "${task}" is not in ${kTasks}`);
      }
    });
    this.#expect(kInfo, "total_episodes", info.total_episodes, episodes.length);
    this.#expect(kInfo, "total_frames", info.total_frames, first);
    return this.findings.length === before;
  }

  /** Returns the statistics of the episodes without errors. */
  async #data(info: Info, episodes: readonly Row[], tasks: number, present: readonly string[]): Promise<Map<string, Stats>[]> {
    const files = new Map<string, Row[]>();
    for (const row of episodes) {
      const file = dataFile(Number(row["data/chunk_index"]), Number(row["data/file_index"]));
      files.set(file, [...(files.get(file) ?? []), row]);
    }
    for (const file of present) if (!files.has(file)) this.#found(file, "no episode is in this file, but LeRobot reads all files");
    const stats: Map<string, Stats>[] = [];
    for (const [file, inside] of files) {
      const table = await this.#read(file, openTable);
      if (!table) continue;
      for (const [name, { dtype, shape }] of Object.entries(info.features)) {
        this.#expect(file, `column "${name}"`, table.columns.get(name), { type: kTypes[dtype], list: shape[0] !== 1 });
      }
      for (const name of table.columns.keys()) if (!info.features[name]) this.#found(file, `column "${name}": not in ${kInfo}`);
      const lengths = inside.map((row) => Number(row["length"]));
      if (!this.#expect(file, "row groups, one for each episode", table.groups, lengths)) continue;
      let first = 0;
      for (const [k, row] of inside.entries()) {
        const frames = await table.rows(first, first + lengths[k]!);
        first += lengths[k]!;
        const of = this.#episode(file, info, row, frames, tasks);
        if (of) stats.push(of);
      }
    }
    return stats;
  }

  #episode(file: string, info: Info, row: Row, frames: readonly Row[], tasks: number): Map<string, Stats> | undefined {
    const before = this.findings.length;
    const episode = Number(row["episode_index"]);
    /** Reports the first frame whose value is not as expected. */
    const every = (name: string, expected: string, holds: (value: Cell, k: number) => boolean): void => {
      const k = frames.findIndex((frame, at) => !holds(frame[name]!, at));
      if (k >= 0) this.#found(file, `${name} of episode ${episode}, frame ${k}: expected ${expected}, got ${JSON.stringify(frames[k]![name])}`);
    };
    every("episode_index", String(episode), (value) => value === episode);
    every("frame_index", "the number of the frame", (value, k) => value === k);
    every("index", "the number of the frame in the dataset", (value, k) => value === Number(row["dataset_from_index"]) + k);
    every("timestamp", `frame_index / ${info.fps} s`, (value, k) => Math.abs(Number(value) - k / info.fps) <= 1e-6 * (1 + k / info.fps));
    every("task_index", `less than ${tasks}`, (value) => Number(value) >= 0 && Number(value) < tasks);
    for (const [name, { shape, info: more }] of Object.entries(info.features)) {
      const [count] = shape;
      every(name, count === 1 ? "a finite number" : `${count} finite numbers`, (value) =>
        (count === 1 ? Number.isFinite(value) : Array.isArray(value) && value.length === count && value.every(Number.isFinite)));
      const senders = more?.senders;
      if (senders) every(name, `an index of ${JSON.stringify(senders)}`, (value) => senders[Number(value)] !== undefined);
    }
    if (this.findings.length !== before || frames.length === 0) return undefined;
    const stats = new Map(Object.keys(info.features).map((name) =>
      [name, statsOf(frames.map((frame) => [frame[name]!].flat() as number[]))]));
    for (const [name, of] of stats) this.#areNear(kEpisodes, `stats/${name}`, (stat) => row[`stats/${name}/${stat}`], of, ` of episode ${episode}`);
    return stats;
  }

  /** Since LeRobot estimates the quantiles, this only checks that they are between the minimum and the maximum. */
  #areNear(file: string, name: string, got: (stat: string) => unknown, expected: Stats, where = ""): void {
    for (const stat of kStatNames) {
      const values = got(stat);
      const near = (value: unknown, i: number): boolean => {
        const [low, high] = [expected["min"]![i]!, expected["max"]![i]!];
        const slack = 1e-6 * Math.max(Math.abs(low), Math.abs(high), 1e-3);
        if (stat.startsWith("q")) return Number(value) >= low - slack && Number(value) <= high + slack;
        return Math.abs(Number(value) - expected[stat]![i]!) <= slack;
      };
      const right = Array.isArray(values) && values.length === expected[stat]!.length && values.every(near);
      if (!right) this.#found(file, `${name}/${stat}${where}: expected ${JSON.stringify(expected[stat])}, got ${JSON.stringify(values)}`);
    }
  }
}

/** Returns all errors that were found in the dataset in `folder`. If the metadata is not usable, the data is not checked. */
export async function check(folder: string): Promise<readonly Finding[]> {
  const checker = new Checker(folder);
  await checker.run();
  return checker.findings;
}

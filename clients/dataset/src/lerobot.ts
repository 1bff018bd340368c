// SPDX-License-Identifier: Apache-2.0
// Writes episodes in the LeRobot v2.1 format, without videos:
//
//     meta/info.json, tasks.jsonl, episodes.jsonl, episodes_stats.jsonl
//     data/chunk-000/episode_000000.parquet
//
// Source: the datasets of huggingface.co/lerobot and their meta/info.json.
import { mkdirSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { parquetWriteBuffer } from "hyparquet-writer";
import type { Episode, Frame } from "./episodes.js";

export interface DatasetConfig {
  /** The folder must be empty, or it must not exist. */
  readonly out: string;
  readonly fps: number;
  /** Description of the task in natural language. */
  readonly task: string;
  readonly robot: string;
}

interface Feature {
  readonly dtype: "float32" | "int64";
  readonly names: readonly string[] | null;
  readonly of: (frame: Frame, at: Index) => readonly number[];
}

/** Position of a frame in the dataset. */
interface Index {
  readonly frame: number;
  readonly episode: number;
  readonly whole: number;
  readonly fps: number;
}

const kChunk = 1000; // episodes

/** Features by name. The contact force is included if it was measured in every frame. */
function featuresOf(episodes: readonly Episode[]): ReadonlyMap<string, Feature> {
  const one = (dtype: Feature["dtype"], of: (at: Index) => number): Feature => ({ dtype, names: null, of: (_, at) => [of(at)] });
  const all = new Map<string, Feature>();
  all.set("observation.state", {
    dtype: "float32", names: ["x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"], of: ({ state }) => state,
  });
  if (episodes.every(({ frames }) => frames.every(({ contact }) => contact))) {
    all.set("observation.contact_force", { dtype: "float32", names: ["x_n", "y_n", "z_n"], of: ({ contact }) => contact! });
  }
  all.set("action", { dtype: "float32", names: ["x_m", "y_m", "z_m"], of: ({ action }) => action });
  all.set("timestamp", one("float32", ({ frame, fps }) => frame / fps));
  all.set("frame_index", one("int64", ({ frame }) => frame));
  all.set("episode_index", one("int64", ({ episode }) => episode));
  all.set("index", one("int64", ({ whole }) => whole));
  all.set("task_index", one("int64", () => 0));
  return all;
}

type Column = Parameters<typeof parquetWriteBuffer>[0]["columnData"][number];
type Schema = NonNullable<Parameters<typeof parquetWriteBuffer>[0]["schema"]>;

function parquet(features: ReadonlyMap<string, Feature>, rows: ReadonlyMap<string, readonly (readonly number[])[]>): Uint8Array {
  const schema: Schema = [{ name: "schema", num_children: features.size }];
  const columnData: Column[] = [];
  for (const [name, { dtype, names }] of features) {
    const type = dtype === "float32" ? "FLOAT" : "INT64";
    const values = rows.get(name)!;
    if (names) {
      schema.push({ name, repetition_type: "OPTIONAL", num_children: 1, converted_type: "LIST" });
      schema.push({ name: "list", repetition_type: "REPEATED", num_children: 1 });
      schema.push({ name: "element", repetition_type: "OPTIONAL", type });
      columnData.push({ name, data: values.map((value) => [...value]) });
    } else {
      schema.push({ name, repetition_type: "OPTIONAL", type });
      columnData.push({ name, data: values.map(([value]) => (type === "INT64" ? BigInt(value!) : value!)) });
    }
  }
  return new Uint8Array(parquetWriteBuffer({ columnData, schema }));
}

/** Minimum, maximum, mean and standard deviation of each component. */
function statsOf(rows: readonly (readonly number[])[]): Record<string, number[]> {
  const components = rows[0]!.map((_, i) => rows.map((row) => row[i]!));
  const mean = components.map((values) => values.reduce((sum, value) => sum + value, 0) / values.length);
  return {
    min: components.map((values) => values.reduce((a, b) => Math.min(a, b))),
    max: components.map((values) => values.reduce((a, b) => Math.max(a, b))),
    mean,
    std: components.map((values, i) => Math.sqrt(values.reduce((sum, value) => sum + (value - mean[i]!) ** 2, 0) / values.length)),
    count: [rows.length],
  };
}

const padded = (value: number, digits: number): string => String(value).padStart(digits, "0");

/** Returns the number of written frames. Throws an Error if `out` is not empty or there is no episode. */
export function writeDataset(episodes: readonly Episode[], { out, fps, task, robot }: DatasetConfig): number {
  if (episodes.length === 0) throw new Error("expected at least one episode: the follower is never engaged in the recordings");
  mkdirSync(out, { recursive: true });
  if (readdirSync(out).length > 0) throw new Error(`${out}: expected an empty folder, or a new one; existing files are never overwritten`);
  mkdirSync(join(out, "meta"));
  const features = featuresOf(episodes);
  const lines: Record<"episodes" | "episodes_stats", object[]> = { episodes: [], episodes_stats: [] };
  let whole = 0;
  episodes.forEach(({ frames }, episode) => {
    const rows = new Map<string, (readonly number[])[]>();
    for (const [name, { of }] of features) {
      rows.set(name, frames.map((frame, k) => of(frame, { frame: k, episode, whole: whole + k, fps })));
    }
    whole += frames.length;
    const folder = join(out, "data", `chunk-${padded(Math.floor(episode / kChunk), 3)}`);
    mkdirSync(folder, { recursive: true });
    writeFileSync(join(folder, `episode_${padded(episode, 6)}.parquet`), parquet(features, rows));
    lines.episodes.push({ episode_index: episode, tasks: [task], length: frames.length });
    const stats = Object.fromEntries([...rows].map(([name, values]) => [name, statsOf(values)]));
    lines.episodes_stats.push({ episode_index: episode, stats });
  });
  const info = {
    codebase_version: "v2.1",
    robot_type: robot,
    total_episodes: episodes.length,
    total_frames: whole,
    total_tasks: 1,
    total_videos: 0,
    total_chunks: Math.ceil(episodes.length / kChunk),
    chunks_size: kChunk,
    fps,
    splits: { train: `0:${episodes.length}` },
    data_path: "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
    video_path: null,
    features: Object.fromEntries([...features].map(([name, { dtype, names }]) => [name, { dtype, shape: [names?.length ?? 1], names }])),
  };
  writeFileSync(join(out, "meta", "info.json"), `${JSON.stringify(info, null, 2)}\n`);
  writeFileSync(join(out, "meta", "tasks.jsonl"), `${JSON.stringify({ task_index: 0, task })}\n`);
  for (const [name, of] of Object.entries(lines)) {
    writeFileSync(join(out, "meta", `${name}.jsonl`), of.map((line) => `${JSON.stringify(line)}\n`).join(""));
  }
  return whole;
}

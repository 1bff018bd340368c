// SPDX-License-Identifier: Apache-2.0
// Writes the layout of LeRobot v3.0:
//
//     meta/info.json, stats.json, tasks.parquet
//     meta/episodes/chunk-000/file-000.parquet     a row for each episode, with its place and statistics
//     data/chunk-000/file-000.parquet              several episodes, each in a row group of its own
//
// Source: huggingface/lerobot at 7427f318, src/lerobot/datasets (utils.py, io_utils.py, dataset_writer.py).
import { join } from "node:path";
import { cellsOf, infoOf, padded, writeJson, type Source } from "./source.js";
import type { Rows } from "./features.js";
import { TableWriter, type Cell, type ColumnType } from "./parquet.js";
import { aggregate, kStatNames, statsOf, type Stats } from "./stats.js";

export const kTasks = "meta/tasks.parquet";
export const kEpisodes = "meta/episodes/chunk-000/file-000.parquet";
export const kDataPath = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet";
const kFilesPerChunk = 1000;

export const dataFile = (chunk: number, file: number): string => `data/chunk-${padded(chunk, 3)}/file-${padded(file, 3)}.parquet`;

/** Writes the data files, and returns the index of the file of each episode. */
function writeData(source: Source, onRows: (rows: Rows) => void): number[] {
  const { config: { out, fileSizeMib }, episodes, columns } = source;
  const files: number[] = [];
  let table: TableWriter | undefined;
  let file = -1;
  let frames = 0;  // in this file
  for (const { rows: read } of episodes) {
    const rows = read();
    const { length } = rows.get("index")!;
    if (!table || table.bytes * (1 + length / frames) > fileSizeMib * 2 ** 20) {
      table?.close();
      ++file;
      frames = 0;
      table = new TableWriter(join(out, dataFile(Math.floor(file / kFilesPerChunk), file % kFilesPerChunk)), columns);
    }
    table.append(cellsOf(source, rows));
    frames += length;
    files.push(file);
    onRows(rows);
  }
  table?.close();
  return files;
}

/**
 * The index of this pandas table is the text of the task. Without the key "pandas", the index would be a number, and
 * LeRobot would take it for the text.
 */
function writeTasks({ config: { out, task } }: Source): void {
  const column = (name: string, pandas: string, numpy: string): object =>
    ({ name, field_name: name, pandas_type: pandas, numpy_type: numpy, metadata: null });
  const pandas = {
    index_columns: ["task"],
    column_indexes: [{ name: null, field_name: null, pandas_type: "unicode", numpy_type: "object", metadata: { encoding: "UTF-8" } }],
    columns: [column("task_index", "int64", "int64"), column("task", "unicode", "object")],
    creator: { library: "tendon-dataset", version: "0.2.0" },
    pandas_version: "2.2.2",
  };
  const columns = new Map<string, ColumnType>([["task_index", { type: "INT64", list: false }], ["task", { type: "TEXT", list: false }]]);
  const table = new TableWriter(join(out, kTasks), columns, { pandas: JSON.stringify(pandas) });
  table.append(new Map<string, Cell[]>([["task_index", [0]], ["task", [task]]]));
  table.close();
}

function writeEpisodes({ config: { out, task }, features, episodes }: Source, stats: readonly ReadonlyMap<string, Stats>[], files: readonly number[]): void {
  const columns = new Map<string, ColumnType>();
  const cells = new Map<string, Cell[]>();
  const add = (name: string, type: ColumnType, of: (episode: Source["episodes"][number]) => Cell): void => {
    columns.set(name, type);
    cells.set(name, episodes.map(of));
  };
  const integer = (name: string, of: (episode: Source["episodes"][number]) => number): void => add(name, { type: "INT64", list: false }, of);
  const lengthOf = ({ index }: { readonly index: number }): number => stats[index]!.get("index")!["count"]![0]!;
  integer("episode_index", ({ index }) => index);
  add("tasks", { type: "TEXT", list: true }, () => [task]);
  integer("length", lengthOf);
  integer("data/chunk_index", ({ index }) => Math.floor(files[index]! / kFilesPerChunk));
  integer("data/file_index", ({ index }) => files[index]! % kFilesPerChunk);
  integer("dataset_from_index", ({ first }) => first);
  integer("dataset_to_index", (episode) => episode.first + lengthOf(episode));
  integer("meta/episodes/chunk_index", () => 0);
  integer("meta/episodes/file_index", () => 0);
  for (const feature of features.keys()) {
    for (const name of kStatNames) {
      add(`stats/${feature}/${name}`, { type: name === "count" ? "INT64" : "DOUBLE", list: true }, ({ index }) => stats[index]!.get(feature)![name]!);
    }
  }
  const table = new TableWriter(join(out, kEpisodes), columns);
  table.append(cells);
  table.close();
}

export function writeV30(source: Source): void {
  const { config: { out, fileSizeMib }, features } = source;
  const stats: Map<string, Stats>[] = [];
  const files = writeData(source, (rows) => stats.push(new Map([...rows].map(([name, values]) => [name, statsOf(values)]))));
  writeTasks(source);
  writeEpisodes(source, stats, files);
  writeJson(out, "meta/stats.json", Object.fromEntries([...features.keys()].map((name) => [name, aggregate(stats.map((of) => of.get(name)!))])));
  writeJson(out, "meta/info.json", {
    ...infoOf(source), chunks_size: kFilesPerChunk, data_files_size_in_mb: fileSizeMib, video_files_size_in_mb: 200, data_path: kDataPath,
  });
}

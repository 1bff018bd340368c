// SPDX-License-Identifier: Apache-2.0
// The functions and types that are used by all layouts of a dataset.
import { mkdirSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { described, type Features, type Layout, type Rows } from "./features.js";
import type { Cell, Columns } from "./parquet.js";

export interface DatasetConfig {
  /** The folder must be empty, or it must not exist. */
  readonly out: string;
  readonly fps: number;
  /** Description of the task in natural language. */
  readonly task: string;
  readonly robot: string;
  /** v3.0 */
  readonly layout?: Layout;
  /** Files of v3.0 with more data are split between episodes. MiB, 100 */
  readonly fileSizeMib?: number;
}

/** What a layout writes. */
export interface Source {
  readonly config: Required<DatasetConfig>;
  readonly features: Features;
  readonly episodes: readonly { readonly index: number; readonly first: number; readonly rows: () => Rows }[];
  readonly frames: number;
  readonly columns: Columns;
}

/** Returns the part of meta/info.json that is the same in all layouts. */
export function infoOf({ config, features, episodes, frames }: Source): Record<string, unknown> {
  return {
    codebase_version: config.layout, robot_type: config.robot, total_episodes: episodes.length, total_frames: frames, total_tasks: 1,
    fps: config.fps, splits: { train: `0:${episodes.length}` }, video_path: null, features: described(features),
  };
}

/** The cells of a data file. */
export const cellsOf = ({ features }: Source, rows: Rows): Map<string, readonly Cell[]> =>
  new Map([...rows].map(([name, values]) => [name, features.get(name)!.names ? values : values.map(([value]) => value!)]));

export const padded = (value: number, digits: number): string => String(value).padStart(digits, "0");

export function writeText(out: string, path: string, text: string): void {
  mkdirSync(dirname(join(out, path)), { recursive: true });
  writeFileSync(join(out, path), text);
}
export const writeJson = (out: string, path: string, json: unknown): void => writeText(out, path, `${JSON.stringify(json, null, 2)}\n`);

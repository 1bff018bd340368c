// SPDX-License-Identifier: Apache-2.0
// Writes episodes as a dataset of LeRobot, without videos.
import { mkdirSync, readdirSync } from "node:fs";
import type { Episode } from "./episodes.js";
import { featuresOf, rowsOf } from "./features.js";
import { writeV21 } from "./layout_v21.js";
import { writeV30 } from "./layout_v30.js";
import type { Columns } from "./parquet.js";
import type { DatasetConfig } from "./source.js";

/** Returns the number of written frames. Throws an Error if `out` is not empty or there is no episode. */
export function writeDataset(episodes: readonly Episode[], config: DatasetConfig): number {
  if (episodes.length === 0) throw new Error("expected at least one episode: the follower is never engaged in the recordings");
  const { out, fps, layout = "v3.0", fileSizeMib = 100 } = config;
  mkdirSync(out, { recursive: true });
  if (readdirSync(out).length > 0) throw new Error(`${out}: expected an empty folder, or a new one; existing files are never overwritten`);
  const features = featuresOf(episodes, layout);
  let frames = 0;
  const placed = episodes.map((episode, index) => {
    const first = frames;
    frames += episode.frames.length;
    return { index, first, rows: () => rowsOf(features, episode, { episode: index, whole: first, fps }) };
  });
  const columns: Columns = new Map([...features].map(([name, { dtype, names }]) =>
    [name, { type: dtype === "float32" ? "FLOAT" : "INT64", list: names !== null }]));
  const write = layout === "v3.0" ? writeV30 : writeV21;
  write({ config: { ...config, layout, fileSizeMib }, features, episodes: placed, frames, columns });
  return frames;
}

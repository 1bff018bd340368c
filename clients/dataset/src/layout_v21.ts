// SPDX-License-Identifier: Apache-2.0
// Writes the layout of LeRobot v2.1, which is supported for one more release:
//
//     meta/info.json, tasks.jsonl, episodes.jsonl, episodes_stats.jsonl
//     data/chunk-000/episode_000000.parquet
import { join } from "node:path";
import { cellsOf, infoOf, padded, writeJson, writeText, type Source } from "./source.js";
import { TableWriter } from "./parquet.js";
import { statsOf } from "./stats.js";

const kChunk = 1000; // episodes

export function writeV21(source: Source): void {
  const { config: { out, task }, episodes, columns } = source;
  const lines: Record<"tasks" | "episodes" | "episodes_stats", object[]> = { tasks: [{ task_index: 0, task }], episodes: [], episodes_stats: [] };
  for (const { index, rows: read } of episodes) {
    const rows = read();
    const table = new TableWriter(join(out, `data/chunk-${padded(Math.floor(index / kChunk), 3)}/episode_${padded(index, 6)}.parquet`), columns);
    table.append(cellsOf(source, rows));
    table.close();
    lines.episodes.push({ episode_index: index, tasks: [task], length: rows.get("index")!.length });
    const stats = Object.fromEntries([...rows].map(([name, values]) => [name, statsOf(values, { quantiles: false })]));
    lines.episodes_stats.push({ episode_index: index, stats });
  }
  writeJson(out, "meta/info.json", {
    ...infoOf(source),
    total_videos: 0,
    total_chunks: Math.ceil(episodes.length / kChunk),
    chunks_size: kChunk,
    data_path: "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
  });
  for (const [name, of] of Object.entries(lines)) {
    writeText(out, `meta/${name}.jsonl`, of.map((line) => `${JSON.stringify(line)}\n`).join(""));
  }
}

#!/usr/bin/env node
// SPDX-License-Identifier: Apache-2.0
import { parseArgs } from "node:util";
import { check } from "./check.js";
import { writeDataset } from "./dataset.js";
import { readDemonstration } from "./demonstration.js";
import { CouplingEpisodes, episodesOfRobot, type Episode } from "./episodes.js";
import type { Layout } from "./features.js";
import { readCoupling } from "./recording.js";

const kHelp = `tendon-dataset: convert recordings of a coupling to a robot-learning dataset (LeRobot v3.0, without videos).

Usage: tendon-dataset FILE... --out DIR [OPTIONS]
       tendon-dataset --check DIR [--json]

  FILE.mcap               Recording of a leader and its follower, written by tendon-replay --merge
  FILE.jsonl              Demonstration of a robot's program, written by tendon.demonstration of clients/python
  -h, --help              Print this help and exit
  --out DIR               Folder of the dataset; must be empty or not exist
  --fps NUMBER            Frames per second, 1 to 1000 [30]
  --task TEXT             Task of the operator [teleoperation]
  --robot NAME            Type of the follower [tendon]
  --layout VERSION        v3.0, or v2.1 for one more release [v3.0]
  --check DIR             Find what is wrong with a dataset of LeRobot v3.0
  --json                  Print JSON on stdout, one object, instead of sentences

An episode starts each time the operator engages. Exit: 0 success; 1 a file cannot be used, or --check
has found something; 2 wrong usage.

Example: tendon-replay leader.mcap --merge follower.mcap --into pair.mcap
         tendon-dataset pair.mcap --out press --task "press the wall"
`;

function options() {
  const { values, positionals } = parseArgs({
    allowPositionals: true,
    options: {
      help: { type: "boolean", short: "h", default: false },
      out: { type: "string" },
      fps: { type: "string", default: "30" },
      task: { type: "string", default: "teleoperation" },
      robot: { type: "string", default: "tendon" },
      layout: { type: "string", default: "v3.0" },
      check: { type: "string" },
      json: { type: "boolean", default: false },
    },
  });
  if (values.help) {
    process.stdout.write(kHelp);
    process.exit(0);
  }
  if (values.check !== undefined) {
    if (positionals.length > 0 || values.out !== undefined) throw new RangeError("--check: expected no FILE and no --out");
    return { ...values, check: values.check };
  }
  const fps = Number(values.fps);
  if (!(Number.isInteger(fps) && fps >= 1 && fps <= 1000)) {
    throw new RangeError(`--fps: expected a whole number from 1 to 1000, got "${values.fps}"`);
  }
  const layout = kLayouts.find((name) => name === values.layout);
  if (!layout) throw new RangeError(`--layout: expected ${kLayouts.join(" or ")}, got "${values.layout}"`);
  if (values.out === undefined) throw new RangeError("--out: missing, expected a folder for the dataset");
  if (positionals.length === 0) throw new RangeError("FILE: missing, expected a merged recording or a demonstration");
  return { ...values, check: undefined, out: values.out, fps, layout, recordings: positionals };
}

const kLayouts: readonly Layout[] = ["v3.0", "v2.1"];

async function episodesOf(recording: string, fps: number): Promise<Episode[]> {
  if (recording.endsWith(".jsonl")) return episodesOfRobot(await readDemonstration(recording), fps);
  const episodes = new CouplingEpisodes(fps);
  await readCoupling(recording, episodes);
  return episodes.finish();
}

async function checkDataset(folder: string, json: boolean): Promise<void> {
  const findings = await check(folder);
  const lines = findings.map(({ file, what }) => `${folder}/${file}: ${what}\n`);
  process.stdout.write(json ? `${JSON.stringify({ folder, findings })}\n` : findings.length > 0 ? lines.join("") : `${folder}: nothing found\n`);
  if (findings.length > 0) process.exitCode = 1;
}

async function main(): Promise<void> {
  const told = options();
  if (told.check !== undefined) return checkDataset(told.check, told.json);
  const { recordings, json, ...config } = told;
  const episodes: Episode[] = [];
  for (const recording of recordings) {
    episodes.push(...(await episodesOf(recording, config.fps)));
    if (process.stderr.isTTY) process.stderr.write(`read ${recording}: ${episodes.length} episodes so far\n`);
  }
  const frames = writeDataset(episodes, config);
  const done = { out: config.out, episodes: episodes.length, frames, fps: config.fps };
  process.stdout.write(json ? `${JSON.stringify(done)}\n` : `${done.out}: ${done.episodes} episodes, ${frames} frames at ${done.fps} Hz\n`);
}

main().catch((error: unknown) => {
  process.stderr.write(`tendon-dataset: ${error instanceof Error ? error.message : String(error)}\n`);
  const usage = error instanceof RangeError || (error as { code?: string }).code?.startsWith("ERR_PARSE_ARGS");
  process.exitCode = usage ? 2 : 1;
});

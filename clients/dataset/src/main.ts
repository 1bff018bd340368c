#!/usr/bin/env node
// SPDX-License-Identifier: Apache-2.0
import { parseArgs } from "node:util";
import { readDemonstration } from "./demonstration.js";
import { episodesOf, episodesOfRobot, type Episode } from "./episodes.js";
import { writeDataset } from "./lerobot.js";
import { readCoupling } from "./recording.js";

const kHelp = `tendon-dataset: convert recordings of a coupling to a robot-learning dataset (LeRobot v2.1, without videos).

Usage: tendon-dataset FILE... --out DIR [OPTIONS]

  FILE.mcap               Recording of a leader and its follower, written by tendon-replay --merge
  FILE.jsonl              Demonstration of a robot's program, written by tendon.demonstration of clients/python
  -h, --help              Print this help and exit
  --out DIR               Folder of the dataset; must be empty or not exist
  --fps NUMBER            Frames per second, 1 to 1000 [30]
  --task TEXT             Task of the operator [teleoperation]
  --robot NAME            Type of the follower [tendon]
  --json                  Print JSON on stdout, one object, instead of a sentence

An episode starts each time the operator engages. Exit: 0 success; 1 a file cannot be used; 2 wrong usage.

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
      json: { type: "boolean", default: false },
    },
  });
  if (values.help) {
    process.stdout.write(kHelp);
    process.exit(0);
  }
  const fps = Number(values.fps);
  if (!(Number.isInteger(fps) && fps >= 1 && fps <= 1000)) {
    throw new RangeError(`--fps: expected a whole number from 1 to 1000, got "${values.fps}"`);
  }
  if (values.out === undefined) throw new RangeError("--out: missing, expected a folder for the dataset");
  if (positionals.length === 0) throw new RangeError("FILE: missing, expected a merged recording or a demonstration");
  return { ...values, out: values.out, fps, recordings: positionals };
}

async function main(): Promise<void> {
  const { recordings, json, ...config } = options();
  const episodes: Episode[] = [];
  for (const recording of recordings) {
    episodes.push(...(recording.endsWith(".jsonl")
      ? episodesOfRobot(await readDemonstration(recording), config.fps)
      : episodesOf(await readCoupling(recording), config.fps)));
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

// SPDX-License-Identifier: Apache-2.0
// This test runs real processes. A hand moves the device of another server, both servers record, and the recordings are
// converted to a dataset.
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";
import { it } from "node:test";
import { kRoot } from "../typescript/support/paths.js";
import { findTendond, Program, scene } from "../typescript/support/program.js";
import { readJson, readParquetFile } from "./read_back.js";

const address = async (server: Program): Promise<string> =>
  /"address":"([^"]*)"/.exec(await server.line((line) => line.includes('"address"')))![1]!;

it("what an operator did becomes a dataset", async (test) => {
  const tendond = findTendond(test);
  if (!tendond) return;
  const folder = mkdtempSync(join(tmpdir(), "tendon-dataset-"));
  test.after(() => rmSync(folder, { recursive: true }));
  const file = (name: string): string => join(folder, `${name}.mcap`);
  const follower = new Program(test, tendond, [scene("follower"), "--listen", "127.0.0.1:0", "--json", "--record", file("follower")]);
  const leader = new Program(test, tendond, [
    scene("leader"), "--listen", "127.0.0.1:0", "--json", "--record", file("leader"), "--dial", await address(follower),
  ]);
  await leader.line((line) => line.includes("teleoperation: engaged"));
  await sleep(3000);
  for (const server of [leader, follower]) assert.equal(await server.end("SIGTERM"), 0);

  const replay = join(process.env["TENDON_PROGRAMS"]!, "tendon-replay");
  execFileSync(replay, [file("leader"), "--merge", file("follower"), "--into", file("pair")]);
  const tool = join(kRoot, "clients/dataset/dist/main.js");
  const out = join(folder, "press");
  const said = execFileSync("node", [tool, file("pair"), "--out", out, "--fps", "50", "--task", "press", "--json"], { encoding: "utf8" });
  const { episodes, frames } = JSON.parse(said) as { episodes: number; frames: number };
  assert.equal(episodes, 1);
  assert.ok(frames > 100, said);
  assert.equal(execFileSync("node", [tool, "--check", out], { encoding: "utf8" }), `${out}: nothing found\n`);
  const columns = readParquetFile(join(out, "data/chunk-000/file-000.parquet"));
  assert.equal(columns.get("frame_index")!.values.length, frames);
  const info = readJson(join(out, "meta/info.json"));
  assert.equal(info.total_frames, frames);
  assert.ok(info.features.action.info.clock_error_s < 0.01, "both servers are on one machine");
  const x = (name: string): number[] => columns.get(name)!.values.map((row) => (row as number[])[0]!);
  const spread = (values: number[]): number => Math.max(...values) - Math.min(...values);
  assert.ok(spread(x("action")) > 0.02, "the hand moved");
  assert.ok(spread(x("observation.state")) > 0.01, "the tool followed");
  assert.ok(Math.min(...x("observation.wrench")) < -0.3, "it touched the wall");
  assert.ok(Math.max(...x("tendon.hand_wrench").map(Math.abs)) > 0.1, "the hand felt it");
  assert.ok(columns.get("tendon.sender")!.values.every((sender) => sender === 1));
  assert.throws(() => execFileSync("node", [tool, file("leader"), "--out", join(folder, "no")], { stdio: "pipe" }), /both ends of a coupling/);
});

it("what a robot that is a guest did becomes a dataset", async (test) => {
  const tendond = findTendond(test);
  if (!tendond) return;
  const python = "/usr/bin/python3";
  if (spawnSync(python, ["-c", "import google.protobuf, nacl.bindings"]).status !== 0) return test.skip("python3-protobuf or python3-nacl is missing");
  const folder = mkdtempSync(join(tmpdir(), "tendon-dataset-"));
  test.after(() => rmSync(folder, { recursive: true }));
  const server = new Program(test, tendond, [scene("robot"), "--listen", "127.0.0.1:0", "--json", "--record", "/dev/null"]);
  const file = join(folder, "press.jsonl");
  const robot = new Program(test, python, [
    join(kRoot, "tests/clients/dataset/robot.py"), "--server", await address(server), "--demonstration", file, "--duration-s", "7",
  ]);
  assert.equal(await robot.end(), 0, robot.lines.join("\n"));
  const out = join(folder, "press");
  const tool = join(kRoot, "clients/dataset/dist/main.js");
  const said = execFileSync("node", [tool, file, "--out", out, "--fps", "50", "--task", "press", "--json"], { encoding: "utf8" });
  const { episodes, frames } = JSON.parse(said) as { episodes: number; frames: number };
  assert.equal(episodes, 1);
  assert.ok(frames > 80, said);
  const columns = readParquetFile(join(out, "data/chunk-000/file-000.parquet"));
  const rows = (name: string, i: number): number[] => columns.get(name)!.values.map((row) => (row as number[])[i]!);
  assert.equal(rows("action", 0).length, frames);
  const [wish, place] = [rows("action", 2), rows("observation.state", 2)];
  assert.ok(Math.max(...wish) - Math.min(...wish) > 0.01, "the hand moved");
  wish.forEach((z, k) => assert.ok(Math.abs(z - place[k]!) < 0.01, "the tool follows its wish"));
  const force = rows("observation.wrench", 2);
  place.forEach((z, k) => assert.ok(Math.abs(force[k]! - Math.max(0, -300 * z)) < 1e-3, "they are of one moment"));
});

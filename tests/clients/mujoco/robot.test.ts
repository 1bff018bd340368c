// SPDX-License-Identifier: Apache-2.0
// This test runs real processes: a simulated hand, and an arm in MuJoCo that follows it and touches a table. The
// network has a delay of 50 ± 10 ms and a loss of 2 %. It then fails and recovers. TENDON_PROGRAMS is the folder of
// tendond, tendon-inject and tendon-report.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createSocket } from "node:dgram";
import { once } from "node:events";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { it, type TestContext } from "node:test";
import { kRoot } from "../typescript/support/paths.js";
import { findTendond, Program, scene } from "../typescript/support/program.js";

const kBuilt = join(kRoot, "clients/mujoco/dist/examples/robot_arm.js");
/** These are the values in the example and its scene. kSpeed is in m/s. */
const [kScale, kForceScale, kSpeed] = [0.5, 0.4, 0.25];

interface Line {
  readonly phase: string;
  readonly ms: number;
  readonly hand: { readonly x: number; readonly y: number; readonly z: number };
  readonly tool: Line["hand"];
  readonly force: Line["hand"];
  /** Force that the device applied to the hand, N. */
  readonly felt?: Line["hand"];
}
const parsed = (program: Program): Line[] =>
  program.lines.filter((line) => line.startsWith('{"phase"')).map((line) => JSON.parse(line));
const apart = (a: Line["hand"], b: Line["hand"]): number => Math.hypot(a.x - b.x, a.y - b.y, a.z - b.z);
const isPhase = (phase: string) => (line: string): boolean => line.includes(`{"phase":"${phase}"`);

async function freePort(): Promise<number> {
  const socket = createSocket("udp4").bind(0, "127.0.0.1");
  await once(socket, "listening");
  const { port } = socket.address();
  socket.close();
  return port;
}

/** Splits the lines into sequences with the same phase. */
function stretches(lines: readonly Line[]): Line[][] {
  const all: Line[][] = [];
  for (const line of lines) {
    if (all.at(-1)?.[0]!.phase === line.phase) all.at(-1)!.push(line);
    else all.push([line]);
  }
  return all;
}

/** The largest distance of the tool from its position at `settleMs` after the beginning of the run, m. */
const wander = (lines: readonly Line[], settleMs: number): number => {
  const rest = lines.filter(({ ms }) => ms >= lines[0]!.ms + settleMs);
  return Math.max(0, ...rest.map(({ tool }) => apart(tool, rest[0]!.tool)));
};

async function injector(test: TestContext, programs: string, listen: string, to: string): Promise<Program> {
  const network = new Program(test, join(programs, "tendon-inject"),
    ["--listen", listen, "--to", to, "--profile", "delay=uniform(40ms,60ms) loss=2%", "--seed", "7", "--json"]);
  await network.line((line) => line.includes('"listen"'));
  return network;
}

it("an arm in MuJoCo follows a far hand, is felt, and waits for the act", async (test) => {
  const tendond = findTendond(test);
  if (!tendond) return;
  const folder = mkdtempSync(join(tmpdir(), "robot-"));
  test.after(() => rmSync(folder, { recursive: true }));
  const [recording, programs] = [join(folder, "run.mcap"), join(tendond, "..")];
  const [address, between] = [`127.0.0.1:${await freePort()}`, `127.0.0.1:${await freePort()}`];
  const network = await injector(test, programs, between, address);
  const engine = new Program(test, process.execPath, [kBuilt, "--server", between, "--json"]);
  await engine.line(isPhase("alone"));
  const server = new Program(test, tendond,
    [scene("robot"), "--listen", address, "--record", recording, "--duration-s", "18.5", "--json"]);

  await engine.line(isPhase("clutched"));
  for (let last = ""; last !== "engaged,clutched,engaged";) { // the button engages, clutches and engages again
    await new Promise((resolve) => setTimeout(resolve, 20));
    last = stretches(parsed(engine)).map(([first]) => first!.phase).slice(-3).join();
    assert.ok(!isPhase("lost")(engine.lines.at(-1)!), "the network was not yet cut");
  }
  await new Promise((resolve) => setTimeout(resolve, 1300));
  await network.end("SIGKILL");
  await engine.line(isPhase("lost"));
  await new Promise((resolve) => setTimeout(resolve, 300));
  await injector(test, programs, between, address);
  assert.equal(await server.end(), 0);
  assert.equal(await engine.end("SIGINT"), 0);

  const lines = parsed(engine);
  const runs = stretches(lines);
  const order = runs.map(([first]) => first!.phase);
  assert.deepEqual(order.slice(0, 10),
    ["alone", "coupled", "clutched", "engaged", "clutched", "engaged", "lost", "coupled", "clutched", "engaged"]);
  const [, coupled, pressing, following, clutch, again, lost, back, press, last] = runs;

  const before = [...coupled!, ...pressing!];
  assert.ok(Math.max(...before.map(({ hand }) => apart(hand, before[0]!.hand))) > 0.008, "the hand moved before the act");
  assert.ok(wander(before, 0) < 2e-4, `the robot moved ${wander(before, 0)} m before the act`);

  for (const [from, to] of [[pressing!, following!], [clutch!, again!], [press!, last!]] as const) {
    const [a, b] = [from.at(-1)!, to[0]!];
    const allowed = 5e-4 + kSpeed * ((b.ms - a.ms) / 1000);
    assert.ok(apart(a.tool, b.tool) <= Math.min(allowed, 5e-3), `engaging moved the robot by ${apart(a.tool, b.tool)} m`);
  }

  // The scale is one half. The hand does not move for one second, 20 mm below the position where it was engaged. (The y
  // axis of the device is the z axis of the robot.)
  const start = following![0]!;
  const resting = following!.filter(({ hand, tool }) => Math.abs(hand.y + 0.02) < 0.002 && tool.z > 0.172);
  const settled = resting.slice(Math.floor(resting.length / 4), Math.floor(resting.length / 2)).at(-1)!;
  const wanted = kScale * (settled.hand.y - start.hand.y);
  assert.ok(Math.abs(settled.tool.z - start.tool.z - wanted) < 0.0015, `${settled.tool.z - start.tool.z} m for ${wanted}`);

  const pressed = following!.filter(({ force }) => force.z > 1);
  assert.ok(pressed.length > 10, "it pressed on the table");
  assert.ok(Math.min(...pressed.map(({ tool }) => tool.z)) > 0.168, "which stopped it");

  assert.ok(wander(clutch!, 300) < 1e-3, `the clutched robot moved ${wander(clutch!, 300)} m`);
  const clutched = Math.max(...clutch!.map(({ hand }) => apart(hand, clutch![0]!.hand)));
  assert.ok(clutched > 0.02, `while the hand did, ${clutched} m`);

  for (const stretch of [lost!, back!])
    assert.ok(wander(stretch, 300) < 1e-3, `${stretch[0]!.phase}, the robot moved ${wander(stretch, 300)} m`);
  assert.ok(apart(lost![0]!.hand, back!.at(-1)!.hand) > 0.005, "while the hand did");

  const report = JSON.parse(execFileSync(join(programs, "tendon-report"), [recording, "--json"], { encoding: "utf8" }));
  const most = Math.max(...pressed.map(({ force }) => kForceScale * force.z));
  test.diagnostic(`the table pushed with ${(most / kForceScale).toFixed(1)} N, the hand felt ${report.peak_force_n.toFixed(2)} N; ` +
    `least energy ${report.least_energy_j.toExponential(2)} J, ${report.overruns} overruns`);
  assert.ok(report.limiter_on && report.least_energy_j >= -1e-9, JSON.stringify(report));
  assert.ok(report.peak_force_n > 0.25 && report.peak_force_n <= 1.05 * most, JSON.stringify(report));
  const felt = lines.map((line) => line.felt?.y ?? 0);
  assert.ok(Math.max(...felt) > 0.2 && Math.min(...felt) > -0.2, `the table pushes up: ${Math.min(...felt)} … ${Math.max(...felt)} N`);
});

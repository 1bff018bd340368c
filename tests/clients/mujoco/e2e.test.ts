// SPDX-License-Identifier: Apache-2.0
// Runs tendond with a simulated device and hand, and MuJoCo. TENDON_PROGRAMS is the folder of tendond.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { it } from "node:test";
import { connect, udp, type DeviceState } from "tendon-client/node";
import { TouchableScene } from "../../../clients/mujoco/src/index.js";
import { kRoot } from "../typescript/support/paths.js";
import { Program, startNode, startTendond, until } from "../typescript/support/program.js";
import { block } from "./scenes.js";

const kBuilt = join(kRoot, "clients/mujoco/dist/examples/touch_block.js");

/** Returns whether the hand is inside the block and is pushed out, in a line of echo_motion. */
function isPush(line: string): boolean {
  if (!line.includes('"tick"')) return false;
  const { position_m: position, force_n: force } = JSON.parse(line);
  return position[0] > 0.002 && force[0] < -0.2;
}

it("a block in MuJoCo is felt: the example, as npm builds it", async (test) => {
  const tendond = await startTendond(test);
  if (!tendond) return;
  const engine = new Program(test, process.execPath, [kBuilt, "--server", tendond.address, "--json"]);
  const echo = startNode(test, "examples/echo_motion", "--server", tendond.address, "--json", "--rate-hz", "0");
  const [x, f] = [JSON.parse(await echo.line(isPush))].map(({ position_m, force_n }) => [position_m[0], force_n[0]])[0]!;
  test.diagnostic(`the hand is ${(1000 * x).toFixed(1)} mm deep and feels ${f.toFixed(2)} N`);
  assert.equal(await echo.end("SIGINT"), 0);
  assert.equal(await engine.end("SIGINT"), 0);
  const { summary } = JSON.parse(engine.lines.at(-1)!);
  assert.equal(summary.sessions, 1);
  assert.ok(summary.forces > 0 && summary.forces_unusable === 0);
  assert.equal(await tendond.program.end("SIGINT"), 0);
  const stopped = JSON.parse(tendond.program.lines.find((line) => line.includes('"stopped"'))!);
  assert.deepEqual([stopped.welcomed, stopped.invalid, stopped.fault], [2, 0, 0]);
});

it("forces that the device gives out are those that MuJoCo gave", async (test) => {
  const tendond = await startTendond(test);
  if (!tendond) return;
  const scene = await TouchableScene.load(block({ n: 4 }).replace('pos="0 0 0.066"', 'pos="0 0 0.0605"'), {
    tool: "tool",
    rotation: [0, 0, 1, 0, 1, 0, -1, 0, 0],
  });
  test.after(() => scene.delete());
  let [busyMs, pressed] = [0, 0];
  const physics = (hand: DeviceState) => {
    const before = performance.now();
    const touch = scene.physics(hand);
    busyMs += performance.now() - before;
    if (touch.force.x < -0.2) ++pressed;
    return touch;
  };
  let felt = 0;
  const engine = connect(udp(tendond.address), { name: "mujoco", rateHz: 100 }, { physics });
  const observer = connect(udp(tendond.address), { name: "observer" }, {
    watch: ({ forceApplied }) => {
      if (forceApplied.x < -0.2) ++felt;
    },
  });
  test.after(() => [engine, observer].forEach((guest) => guest.stop()));
  await until("pressed and felt", () => pressed >= 20 && felt >= 20);
  const { steps, answers, badPositions, restarts, incomplete } = scene.stats();
  test.diagnostic(`${answers} answers, ${steps} steps, ${Math.round((1000 * steps) / busyMs)} steps/s of ${scene.model.nv} degrees of freedom`);
  assert.deepEqual([badPositions, restarts, incomplete, engine.stats().forcesUnusable], [0, 0, 0, 0]);
  assert.ok(answers > 0 && steps >= answers);
});

it("the README's example compiles and is, word for word, the one run", () => {
  const [, example] = /```ts\n([\s\S]*?)```/.exec(readFileSync(join(kRoot, "clients/mujoco/README.md"), "utf8"))!;
  const source = readFileSync(join(kRoot, "clients/mujoco/examples/touch_block.ts"), "utf8");
  assert.equal(example, source.replace(/^\/\/ SPDX.*\n/, ""));
});

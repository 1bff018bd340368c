// SPDX-License-Identifier: Apache-2.0
// Measures the cost of a step and the force on a sphere 2 mm deep in B1, for several meshes. Then it measures the
// static stiffness of B1 under a patch (tests/tools/lab/ACCURACY.md) and the cost of an answer for the peg wedged in
// its hole. Run tests/clients/typescript/run mujoco build first.
import { readFileSync } from "node:fs";
import { TouchableScene, zUp } from "../../../clients/mujoco/build/clients/mujoco/src/index.js";
import { press } from "../../../clients/mujoco/build/tests/clients/mujoco/pressed_block.js";
import { block } from "../../../clients/mujoco/build/tests/clients/mujoco/scenes.js";

for (const n of [4, 8, 12, 16]) {
  const scene = await TouchableScene.load(block({ n }), { tool: "tool" });
  let force;
  const press = (i) => (force = scene.answer({ x: 0, y: 0, z: -0.0055 - 0.002 * Math.min(i / 40, 1) }, 0.01));
  for (let i = 0; i < 5; ++i) press(i);
  const [before, from] = [process.cpuUsage(), scene.stats().steps];
  for (let i = 5; i < 60; ++i) press(i);
  const { user, system } = process.cpuUsage(before);
  const ms = (user + system) / 1000 / (scene.stats().steps - from);
  console.log(`n = ${n}: ${scene.model.nv} degrees of freedom, ${scene.stats().steps - from} steps, ${ms.toFixed(2)} ms of processor time ` +
    `each = ${Math.round(1000 / ms)} steps/s, ${force.z.toFixed(3)} N up, ${Math.hypot(force.x, force.y).toFixed(3)} N aside`);
  scene.delete();
}

const kSteps = 150; // of 20 ms each; B1 is then at rest
for (const n of [4, 6, 8, 12]) {
  const told = [];
  let ms = 0;
  for (const newtons of [0.3, 1]) {
    const scene = await TouchableScene.load(block({ n, option: 'timestep="0.02" integrator="discrete"' }), { tool: "tool" });
    const before = process.cpuUsage();
    const depth = press(scene, n, newtons, kSteps);
    const { user, system } = process.cpuUsage(before);
    ms = (user + system) / 1000 / kSteps;
    told.push(`${(newtons / depth).toFixed(1)} N/m under ${newtons} N`);
    scene.delete();
  }
  console.log(`n = ${n}: ${told.join(", ")}; ${ms.toFixed(2)} ms of processor time each of ${kSteps} steps`);
}

const example = readFileSync(new URL("../../../clients/mujoco/examples/peg_in_hole.ts", import.meta.url), "utf8");
const tilt = (radians) => ({ w: Math.cos(radians / 2), x: 0, y: 0, z: Math.sin(radians / 2) });
for (const sendStiffness of [false, true]) {
  const scene = await TouchableScene.load(/`([\s\S]*)`/.exec(example)[1], { tool: "peg", rotation: zUp(), sendStiffness });
  const wedge = (i) => scene.touch({ x: 0, y: -0.018, z: 0 }, 0.01, tilt(0.15 + 0.05 * Math.sin(i / 5)));
  for (let i = 0; i < 200; ++i) scene.touch({ x: 0, y: -0.0001 * Math.min(i, 180), z: 0 }, 0.01, tilt(0));
  for (let i = 0; i < 200; ++i) wedge(i);
  const before = process.cpuUsage();
  for (let i = 0; i < 1000; ++i) wedge(i);
  const { user, system } = process.cpuUsage(before);
  const ms = ((user + system) / 1e6).toFixed(3);
  console.log(`peg, wedged by ${scene.data.ncon} contacts, ${sendStiffness ? "with" : "without"} stiffness: ${ms} ms of processor time for ` +
    `an answer of 10 steps`);
  scene.delete();
}

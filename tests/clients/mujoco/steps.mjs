// SPDX-License-Identifier: Apache-2.0
//
// node steps.mjs: what a step costs and what a sphere 2 mm deep in B1 feels, by fineness; the table in
// clients/mujoco/README.md. Wants tests/clients/typescript/run mujoco build.
import { TouchableScene } from "../../../clients/mujoco/build/clients/mujoco/src/index.js";
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

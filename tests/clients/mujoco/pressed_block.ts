// SPDX-License-Identifier: Apache-2.0
// Presses on block B1 with the patch of clients/softbody, to compare the models.
import assert from "node:assert/strict";
import type { TouchableScene } from "../../../clients/mujoco/src/index.js";

/**
 * Presses the top center of `block({ n })` with F = `newtons` for `steps` steps. The pressure is 3F/(πa²)·(1 −
 * (r/a)²)² over a patch of radius a = 20 mm. Returns the mean downward displacement of the patch, m.
 */
export function press(scene: TouchableScene, n: number, newtons: number, steps: number): number {
  const { mujoco, model, data } = scene;
  mujoco.mj_forward(model, data);
  const rest = Float64Array.from(data.flexvert_xpos as Float64Array);
  const h = 0.1 / n;
  const index = new Map<string, number>();
  for (let v = 0; v < rest.length / 3; ++v)
    if (rest[3 * v + 2]! > 0.05 - 1e-6) index.set(`${Math.round(rest[3 * v]! / h)},${Math.round(rest[3 * v + 1]! / h)}`, v);
  assert.equal(index.size, (n + 1) ** 2);
  // Integrates over two triangles per cell, whose diagonals point to the center, with 24² midpoints each.
  const weight = new Map<number, number>();
  let total = 0;
  const add = (corners: readonly (readonly [number, number])[]): void => {
    const parts = 24;
    for (let i = 0; i < parts; ++i)
      for (let j = 0; j < parts - i; ++j)
        for (const third of j < parts - i - 1 ? [1, 2] : [1]) {
          const [b, c] = [(i + third / 3) / parts, (j + third / 3) / parts];
          const shape = [1 - b - c, b, c];
          const [x, y] = [0, 1].map((axis) => h * shape.reduce((sum, s, k) => sum + s * corners[k]![axis]!, 0));
          const pressure = Math.max(1 - (x! * x! + y! * y!) / 0.02 ** 2, 0) ** 2;
          shape.forEach((s, k) => {
            const vertex = index.get(corners[k]!.join())!;
            weight.set(vertex, (weight.get(vertex) ?? 0) + s * pressure);
          });
          total += pressure;
        }
  };
  for (let i = -n / 2; i < n / 2; ++i)
    for (let j = -n / 2; j < n / 2; ++j) {
      const [a, b, c, d] = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]] as const;
      for (const triangle of i >= 0 === j >= 0 ? [[a, b, c], [a, c, d]] : [[a, b, d], [b, c, d]]) add(triangle as never);
    }
  for (let step = 0; step < steps; ++step) {
    for (const [vertex, w] of weight) data.xfrc_applied[6 * model.flex_vertbodyid[vertex] + 2] = (-newtons * w) / total;
    mujoco.mj_step(model, data);
  }
  mujoco.mj_forward(model, data);
  let mean = 0;
  for (const [vertex, w] of weight) mean += (w / total) * (rest[3 * vertex + 2]! - data.flexvert_xpos[3 * vertex + 2]);
  return mean;
}

// SPDX-License-Identifier: Apache-2.0
// Compares the fields of MuJoCo's geoms with the same shapes in the frame of the body.
import assert from "node:assert/strict";
import { describe, it, type TestContext } from "node:test";
import { Field, TouchableScene } from "../../../clients/mujoco/src/index.js";
import { distanceTo } from "../../../clients/typescript/src/shape.js";

const kCube = { vertex: "0 0 0  0.02 0 0  0 0.02 0  0.02 0.02 0  0 0 0.01  0.02 0 0.01  0 0.02 0.01  0.02 0.02 0.01",
  face: "0 2 1  1 2 3  4 5 6  5 7 6  0 1 4  1 5 4  2 6 3  3 6 7  0 4 2  2 4 6  1 3 5  3 7 5" };
const kScene = `<mujoco>
  <asset><mesh name="brick" vertex="${kCube.vertex}" face="${kCube.face}"/></asset>
  <worldbody>
    <body name="tool" mocap="true"><geom type="sphere" size="0.01"/></body>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 0.01" euler="90 0 0"/>
    <body name="part" pos="1 2 3" euler="10 20 30">
      <geom name="ball" type="sphere" size="0.01" pos="0.01 0.02 0.03"/>
      <geom name="rod" type="capsule" size="0.01 0.02" pos="0 0 0.03" euler="90 0 0"/>
      <geom name="box" type="box" size="0.01 0.02 0.03" pos="0 0.01 0" euler="0 0 90"/>
      <geom name="mesh" type="mesh" mesh="brick" pos="0.1 0 0" euler="0 0 90"/>
      <geom name="can" type="cylinder" size="0.01 0.02"/>
    </body>
  </worldbody>
</mujoco>`;

async function load(test: TestContext) {
  const scene = await TouchableScene.load(kScene, { tool: "tool", onWarning: () => {} });
  test.after(() => scene.delete());
  return { mj: scene.mujoco, model: scene.model };
}
const at = (x: number, y: number, z: number) => ({ x, y, z });

describe("the field of a geom", () => {
  it("is a primitive in the frame of its body", async (test) => {
    const { mj, model } = await load(test);
    for (const [geom, x, expected] of [
      ["floor", at(0, 0.05, 0), -0.05], // the normal is turned from z to −y
      ["ball", at(0.01, 0.02, 0.06), 0.02],
      ["rod", at(0, 0.05, 0.03), 0.02],
      ["box", at(0.05, 0.01, 0), 0.03],
      ["box", at(0, 0.05, 0), 0.03],
    ] as const) {
      const { primitives } = Field.fromGeom(mj, model, geom);
      assert.ok(Math.abs(distanceTo(primitives[0]!, x) - expected) < 1e-12, `${geom}: ${distanceTo(primitives[0]!, x)}`);
    }
  });

  it("of a mesh is that of its triangles before MuJoCo moves them", async (test) => {
    const { mj, model } = await load(test);
    const told = Field.fromGeom(mj, model, "mesh", { spacingMm: 2 }).describe();
    // The mesh is from (0.08, 0, 0) to (0.1, 0.02, 0.01) in the frame of the body.
    const box = { kind: "box", centre: at(0.09, 0.01, 0.005), half: at(0.01, 0.01, 0.005) } as const;
    const bricks = Field.fromFunction((x) => distanceTo(box, x), at(0.064, -0.016, -0.016), at(0.112, 0.032, 0.032), 2).describe();
    assert.equal(told.bricks.length, bricks.bricks.length);
    let most = 0;
    told.bricks.forEach(({ weights }, brick) => {
      const [ours, theirs] = [weights, bricks.bricks[brick]!.weights].map((bytes) => new Int16Array(bytes.slice().buffer));
      ours!.forEach((weight, i) => (most = Math.max(most, Math.abs(weight - theirs![i]!))));
    });
    assert.ok(most <= 2, `${most} units of ${(16 * 0.002) / 32767} m`);
  });

  it("is refused if it has another type or name", async (test) => {
    const { mj, model } = await load(test);
    assert.throws(() => Field.fromGeom(mj, model, "can"), /geom "can" has type 5: expected a plane, sphere, capsule, box or mesh/);
    assert.throws(() => Field.fromGeom(mj, model, "none"), /geom "none": expected the name of a geom of the model/);
  });
});

// SPDX-License-Identifier: Apache-2.0
// Fields are encoded as in protocol/vectors/fields.json, which is written by C++, and meshes as by the Python client.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, it } from "node:test";
import { depthTableOf, Field } from "../../../clients/typescript/src/field.js";
import type { Vec3 } from "../../../clients/typescript/src/messages.js";
import { distanceTo, type Primitive } from "../../../clients/typescript/src/shape.js";
import { toHex } from "./support/bytes.js";
import { kRoot } from "./support/paths.js";
import { readVectors } from "./support/vectors.js";

interface Shape {
  readonly kind: number;
  readonly hollow: boolean;
  readonly numbers: readonly number[];
}

const vec = ([x, y, z]: readonly number[]): Vec3 => ({ x: x!, y: y!, z: z! });

function shapeOf({ kind, hollow, numbers: n }: Shape): Primitive {
  switch (kind) {
    case 1:
      return { kind: "plane", at: vec(n), normal: vec(n.slice(3)), hollow };
    case 2:
      return { kind: "sphere", centre: vec(n), radius: n[3]!, hollow };
    case 3:
      return { kind: "capsule", start: vec(n), end: vec(n.slice(3)), radius: n[6]!, hollow };
    default: {
      const turn = { w: n[7]!, x: n[8]!, y: n[9]!, z: n[10]! };
      return { kind: "box", centre: vec(n), half: vec(n.slice(3)), rounding: n[6]!, turn, hollow };
    }
  }
}

describe("field", () => {
  for (const vector of readVectors("fields.json").fields) {
    it(`${vector.name}: is encoded as it is here`, () => {
      const primitives: Primitive[] = vector.primitives.map(shapeOf);
      const [sampled]: Primitive[] = vector.sampled.map(shapeOf);
      const field = sampled
        ? Field.fromFunction((x) => distanceTo(sampled, x), vec(vector.low), vec(vector.high), 1000 * vector.spacing, primitives)
        : Field.fromPrimitives(...primitives);
      for (const region of vector.region.map(shapeOf)) field.material("inside", { stiffness: 100, region });
      const told = field.describe();
      assert.equal(toHex(told.manifest), vector.manifest);
      assert.equal(toHex(told.name), vector.field);
      if (vector.first_brick) assert.equal(toHex(told.bricks[0]!.weights), vector.first_brick);
    });
  }

  const meshes = JSON.parse(readFileSync(join(kRoot, "tests/clients/field_meshes.json"), "utf8"));
  for (const mesh of meshes) {
    it(`${mesh.name}: a mesh is encoded as by the Python client`, () => {
      const field = Field.fromTriangles(mesh.points, mesh.triangles, mesh.spacing_mm);
      assert.equal(toHex(field.describe().name), mesh.field);
    });
  }

  it("open edges are counted and placed", () => {
    const { points, triangles } = meshes[0];
    assert.throws(() => Field.fromTriangles(points, triangles.slice(1)), /mesh: 3 open edges, for example from \(10, -7, -6\) to .* mm, /);
    const [[a, b, c], ...others] = triangles;
    assert.throws(() => Field.fromTriangles(points, [[a, c, b], ...others]), /mesh: 3 edges whose triangles have opposite normals/);
    assert.throws(() => Field.fromTriangles(points, [[0, 1, 99]]), /triangle 1 = 0, 1, 99: expected vertices 0 … 7/);
  });

  it("what cannot be is refused", () => {
    const ball: Primitive = { kind: "sphere", centre: vec([0, 0, 0]), radius: 0.01 };
    const field = Field.fromPrimitives(ball);
    assert.throws(() => Field.fromPrimitives(), /the field has no surface/);
    assert.throws(() => Field.fromPrimitives({ ...ball, radius: 0 }), /radius = 0: expected a length above 0 m/);
    assert.throws(() => Field.fromFunction((x) => x.z, vec([0, 0, 0]), vec([0.272, 0.272, 0.008])), /1156 bricks .* try a spacing of 1.1 mm/);
    assert.throws(() => field.material("x", { stiffness: 0 }), /stiffness = 0: expected above 0 N\/m/);
    assert.throws(() => field.material("x", { stiffness: 1, branch: 1 }), /branch = 1: expected a branch with relaxS/);
    assert.throws(() => field.material("x", { stiffness: 1, table: { step: 0, force: [1] } }), /step = 0: expected 0.0001 to 0.1 m/);
    assert.throws(() => field.material("x", { stiffness: 1, table: { step: 1e-3, force: [] } }), /force = 0: expected 1 to 16 entries/);
    assert.throws(() => depthTableOf([1e-3, 1e-3], [1, 2]), /depths\[1\] = 0.001: expected above 0.001 m/);
    assert.throws(() => depthTableOf([1e-3, 2e-3], [1, 1]), /forces\[1\] = 1: expected above 1 N/);
    assert.throws(() => depthTableOf([0.2], [1]), /step = 0.2: expected 0.0001 to 0.1 m/);
    assert.throws(() => field.fixture("point", vec([0, 0, 0]), 100, vec([1, 1, 0])), /normal = 1.41.*: expected a vector of length 1/);
  });

  it("materials are those of the description", () => {
    const field = Field.fromPrimitives({ kind: "sphere", centre: vec([0, 0, 0]), radius: 0.01 });
    field.material("steel", { stiffness: 1500, friction: 0.3 });
    field.material("pad", { stiffness: 300, relaxS: 0.2, region: { kind: "sphere", centre: vec([0, 0, 0]), radius: 1 } });
    const region: Primitive = { kind: "sphere", centre: vec([1, 0, 0]), radius: 0.1 };
    field.material("liver", { ...depthTableOf([0.002, 0.004, 0.006], [0.25, 0.5, 1.25]), region });
    field.fixture("line", vec([0, 0, 0]), 200, vec([1, 0, 0]), 2);
    const told = field.describe();
    assert.deepEqual(told.materials.map((one) => [one.stiffness, one.branchStiffness, one.relaxation, one.friction]),
      [[1500, 0, 0, 0.3], [300, 300, 0.2, 0], [375, 0, 0, 0]]);
    assert.deepEqual(told.tables, [{ material: 2, step: 0.002, force: [-0.5, -1, -1] }]);
    assert.equal(told.manifest[52], 1);
    assert.deepEqual(told.fixtures.map(({ kind, mostForce }) => [kind, mostForce]), [[2, 2]]);
  });

  it("a table of a curve has its forces, and there are at most three", () => {
    const { stiffness, table } = depthTableOf([0.001, 0.0045, 0.016], [0.01, 0.5, 4]);
    const [first, last] = [table.force[0]! + stiffness * 0.001, table.force[15]! + stiffness * 0.016];
    assert.ok(Math.abs(stiffness - 80) < 1e-9 && Math.abs(first - 0.01) < 1e-9 && Math.abs(last - 4) < 1e-9);
    const field = Field.fromPrimitives({ kind: "sphere", centre: vec([0, 0, 0]), radius: 0.01 });
    const region: Primitive = { kind: "sphere", centre: vec([1, 0, 0]), radius: 0.1 };
    for (const name of ["a", "b", "c", "c"]) field.material(name, { stiffness, table, region });
    assert.throws(() => field.material("d", { stiffness, table, region }), /tables = 4: expected at most 3/);
  });
});

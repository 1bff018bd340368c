// SPDX-License-Identifier: Apache-2.0
// Primitives: shapes with an exact signed distance, which is negative inside the solid (core/field/primitives.h). All
// lengths are in m, in the frame of the object.
import { expect } from "./expect.js";
import { kUnitTolerance } from "./limits.js";
import type { Quat, Vec3 } from "./messages.js";

/** If `hollow`, the solid is everything outside of the shape. */
export type Primitive = { readonly hollow?: boolean } & (
  /** A half-space. `normal` is a unit vector that points out of the solid. */
  | { readonly kind: "plane"; readonly at: Vec3; readonly normal: Vec3 }
  | { readonly kind: "sphere"; readonly centre: Vec3; readonly radius: number }
  /** All positions within `radius` of the line from `start` to `end`. */
  | { readonly kind: "capsule"; readonly start: Vec3; readonly end: Vec3; readonly radius: number }
  /** A box with sides of 2 `half`, whose edges are rounded with `rounding`, turned by `turn` about its centre. */
  | { readonly kind: "box"; readonly centre: Vec3; readonly half: Vec3; readonly rounding?: number; readonly turn?: Quat }
);

export const kPrimitiveKinds: readonly Primitive["kind"][] = ["plane", "sphere", "capsule", "box"];

const kIdentity: Quat = { w: 1, x: 0, y: 0, z: 0 };
const minus = (a: Vec3, b: Vec3): Vec3 => ({ x: a.x - b.x, y: a.y - b.y, z: a.z - b.z });
/** Eigen adds in this order, so that all languages compute the same bits. */
const dot = (a: Vec3, b: Vec3): number => a.x * b.x + (a.y * b.y + a.z * b.z);
const norm = (v: Vec3): number => Math.sqrt(dot(v, v));
const cross = (a: Vec3, b: Vec3): Vec3 => ({ x: a.y * b.z - a.z * b.y, y: a.z * b.x - a.x * b.z, z: a.x * b.y - a.y * b.x });
const list = (v: Vec3): number[] => [v.x, v.y, v.z];

/** Returns R v. */
export function rotated({ w, ...axis }: Quat, v: Vec3): Vec3 {
  const c = cross(axis, v);
  const across = { x: 2 * c.x, y: 2 * c.y, z: 2 * c.z };
  const d = cross(axis, across);
  return { x: v.x + w * across.x + d.x, y: v.y + w * across.y + d.y, z: v.z + w * across.z + d.z };
}

/** Returns a primitive that is not hollow. */
function solidDistance(shape: Primitive, x: Vec3): number {
  switch (shape.kind) {
    case "plane":
      return dot(shape.normal, minus(x, shape.at));
    case "sphere":
      return norm(minus(x, shape.centre)) - shape.radius;
    case "capsule": {
      const axis = minus(shape.end, shape.start);
      const way = minus(x, shape.start);
      const squared = dot(axis, axis);
      const share = squared > 0 ? Math.min(Math.max(dot(way, axis) / squared, 0), 1) : 0;
      return norm({ x: way.x - share * axis.x, y: way.y - share * axis.y, z: way.z - share * axis.z }) - shape.radius;
    }
    case "box": {
      const { half, rounding = 0, turn = kIdentity } = shape;
      const local = rotated({ w: turn.w, x: -turn.x, y: -turn.y, z: -turn.z }, minus(x, shape.centre));
      const q = {
        x: Math.abs(local.x) - half.x + rounding, y: Math.abs(local.y) - half.y + rounding, z: Math.abs(local.z) - half.z + rounding,
      };
      const most = Math.max(q.x, q.y, q.z);
      return (most > 0 ? norm({ x: Math.max(q.x, 0), y: Math.max(q.y, 0), z: Math.max(q.z, 0) }) : most) - rounding;
    }
  }
}

/** Returns the signed distance in m. */
export function distanceTo(shape: Primitive, x: Vec3): number {
  const solid = solidDistance(shape, x);
  return shape.hollow === true ? -solid : solid;
}

export function centreOf(shape: Primitive): Vec3 {
  if (shape.kind === "plane") return shape.at;
  if (shape.kind !== "capsule") return shape.centre;
  const { start: a, end: b } = shape;
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, z: (a.z + b.z) / 2 };
}

/** Returns the numbers of a shape in a manifest. Throws a RangeError if one of them is out of bounds. */
export function numbersOf(shape: Primitive): number[] {
  const length = (name: string, value: number): number => {
    expect(value > 0 && value < Infinity, name, value, "a length above 0 m");
    return value;
  };
  const all = ((): number[] => {
    switch (shape.kind) {
      case "plane":
        expect(Math.abs(norm(shape.normal) - 1) <= kUnitTolerance, "normal", list(shape.normal), "a vector of length 1");
        return [...list(shape.at), ...list(shape.normal)];
      case "sphere":
        return [...list(shape.centre), length("radius", shape.radius)];
      case "capsule":
        return [...list(shape.start), ...list(shape.end), length("radius", shape.radius)];
      case "box": {
        const { half, rounding = 0, turn: { w, x, y, z } = kIdentity } = shape;
        const most = Math.min(...list(half));
        list(half).forEach((value) => length("half", value));
        expect(rounding >= 0 && rounding <= most, "rounding", rounding, `0 to ${most} m`);
        const one = Math.sqrt(w * w + x * x + y * y + z * z);
        expect(Math.abs(one - 1) <= kUnitTolerance, "turn", [w, x, y, z], "a quaternion of length 1");
        return [...list(shape.centre), ...list(half), rounding, w, x, y, z];
      }
    }
  })();
  expect(all.every(Number.isFinite), shape.kind, all, "finite numbers");
  return all;
}

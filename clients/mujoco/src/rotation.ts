// SPDX-License-Identifier: Apache-2.0
// Rotations as unit quaternions w, x, y, z, and as row-major matrices. The names are those of core/base/rotation.h.
import type { Quat } from "tendon-client";
import type { Triple } from "./contact_force.js";

export type Rotation = readonly [number, number, number, number];
/** 9 numbers, row-major. */
export type Matrix = readonly number[];

export const kNoTurn: Rotation = [1, 0, 0, 0];

/** Returns a b, which is the rotation b followed by a. */
export const product = ([a, b, c, d]: Rotation, [w, x, y, z]: Rotation): Rotation => [
  a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w,
];
export const inverse = ([w, x, y, z]: Rotation): Rotation => [w, -x, -y, -z];

export function unit(q: Rotation): Rotation {
  const length = Math.hypot(...q);
  return [q[0] / length, q[1] / length, q[2] / length, q[3] / length];
}

/** Returns the rotation about `vector` by its length in rad. */
export function rotationBy(vector: Triple): Rotation {
  const angle = Math.hypot(...vector);
  const share = angle > 0 ? Math.sin(angle / 2) / angle : 0.5;
  return [Math.cos(angle / 2), share * vector[0], share * vector[1], share * vector[2]];
}

/** Returns the rotation vector, whose norm is at most π. The result is the same for q and −q. */
export function rotationVector([w, x, y, z]: Rotation): Triple {
  const length = Math.hypot(x, y, z);
  if (length === 0) return [0, 0, 0];
  const share = (2 * Math.atan2(w < 0 ? -length : length, Math.abs(w))) / length;
  return [share * x, share * y, share * z];
}

export const times = (m: Matrix, [x, y, z]: Triple): Triple => [
  m[0]! * x + m[1]! * y + m[2]! * z, m[3]! * x + m[4]! * y + m[5]! * z, m[6]! * x + m[7]! * y + m[8]! * z,
];
export const transposed = (m: Matrix): Matrix => [0, 3, 6, 1, 4, 7, 2, 5, 8].map((at) => m[at]!);
export const matrixProduct = (a: Matrix, b: Matrix): Matrix =>
  Array.from({ length: 9 }, (_, at) => [0, 1, 2].reduce((sum, k) => sum + a[at - (at % 3) + k]! * b[3 * k + (at % 3)]!, 0));

export const matrixOf = ([w, x, y, z]: Rotation): Matrix => [
  1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
  2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
  2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
];

/** Converts a rotation matrix. The largest component is computed first (Shepperd, J. Guidance and Control 1(3), 1978).
 */
export function rotationOf(m: Matrix): Rotation {
  const [a, b, c] = [m[0]!, m[4]!, m[8]!];
  const squares = [1 + a + b + c, 1 + a - b - c, 1 - a + b - c, 1 - a - b + c]; // 4 w², 4 x², 4 y², 4 z²
  const largest = squares.indexOf(Math.max(...squares));
  const [yz, zx, xy] = [m[7]! - m[5]!, m[2]! - m[6]!, m[3]! - m[1]!];
  const [sxy, szx, syz] = [m[1]! + m[3]!, m[2]! + m[6]!, m[5]! + m[7]!];
  const s = squares[largest]!;
  const rows: readonly Rotation[] = [[s, yz, zx, xy], [yz, s, sxy, szx], [zx, sxy, s, syz], [xy, szx, syz, s]];
  return unit(rows[largest]!);
}

/**
 * Returns the closest symmetric matrix to `m` with eigenvalues in [0, most]: a passive spring. Undefined if `m` is
 * not finite. The eigenvalues are computed by Jacobi rotations.
 */
export function spring(m: Matrix, most: number): Matrix | undefined {
  if (!m.every(Number.isFinite)) return undefined;
  let left = m.map((value, at) => (value + transposed(m)[at]!) / 2) as Matrix;
  let axes: Matrix = [1, 0, 0, 0, 1, 0, 0, 0, 1]; // columns: m = axes · left · axesᵀ
  for (let sweep = 0; sweep < 12; ++sweep) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]] as const) {
      const off = left[3 * p + q]!;
      if (off === 0) continue;
      const angle = Math.atan2(2 * off, left[4 * q]! - left[4 * p]!) / 2;
      const [turn, cos, sin] = [[1, 0, 0, 0, 1, 0, 0, 0, 1], Math.cos(angle), Math.sin(angle)];
      [turn[4 * p], turn[3 * p + q], turn[3 * q + p], turn[4 * q]] = [cos, sin, -sin, cos];
      left = matrixProduct(transposed(turn), matrixProduct(left, turn));
      axes = matrixProduct(axes, turn);
    }
  }
  const clipped = [0, 0, 0, 0, 0, 0, 0, 0, 0];
  for (const at of [0, 4, 8]) clipped[at] = Math.min(Math.max(left[at]!, 0), most);
  const near = matrixProduct(axes, matrixProduct(clipped, transposed(axes)));
  return near.map((value, at) => (value + transposed(near)[at]!) / 2);
}

/**
 * Returns the rotation from the device frame to a scene in which z points up, x to the right of the operator, and y
 * away from the operator. `operatorFromDevice` is part of the HandleDescription (x right, y up, z to the operator). By
 * default, it is the identity.
 */
export function zUp(operatorFromDevice: Quat = { w: 1, x: 0, y: 0, z: 0 }): Matrix {
  const { w, x, y, z } = operatorFromDevice;
  return matrixProduct([1, 0, 0, 0, 0, -1, 0, 1, 0], matrixOf(unit([w, x, y, z])));
}

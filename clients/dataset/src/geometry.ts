// SPDX-License-Identifier: Apache-2.0
export type Vec3 = readonly [number, number, number];
/** A unit quaternion (Hamilton convention), w x y z. */
export type Quat = readonly [number, number, number, number];

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const less = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** M·u, for the rows of M. */
export const times = ([x, y, z]: readonly [Vec3, Vec3, Vec3], u: Vec3): Vec3 => [dot(x, u), dot(y, u), dot(z, u)];

export function product([a, b, c, d]: Quat, [w, x, y, z]: Quat): Quat {
  return [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w];
}

export const inverse = ([w, x, y, z]: Quat): Quat => [w, -x, -y, -z];

/** Returns q or −q, which is the same rotation. The result is closer to `other`. */
export function closer(q: Quat, other: Quat): Quat {
  const same = q.reduce((sum, value, i) => sum + value * other[i]!, 0) >= 0;
  return same ? q : [-q[0], -q[1], -q[2], -q[3]];
}

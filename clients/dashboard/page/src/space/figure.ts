// SPDX-License-Identifier: Apache-2.0
//
// Computes what the 3-D view draws for a state, without three.js or a browser.
import type { HandleInfo } from "../stream.js";
import type { Track } from "../track.js";

export type Vec = readonly [number, number, number];
/** A unit quaternion (Hamilton convention): w + x i + y j + z k. */
export type Quat = readonly [w: number, x: number, y: number, z: number];

const kNoTurn: Quat = [1, 0, 0, 0];

/** Returns a b: first b, then a. */
export function product(a: Quat, b: Quat): Quat {
  return [
    a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
    a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
    a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
    a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
  ];
}

export function rotated([w, x, y, z]: Quat, v: Vec): Vec {
  const [tx, ty, tz] = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
  return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx];
}

/** In the order of three.js: x, y, z, w. */
export const threeOrder = ([w, x, y, z]: Quat): [number, number, number, number] => [x, y, z, w];

/** One state of a device in its base frame. Quantities that are not measured or not received are undefined. */
export interface Pose {
  readonly position: Vec;
  readonly orientation?: Quat | undefined;
  /** N, applied and wanted. */
  readonly force?: Vec | undefined;
  readonly wanted?: Vec | undefined;
  /** N·m, applied. */
  readonly torque?: Vec | undefined;
  /** N, force of the hand on the handle. */
  readonly hand?: Vec | undefined;
  /** rad */
  readonly grip?: number | undefined;
  /** N, on the fingers. */
  readonly gripForce?: number | undefined;
  readonly buttons: number;
  readonly contact?: Contact | undefined;
  /** Of the rendered field, with the depth of the hand in m. */
  readonly proxy?: { readonly at: Vec; readonly depth: number } | undefined;
}

/** A flat surface. `gap`: m, distance of the tool along the normal; negative inside. */
export interface Contact {
  readonly normal: Vec;
  readonly gap: number;
}

const vec = (x: number, y: number, z: number): Vec | undefined => (Number.isFinite(x + y + z) ? [x, y, z] : undefined);

export function poseAt(track: Track, i: number): Pose | undefined {
  const base = (name: Parameters<Track["column"]>[0]): number => track.column(name)[i]!;
  const position = vec(base("x"), base("y"), base("z"));
  if (i < track.begin || i >= track.end || !position) return undefined;
  const held = (name: Parameters<Track["column"]>[0]): number => track.column(name)[i] ?? NaN;
  const number = (value: number): number | undefined => (Number.isFinite(value) ? value : undefined);
  const q: Quat = [held("qw"), held("qx"), held("qy"), held("qz")];
  const normal = vec(held("nx"), held("ny"), held("nz"));
  const gap = number(held("gap"));
  const [proxy, depth] = [vec(held("px"), held("py"), held("pz")), number(held("depth"))];
  return {
    position,
    orientation: q.every(Number.isFinite) ? q : undefined,
    force: vec(base("ax"), base("ay"), base("az")),
    wanted: vec(base("wx"), base("wy"), base("wz")),
    torque: vec(held("tx"), held("ty"), held("tz")),
    hand: vec(held("hx"), held("hy"), held("hz")),
    grip: number(held("grip")),
    gripForce: number(held("gripForce")),
    buttons: number(held("buttons")) ?? 0,
    contact: normal && gap !== undefined ? { normal, gap } : undefined,
    proxy: proxy && depth !== undefined ? { at: proxy, depth } : undefined,
  };
}

/** A pose in the operator frame: x right, y up, z to the viewer. Lengths in m. */
export interface Figure {
  readonly kind: "stylus" | "point";
  readonly position: Vec;
  /** In the order of three.js; rotates the handle frame to the operator frame. */
  readonly quaternion: readonly [number, number, number, number];
  readonly force: Vec | undefined;
  readonly wanted: Vec | undefined;
  readonly torque: Vec | undefined;
  readonly hand: Vec | undefined;
  /** rad between the fingers. */
  readonly opening: number | undefined;
  readonly gripForce: number | undefined;
  readonly buttons: readonly { readonly name: string; readonly held: boolean }[];
  /** The point of the surface closest to the handle, and its normal. */
  readonly plane: { readonly at: Vec; readonly normal: Vec; readonly gap: number } | undefined;
  readonly proxy: { readonly at: Vec; readonly depth: number } | undefined;
}

/** Without a `handle` or its frame, x is right, y up and z to the user. */
export function figureOf(pose: Pose, handle: HandleInfo | null | undefined): Figure {
  const frame = frameOf(handle);
  const turned = (v: Vec | undefined): Vec | undefined => v && rotated(frame, v);
  const names = [...(handle?.buttons ?? [])];
  for (let bit = names.length; bit < 32 && pose.buttons >>> bit !== 0; ++bit) names.push(`button ${bit}`);
  const position = rotated(frame, pose.position);
  const normal = turned(pose.contact?.normal);
  return {
    kind: pose.orientation ? "stylus" : "point",
    position,
    quaternion: threeOrder(pose.orientation ? product(frame, pose.orientation) : kNoTurn),
    force: turned(pose.force),
    wanted: turned(pose.wanted),
    torque: turned(pose.torque),
    hand: turned(pose.hand),
    opening: pose.grip,
    gripForce: pose.gripForce,
    buttons: names.map((name, bit) => ({ name: name || `button ${bit}`, held: ((pose.buttons >>> bit) & 1) === 1 })),
    plane: normal && {
      at: [0, 1, 2].map((k) => position[k]! - pose.contact!.gap * normal[k]!) as unknown as Vec,
      normal,
      gap: pose.contact!.gap,
    },
    proxy: pose.proxy && { at: rotated(frame, pose.proxy.at), depth: pose.proxy.depth },
  };
}

export const frameOf = (handle: HandleInfo | null | undefined): Quat => handle?.operator_from_device ?? kNoTurn;

/** Maximum fraction of a stiffness in other directions for which the surface counts as flat. */
const kFlat = 0.1;

/**
 * Returns the flat surface of an engine from its stiffness k n nᵀ and force k·depth·n. Returns undefined if the
 * stiffness has more than one direction, as for a point spring, or if there is no pushing force.
 */
export function contactOf(stiffness: readonly number[], force: Vec): Contact | undefined {
  if (stiffness.length !== 9 || !stiffness.every(Number.isFinite)) return undefined;
  const at = (row: number, column: number): number => (stiffness[3 * row + column]! + stiffness[3 * column + row]!) / 2;
  const k = at(0, 0) + at(1, 1) + at(2, 2);
  const most = [0, 1, 2].reduce((best, i) => (at(i, i) > at(best, best) ? i : best), 0);
  const row = [at(most, 0), at(most, 1), at(most, 2)];
  const length = Math.hypot(...row);
  if (!(k > 0) || !(length > 0)) return undefined;
  let n = row.map((v) => v / length) as unknown as Vec;
  let rest = 0;
  for (let i = 0; i < 3; ++i) for (let j = 0; j < 3; ++j) rest += (at(i, j) - k * n[i]! * n[j]!) ** 2;
  const push = force[0] * n[0] + force[1] * n[1] + force[2] * n[2];
  if (Math.sqrt(rest) > kFlat * k || !Number.isFinite(push) || push === 0) return undefined;
  if (push < 0) n = [-n[0], -n[1], -n[2]];
  return { normal: n, gap: -Math.abs(push) / k };
}

/**
 * Returns the rotation for "right=x up=y user=z" in the text of a scene, because recordings contain no device
 * description. Returns undefined if it is missing or not right-handed.
 */
export function frameOfScene(text: string): Quat | undefined {
  const words = /^\s*axes\s*=\s*["']([^"']*)["']/m.exec(text)?.[1];
  if (words === undefined) return undefined;
  const rows = ["right", "up", "user"].map((word): Vec | undefined => {
    const found = new RegExp(`(?:^|\\s)${word}=(-?)([xyz])(?:\\s|$)`).exec(words);
    if (!found) return undefined;
    const row = ["x", "y", "z"].map((axis) => (axis === found[2] ? (found[1] ? -1 : 1) : 0));
    return row as unknown as Vec;
  });
  const [right, up, user] = rows;
  if (!right || !up || !user) return undefined;
  const cross: Vec = [right[1] * up[2] - right[2] * up[1], right[2] * up[0] - right[0] * up[2], right[0] * up[1] - right[1] * up[0]];
  if (cross.some((v, i) => v !== user[i])) return undefined;
  return quatOfRows(right, up, user);
}

/** Converts a rotation matrix. Divides by the largest of four squares for accuracy. */
function quatOfRows(a: Vec, b: Vec, c: Vec): Quat {
  const squares = [1 + a[0] + b[1] + c[2], 1 + a[0] - b[1] - c[2], 1 - a[0] + b[1] - c[2], 1 - a[0] - b[1] + c[2]];
  const largest = squares.indexOf(Math.max(...squares));
  const s = 2 * Math.sqrt(squares[largest]!);
  const q = [
    [s / 4, (c[1] - b[2]) / s, (a[2] - c[0]) / s, (b[0] - a[1]) / s],
    [(c[1] - b[2]) / s, s / 4, (a[1] + b[0]) / s, (a[2] + c[0]) / s],
    [(a[2] - c[0]) / s, (a[1] + b[0]) / s, s / 4, (b[2] + c[1]) / s],
    [(b[0] - a[1]) / s, (a[2] + c[0]) / s, (b[2] + c[1]) / s, s / 4],
  ][largest]!;
  return q as unknown as Quat;
}

/** `patches`: the number of places of the surface that were touched. */
export function wordsOf(figure: Figure, patches = 0): string {
  const parts: string[] = [figure.kind === "stylus" ? "a stylus" : "a point"];
  const some = (v: Vec | undefined, least: number): boolean => v !== undefined && Math.hypot(...v) > least;
  if (some(figure.force, kLeastForce)) parts.push("a force");
  if (some(figure.wanted, kLeastForce)) parts.push("a wanted force");
  if (some(figure.torque, kLeastTorque)) parts.push("a torque");
  if (some(figure.hand, kLeastForce)) parts.push("the hand's force");
  if (figure.opening !== undefined) parts.push("two fingers");
  if (figure.plane) parts.push("a surface");
  if (figure.proxy) parts.push("a proxy");
  if (patches > 0) parts.push("the touched surface");
  for (const button of figure.buttons) if (button.held) parts.push(`${button.name} held`);
  return parts.join(", ");
}

/** N and N·m. Arrows below this limit are not drawn because they would flicker. */
export const kLeastForce = 0.01;
export const kLeastTorque = 0.0005;

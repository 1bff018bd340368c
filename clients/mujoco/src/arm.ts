// SPDX-License-Identifier: Apache-2.0
import loadMujoco, { type DoubleBuffer, type MainModule, type MjData, type MjModel } from "@mujoco/mujoco";
import type { Pose, ToolContact } from "tendon-client";
import { ContactForce, type Triple } from "./contact_force.js";
import { loadModel } from "./load.js";
import { inverse, product, rotationOf, rotationVector } from "./rotation.js";

/** λ of the damped least squares. It limits the joint speeds near singular configurations. */
const kDamping = 0.05;
/** The limits of the error that is passed to the servos, m and rad. They limit the force of an arm that is blocked. */
const kMostWay = 0.05;
const kMostTurn = 0.3;
/** The maximum number of steps per call, so that the arm does not jump after a pause of the program. */
const kMostSteps = 50;

/** Solves a · x = b for a symmetric, positive definite `a` with n rows by Gaussian elimination without pivoting. */
function solve(a: Float64Array, b: Float64Array): Float64Array {
  const n = b.length;
  for (let i = 0; i < n; ++i) {
    for (let row = i + 1; row < n; ++row) {
      const share = a[row * n + i]! / a[i * n + i]!;
      for (let k = i; k < n; ++k) a[row * n + k]! -= share * a[i * n + k]!;
      b[row]! -= share * b[i]!;
    }
  }
  for (let i = n - 1; i >= 0; --i) {
    for (let k = i + 1; k < n; ++k) b[i]! -= a[i * n + k]! * b[k]!;
    b[i]! /= a[i * n + i]!;
  }
  return b;
}

/**
 * A robot arm in MuJoCo with the interface required for a Follower: pose(), goTo(), hold(), contact(). The joints are
 * those of the scene, each with a position servo (`<position>`, in the same order). The tool is a site, and contacts
 * are those of its body. The servo targets are computed by damped least squares:
 *
 *     q_wanted = q + Jᵀ (J Jᵀ + λ² I)⁻¹ e        e: bounded position and rotation error of the tool
 *
 * so a blocked tool pushes only with the stiffness of the servos. The memory belongs to WebAssembly; free it with
 * delete().
 */
export class Arm {
  readonly #mj: MainModule;
  readonly #model: MjModel;
  readonly #data: MjData;
  readonly #site: number;
  readonly #contacts: ContactForce;
  readonly #jacobian: readonly [DoubleBuffer, DoubleBuffer];
  #goal: Pose;
  #holds = true;
  /** The elapsed time that has not been simulated yet, s. */
  #due = 0;

  static async load(mjcf: string, site: string): Promise<Arm> {
    const mj = await loadMujoco();
    const model = loadModel(mj, mjcf, {}, (text) => console.error(`MuJoCo scene: ${text}`));
    try {
      return new Arm(mj, model, site);
    } catch (error) {
      model.delete();
      throw error;
    }
  }

  private constructor(mj: MainModule, model: MjModel, site: string) {
    [this.#mj, this.#model] = [mj, model];
    this.#site = mj.mj_name2id(model, mj.mjtObj.mjOBJ_SITE.value, site);
    if (this.#site < 0) throw new Error(`MuJoCo scene: expected a site "${site}", found none`);
    if (model.nu !== model.nv || model.nq !== model.nv)
      throw new Error(`MuJoCo scene: expected one servo for each of ${model.nv} hinges or slides, found ${model.nu}`);
    const body: number = model.site_bodyid[this.#site];
    const geoms = Array.from({ length: model.ngeom }, (_, geom) => geom).filter((geom) => model.geom_bodyid[geom] === body);
    this.#contacts = new ContactForce(mj, model, geoms);
    this.#data = new mj.MjData(model);
    this.#jacobian = [new mj.DoubleBuffer(3 * model.nv), new mj.DoubleBuffer(3 * model.nv)];
    if (model.nkey > 0) mj.mj_resetDataKeyframe(model, this.#data, 0);
    mj.mj_forward(model, this.#data);
    this.#goal = this.pose();
  }

  /** Pose of the tool in the frame of the scene. */
  pose(): Pose {
    const [at, turned] = [this.#data.site_xpos, this.#data.site_xmat]; // these views are invalid if the heap has grown
    const matrix = Array.from({ length: 9 }, (_, i) => turned[9 * this.#site + i] as number);
    const [w, x, y, z] = rotationOf(matrix);
    return { position: { x: at[3 * this.#site], y: at[3 * this.#site + 1], z: at[3 * this.#site + 2] }, orientation: { w, x, y, z } };
  }

  goTo(goal: Pose): void {
    [this.#goal, this.#holds] = [goal, false];
  }

  /** Holds the pose that the arm has at the first call. */
  hold(): void {
    if (!this.#holds) [this.#goal, this.#holds] = [this.pose(), true];
  }

  /** Returns the force on the tool (N) in the newest step, in the frame of the scene. */
  contact(): ToolContact {
    const [x, y, z] = this.#contacts.on(this.#data);
    return { force: { x, y, z } };
  }

  /** Simulates `seconds`. The remainder of a step is carried over to the next call. */
  advance(seconds: number): void {
    const step: number = this.#model.opt.timestep;
    this.#due = Math.min(this.#due + seconds, kMostSteps * step);
    if (this.#due < step) return;
    this.#lead();
    for (; this.#due >= step; this.#due -= step) this.#mj.mj_step(this.#model, this.#data);
  }

  delete(): void {
    this.#jacobian.forEach((buffer) => buffer.delete());
    this.#contacts.delete();
    this.#data.delete();
    this.#model.delete();
  }

  #error(): Float64Array {
    const { position: p, orientation: q } = this.pose();
    const { position: to, orientation: turned = q } = this.#goal;
    const way: Triple = [to.x - p.x, to.y - p.y, to.z - p.z];
    const back = inverse([q!.w, q!.x, q!.y, q!.z]);
    const turn = rotationVector(product([turned!.w, turned!.x, turned!.y, turned!.z], back));
    const part = Math.min(1, kMostWay / Math.hypot(...way)); // without an error, most / 0 is infinite and this is 1
    const share = Math.min(1, kMostTurn / Math.hypot(...turn));
    return Float64Array.from([...way.map((c) => part * c), ...turn.map((c) => share * c)]);
  }

  #lead(): void {
    const n: number = this.#model.nv;
    this.#mj.mj_jacSite(this.#model, this.#data, this.#jacobian[0], this.#jacobian[1], this.#site);
    const j = new Float64Array(6 * n); // 6 × n, row-major
    this.#jacobian.forEach((buffer, half) => j.set(buffer.GetView(), 3 * n * half));
    const a = new Float64Array(36);
    for (let row = 0; row < 6; ++row) {
      for (let column = 0; column < 6; ++column)
        for (let k = 0; k < n; ++k) a[6 * row + column]! += j[row * n + k]! * j[column * n + k]!;
      a[7 * row]! += kDamping ** 2;
    }
    const e = solve(a, this.#error());
    const [ctrl, q] = [this.#data.ctrl, this.#data.qpos];
    for (let k = 0; k < n; ++k) ctrl[k] = q[k] + e.reduce((sum, value, row) => sum + j[row * n + k]! * value, 0);
  }
}

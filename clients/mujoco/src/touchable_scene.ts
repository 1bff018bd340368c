// SPDX-License-Identifier: Apache-2.0
import loadMujoco, { type MainModule, type MjData, type MjModel } from "@mujoco/mujoco";
import type { DeviceState, Quat, Touch, Vec3 } from "tendon-client";
import { ContactForce, type Triple } from "./contact_force.js";
import { loadModel, type Assets } from "./load.js";
import {
  inverse, matrixProduct, product, rotationBy, rotationOf, rotationVector, times, transposed, unit, type Matrix, type Rotation,
} from "./rotation.js";
import { toolOf, type Coupling, type Pose, type Tool } from "./tool.js";

export interface SceneConfig {
  /**
   * Name of the body that the hand holds; it must have a geom. Its pose in the scene corresponds to the origin of the
   * device and to an unrotated handle. A body with mocap="true" follows the position of the hand. A body with a
   * <freejoint/> is held by a virtual coupling: it rotates with the handle, and torque, stiffness and angular
   * stiffness are sent as well (see tool.ts).
   */
  readonly tool: string;
  /** The stiffness of the coupling if the tool is held. Default: 1000 N/m and 2 N·m/rad. */
  readonly coupling?: Partial<Coupling>;
  /** For a held tool. Each answer then needs 14 evaluations without collision detection. Default: true. */
  readonly sendStiffness?: boolean;
  /** Rotation from device frame to scene frame, row-major. Default: identity. See zUp() for scenes with z up. */
  readonly rotation?: readonly number[];
  /**
   * m/s, maximum speed of the tool. Otherwise a jump of the hand (at the start, or after a gap) could put it deep
   * into a body within one step. Default: 1, which is faster than a hand in contact.
   */
  readonly maxToolSpeed?: number;
  /** The maximum angular speed of the tool, rad/s. Default: 20. */
  readonly maxToolSpin?: number;
  /** The maximum number of steps per answer. If more are due, simulated time falls behind. Default: 20. */
  readonly maxSteps?: number;
  readonly assets?: Assets;
  /** This is called with warnings about the scene and the simulation. Default: console.warn. */
  readonly onWarning?: (text: string) => void;
}

export interface SceneStats {
  readonly answers: number;
  readonly steps: number;
  /** The number of positions that were not finite or whose orientation was invalid. They were not simulated. */
  readonly badPositions: number;
  /** The number of answers in which the hand was too fast (maxToolSpeed, maxToolSpin), so that the tool lagged. */
  readonly lagging: number;
  /** The number of times that the scene was reset because MuJoCo had lost the solution. */
  readonly restarts: number;
  /** The number of answers in which some contacts are missing, because MuJoCo did not have enough memory. */
  readonly incomplete: number;
  /** The time of the hand that was not simulated because of maxSteps, s. */
  readonly behind: number;
}

const kIdentity = [1, 0, 0, 0, 1, 0, 0, 0, 1];
/** This force is not sent by ForceClient, because it is better to send no force than a wrong one. */
const kNoTouch: Touch = { force: { x: NaN, y: NaN, z: NaN } };

function checkRotation(r: readonly number[]): readonly number[] {
  const dot = (i: number, j: number): number => r[3 * i]! * r[3 * j]! + r[3 * i + 1]! * r[3 * j + 1]! + r[3 * i + 2]! * r[3 * j + 2]!;
  const volume = r.length !== 9 ? NaN : r[0]! * (r[4]! * r[8]! - r[5]! * r[7]!) - r[1]! * (r[3]! * r[8]! - r[5]! * r[6]!) +
    r[2]! * (r[3]! * r[7]! - r[4]! * r[6]!);
  const off = Math.max(...[0, 1, 2].map((i) => Math.abs(dot(i, i) - 1)), ...[0, 1, 2].map((i) => Math.abs(dot(i, (i + 1) % 3))));
  if (off < 1e-6 && volume > 0) return r;
  throw new RangeError(`rotation: expected 9 numbers, a rotation row by row, got [${r.join(", ")}]`);
}

function positive(name: string, value: number): number {
  if (value > 0 && Number.isFinite(value)) return value;
  throw new RangeError(`${name}: expected a number > 0, got ${value}`);
}

/**
 * A MuJoCo scene that a hand can touch, for use as the callback of connect() or run().
 *
 *     const scene = await TouchableScene.load(mjcf, { tool: "tool" });
 *     process.exitCode = await run(options, scene);
 *
 * The tool follows the hand, the scene is simulated for the time elapsed at the device, and the force on the tool is
 * returned. Errors that MuJoCo would not report are rejected in load() or result in a warning without a force
 * (README.md). The memory belongs to WebAssembly; free it with delete().
 */
export class TouchableScene {
  /** Provides access to MuJoCo and the scene for other uses, such as actuators, additional bodies or rendering. */
  readonly mujoco: MainModule;
  readonly model: MjModel;
  readonly data: MjData;
  readonly #config: Required<Pick<SceneConfig, "maxToolSpeed" | "maxToolSpin" | "maxSteps" | "onWarning">>;
  readonly #timestep: number;
  readonly #frame: Matrix;
  readonly #turned: Rotation;
  readonly #tool: Tool;
  /** Returns the last pose of the tool. */
  #led: Pose;
  readonly #stats = { answers: 0, steps: 0, badPositions: 0, lagging: 0, restarts: 0, incomplete: 0, behind: 0 };
  #sampledNs: bigint | undefined;
  /** The elapsed time that has not been simulated yet, s. */
  #due = 0;
  #touch: Touch | undefined;
  /** Returns how many warnings were issued by MuJoCo for each mjtWarning. */
  #warned: readonly number[];

  /** Throws an Error if the scene is invalid, a RangeError if `config` is invalid. */
  static async load(mjcf: string, config: SceneConfig): Promise<TouchableScene> {
    const mujoco = await loadMujoco();
    const onWarning = config.onWarning ?? ((text) => console.warn(`MuJoCo scene: ${text}`));
    const model = loadModel(mujoco, mjcf, config.assets ?? {}, onWarning);
    try {
      return new TouchableScene(mujoco, model, { ...config, onWarning });
    } catch (error) {
      model.delete();
      throw error;
    }
  }

  private constructor(mujoco: MainModule, model: MjModel, config: SceneConfig & { readonly onWarning: (text: string) => void }) {
    [this.mujoco, this.model] = [mujoco, model];
    this.#config = {
      maxToolSpeed: positive("maxToolSpeed", config.maxToolSpeed ?? 1),
      maxToolSpin: positive("maxToolSpin", config.maxToolSpin ?? 20),
      maxSteps: Math.ceil(positive("maxSteps", config.maxSteps ?? 20)),
      onWarning: config.onWarning,
    };
    this.#frame = checkRotation(config.rotation ?? kIdentity);
    this.#turned = rotationOf(this.#frame);
    this.#timestep = model.opt.timestep;
    const body = this.#body(config.tool);
    this.data = new mujoco.MjData(model);
    try {
      this.#tool = toolOf(mujoco, model, this.data, body, config.tool, this.#geomsOf(body), {
        stiffness: positive("coupling.stiffness", config.coupling?.stiffness ?? 1000),
        angularStiffness: positive("coupling.angularStiffness", config.coupling?.angularStiffness ?? 2),
      }, config.sendStiffness ?? true);
    } catch (error) {
      this.data.delete();
      throw error;
    }
    this.#led = this.#tool.home;
    this.#warned = this.#warnings();
  }

  readonly physics = (hand: DeviceState): Touch => {
    const before = this.#sampledNs ?? hand.sampledNs;
    this.#sampledNs = hand.sampledNs; // a restarted server has a new time origin
    const elapsed = Math.max(Number(hand.sampledNs - before) / 1e9, 0);
    return this.touch(hand.position, elapsed, hand.turning?.orientation) ?? kNoTouch;
  };

  /** Returns the force of touch(), N. */
  answer(position: Vec3, elapsed: number, orientation?: Quat): Vec3 | undefined {
    return this.touch(position, elapsed, orientation)?.force;
  }

  /**
   * Returns the force on the hand in the device frame. The hand is at `position` (m) with `orientation`, `elapsed` s
   * after the last call. The tool moves there at constant velocity during the simulated steps (one step in the first
   * call). A held tool also returns a torque if the hand has an orientation. Returns undefined and calls onWarning if
   * there is no reliable force.
   */
  touch(position: Vec3, elapsed: number, orientation?: Quat): Touch | undefined {
    const hand = [position.x, position.y, position.z] as const;
    const { w, x, y, z } = orientation ?? { w: 1, x: 0, y: 0, z: 0 };
    const isTurn = Math.abs(Math.hypot(w, x, y, z) - 1) <= 1e-3;
    // MuJoCo silently treats a tool at NaN or 1e30 as not in contact.
    if (!hand.every((value) => Math.abs(value) < this.mujoco.mjMAXVAL) || !isTurn || !(elapsed >= 0 && Number.isFinite(elapsed))) {
      const turned = isTurn ? "" : `, turned by (${[w, x, y, z].join(", ")}),`;
      this.#tell(++this.#stats.badPositions, `a hand at (${hand.join(", ")}) m,${turned} ${elapsed} s later, is not a valid position: not computed`);
      return undefined;
    }
    const steps = this.#stepsFor(elapsed);
    if (steps === 0) return this.#touch;
    this.#advance(this.#toScene(hand, unit([w, x, y, z])), steps);
    this.#stats.steps += steps;
    const lost = this.#lost();
    const touch = lost || this.#isIncomplete() ? undefined : this.#felt(orientation !== undefined);
    if (lost) {
      this.#tell(++this.#stats.restarts, `the simulation has become invalid (${lost}): no force, and the scene is reset`);
      this.#restart();
    }
    if (touch) ++this.#stats.answers;
    return (this.#touch = touch);
  }

  /** Returns the sum of all contact forces on a body (N) in the newest step, in the frame of the scene. */
  contactForce(body: string): Vec3 {
    const reader = new ContactForce(this.mujoco, this.model, this.#geomsOf(this.#body(body)));
    const [x, y, z] = reader.on(this.data);
    reader.delete();
    return { x, y, z };
  }

  /** Returns a copy. */
  stats(): SceneStats {
    return { ...this.#stats };
  }

  delete(): void {
    this.#tool.delete();
    this.data.delete();
    this.model.delete();
  }

  #body(name: string): number {
    const id: number = this.mujoco.mj_name2id(this.model, this.mujoco.mjtObj.mjOBJ_BODY.value, name);
    if (id < 0) throw new Error(`MuJoCo scene: expected a body "${name}", found none`);
    return id;
  }

  #geomsOf(body: number): number[] {
    return Array.from({ length: this.model.ngeom }, (_, geom) => geom).filter((geom) => this.model.geom_bodyid[geom] === body);
  }

  /** Returns the number of whole steps. The remainder is carried over to the next call. */
  #stepsFor(elapsed: number): number {
    const { steps, restarts } = this.#stats;
    this.#due += steps === 0 && restarts === 0 ? Math.max(elapsed, this.#timestep) : elapsed;
    const due = Math.floor(this.#due / this.#timestep + 1e-6);
    const done = Math.min(due, this.#config.maxSteps);
    if (due > done && this.#stats.behind === 0)
      this.#config.onWarning(`more than maxSteps = ${this.#config.maxSteps} steps were due for one answer: the simulation is slower than real time`);
    this.#stats.behind += (due - done) * this.#timestep;
    this.#due = Math.max(this.#due - due * this.#timestep, 0);
    return done;
  }

  #toScene(hand: Triple, turn: Rotation): Pose {
    const { at, turn: home } = this.#tool.home;
    const way = times(this.#frame, hand);
    const turned = product(product(this.#turned, turn), inverse(this.#turned));
    return { at: [at[0] + way[0], at[1] + way[1], at[2] + way[2]], turn: product(turned, home) };
  }

  #advance(hand: Pose, steps: number): void {
    const { maxToolSpeed, maxToolSpin } = this.#config;
    const from = this.#led;
    const way = from.at.map((at, i) => hand.at[i]! - at) as never as Triple;
    const spin = rotationVector(product(hand.turn, inverse(from.turn)));
    const time = steps * this.#timestep;
    // If there is no displacement, reach / 0 is infinite and this is 1.
    const share = Math.min(1, (maxToolSpeed * time) / Math.hypot(...way), (maxToolSpin * time) / Math.hypot(...spin));
    if (share < 1)
      this.#tell(++this.#stats.lagging, `the hand is faster than ${maxToolSpeed} m/s or ${maxToolSpin} rad/s: the tool lags behind the hand`);
    for (let step = 1; step <= steps; ++step) {
      const part = share * (step / steps);
      const turn = unit(product(rotationBy([part * spin[0], part * spin[1], part * spin[2]]), from.turn));
      this.#led = { at: [from.at[0] + way[0] * part, from.at[1] + way[1] * part, from.at[2] + way[2] * part], turn };
      this.#tool.lead(this.#led, this.#timestep);
      this.mujoco.mj_step(this.model, this.data);
    }
  }

  #warnings(): number[] {
    const all = this.data.warning; // owned by MuJoCo, unlike data.contact; deleting it would crash
    return Array.from({ length: all.size() }, (_, i) => {
      const one = all.get(i)!; // a copy
      const { number } = one;
      one.delete();
      return number;
    });
  }

  /** Returns an error message or an empty string. MuJoCo itself only counts the error and restarts at time 0. */
  #lost(): string {
    const now = this.#warnings();
    const kinds = this.mujoco.mjtWarning;
    const bad = ["mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC"] as const;
    const told = bad.filter((kind) => now[kinds[kind].value]! > this.#warned[kinds[kind].value]!);
    return told.map((kind) => kind.replace("mjWARN_", "")).join(", ");
  }

  #isIncomplete(): boolean {
    const now = this.#warnings();
    const { mjWARN_CONTACTFULL: contacts, mjWARN_CNSTRFULL: constraints } = this.mujoco.mjtWarning;
    const full = [contacts.value, constraints.value].some((kind) => now[kind]! > this.#warned[kind]!);
    this.#warned = now;
    if (full)
      this.#tell(++this.#stats.incomplete, `MuJoCo has not enough memory for all contacts: no force. Use <size memory="200M"/>`);
    return full;
  }

  #restart(): void {
    this.mujoco.mj_resetData(this.model, this.data);
    this.#tool.restart();
    this.#led = this.#tool.home;
    this.#warned = this.#warnings();
  }

  /** If the hand does not have an orientation, there is no torque. */
  #felt(turns: boolean): Touch {
    const { force, torque, stiffness, angularStiffness, validRadius } = this.#tool.felt();
    return {
      force: this.#toDevice(force),
      stiffness: stiffness && this.#springToDevice(stiffness),
      validRadius,
      torque: turns && torque ? this.#toDevice(torque) : undefined,
      angularStiffness: turns && angularStiffness ? this.#springToDevice(angularStiffness) : undefined,
    };
  }

  #toDevice(v: Triple): Vec3 {
    const [x, y, z] = times(transposed(this.#frame), v);
    return { x, y, z };
  }

  #springToDevice(k: Matrix): Matrix {
    return matrixProduct(transposed(this.#frame), matrixProduct(k, this.#frame));
  }

  /** Warns at the 1st, 2nd, 4th, 8th … time. */
  #tell(times: number, text: string): void {
    if (Number.isInteger(Math.log2(times))) this.#config.onWarning(times === 1 ? text : `${text} (${times} times so far)`);
  }
}

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
   * Name of the body that the hand holds, with a geom. Where and how the scene puts it is where the device's origin is, and how
   * a handle lies that is not turned. With mocap="true" the hand leads it: a point. With a <freejoint/> a virtual coupling holds it:
   * it turns with the handle, and torque, stiffness and angular stiffness are sent besides (tool.ts has the law).
   */
  readonly tool: string;
  /** Of a held tool: 1000 N/m and 2 N·m/rad. */
  readonly coupling?: Partial<Coupling>;
  /** Of a held tool: it is found by 14 evaluations of the scene at each answer, without its collisions. true. */
  readonly sendStiffness?: boolean;
  /** Device frame to scene frame: a rotation, row by row. The identity; zUp() is for scenes whose z points up. */
  readonly rotation?: readonly number[];
  /**
   * m/s. The tool follows the hand no faster: a hand that comes from nowhere (at the start, after a gap, by mistake) would be
   * deep inside a body from one step to the next. 1: faster than hands are in contact.
   */
  readonly maxToolSpeed?: number;
  /** rad/s, likewise. 20. */
  readonly maxToolSpin?: number;
  /** Steps for one answer; where more are due, simulated time falls behind, and the hand is not made to wait. 20. */
  readonly maxSteps?: number;
  /** Files that the scene names. */
  readonly assets?: Assets;
  /** Hears what is doubtful in the scene, and what goes wrong while it runs. console.warn. */
  readonly onWarning?: (text: string) => void;
}

export interface SceneStats {
  /** Forces that were given. */
  readonly answers: number;
  /** Of MuJoCo. */
  readonly steps: number;
  /** Positions that were no numbers, orientations that were no rotations: nothing was computed. */
  readonly badPositions: number;
  /** Answers in which the hand was faster than maxToolSpeed or maxToolSpin: the force is that at the tool, which lags. */
  readonly lagging: number;
  /** MuJoCo lost the solution; the scene began anew. */
  readonly restarts: number;
  /** MuJoCo ran out of memory and left contacts out. */
  readonly incomplete: number;
  /** s of the hand's time that were not simulated, because maxSteps is less than what was due. */
  readonly behind: number;
}

const kIdentity = [1, 0, 0, 0, 1, 0, 0, 0, 1];
/** A force that ForceClient counts and does not send: to have none is better than to have a wrong one. */
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
 * A MuJoCo scene that a hand can touch: hand it to connect() or run() as the callback.
 *
 *     const scene = await TouchableScene.load(mjcf, { tool: "tool" });
 *     process.exitCode = await run(options, scene);
 *
 * The tool follows the hand, the scene is stepped by as much time as has passed at the device, and what the tool feels goes
 * back. What MuJoCo would get wrong without a word is refused at load (an Error), or comes as no force
 * and a warning: README.md lists it. Memory is WebAssembly's: delete() frees it.
 */
export class TouchableScene {
  /** MuJoCo itself and the scene in it, for what else a scene needs: actuators, more bodies, a picture. */
  readonly mujoco: MainModule;
  readonly model: MjModel;
  readonly data: MjData;
  readonly #config: Required<Pick<SceneConfig, "maxToolSpeed" | "maxToolSpin" | "maxSteps" | "onWarning">>;
  readonly #timestep: number;
  /** Device to scene. */
  readonly #frame: Matrix;
  readonly #turned: Rotation;
  readonly #tool: Tool;
  /** Where the tool was led last. */
  #led: Pose;
  readonly #stats = { answers: 0, steps: 0, badPositions: 0, lagging: 0, restarts: 0, incomplete: 0, behind: 0 };
  #sampledNs: bigint | undefined;
  /** s that have passed and were not simulated yet: less than a step. */
  #due = 0;
  #touch: Touch | undefined;
  /** How often MuJoCo has warned, by mjtWarning. */
  #warned: readonly number[];

  /** Throws an Error that says what in the scene is wrong, a RangeError for an impossible `config`. */
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

  /** The callback of connect() and run(). */
  readonly physics = (hand: DeviceState): Touch => {
    const before = this.#sampledNs ?? hand.sampledNs;
    this.#sampledNs = hand.sampledNs; // a server that was restarted counts from another beginning
    const elapsed = Math.max(Number(hand.sampledNs - before) / 1e9, 0);
    return this.touch(hand.position, elapsed, hand.turning?.orientation) ?? kNoTouch;
  };

  /** The force of touch(), N. */
  answer(position: Vec3, elapsed: number, orientation?: Quat): Vec3 | undefined {
    return this.touch(position, elapsed, orientation)?.force;
  }

  /**
   * What the hand feels, in the device's frame: it is at `position` (m) and turned by `orientation`, `elapsed` s after the last
   * call. The tool goes there in a line, turning about one axis, while the scene is stepped; at the first call by one step. A held
   * tool gives torque, too, and only for a hand with an orientation. Undefined where there is no force that could be believed;
   * onWarning has heard why.
   */
  touch(position: Vec3, elapsed: number, orientation?: Quat): Touch | undefined {
    const hand = [position.x, position.y, position.z] as const;
    const { w, x, y, z } = orientation ?? { w: 1, x: 0, y: 0, z: 0 };
    const isTurn = Math.abs(Math.hypot(w, x, y, z) - 1) <= 1e-3;
    // MuJoCo takes NaN and 1e30 for a tool that touches nothing, and says nothing.
    if (!hand.every((value) => Math.abs(value) < this.mujoco.mjMAXVAL) || !isTurn || !(elapsed >= 0 && Number.isFinite(elapsed))) {
      const turned = isTurn ? "" : `, turned by (${[w, x, y, z].join(", ")}),`;
      this.#tell(++this.#stats.badPositions, `a hand at (${hand.join(", ")}) m,${turned} ${elapsed} s later, is nowhere: not computed`);
      return undefined;
    }
    const steps = this.#stepsFor(elapsed);
    if (steps === 0) return this.#touch;
    this.#advance(this.#toScene(hand, unit([w, x, y, z])), steps);
    this.#stats.steps += steps;
    const lost = this.#lost();
    const touch = lost || this.#isIncomplete() ? undefined : this.#felt(orientation !== undefined);
    if (lost) {
      this.#tell(++this.#stats.restarts, `MuJoCo lost the solution (${lost}): no force, and the scene begins anew`);
      this.#restart();
    }
    if (touch) ++this.#stats.answers;
    return (this.#touch = touch);
  }

  /** N, in the scene's frame: what all contacts together exert on a body, as of the newest step. */
  contactForce(body: string): Vec3 {
    const reader = new ContactForce(this.mujoco, this.model, this.#geomsOf(this.#body(body)));
    const [x, y, z] = reader.on(this.data);
    reader.delete();
    return { x, y, z };
  }

  /** As it is now; it does not change any more. */
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
    if (id < 0) throw new Error(`MuJoCo scene: it has no body "${name}"`);
    return id;
  }

  #geomsOf(body: number): number[] {
    return Array.from({ length: this.model.ngeom }, (_, geom) => geom).filter((geom) => this.model.geom_bodyid[geom] === body);
  }

  /** Whole steps; what is left of a step waits for the next call. */
  #stepsFor(elapsed: number): number {
    const { steps, restarts } = this.#stats;
    this.#due += steps === 0 && restarts === 0 ? Math.max(elapsed, this.#timestep) : elapsed;
    const due = Math.floor(this.#due / this.#timestep + 1e-6);
    const done = Math.min(due, this.#config.maxSteps);
    if (due > done && this.#stats.behind === 0)
      this.#config.onWarning(`more than maxSteps = ${this.#config.maxSteps} were due for one answer: simulated time falls behind`);
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
    // 1 where there is no way: reach / 0
    const share = Math.min(1, (maxToolSpeed * time) / Math.hypot(...way), (maxToolSpin * time) / Math.hypot(...spin));
    if (share < 1)
      this.#tell(++this.#stats.lagging, `the hand is faster than ${maxToolSpeed} m/s or ${maxToolSpin} rad/s: the tool lags behind it`);
    for (let step = 1; step <= steps; ++step) {
      const part = share * (step / steps);
      const turn = unit(product(rotationBy([part * spin[0], part * spin[1], part * spin[2]]), from.turn));
      this.#led = { at: [from.at[0] + way[0] * part, from.at[1] + way[1] * part, from.at[2] + way[2] * part], turn };
      this.#tool.lead(this.#led, this.#timestep);
      this.mujoco.mj_step(this.model, this.data);
    }
  }

  #warnings(): number[] {
    const all = this.data.warning; // MuJoCo's own, unlike data.contact: to delete it would end the program
    return Array.from({ length: all.size() }, (_, i) => {
      const one = all.get(i)!; // a copy
      const { number } = one;
      one.delete();
      return number;
    });
  }

  /** Why the state is none, in words; empty: it is one. MuJoCo, which begins at time 0 then, says it by these numbers only. */
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
      this.#tell(++this.#stats.incomplete, `MuJoCo has no room for all contacts: no force. <size memory="200M"/> gives it more`);
    return full;
  }

  #restart(): void {
    this.mujoco.mj_resetData(this.model, this.data);
    this.#tool.restart();
    this.#led = this.#tool.home;
    this.#warned = this.#warnings();
  }

  /** Of a hand without an orientation nobody can use the torque. */
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

  /** The 1st, 2nd, 4th, 8th … time. */
  #tell(times: number, text: string): void {
    if (Number.isInteger(Math.log2(times))) this.#config.onWarning(times === 1 ? text : `${text} (${times} times so far)`);
  }
}

// SPDX-License-Identifier: Apache-2.0
import loadMujoco, { type MainModule, type MjData, type MjModel } from "@mujoco/mujoco";
import type { DeviceState, Vec3 } from "tendon-client";
import { ContactForce, type Triple } from "./contact_force.js";
import { loadModel, type Assets } from "./load.js";

export interface SceneConfig {
  /** Name of the body that the hand holds: a mocap body with a geom. Where the scene puts it is where the device's origin is. */
  readonly tool: string;
  /** Device frame to scene frame: a rotation, row by row. The identity. */
  readonly rotation?: readonly number[];
  /**
   * m/s. The tool follows the hand no faster: a hand that comes from nowhere (at the start, after a gap, by mistake) would be
   * deep inside a body from one step to the next. 1: faster than hands are in contact.
   */
  readonly maxToolSpeed?: number;
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
  /** Positions that were no numbers: nothing was computed. */
  readonly badPositions: number;
  /** Answers in which the hand was faster than maxToolSpeed: the force is that at the tool, which lags. */
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
const kNoForce: Vec3 = { x: NaN, y: NaN, z: NaN };

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
 * The tool follows the hand, the scene is stepped by as much time as has passed at the device, and the sum of the contact
 * forces on the tool goes back. What MuJoCo would get wrong without a word is refused at load (an Error), or comes as no force
 * and a warning: README.md lists it. Memory is WebAssembly's: delete() frees it.
 */
export class TouchableScene {
  /** MuJoCo itself and the scene in it, for what else a scene needs: actuators, more bodies, a picture. */
  readonly mujoco: MainModule;
  readonly model: MjModel;
  readonly data: MjData;
  readonly #config: Required<Pick<SceneConfig, "maxToolSpeed" | "maxSteps" | "rotation" | "onWarning">>;
  readonly #timestep: number;
  readonly #mocap: number;
  readonly #home: Triple;
  readonly #onTool: ContactForce;
  readonly #stats = { answers: 0, steps: 0, badPositions: 0, lagging: 0, restarts: 0, incomplete: 0, behind: 0 };
  #sampledNs: bigint | undefined;
  /** s that have passed and were not simulated yet: less than a step. */
  #due = 0;
  #force: Vec3 | undefined;
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
      maxSteps: Math.ceil(positive("maxSteps", config.maxSteps ?? 20)),
      rotation: checkRotation(config.rotation ?? kIdentity),
      onWarning: config.onWarning,
    };
    this.#timestep = model.opt.timestep;
    const body = this.#body(config.tool);
    this.#mocap = model.body_mocapid[body];
    if (this.#mocap < 0) throw new Error(`MuJoCo scene: the tool, body "${config.tool}", wants mocap="true": the hand moves it`);
    const geoms = this.#geomsOf(body);
    if (!geoms.some((geom) => model.geom_contype[geom] !== 0 || model.geom_conaffinity[geom] !== 0))
      throw new Error(`MuJoCo scene: the tool, body "${config.tool}", has no geom that touches anything`);
    this.#home = [model.body_pos[3 * body], model.body_pos[3 * body + 1], model.body_pos[3 * body + 2]];
    this.#onTool = new ContactForce(mujoco, model, geoms);
    this.data = new mujoco.MjData(model);
    this.#warned = this.#warnings();
  }

  /** The callback of connect() and run(). */
  readonly physics = (hand: DeviceState): Vec3 => {
    const before = this.#sampledNs ?? hand.sampledNs;
    this.#sampledNs = hand.sampledNs; // a server that was restarted counts from another beginning
    return this.answer(hand.position, Math.max(Number(hand.sampledNs - before) / 1e9, 0)) ?? kNoForce;
  };

  /**
   * N, on the hand, in the device's frame: the hand is at `position` (m, device frame), `elapsed` s after the last call. The
   * tool goes there in a line while the scene is stepped; at the first call by one step. Undefined where there is no force that
   * could be believed; onWarning has heard why.
   */
  answer(position: Vec3, elapsed: number): Vec3 | undefined {
    const hand = [position.x, position.y, position.z];
    // MuJoCo takes NaN and 1e30 for a tool that touches nothing, and says nothing.
    if (!hand.every((value) => Math.abs(value) < this.mujoco.mjMAXVAL) || !(elapsed >= 0 && Number.isFinite(elapsed))) {
      this.#tell(++this.#stats.badPositions, `a hand at (${hand.join(", ")}) m, ${elapsed} s later, is nowhere: not computed`);
      return undefined;
    }
    const steps = this.#stepsFor(elapsed);
    if (steps === 0) return this.#force;
    this.#advance(hand, steps);
    this.#stats.steps += steps;
    const lost = this.#lost();
    const force = lost || this.#isIncomplete() ? undefined : this.#toDevice(this.#onTool.on(this.data));
    if (lost) {
      this.#tell(++this.#stats.restarts, `MuJoCo lost the solution (${lost}): no force, and the scene begins anew`);
      this.#restart();
    }
    if (force) ++this.#stats.answers;
    return (this.#force = force);
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
    this.#onTool.delete();
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

  #advance(hand: readonly number[], steps: number): void {
    const { rotation: r, maxToolSpeed } = this.#config;
    const tool = (): Float64Array => this.data.mocap_pos.subarray(3 * this.#mocap, 3 * this.#mocap + 3); // a view dies when the heap grows
    const from = [...tool()];
    const way = from.map((at, i) => this.#home[i]! + r[3 * i]! * hand[0]! + r[3 * i + 1]! * hand[1]! + r[3 * i + 2]! * hand[2]! - at);
    const reach = maxToolSpeed * steps * this.#timestep;
    const share = Math.min(1, reach / Math.hypot(...way)); // 1 where there is no way: reach / 0
    if (share < 1) this.#tell(++this.#stats.lagging, `the hand is faster than ${maxToolSpeed} m/s: the tool lags behind it`);
    for (let step = 1; step <= steps; ++step) {
      tool().set(from.map((at, i) => at + way[i]! * share * (step / steps)));
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
    this.#warned = this.#warnings();
  }

  #toDevice([x, y, z]: Triple): Vec3 {
    const r = this.#config.rotation;
    return {
      x: r[0]! * x + r[3]! * y + r[6]! * z,
      y: r[1]! * x + r[4]! * y + r[7]! * z,
      z: r[2]! * x + r[5]! * y + r[8]! * z,
    };
  }

  /** The 1st, 2nd, 4th, 8th … time. */
  #tell(times: number, text: string): void {
    if (Number.isInteger(Math.log2(times))) this.#config.onWarning(times === 1 ? text : `${text} (${times} times so far)`);
  }
}

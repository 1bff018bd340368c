// SPDX-License-Identifier: Apache-2.0
// The body of the scene that the hand holds. Everything here is in the scene's frame.
import type { MainModule, MjData, MjModel } from "@mujoco/mujoco";
import { ContactForce, type Triple } from "./contact_force.js";
import {
  inverse, kNoTurn, matrixOf, product, rotationBy, rotationVector, spring, times, unit, type Matrix, type Rotation,
} from "./rotation.js";

export interface Pose {
  /** m */
  readonly at: Triple;
  /** Turns the tool's frame into the scene's. */
  readonly turn: Rotation;
}

/** What the hand feels of the tool, on the hand, about the point that it holds. */
export interface Felt {
  /** N */
  readonly force: Triple;
  /** N·m */
  readonly torque?: Triple;
  /** N/m and N·m/rad, what the scene sets against the hand's next motion and turn. */
  readonly stiffness?: Matrix | undefined;
  readonly angularStiffness?: Matrix | undefined;
  /** m, how far from here the stiffness holds. */
  readonly validRadius?: number;
}

export interface Tool {
  /** Where the scene file puts it: there is the device's origin. */
  readonly home: Pose;
  /** Before a step of `seconds`, at whose end the hand is at `pose`; it comes there evenly. */
  lead(pose: Pose, seconds: number): void;
  /** Of the newest step. It changes nothing. */
  felt(): Felt;
  /** The scene begins anew. */
  restart(): void;
  delete(): void;
}

const negative = ([x, y, z]: Triple): Triple => [-x, -y, -z];
const rotate = (q: Rotation, v: Triple): Triple => times(matrixOf(q), v);

const toolError = (name: string, what: string): Error => new Error(`MuJoCo scene: the tool, body "${name}", ${what}`);

export interface Coupling {
  /** N/m, between the hand and the tool. */
  readonly stiffness: number;
  /** N·m/rad */
  readonly angularStiffness: number;
}

/** A mocap body, which is where the hand is; it does not turn. The contact forces on it go to the hand. */
class LedTool implements Tool {
  readonly home: Pose;
  readonly #data: MjData;
  readonly #mocap: number;
  readonly #contacts: ContactForce;

  constructor(mj: MainModule, model: MjModel, data: MjData, body: number, geoms: readonly number[]) {
    this.#data = data;
    this.#mocap = model.body_mocapid[body];
    this.home = { at: [...(model.body_pos.subarray(3 * body, 3 * body + 3) as Float64Array)] as never, turn: kNoTurn };
    this.#contacts = new ContactForce(mj, model, geoms);
  }

  lead({ at }: Pose): void {
    this.#data.mocap_pos.set(at, 3 * this.#mocap); // a view dies when the heap grows
  }
  felt(): Felt {
    return { force: this.#contacts.on(this.#data) };
  }
  restart(): void {}
  delete(): void {
    this.#contacts.delete();
  }
}

/** So far to either side are the poses at which the answer is taken for its derivative: m and rad. */
const kProbe = 1e-4;
const kProbeTurn = 2e-3;

/**
 * A free body that a virtual coupling holds to the hand. With p, q the tool's place and orientation, p_h, q_h the hand's, and
 * (w, v) = q q_h⁻¹ the rotation error, the coupling exerts on the tool, at the origin of its frame,
 *
 *     F = −k (p − p_h) − B (ṗ − ṗ_h)
 *     τ = −2 (w K v + v × K v) − B_r (ω − ω_h)         K = κ I, so τ = −2 κ w v: κ sin θ about the axis of the error
 *
 * which is the torsion spring of core/base/rotation.h, the gradient of 2 vᵀ K v. K is the same about every axis because only then
 * the hand's torque is the tool's, reversed. B and B_r damp the tool critically on the coupling (of each of its axes, by
 * its inertia in the scene file); MuJoCo integrates them implicitly.
 *
 * **The hand feels the springs alone**, reversed: k (p − p_h) and 2 κ w v, about p_h. The dampers are there so that the tool
 * does not ring, and are not felt.
 *
 * **Stiffness**: finite differences at constant state. All that moves stays where it is and as fast; the hand is put 0.1 mm (2
 * mrad) to either side along each axis, so that the coupling pulls otherwise, and MuJoCo says what its constraints (contacts,
 * joints, limits) set against that in the same instant: c. Then K = −∂c/∂x. A tool in free space gives way: 0. Against
 * a wall it is k along the normal, and along the wall too while friction holds. A body that can be moved counts by its inertia.
 * Of the result the spring next to it is taken that stores energy and makes none, no stiffer than the coupling.
 */
class HeldTool implements Tool {
  readonly home: Pose;
  readonly #mj: MainModule;
  readonly #model: MjModel;
  readonly #data: MjData;
  readonly #coupling: Coupling;
  readonly #derives: boolean;
  readonly #qpos: number;
  readonly #dof: number;
  /** N·s/m and N·m·s/rad, of the six degrees of freedom; those of rotation are about the tool's own axes. */
  readonly #damping: readonly number[];
  #hand: Pose;
  /** N and N·m, what the dampers owe to the hand's motion; their part of the tool's own is MuJoCo's. */
  #dragged: readonly number[] = [0, 0, 0, 0, 0, 0];

  constructor(mj: MainModule, model: MjModel, data: MjData, body: number, name: string, coupling: Coupling, derives: boolean) {
    [this.#mj, this.#model, this.#data, this.#coupling, this.#derives] = [mj, model, data, coupling, derives];
    const joint: number = model.body_jntadr[body];
    [this.#qpos, this.#dof] = [model.jnt_qposadr[joint], model.jnt_dofadr[joint]];
    this.home = this.#pose(model.qpos0);
    this.#hand = this.home;
    const springs = [0, 1, 2, 3, 4, 5].map((i) => (i < 3 ? coupling.stiffness : coupling.angularStiffness));
    const step: number = model.opt.timestep;
    this.#damping = springs.map((stiffness, i) => {
      const inertia: number = model.dof_M0[this.#dof + i];
      if (!(inertia >= stiffness * step * step)) {
        const [least, unit, of] = i < 3 ? ["mass", "kg", "N/m"] : ["moment of inertia", "kg·m²", "N·m/rad"];
        throw toolError(name, `is too light for its coupling: at ${stiffness} ${of} and a step of ${step} s it wants a ${least} of ` +
          `${(stiffness * step * step).toExponential(1)} ${unit} or more, got ${inertia.toExponential(1)}`);
      }
      return 2 * Math.sqrt(stiffness * inertia);
    });
    this.#damping.forEach((damping, i) => (model.dof_damping[this.#dof + i] += damping));
  }

  lead(hand: Pose, seconds: number): void {
    const speed = hand.at.map((to, i) => (to - this.#hand.at[i]!) / seconds);
    const turned = rotationVector(product(hand.turn, inverse(this.#hand.turn)));
    const spin = this.#toTool(turned.map((angle) => angle / seconds) as never);
    this.#dragged = [...speed, ...spin].map((rate, i) => this.#damping[i]! * rate);
    this.#pull(this.#hand); // from where both are now: a tool that runs beside the hand feels nothing
    this.#hand = hand;
  }

  felt(): Felt {
    const { force, torque } = this.#springs(this.#hand);
    const felt = { force: negative(force), torque: negative(torque) };
    if (!this.#derives) return felt;
    // So far back the hand lets go of what it presses; a spring beyond would pull.
    return { ...felt, ...this.#derivatives(), validRadius: Math.hypot(...force) / this.#coupling.stiffness };
  }

  restart(): void {
    this.#hand = this.home;
    this.#dragged = [0, 0, 0, 0, 0, 0];
  }
  delete(): void {}

  #pose(qpos: Float64Array): Pose {
    const [x, y, z, ...turn] = qpos.subarray(this.#qpos, this.#qpos + 7);
    return { at: [x!, y!, z!], turn: unit(turn as never) };
  }
  #toTool(v: Triple): Triple {
    return rotate(inverse(this.#pose(this.#data.qpos).turn), v);
  }

  /** On the tool, at the origin of its frame. */
  #springs(hand: Pose): { readonly force: Triple; readonly torque: Triple } {
    const { stiffness: k, angularStiffness: kappa } = this.#coupling;
    const { at, turn } = this.#pose(this.#data.qpos);
    const [w, ...v] = product(turn, inverse(hand.turn));
    return {
      force: at.map((place, i) => -k * (place - hand.at[i]!)) as never,
      torque: v.map((value) => -2 * kappa * w * value) as never,
    };
  }

  /** MuJoCo has forces on a free joint along the scene's axes, and torques about the body's own. */
  #pull(hand: Pose): void {
    const { force, torque } = this.#springs(hand);
    const all = [...force, ...this.#toTool(torque)];
    this.#data.qfrc_applied.set(all.map((value, i) => value + this.#dragged[i]!), this.#dof);
  }

  #derivatives(): { readonly stiffness: Matrix | undefined; readonly angularStiffness: Matrix | undefined } {
    const { mjSTAGE_NONE: none, mjSTAGE_VEL: velocity } = this.#mj.mjtStage;
    const turn = this.#pose(this.#data.qpos).turn;
    const answer = (hand: Pose, stage: number): Float64Array => {
      this.#pull(hand);
      this.#mj.mj_forwardSkip(this.#model, this.#data, stage, 1);
      return this.#data.qfrc_constraint.slice(this.#dof, this.#dof + 6);
    };
    answer(this.#hand, none.value); // once with all that depends on places and speeds
    const columns = [0, 1, 2, 3, 4, 5].map((axis) => {
      const probe = axis < 3 ? kProbe : kProbeTurn;
      const [more, less] = [1, -1].map((side) => {
        const way = [0, 1, 2].map((i) => (i === axis % 3 ? side * probe : 0)) as never as Triple;
        const { at, turn: turned } = this.#hand;
        const hand = axis < 3 ? { at: at.map((x, i) => x + way[i]!) as never, turn: turned }
          : { at, turn: product(rotationBy(way), turned) };
        const c = answer(hand, velocity.value);
        return axis < 3 ? [...c.subarray(0, 3)] : rotate(turn, [...c.subarray(3, 6)] as never);
      });
      return [0, 1, 2].map((i) => -(more![i]! - less![i]!) / (2 * probe));
    });
    answer(this.#hand, velocity.value); // what else reads the scene finds it as it is
    const rows = (first: number): Matrix => [0, 1, 2].flatMap((row) => [0, 1, 2].map((axis) => columns[first + axis]![row]!));
    return {
      stiffness: spring(rows(0), this.#coupling.stiffness),
      angularStiffness: spring(rows(3), this.#coupling.angularStiffness),
    };
  }
}

/** Throws an Error that says why the hand cannot hold this body. */
export function toolOf(
  mj: MainModule, model: MjModel, data: MjData, body: number, name: string, geoms: readonly number[], coupling: Coupling,
  derives: boolean,
): Tool {
  if (!geoms.some((geom) => model.geom_contype[geom] !== 0 || model.geom_conaffinity[geom] !== 0))
    throw toolError(name, "has no geom that touches anything");
  if (model.body_mocapid[body] >= 0) return new LedTool(mj, model, data, body, geoms);
  const free = model.body_jntnum[body] === 1 && model.jnt_type[model.body_jntadr[body]] === mj.mjtJoint.mjJNT_FREE.value;
  if (!free) throw toolError(name, `wants mocap="true", and the hand leads it, or a <freejoint/>, and the hand holds and turns it`);
  return new HeldTool(mj, model, data, body, name, coupling, derives);
}

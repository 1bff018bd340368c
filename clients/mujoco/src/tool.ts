// SPDX-License-Identifier: Apache-2.0
// The body in the scene that the hand holds. All quantities are in the frame of the scene.
import type { MainModule, MjData, MjModel } from "@mujoco/mujoco";
import { ContactForce, type Triple } from "./contact_force.js";
import {
  inverse, kNoTurn, matrixOf, product, rotationBy, rotationVector, spring, times, unit, type Matrix, type Rotation,
} from "./rotation.js";

export interface Pose {
  /** m */
  readonly at: Triple;
  /** The rotation from the frame of the tool to that of the scene. */
  readonly turn: Rotation;
}

/** The force on the hand, and the torque about the point that is held by the hand. */
export interface Felt {
  /** N */
  readonly force: Triple;
  /** N·m */
  readonly torque?: Triple;
  /** How much the scene resists a displacement and a rotation of the hand, N/m and N·m/rad. */
  readonly stiffness?: Matrix | undefined;
  readonly angularStiffness?: Matrix | undefined;
  /** The range in which the stiffness is valid, m. */
  readonly validRadius?: number;
}

export interface Tool {
  /** The initial pose in the scene file. It corresponds to the origin of the device. */
  readonly home: Pose;
  /**
   * Must be called before a step of `seconds`. `pose` is the pose of the hand at the end of the step. The hand moves
   * there at constant speed.
   */
  lead(pose: Pose, seconds: number): void;
  /** Returns the force of the newest step. The scene is not changed. */
  felt(): Felt;
  restart(): void;
  delete(): void;
}

const negative = ([x, y, z]: Triple): Triple => [-x, -y, -z];
const rotate = (q: Rotation, v: Triple): Triple => times(matrixOf(q), v);

const toolError = (name: string, what: string): Error => new Error(`MuJoCo scene: the tool, body "${name}", ${what}`);

export interface Coupling {
  /** Stiffness of the coupling between the hand and the tool, N/m. */
  readonly stiffness: number;
  /** N·m/rad */
  readonly angularStiffness: number;
}

/** A mocap body that is at the hand and does not rotate. The hand feels the contact forces on it. */
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
    this.#data.mocap_pos.set(at, 3 * this.#mocap); // these views are invalid if the heap has grown
  }
  felt(): Felt {
    return { force: this.#contacts.on(this.#data) };
  }
  restart(): void {}
  delete(): void {
    this.#contacts.delete();
  }
}

/** The step that is used in finite differences, m and rad. */
const kProbe = 1e-4;
const kProbeTurn = 2e-3;

/**
 * A free body, coupled to the hand by a virtual coupling. With the pose p, q of the tool, the pose p_h, q_h of the
 * hand, and the rotation error (w, v) = q q_h⁻¹, the coupling exerts on the tool, at the origin of its frame,
 *
 *     F = −k (p − p_h) − B (ṗ − ṗ_h)
 *     τ = −2 (w K v + v × K v) − B_r (ω − ω_h)         K = κ I, so τ = −2 κ w v: κ sin θ about the axis of the error
 *
 * This is the torsion spring of core/base/rotation.h, the gradient of 2 vᵀ K v. K must be isotropic so that the
 * torque on the hand is the opposite of that on the tool. B and B_r damp the tool critically (each axis by its
 * inertia in the scene file); MuJoCo integrates them implicitly.
 *
 * **The hand feels only the springs**: k (p − p_h) and 2 κ w v, about p_h. The dampers prevent oscillations of the
 * tool but are not felt.
 *
 * **Stiffness** is computed by finite differences at constant state: with unchanged positions and velocities, the
 * hand is moved by 0.1 mm (2 mrad) in both directions along each axis, which changes the coupling force, and MuJoCo
 * computes the constraint force c (contacts, joints, limits) at the same time. Then K = −∂c/∂x. It is 0 for a tool in
 * free space, and k along the normal of a wall, also along the wall while friction holds. A movable body contributes
 * by its inertia. The result is projected to the closest passive spring that is not stiffer than the coupling.
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
  /** The damping of the six degrees of freedom, N·s/m and N·m·s/rad. Rotations are about the axes of the tool. */
  readonly #damping: readonly number[];
  #hand: Pose;
  /** The damper forces that the motion of the hand causes, N and N·m. MuJoCo adds those of the tool. */
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
        throw toolError(name, `is too light for its coupling: at ${stiffness} ${of} and a step of ${step} s, expected a ${least} of ` +
          `at least ${(stiffness * step * step).toExponential(1)} ${unit}, got ${inertia.toExponential(1)}`);
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
    this.#pull(this.#hand); // starts at the current poses, so that there is no force if the tool moves with the hand
    this.#hand = hand;
  }

  felt(): Felt {
    const { force, torque } = this.#springs(this.#hand);
    const felt = { force: negative(force), torque: negative(torque) };
    if (!this.#derives) return felt;
    // At this distance, the force of the spring is zero. Beyond it, the model would pull.
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

  /** The force on the tool, at the origin of its frame. */
  #springs(hand: Pose): { readonly force: Triple; readonly torque: Triple } {
    const { stiffness: k, angularStiffness: kappa } = this.#coupling;
    const { at, turn } = this.#pose(this.#data.qpos);
    const [w, ...v] = product(turn, inverse(hand.turn));
    return {
      force: at.map((place, i) => -k * (place - hand.at[i]!)) as never,
      torque: v.map((value) => -2 * kappa * w * value) as never,
    };
  }

  /** In MuJoCo, forces on a free joint are in the axes of the scene, and torques in those of the body. */
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
    answer(this.#hand, none.value); // updates all quantities that depend on positions and velocities
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
    answer(this.#hand, velocity.value); // restores the scene
    const rows = (first: number): Matrix => [0, 1, 2].flatMap((row) => [0, 1, 2].map((axis) => columns[first + axis]![row]!));
    return {
      stiffness: spring(rows(0), this.#coupling.stiffness),
      angularStiffness: spring(rows(3), this.#coupling.angularStiffness),
    };
  }
}

/** Throws an Error if the hand cannot hold this body. */
export function toolOf(
  mj: MainModule, model: MjModel, data: MjData, body: number, name: string, geoms: readonly number[], coupling: Coupling,
  derives: boolean,
): Tool {
  if (!geoms.some((geom) => model.geom_contype[geom] !== 0 || model.geom_conaffinity[geom] !== 0))
    throw toolError(name, "has no geom that can touch other geoms");
  if (model.body_mocapid[body] >= 0) return new LedTool(mj, model, data, body, geoms);
  const free = model.body_jntnum[body] === 1 && model.jnt_type[model.body_jntadr[body]] === mj.mjtJoint.mjJNT_FREE.value;
  if (!free) throw toolError(name, `requires mocap="true", so that the hand moves it, or a <freejoint/>, so that the hand holds and turns it`);
  return new HeldTool(mj, model, data, body, name, coupling, derives);
}

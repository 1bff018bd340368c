// SPDX-License-Identifier: Apache-2.0
// Teleoperation of a robot by the hand at a Tendon server, with force feedback.
import type { Touch } from "./answer.js";
import { expect } from "./expect.js";
import { Mode, type Contact, type DeviceState, type Quat, type Vec3 } from "./messages.js";

/** Pose of the tool, or its target, in the frame of the robot. */
export interface Pose {
  /** m */
  readonly position: Vec3;
  /** A unit quaternion. If it is absent, only the position is controlled. */
  readonly orientation?: Quat | undefined;
  /** The opening of the gripper, m or rad. It is absent if there is no gripper. */
  readonly grip?: number | undefined;
}

/** Force of the environment on the tool, in the frame of the robot. For example, a table exerts an upward force. */
export interface ToolContact {
  /** N */
  readonly force: Vec3;
  /** The torque about the position of the tool, N·m. */
  readonly torque?: Vec3 | undefined;
  /** The stiffness of the surface along its normal, N/m. It must be positive, and is absent if it is not known. */
  readonly stiffness?: number | undefined;
  /** This points from the surface to the tool. If it is absent, it is the direction of the force. */
  readonly normal?: Vec3 | undefined;
  /** The force on the fingers, N. If it is positive, it opens them. */
  readonly gripForce?: number | undefined;
}

/** Mapping from the hand to the tool. Defaults are in brackets. */
export interface FollowerConfig {
  /** s_x, motion of the follower / motion of the leader, 0.01 … 100 [1]. */
  readonly scale?: number;
  /** s_f, force on the leader / force on the follower, 0.01 … 100 [1]. */
  readonly forceScale?: number;
  /** R, from the device base frame to the robot frame; norm 1 ± 1e-3 [none]. */
  readonly rotation?: Quat;
  /** Coupled axes of the device, "x" … "xyz"; the others move freely without force ["xyz"]. */
  readonly axes?: string;
  /** 0 … 31, clutched while pressed. Absent: only engage() and disengage(). */
  readonly clutchButton?: number | undefined;
  /** Each press switches between engaged and clutched [false]. */
  readonly toggle?: boolean;
  /** "button": pressing and releasing the clutch (toggle: pressing it); "call": engage() ["button"]. */
  readonly engageBy?: "button" | "call";
  /** m/s, 0.001 … 10, maximum speed of the target [0.25]. */
  readonly speed?: number;
  /** rad/s, 0.01 … 100, maximum angular speed of the target [2]. */
  readonly spin?: number;
  /** s, 0 … 10, duration of the force ramp after engaging [0.3]. */
  readonly rampS?: number;
  /** Opening of the robot's gripper / opening of the hand's gripper, 0.001 … 1000 [1]. */
  readonly gripRatio?: number;
  /** m/s or rad/s, 0.001 … 100, maximum speed of the gripper [0.1]. */
  readonly gripSpeed?: number;
  /** Rate at which target() is called, 1 … 100000 [500]. */
  readonly rateHz?: number;
}

/** "alone": no state has arrived. "coupled": waiting for the operator to engage. "lost": states stopped; engage again.
 */
export type Following = "alone" | "coupled" | "engaged" | "clutched" | "lost";

const kDefaults = {
  scale: 1, forceScale: 1, rotation: { w: 1, x: 0, y: 0, z: 0 }, axes: "xyz", clutchButton: undefined, toggle: false,
  engageBy: "button", speed: 0.25, spin: 2, rampS: 0.3, gripRatio: 1, gripSpeed: 0.1, rateHz: 500,
} as const;
type Complete = Required<FollowerConfig>;

/** Time constant of the delay filter. */
const kSmoothingMs = 1000;
/** After a pause of the robot program, the target does not jump. */
const kLongestStepMs = 100;
const kHoldMs = 20;
const kLostMs = 250;
const kFaultOrDisarmed = 256 | 8192;
const kNoContact = "the robot measures no contact force: the hand feels nothing";
const kBadPose = "the robot's pose is not finite: disengaged";
const kZero: Vec3 = { x: 0, y: 0, z: 0 };

function between(least: number, most: number, fields: Readonly<Record<string, number>>): void {
  for (const [name, value] of Object.entries(fields)) expect(value >= least && value <= most, name, value, `${least} to ${most}`);
}

function complete(given: FollowerConfig): Complete {
  const config = { ...kDefaults, ...given } as Complete;
  const { rotation, axes, clutchButton, toggle, engageBy, rampS } = config;
  const [isClutch, { scale, forceScale, speed, spin, gripRatio, gripSpeed, rateHz }] = [clutchButton !== undefined, config];
  between(0.01, 100, { scale, forceScale });
  const length = Math.hypot(rotation.w, rotation.x, rotation.y, rotation.z);
  expect(Math.abs(length - 1) <= 1e-3, "rotation", `of length ${Number(length.toPrecision(6))}`, "a unit quaternion");
  expect(/^(?=.)x?y?z?$/.test(axes), "axes", `"${axes}"`, 'one or more of the letters "xyz", in this order');
  if (isClutch) between(0, 31, { clutchButton: clutchButton! });
  expect(engageBy === "button" || engageBy === "call", "engageBy", `"${engageBy}"`, '"button" or "call"');
  expect(engageBy === "call" || isClutch, "engageBy", '"button"', '"call" without clutchButton');
  expect(!toggle || isClutch, "toggle", "true", "false without clutchButton");
  between(0.001, 10, { speed });
  between(0.01, 100, { spin });
  between(0, 10, { rampS });
  between(0.001, 1000, { gripRatio });
  between(0.001, 100, { gripSpeed });
  between(1, 100000, { rateHz });
  return config;
}

/**
 * Position mapping, clutch and reaction to loss of connection. It does not use a clock or a timer: `nowMs` is the
 * arrival time of a state, from any monotonic clock (performance.now()).
 *
 *     const follow = new Follower({ scale: 0.5, clutchButton: 1 });
 *     const physics = (hand: DeviceState) => {
 *       move(follow.target(hand, robot.pose(), performance.now())); // undefined: the robot must hold its pose
 *       return follow.touch(robot.contact());
 *     };
 *     setInterval(() => move(follow.silence(performance.now())), 10);
 *
 * With positions p, orientations q, the hand l (leader), the tool f (follower), and 0 for the values at the time of
 * engaging:
 *
 *     p_f = p_f0 + s_x R M (p_l − p_l0)        q_f = (R q_l q_l0⁻¹ R⁻¹) q_f0        M selects the coupled axes
 *     F_l = s_f M Rᵀ F_f                       τ_l = s_f / s_x Rᵀ τ_f               K_l = s_f s_x M Rᵀ K_f R M
 *
 * The robot does not move until the operator engages with the button or with engage(). The offset is defined by the
 * poses at that time, so that the robot does not move when it is engaged or when the clutch is released. The reaction
 * to missing states depends on the age of the newest state beyond the smoothed delay, where v is three periods, at
 * least 20 ms:
 *
 *     v             the target stops
 *     v + 20 ms     undefined: the robot must hold its pose
 *     v + 250 ms    lost: new states couple again, but the operator must engage again
 *
 * Absolute times of the two clocks are never compared. The coupling ends if the device has a fault or is disarmed, or
 * if a pose is not finite. Throws the RangeError "FIELD = VALUE: expected …" if the config is invalid.
 */
export class Follower {
  readonly #config: Complete;
  readonly #turn: Quat;
  /** v, ms */
  readonly #lateMs: number;
  #scale: number;
  #forceScale: number;
  #phase: Following = "alone";
  #words = "";
  #asked = false;
  /** Button in the newest state. Initially true, so that a press counts only after a release. */
  #held = true;
  #tick = 0n;
  #sampledNs = 0n;
  /** Arrival and sampling time of the first state. Delays are measured relative to it. */
  #base: { readonly ms: number; readonly sampledNs: bigint } | undefined;
  /** ms, smoothed delay, relative to that of the first state. */
  #usual = 0;
  #now = 0;
  #gainFrom = 0;
  #waits = false;
  #hand0: { readonly position: Vec3; readonly orientation: Quat | undefined } = { position: kZero, orientation: undefined };
  #pose0: Pose = { position: kZero };
  #target: Pose = { position: kZero };

  constructor(config: FollowerConfig) {
    this.#config = complete(config);
    this.#turn = unit(this.#config.rotation);
    [this.#scale, this.#forceScale] = [this.#config.scale, this.#config.forceScale];
    this.#lateMs = Math.max(3000 / this.#config.rateHz, 20);
  }

  get phase(): Following {
    return this.#phase;
  }
  /** Newest message for the operator. Empty if there is none. */
  get words(): string {
    return this.#words;
  }

  /** Engages at the next state. Returns false and does nothing unless the phase is "coupled". */
  engage(): boolean {
    return (this.#asked = this.#phase === "coupled");
  }
  /** Stops the robot until the operator engages again. */
  disengage(): void {
    this.#asked = false;
    if (this.#phase === "engaged" || this.#phase === "clutched") this.#phase = "coupled";
  }
  /** Has no effect and returns false while the robot follows. Throws a RangeError if a scale is out of bounds. */
  setScale(scale: number, forceScale: number): boolean {
    between(0.01, 100, { scale, forceScale });
    if (this.#phase === "engaged") return false;
    [this.#scale, this.#forceScale] = [scale, forceScale];
    return true;
  }

  /** Returns the next target of the tool, which moves at most at `speed`, or undefined to hold. `pose`: current pose.
   */
  target(hand: DeviceState, pose: Pose, nowMs: number): Pose | undefined {
    let elapsed = this.#advance(nowMs);
    if (hand.tick < this.#tick) this.#lose(); // the server has been replaced or restarted
    const age = this.#take(hand);
    if (age > this.#lateMs + kLostMs) this.#lose();
    const fresh = this.#phase !== "lost" && age <= this.#lateMs;
    if (isFinitePose(pose)) {
      this.#act(hand, pose, fresh);
    } else {
      this.disengage();
      this.#words = kBadPose;
    }
    if (this.#phase !== "engaged" || age > this.#lateMs + kHoldMs) {
      this.#waits = true;
      return undefined;
    }
    if (this.#waits) [this.#waits, this.#target, elapsed] = [false, pose, 0];
    if (fresh) this.#approach(hand, elapsed / 1000);
    return this.#target;
  }

  /** Must be called every few milliseconds while no state arrives. Returns the last target at first, then undefined. */
  silence(nowMs: number): Pose | undefined {
    this.#advance(nowMs);
    if (this.#phase === "engaged" && this.#age() <= this.#lateMs + kHoldMs) return this.#target;
    this.#waits = true;
    return undefined;
  }

  /**
   * Returns the force on the hand for a contact of the tool; the force is zero while the robot does not follow.
   * Returns null, which is not sent, if `contact` is undefined, because a zero force would look like a measurement.
   */
  touch(contact: ToolContact | undefined): Touch | null {
    if (!contact) {
      this.#words = kNoContact;
      return null;
    }
    if (this.#phase !== "engaged") return { force: kZero };
    const { rampS, gripRatio } = this.#config;
    const gain = this.#forceScale * (rampS > 0 ? Math.min((this.#now - this.#gainFrom) / (1000 * rampS), 1) : 1);
    const lever = gain / this.#scale;
    const back = inverse(this.#turn);
    return {
      force: times(gain, this.#masked(rotated(back, contact.force))),
      torque: contact.torque && times(lever, rotated(back, contact.torque)),
      gripForce: contact.gripForce === undefined ? undefined : lever * gripRatio * contact.gripForce,
      ...this.#surface(contact, back, gain),
    };
  }

  /** Transforms stiffness and surface to the units of the hand, if both are known. */
  #surface(contact: ToolContact, back: Quat, gain: number): { readonly stiffness?: number[]; readonly contact?: Contact } {
    const { force, stiffness: k = 0, normal = force } = contact;
    const length = Math.hypot(normal.x, normal.y, normal.z);
    if (!(k > 0 && length > 0 && length < Infinity)) return {};
    const n = rotated(back, times(1 / length, normal));
    const { x, y, z } = this.#masked(n);
    const stiffness = [x, y, z].flatMap((row) => [x, y, z].map((column) => gain * this.#scale * k * row * column));
    if (this.#config.axes !== "xyz") return { stiffness };
    const depth = (force.x * normal.x + force.y * normal.y + force.z * normal.z) / length / (k * this.#scale);
    return { stiffness, contact: { normal: n, gap: -depth } };
  }

  /** Advances the time. Returns the elapsed time in ms, at most kLongestStepMs. */
  #advance(nowMs: number): number {
    const elapsed = Math.max(nowMs - this.#now, 0);
    this.#now = Math.max(nowMs, this.#now);
    if (this.#age() > this.#lateMs + kLostMs) this.#lose();
    return Math.min(elapsed, kLongestStepMs);
  }

  /** Age of the newest state beyond the smoothed delay, ms. */
  #age(): number {
    if (!this.#base) return 0;
    return this.#now - this.#base.ms - Number(this.#sampledNs - this.#base.sampledNs) / 1e6 - this.#usual;
  }

  /** Records a new state and returns its age. The first one after a silence is the base of the delay. */
  #take(hand: DeviceState): number {
    if (!this.#base) {
      this.#base = { ms: this.#now, sampledNs: hand.sampledNs };
      [this.#usual, this.#sampledNs, this.#phase, this.#asked, this.#held] = [0, hand.sampledNs, "coupled", false, true];
    }
    const period = Math.max(Number(hand.sampledNs - this.#sampledNs) / 1e6, 0);
    [this.#tick, this.#sampledNs] = [hand.tick, hand.sampledNs];
    const age = this.#age();
    this.#usual += Math.min(period / kSmoothingMs, 1) * age;
    return age;
  }

  #lose(): void {
    [this.#phase, this.#base, this.#asked, this.#tick] = ["lost", undefined, false, 0n];
  }

  /** Handles the clutch button and engage(). */
  #act(hand: DeviceState, pose: Pose, fresh: boolean): void {
    const { clutchButton: button, toggle, engageBy } = this.#config;
    const held = button !== undefined && ((hand.buttons >>> button) & 1) === 1;
    const pressed = held && !this.#held;
    this.#held = held;
    if (hand.mode === Mode.FAULT || (hand.reasons & kFaultOrDisarmed) !== 0) {
      this.disengage();
      return;
    }
    if (!fresh) return;
    const asked = this.#asked;
    this.#asked = false;
    if (this.#phase === "coupled") {
      if (asked) this.#begin(hand, pose);
      else if (pressed && engageBy === "button") {
        this.#phase = "clutched";
        if (toggle) this.#begin(hand, pose);
      }
    } else if (this.#phase === "engaged" && pressed) {
      this.#phase = "clutched";
    } else if (this.#phase === "clutched" && (toggle ? pressed : !held)) {
      this.#begin(hand, pose);
    }
  }

  /** Engages. The offset is chosen so that the target is the current pose. */
  #begin(hand: DeviceState, pose: Pose): void {
    [this.#phase, this.#gainFrom, this.#pose0, this.#waits] = ["engaged", this.#now, pose, true];
    this.#hand0 = { position: hand.position, orientation: hand.turning?.orientation };
  }

  /** Moves the target toward the pose of the hand within the speed limits. */
  #approach(hand: DeviceState, seconds: number): void {
    const { speed, spin, gripRatio, gripSpeed } = this.#config;
    const [last, start] = [this.#target, this.#hand0];
    const moved = times(this.#scale, rotated(this.#turn, this.#masked(plus(hand.position, -1, start.position))));
    const way = plus(plus(this.#pose0.position, 1, moved), -1, last.position);
    const position = plus(last.position, share(Math.hypot(way.x, way.y, way.z), speed * seconds), way);
    let { orientation, grip } = last;
    const now = hand.turning?.orientation;
    if (start.orientation && now && orientation && this.#pose0.orientation) {
      const turned = product(product(this.#turn, product(now, inverse(start.orientation))), inverse(this.#turn));
      const { w, x, y, z } = product(product(turned, this.#pose0.orientation), inverse(orientation));
      const sine = Math.hypot(x, y, z);
      const angle = 2 * Math.atan2(sine, Math.abs(w));
      const part = (share(angle, spin * seconds) * angle) / 2;
      const along = sine === 0 ? 0 : (w < 0 ? -1 : 1) * (Math.sin(part) / sine);
      orientation = unit(product({ w: Math.cos(part), x: along * x, y: along * y, z: along * z }, orientation));
    }
    if (grip !== undefined && hand.grip) {
      const rest = gripRatio * hand.grip.opening - grip;
      grip += share(Math.abs(rest), gripSpeed * seconds) * rest;
    }
    this.#target = { position, orientation, grip };
  }

  #masked({ x, y, z }: Vec3): Vec3 {
    const { axes } = this.#config;
    return { x: axes.includes("x") ? x : 0, y: axes.includes("y") ? y : 0, z: axes.includes("z") ? z : 0 };
  }
}

function isFinitePose({ position: p, orientation: q, grip }: Pose): boolean {
  return [p.x, p.y, p.z, q?.w ?? 0, q?.x ?? 0, q?.y ?? 0, q?.z ?? 0, grip ?? 0].every(Number.isFinite);
}

/** Returns the factor that limits a displacement of length `whole` to `most`. */
const share = (whole: number, most: number): number => (whole <= most ? 1 : most / whole);
const times = (factor: number, { x, y, z }: Vec3): Vec3 => ({ x: factor * x, y: factor * y, z: factor * z });
const plus = (a: Vec3, factor: number, b: Vec3): Vec3 => ({ x: a.x + factor * b.x, y: a.y + factor * b.y, z: a.z + factor * b.z });
const inverse = ({ w, x, y, z }: Quat): Quat => ({ w, x: -x, y: -y, z: -z });
const product = (a: Quat, b: Quat): Quat => ({
  w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
  x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
  y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
  z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
});
function rotated(q: Quat, v: Vec3): Vec3 {
  const { x, y, z } = product(product(q, { w: 0, ...v }), inverse(q));
  return { x, y, z };
}
function unit({ w, x, y, z }: Quat): Quat {
  const length = Math.hypot(w, x, y, z);
  return { w: w / length, x: x / length, y: y / length, z: z / length };
}

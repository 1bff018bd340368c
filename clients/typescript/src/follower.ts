// SPDX-License-Identifier: Apache-2.0
// A robot follows the hand at a Tendon server, and the hand feels what the robot touches.
import type { Touch } from "./answer.js";
import { expect } from "./expect.js";
import { Mode, type Contact, type DeviceState, type Quat, type Vec3 } from "./messages.js";

/** Of the tool, in the robot's frame; of a target, what the tool is to reach. */
export interface Pose {
  /** m */
  readonly position: Vec3;
  /** Unit quaternion. Absent: position alone is followed. */
  readonly orientation?: Quat | undefined;
  /** Opening of the gripper, m or rad. Absent: no gripper. */
  readonly grip?: number | undefined;
}

/** What the surroundings exert on the tool, in the robot's frame: a table below pushes up. */
export interface ToolContact {
  /** N */
  readonly force: Vec3;
  /** N·m, about the tool's position. */
  readonly torque?: Vec3 | undefined;
  /** N/m, > 0, of the surface along its normal, where it is known. */
  readonly stiffness?: number | undefined;
  /** Out of the body, to the tool. Absent: along the force. */
  readonly normal?: Vec3 | undefined;
  /** N, on the fingers; > 0 opens them. */
  readonly gripForce?: number | undefined;
}

/** How a hand's motion becomes a tool's. */
export interface FollowerConfig {
  /** s_x, follower / leader, 0.01 … 100 [1]. */
  readonly scale?: number;
  /** s_f, leader / follower, 0.01 … 100 [1]. */
  readonly forceScale?: number;
  /** R, turns the device's base frame into the robot's; of length 1 ± 1e-3 [none]. */
  readonly rotation?: Quat;
  /** Of the device that are coupled, "x" … "xyz"; the others are free and feel nothing ["xyz"]. */
  readonly axes?: string;
  /** 0 … 31; held: clutched. Absent: engage() and disengage() alone. */
  readonly clutchButton?: number | undefined;
  /** Each press of the button changes between engaged and clutched [false]. */
  readonly toggle?: boolean;
  /** "button": of the clutch, pressed and released (toggle: pressed); or "call": engage() ["button"]. */
  readonly engageBy?: "button" | "call";
  /** m/s, 0.001 … 10: no target moves faster [0.25]. */
  readonly speed?: number;
  /** rad/s, 0.01 … 100: nor turns faster [2]. */
  readonly spin?: number;
  /** s, 0 … 10, in which the force grows from 0 to all of it after engaging [0.3]. */
  readonly rampS?: number;
  /** Opening of the robot's gripper / that of the hand's, 0.001 … 1000 [1]. */
  readonly gripRatio?: number;
  /** m/s or rad/s, 0.001 … 100, of the gripper [0.1]. */
  readonly gripSpeed?: number;
  /** States per second that target() is given, 1 … 100000 [500]. */
  readonly rateHz?: number;
}

/** "alone": no state has come. "coupled": the robot stands until somebody engages. "lost": by silence; only the act engages. */
export type Following = "alone" | "coupled" | "engaged" | "clutched" | "lost";

const kDefaults = {
  scale: 1, forceScale: 1, rotation: { w: 1, x: 0, y: 0, z: 0 }, axes: "xyz", clutchButton: undefined, toggle: false,
  engageBy: "button", speed: 0.25, spin: 2, rampS: 0.3, gripRatio: 1, gripSpeed: 0.1, rateHz: 500,
} as const;
type Complete = Required<FollowerConfig>;

/** Time constant of the delay that counts as usual. */
const kSmoothingMs = 1000;
/** A robot program that paused does not catch up at once. */
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
  expect(/^(?=.)x?y?z?$/.test(axes), "axes", `"${axes}"`, 'some of "xyz", in that order');
  if (isClutch) between(0, 31, { clutchButton: clutchButton! });
  expect(engageBy === "button" || engageBy === "call", "engageBy", `"${engageBy}"`, '"button" or "call"');
  expect(engageBy === "call" || isClutch, "engageBy", '"button"', '"call": there is no clutchButton');
  expect(!toggle || isClutch, "toggle", "true", "false: there is no clutchButton");
  between(0.001, 10, { speed });
  between(0.01, 100, { spin });
  between(0, 10, { rampS });
  between(0.001, 1000, { gripRatio });
  between(0.001, 100, { gripSpeed });
  between(1, 100000, { rateHz });
  return config;
}

/**
 * Map, clutch, loss ladder and signs of a robot that follows a hand. It has no clock and no timer: `nowMs` is when a state
 * came, of any clock that does not go back (performance.now()).
 *
 *     const follow = new Follower({ scale: 0.5, clutchButton: 1 });
 *     const physics = (hand: DeviceState) => {
 *       move(follow.target(hand, robot.pose(), performance.now())); // undefined: the robot holds its place
 *       return follow.touch(robot.contact());
 *     };
 *     setInterval(() => move(follow.silence(performance.now())), 10);
 *
 * Position p, orientation q; l is the hand (the leader), f the tool (the follower), 0 the moment of engaging:
 *
 *     p_f = p_f0 + s_x R M (p_l − p_l0)        q_f = (R q_l q_l0⁻¹ R⁻¹) q_f0        M leaves out axes that are not coupled
 *     F_l = s_f M Rᵀ F_f                       τ_l = s_f / s_x Rᵀ τ_f               K_l = s_f s_x M Rᵀ K_f R M
 *
 * Nothing moves before the act of engaging, by the button or engage(). The pose of that moment is the offset: neither
 * engaging nor releasing the clutch moves the robot. The age of the newest state beyond the smoothed delay decides when states
 * stop, v being three periods and at least 20 ms:
 *
 *     v             the target stays where it is
 *     v + 20 ms     undefined: the robot holds its place
 *     v + 250 ms    lost: a new state couples again, only a new act engages
 *
 * The two clocks are never compared. A fault or a disarmed device disengages, as does a pose that is not finite.
 * Throws the RangeError "FIELD = VALUE: expected …" for an impossible config.
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
  /** The button at the newest state: only one that was seen free can be pressed. */
  #held = true;
  #tick = 0n;
  #sampledNs = 0n;
  /** Of the state that began the link: the others are counted from it. */
  #base: { readonly ms: number; readonly sampledNs: bigint } | undefined;
  /** ms, smoothed delay, less that of the first state. */
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
  /** The newest sentence for the operator; empty: none. */
  get words(): string {
    return this.#words;
  }

  /** The act, for the next state. False, and nothing happens, unless states come and the robot does not follow. */
  engage(): boolean {
    return (this.#asked = this.#phase === "coupled");
  }
  /** The robot stands until the next act. */
  disengage(): void {
    this.#asked = false;
    if (this.#phase === "engaged" || this.#phase === "clutched") this.#phase = "coupled";
  }
  /** False, and nothing changes, while the robot follows. Throws a RangeError when a scale is out of its bounds. */
  setScale(scale: number, forceScale: number): boolean {
    between(0.01, 100, { scale, forceScale });
    if (this.#phase === "engaged") return false;
    [this.#scale, this.#forceScale] = [scale, forceScale];
    return true;
  }

  /** Where the tool is to go, no faster than `speed`; undefined: hold. `pose`: where the tool is. */
  target(hand: DeviceState, pose: Pose, nowMs: number): Pose | undefined {
    let elapsed = this.#advance(nowMs);
    if (hand.tick < this.#tick) this.#lose(); // another server, or the same one anew
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

  /** The same while no state comes, every few milliseconds: the frozen target, then undefined. */
  silence(nowMs: number): Pose | undefined {
    this.#advance(nowMs);
    if (this.#phase === "engaged" && this.#age() <= this.#lateMs + kHoldMs) return this.#target;
    this.#waits = true;
    return undefined;
  }

  /**
   * What the hand feels of the tool's contact; nothing while the robot does not follow. null for undefined: nothing is sent,
   * because a zero would look measured.
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

  /** Stiffness and surface in the hand's units, where both are known. */
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

  /** Time passes; ms since the last time, bounded. */
  #advance(nowMs: number): number {
    const elapsed = Math.max(nowMs - this.#now, 0);
    this.#now = Math.max(nowMs, this.#now);
    if (this.#age() > this.#lateMs + kLostMs) this.#lose();
    return Math.min(elapsed, kLongestStepMs);
  }

  /** ms, of the newest state, beyond the smoothed delay. */
  #age(): number {
    if (!this.#base) return 0;
    return this.#now - this.#base.ms - Number(this.#sampledNs - this.#base.sampledNs) / 1e6 - this.#usual;
  }

  /** A new state; its age as it comes. The first one after silence says what delay is usual. */
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

  /** What the operator does. */
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

  /** Engaged from a map that moves nothing now. */
  #begin(hand: DeviceState, pose: Pose): void {
    [this.#phase, this.#gainFrom, this.#pose0, this.#waits] = ["engaged", this.#now, pose, true];
    this.#hand0 = { position: hand.position, orientation: hand.turning?.orientation };
  }

  /** The target goes to the hand's place, no faster than it may. */
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

/** Of a way, so that no more than `most` is gone. */
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

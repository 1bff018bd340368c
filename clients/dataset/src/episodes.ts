// SPDX-License-Identifier: Apache-2.0
// Extracts episodes from a coupling, one for each time that the operator engaged.
import type { Moment } from "./demonstration.js";
import { add, closer, inverse, less, product, times, type Quat, type Vec3 } from "./geometry.js";
import type { Act, CouplingSink, End, Port, PoseMap, Step } from "./recording.js";

/** A pose of the follower's tool in its base frame, m. Orientation and grip are undefined if they are not coupled. */
export interface Pose {
  readonly position: Vec3;
  readonly orientation?: Quat | undefined;
  /** The opening of the gripper at the fingers, m. A robot's program can use another unit. */
  readonly grip?: number | undefined;
}

/** N and N·m, about the position of the tool or handle. */
export interface Wrench {
  readonly force: Vec3;
  readonly torque?: Vec3 | undefined;
}

export interface Frame {
  readonly pose: Pose;
  /** m/s */
  readonly velocity: Vec3;
  /** On the tool. It is undefined if it was not measured. */
  readonly contact?: Wrench | undefined;
  /** Exerted by the leader's device on the hand. It is undefined if it is not known. */
  readonly hand?: Wrench | undefined;
  /** The requested pose. */
  readonly action: Pose;
  /** The name of the sender of the action, for example "operator". Undefined if the action is held. */
  readonly sender?: string | undefined;
}

export interface Episode {
  readonly frames: readonly Frame[];
  /** The error of the clock of the follower relative to the leader is at most this value, s. Undefined if not known. */
  readonly clockError?: number | undefined;
}

/** Finds the newest row that is not later than t. The t of calls must increase, since older rows are forgotten. */
class Latest<T> {
  #rows: { readonly t: number; readonly value: T }[] = [];
  #first = 0;

  push(t: number, value: T): void {
    this.#rows.push({ t, value });
  }

  /** The time of the newest row, or −∞. */
  get end(): number {
    return this.#rows.at(-1)?.t ?? -Infinity;
  }

  at(t: number): T | undefined {
    while (this.#first + 1 < this.#rows.length && this.#rows[this.#first + 1]!.t <= t) ++this.#first;
    if (2 * this.#first > this.#rows.length) {
      this.#rows = this.#rows.slice(this.#first);
      this.#first = 0;
    }
    const row = this.#rows[this.#first];
    return row && row.t <= t ? row.value : undefined;
  }
}

const kEngaged = 4;
/** A gap of this time (s) between two states ends an episode. */
const kSilence = 0.5;
/** Messages of different ends and kinds may be out of order by this time, s. */
const kDisorder = 1;

/** A time interval in which the follower was engaged. */
interface Interval {
  readonly act: Act;
  readonly from: number;
  to: number;
  over: boolean;
  readonly frames: Frame[];
  /** Number of the next frame. */
  next: number;
}

/**
 * Makes frames at `fps` from the beginning of each engagement. Episodes with fewer than two frames are omitted. Each
 * frame uses the newest records that are not later. The memory does not depend on the length of the recording, except
 * for the frames.
 */
export class CouplingEpisodes implements CouplingSink {
  readonly #fps: number;
  readonly #steps = { leader: new Latest<() => Step>(), follower: new Latest<() => Step>() };
  readonly #ports = { leader: new Latest<() => Port>(), follower: new Latest<() => Port>() };
  readonly #intervals: Interval[] = [];
  readonly #episodes: Episode[] = [];
  #map: PoseMap | undefined;
  #clockError: number | undefined;

  constructor(fps: number) {
    this.#fps = fps;
  }

  map(map: PoseMap): void {
    this.#map ??= map;
  }

  clockError(bound: number): void {
    this.#clockError = Math.max(bound, this.#clockError ?? 0);
  }

  step(end: End, t: number, read: () => Step): void {
    this.#steps[end].push(t, read);
  }

  port(end: End, t: number, act: Act, read: () => Port): void {
    this.#ports[end].push(t, read);
    if (end === "follower") {
      const current = this.#intervals.at(-1);
      const engaged = act.phase === kEngaged;
      const same = engaged && current?.over === false && current.act.engagement === act.engagement && t - current.to < kSilence;
      if (same) current.to = t;
      else if (current) current.over = true;
      if (engaged && !same) this.#intervals.push({ act, from: t, to: t, over: false, frames: [], next: 0 });
    }
    const ends = [this.#steps.leader, this.#steps.follower, this.#ports.leader, this.#ports.follower].map((rows) => rows.end);
    this.#advance(Math.max(Math.min(...ends), Math.max(...ends) - kDisorder));
  }

  /** Must be called once, after all records. */
  finish(): Episode[] {
    for (const interval of this.#intervals) interval.over = true;
    this.#advance(Infinity);
    return this.#episodes.map((episode) => ({ ...episode, clockError: this.#clockError }));
  }

  /** Makes all frames before the time `settled`. No older record may arrive after this call. */
  #advance(settled: number): void {
    for (let interval = this.#intervals[0]; interval; interval = this.#intervals[0]) {
      const timeOf = (frame: number): number => interval!.from + frame / this.#fps;
      for (; timeOf(interval.next) <= interval.to && timeOf(interval.next) < settled; ++interval.next) {
        const frame = this.#frame(timeOf(interval.next));
        if (frame) interval.frames.push(frame);
      }
      if (settled - interval.to >= kSilence) interval.over = true;
      if (!interval.over || timeOf(interval.next) <= interval.to) return;
      if (interval.frames.length > 1) this.#episodes.push({ frames: interval.frames });
      this.#intervals.shift();
    }
    for (const rows of [this.#steps, this.#ports]) {
      rows.leader.at(settled);
      rows.follower.at(settled);
    }
  }

  #frame(t: number): Frame | undefined {
    const step = this.#steps.follower.at(t)?.();
    const port = this.#ports.follower.at(t)?.();
    const wish = this.#ports.leader.at(t)?.();
    const hand = this.#steps.leader.at(t)?.();
    if (!step || !port || !wish || !this.#map) return undefined;
    const coupled = port.turn && wish.turn && step.orientation;
    return {
      pose: { position: step.position, orientation: coupled && step.orientation, grip: wish.opening === undefined ? undefined : port.opening },
      velocity: step.velocity,
      contact: step.contact && { force: step.contact },
      hand: hand && { force: hand.force, torque: hand.torque },
      action: requested(this.#map, step, port, wish),
      sender: wish.phase === kEngaged ? "operator" : undefined,
    };
  }
}

/** The pose that the leader requests: x_f − u_f + s R u_l and R r_l R⁻¹ r_f⁻¹ q_f (core/teleoperation/handle/turn_coupling.h). */
function requested({ scale, rotation }: PoseMap, step: Step, port: Port, wish: Port): Pose {
  const s = wish.positionScale || scale;
  const [x, y, z] = times(rotation, wish.displacement);
  let orientation: Quat | undefined;
  if (wish.turn && port.turn && step.orientation) {
    const [w, i, j, k] = wish.turn;
    const mapped: Quat = [w, ...times(rotation, [i, j, k])];
    orientation = closer(product(product(mapped, inverse(port.turn)), step.orientation), step.orientation);
  }
  return {
    position: add(less(step.position, port.displacement), [s * x, s * y, s * z]), orientation,
    grip: port.opening === undefined ? undefined : wish.opening,
  };
}

/** s, because times are in ns and sums of floating-point numbers are not exact. */
const kRounding = 1e-7;

/** Returns the sequences in which the robot was engaged. Holding the clutch does not end a sequence. */
function followed(moments: readonly Moment[]): Moment[][] {
  const found: Moment[][] = [];
  let open = false;
  let before = -Infinity;
  for (const moment of moments) {
    const goesOn: boolean = open && moment.t >= before && moment.t - before < kSilence;
    const engaged = moment.phase === "engaged";
    open = engaged || (goesOn && moment.phase === "clutched");
    if (open && goesOn) found.at(-1)!.push(moment);
    else if (open) found.push([moment]);
    before = moment.t;
  }
  return found;
}

/**
 * Like CouplingEpisodes, for a robot that is a client. The velocity is the finite difference between two samples. It is
 * zero in the first frame and unchanged in frames without a new sample. The action does not change while the robot is
 * not following.
 */
export function episodesOfRobot(moments: readonly Moment[], fps: number): Episode[] {
  const episodes: Episode[] = [];
  for (const act of followed(moments)) {
    const robot = new Latest<Moment>();
    for (const moment of act) robot.push(moment.t, moment);
    const [from, to] = [act[0]!.t + kRounding, act.at(-1)!.t + kRounding];
    const frames: Frame[] = [];
    let last = act[0]!;
    let velocity: Vec3 = [0, 0, 0];
    let action = last.target ?? last.pose;
    let at = 0;
    for (let k = 0; from + k / fps <= to; ++k) {
      const moment = robot.at(from + k / fps)!;
      for (; act[at] !== moment; ++at) action = act[at]!.target ?? action;
      action = moment.target ?? action;
      const elapsed = moment.t - last.t;
      const [x, y, z] = less(moment.pose.position, last.pose.position);
      if (elapsed > 0) velocity = [x / elapsed, y / elapsed, z / elapsed];
      frames.push({ pose: moment.pose, velocity, contact: moment.contact, action, sender: moment.target && moment.sender });
      last = moment;
    }
    if (frames.length > 1) episodes.push({ frames });
  }
  return episodes;
}

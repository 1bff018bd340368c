// SPDX-License-Identifier: Apache-2.0
// Extracts episodes from a coupling, one for each time that the operator engaged.
import type { Moment } from "./demonstration.js";
import type { Coupling, PoseMap, Port, Step, Vec3 } from "./recording.js";

export interface Frame {
  /** The position and velocity of the follower's tool in its base frame, m and m/s. */
  readonly state: readonly number[];
  /** The contact force on the tool, N. It is undefined if it was not measured. */
  readonly contact?: Vec3 | undefined;
  /** The position that was requested by the operator, in the base frame of the follower, m. */
  readonly action: Vec3;
}

export interface Episode {
  readonly frames: readonly Frame[];
}

const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const less = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

function mapped({ scale, rotation }: PoseMap, u: Vec3): Vec3 {
  const row = (r: Vec3): number => scale * (r[0] * u[0] + r[1] * u[1] + r[2] * u[2]);
  return [row(rotation[0]), row(rotation[1]), row(rotation[2])];
}

/** Finds the last row in the sorted `rows` that is not later than t. The search starts at the previous result. */
class Latest<T extends { readonly t: number }> {
  readonly #rows: readonly T[];
  #next = 0;

  constructor(rows: readonly T[]) {
    this.#rows = rows;
  }

  at(t: number): T | undefined {
    while (this.#next < this.#rows.length && this.#rows[this.#next]!.t <= t) ++this.#next;
    return this.#rows[this.#next - 1];
  }
}

const kEngaged = 4;

/** Returns the time intervals in which the follower was engaged. */
function acts(ports: readonly Port[]): { readonly from: number; readonly to: number }[] {
  const found: { from: number; to: number }[] = [];
  let before: Port | undefined;
  for (const port of ports) {
    if (port.phase === kEngaged) {
      const same = before?.phase === kEngaged && before.engagement === port.engagement;
      if (same) found.at(-1)!.to = port.t;
      else found.push({ from: port.t, to: port.t });
    }
    before = port;
  }
  return found;
}

/** Returns frames at `fps` from the beginning of each engagement. Episodes with fewer than two frames are omitted. */
export function episodesOf({ leader, follower, map }: Coupling, fps: number): Episode[] {
  const tool = new Latest<Step>(follower.steps);
  const told = new Latest<Port>(follower.ports);
  const hand = new Latest<Port>(leader.ports);
  const episodes: Episode[] = [];
  for (const { from, to } of acts(follower.ports)) {
    const frames: Frame[] = [];
    for (let k = 0; from + k / fps <= to; ++k) {
      const t = from + k / fps;
      const [step, port, wish] = [tool.at(t), told.at(t), hand.at(t)];
      if (!step || !port || !wish) continue;
      const offset = less(step.position, port.displacement);
      frames.push({
        state: [...step.position, ...step.velocity], contact: step.contact, action: add(offset, mapped(map, wish.displacement)),
      });
    }
    if (frames.length > 1) episodes.push({ frames });
  }
  return episodes;
}

/** If there is no state for this time (s), the robot has lost the hand. */
const kSilence = 0.5;
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
 * Like episodesOf, for a robot that is a client. The velocity is the finite difference between two samples. It is
 * zero in the first frame and unchanged in frames without a new sample. The action does not change while the robot is
 * not following.
 */
export function episodesOfRobot(moments: readonly Moment[], fps: number): Episode[] {
  const episodes: Episode[] = [];
  for (const act of followed(moments)) {
    const robot = new Latest<Moment>(act);
    const [from, to] = [act[0]!.t + kRounding, act.at(-1)!.t + kRounding];
    const frames: Frame[] = [];
    let last = act[0]!;
    let velocity = [0, 0, 0];
    let wish = last.target ?? last.position;
    let at = 0;
    for (let k = 0; from + k / fps <= to; ++k) {
      const moment = robot.at(from + k / fps)!;
      for (; act[at] !== moment; ++at) wish = act[at]!.target ?? wish;
      wish = moment.target ?? wish;
      const elapsed = moment.t - last.t;
      if (elapsed > 0) velocity = less(moment.position, last.position).map((d) => d / elapsed);
      frames.push({ state: [...moment.position, ...velocity], contact: moment.contact, action: wish });
      last = moment;
    }
    if (frames.length > 1) episodes.push({ frames });
  }
  return episodes;
}

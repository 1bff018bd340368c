// SPDX-License-Identifier: Apache-2.0
// Defines the columns of a dataset. Their names must not contain "/", because LeRobot does not accept it.
import type { Episode, Frame, Pose, Wrench } from "./episodes.js";

export type Layout = "v3.0" | "v2.1";

export interface Feature {
  readonly dtype: "float32" | "int64";
  /** The names of the components of a list. It is null for a single number. */
  readonly names: readonly string[] | null;
  readonly of: (frame: Frame, at: Index) => readonly number[];
  /** Additional information for users of the dataset, which LeRobot ignores. */
  readonly info?: Readonly<Record<string, unknown>>;
}

export type Features = ReadonlyMap<string, Feature>;
/** Contains the rows of an episode for each feature. The values are already rounded to float32 or integers. */
export type Rows = ReadonlyMap<string, readonly (readonly number[])[]>;

/** Position of a frame in the dataset. */
export interface Index {
  readonly frame: number;
  readonly episode: number;
  readonly whole: number;
  readonly fps: number;
}

const kWrench = ["fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm"];
const wrenchOf = ({ force, torque = [0, 0, 0] }: Wrench): number[] => [...force, ...torque];

/** The senders of actions; the index is the value of `tendon.sender`. */
function sendersOf(episodes: readonly Episode[]): string[] {
  const named = new Set(episodes.flatMap(({ frames }) => frames.flatMap(({ sender }) => sender ?? [])));
  return ["held", ...named];
}

/** Returns the features by name. A feature is omitted if it was not measured in all frames. */
export function featuresOf(episodes: readonly Episode[], layout: Layout): Features {
  const every = (has: (frame: Frame) => unknown): boolean => episodes.every(({ frames }) => frames.every((frame) => has(frame) !== undefined));
  const one = (dtype: Feature["dtype"], of: (at: Index) => number): Feature => ({ dtype, names: null, of: (_, at) => [of(at)] });
  const all = new Map<string, Feature>();
  const add = (name: string, names: readonly string[], of: Feature["of"], info?: Feature["info"]): void => {
    all.set(name, { dtype: "float32", names, of, ...(info && { info }) });
  };
  if (layout === "v2.1") {
    add("observation.state", ["x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"], ({ pose, velocity }) => [...pose.position, ...velocity]);
    if (every(({ contact }) => contact)) add("observation.contact_force", ["x_n", "y_n", "z_n"], ({ contact }) => contact!.force);
    add("action", ["x_m", "y_m", "z_m"], ({ action }) => action.position);
  } else {
    const turns = every(({ pose, action }) => pose.orientation && action.orientation);
    const grips = every(({ pose, action }) => (pose.grip === undefined ? undefined : action.grip));
    const names = ["x_m", "y_m", "z_m", ...(turns ? ["qw", "qx", "qy", "qz"] : []), ...(grips ? ["grip"] : [])];
    const poseOf = ({ position, orientation, grip }: Pose): number[] => [...position, ...(turns ? orientation! : []), ...(grips ? [grip!] : [])];
    const errors = episodes.map(({ clockError }) => clockError);
    const clocks = errors.every((error) => error !== undefined) ? { clock_error_s: Math.max(...errors) } : undefined;
    const senders = sendersOf(episodes);
    add("observation.state", names, ({ pose }) => poseOf(pose));
    add("observation.velocity", ["vx_mps", "vy_mps", "vz_mps"], ({ velocity }) => velocity);
    if (every(({ contact }) => contact)) {
      const torque = every(({ contact }) => contact!.torque) ? "measured" : "not measured in every frame, 0 if not";
      add("observation.wrench", kWrench, ({ contact }) => wrenchOf(contact!), { torque });
    }
    add("action", names, ({ action }) => poseOf(action), clocks);
    if (every(({ hand }) => hand)) add("tendon.hand_wrench", kWrench, ({ hand }) => wrenchOf(hand!), clocks);
    all.set("tendon.sender", {
      dtype: "int64", names: null, of: ({ sender }) => [sender === undefined ? 0 : senders.indexOf(sender, 1)], info: { senders },
    });
  }
  all.set("timestamp", one("float32", ({ frame, fps }) => frame / fps));
  all.set("frame_index", one("int64", ({ frame }) => frame));
  all.set("episode_index", one("int64", ({ episode }) => episode));
  all.set("index", one("int64", ({ whole }) => whole));
  all.set("task_index", one("int64", () => 0));
  return all;
}

export function rowsOf(features: Features, { frames }: Episode, first: Omit<Index, "frame">): Rows {
  return new Map([...features].map(([name, { dtype, of }]) => {
    const stored = dtype === "float32" ? Math.fround : (value: number): number => value;
    return [name, frames.map((frame, k) => of(frame, { ...first, frame: k, whole: first.whole + k }).map(stored))];
  }));
}

/** Returns the features in the format of meta/info.json. */
export function described(features: Features): Record<string, object> {
  return Object.fromEntries([...features].map(([name, { dtype, names, info }]) =>
    [name, { dtype, shape: [names?.length ?? 1], names, ...(info && { info }) }]));
}

// SPDX-License-Identifier: Apache-2.0

/** One haptic step. Unknown values are NaN. */
export interface Sample {
  /** s */ t: number;
  /** m */ x: number;
  y: number;
  z: number;
  /** N */ wx: number;
  wy: number;
  wz: number;
  /** N */ ax: number;
  ay: number;
  az: number;
  /** N */ permitted: number;
  /** J */ energy: number;
  reasons: number;
  mode: number;
  /** s */ age: number;
  /** s, that the step came late; only in recordings */ late: number;
  /** What the handle has beyond a point; undefined where it has nothing. */ handle?: HandleSample;
}

const kHandleColumns = ["qw", "qx", "qy", "qz", "tx", "ty", "tz", "hx", "hy", "hz", "grip", "gripForce", "buttons", "nx", "ny", "nz", "gap", "field", "depth", "px", "py", "pz"] as const;
/**
 * q…: orientation of the handle in the base frame; t…: N·m, applied; h…: N, force of the hand; grip: rad; gripForce:
 * N; buttons: bits; n… and gap: the contact surface of the engine (see contactOf); field: the generation of the
 * rendered field; depth: m, from the proxy p… to the hand.
 */
export type HandleColumn = (typeof kHandleColumns)[number];
export type HandleSample = Record<HandleColumn, number>;

/** All values are unknown, and no button is pressed. */
export const noHandle = (): HandleSample => ({ ...kNoHandle });
const kNoHandle = Object.freeze(Object.fromEntries(kHandleColumns.map((name) => [name, name === "buttons" ? 0 : NaN])) as HandleSample);

const kColumns = ["x", "y", "z", "wx", "wy", "wz", "ax", "ay", "az", "permitted", "energy", "age", "late", "wanted", "applied"] as const;
/** A column of numbers. `wanted` and `applied` are norms. */
export type Column = (typeof kColumns)[number] | HandleColumn;
const kNothing = new Float32Array();

/** Input of a plot: columns, with rows sorted by time. */
export interface Plotted<C extends string> {
  readonly t: ArrayLike<number>;
  readonly begin: number;
  readonly end: number;
  readonly length: number;
  column(name: C): ArrayLike<number>;
  /** Index of the first row at or after `time`. */
  at(time: number): number;
}

/** Steps in columns, sorted by time. For a live device, only the newest `limit` steps. */
export class Track implements Plotted<Column> {
  t = new Float64Array(4096);
  reasons = new Uint32Array(4096);
  mode = new Uint8Array(4096);
  readonly #columns: Record<(typeof kColumns)[number], Float32Array>;
  /** These are only created if a step has such values. */
  #handle: Record<HandleColumn, Float32Array> | undefined;
  /** True if a step had a field. */
  hasField = false;
  /** Indices of the first kept step and of the end. */
  begin = 0;
  end = 0;

  constructor(readonly limit = Infinity) {
    this.#columns = Object.fromEntries(kColumns.map((name) => [name, new Float32Array(4096)])) as Record<(typeof kColumns)[number], Float32Array>;
  }

  get length(): number {
    return this.end - this.begin;
  }
  get first(): number {
    return this.length > 0 ? this.t[this.begin]! : 0;
  }
  get last(): number {
    return this.length > 0 ? this.t[this.end - 1]! : 0;
  }
  /** Returns an empty array for a quantity of the handle or field that no step has. */
  column(name: Column): Float32Array {
    return (this.#columns as Partial<Record<Column, Float32Array>>)[name] ?? this.#handle?.[name as HandleColumn] ?? kNothing;
  }

  push(s: Sample): void {
    if (this.end === this.t.length) this.#makeRoom();
    const i = this.end++;
    const c = this.#columns;
    this.t[i] = s.t;
    c.x[i] = s.x;
    c.y[i] = s.y;
    c.z[i] = s.z;
    c.wx[i] = s.wx;
    c.wy[i] = s.wy;
    c.wz[i] = s.wz;
    c.ax[i] = s.ax;
    c.ay[i] = s.ay;
    c.az[i] = s.az;
    c.permitted[i] = s.permitted;
    c.energy[i] = s.energy;
    c.age[i] = s.age;
    c.late[i] = s.late;
    c.wanted[i] = Math.hypot(s.wx, s.wy, s.wz);
    c.applied[i] = Math.hypot(s.ax, s.ay, s.az);
    this.reasons[i] = s.reasons;
    this.mode[i] = s.mode;
    if (s.handle || this.#handle) this.#pushHandle(i, s.handle ?? kNoHandle);
    this.hasField ||= s.handle !== undefined && s.handle.field > 0;
    if (this.length > this.limit) ++this.begin;
  }

  clear(): void {
    this.begin = this.end = 0;
    this.#handle = undefined;
    this.hasField = false;
  }

  at(time: number): number {
    let [low, high] = [this.begin, this.end];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.t[middle]! < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  after(time: number): number {
    let i = this.at(time);
    while (i < this.end && this.t[i]! === time) ++i;
    return i;
  }

  #pushHandle(i: number, handle: HandleSample): void {
    this.#handle ??= Object.fromEntries(
      kHandleColumns.map((name) => [name, new Float32Array(this.t.length).fill(kNoHandle[name])])) as Record<HandleColumn, Float32Array>;
    for (const name of kHandleColumns) this.#handle[name][i] = handle[name];
  }

  #makeRoom(): void {
    const columns = [this.t, this.reasons, this.mode, ...Object.values(this.#columns), ...Object.values(this.#handle ?? {})];
    if (this.begin > this.t.length / 2) {
      for (const column of columns) column.copyWithin(0, this.begin, this.end);
      [this.begin, this.end] = [0, this.length];
      return;
    }
    const grown = <T extends Float64Array | Float32Array | Uint32Array | Uint8Array>(column: T): T => {
      const larger = new (column.constructor as new (length: number) => T)(2 * column.length);
      larger.set(column);
      return larger;
    };
    this.t = grown(this.t);
    this.reasons = grown(this.reasons);
    this.mode = grown(this.mode);
    for (const name of kColumns) this.#columns[name] = grown(this.#columns[name]);
    if (this.#handle) for (const name of kHandleColumns) this.#handle[name] = grown(this.#handle[name]);
  }
}

/** Reduces steps to `columns` pixels: minimum and maximum in each pixel; null in gaps. */
export function thin<C extends string>(
  track: Plotted<C>, names: readonly C[], from: number, to: number, columns: number, scale: number,
): [number[], ...(number | null)[][]] {
  const first = Math.max(track.begin, track.at(from) - 1);
  const last = Math.min(track.end, track.at(to) + 1);
  const times: number[] = [];
  const values: (number | null)[][] = names.map(() => []);
  const sources = names.map((name) => track.column(name));
  const gap = Math.max(20 * usualStep(track), 0.06);
  const put = (column: number, value: number): void => {
    values[column]!.push(Number.isFinite(value) ? value * scale : null);
  };
  if (last - first <= 2 * columns) {
    for (let i = first; i < last; ++i) {
      if (i > first && track.t[i]! - track.t[i - 1]! > gap) {
        times.push((track.t[i]! + track.t[i - 1]!) / 2);
        for (const column of values) column.push(null);
      }
      times.push(track.t[i]!);
      sources.forEach((source, k) => put(k, source[i]!));
    }
    return [times, ...values];
  }
  // The grid is fixed in time; otherwise the picture would flicker.
  const width = Math.max((to - from) / columns, 1e-9);
  const lows = sources.map(() => 0);
  const highs = sources.map(() => 0);
  const start = track.at(from);
  if (start >= last) return [times, ...values];
  for (let i = start, cell = Math.floor(track.t[start]! / width); i < last; ++cell) {
    const end = track.at((cell + 1) * width);
    const stop = Math.min(Math.max(end, i), last);
    const some = stop > i;
    // A pixel without a step is not necessarily a gap.
    if (!some && i > track.begin && track.t[i]! - track.t[i - 1]! <= gap) continue;
    times.push(cell * width, (cell + 0.5) * width);
    sources.forEach((source, k) => {
      if (!some) return void values[k]!.push(null, null);
      lows[k] = i;
      highs[k] = i;
      for (let j = i + 1; j < stop; ++j) {
        if (source[j]! < source[lows[k]!]!) lows[k] = j;
        if (source[j]! > source[highs[k]!]!) highs[k] = j;
      }
      put(k, source[Math.min(lows[k]!, highs[k]!)]!);
      put(k, source[Math.max(lows[k]!, highs[k]!)]!);
    });
    i = stop;
  }
  return [times, ...values];
}

/** s, time between steps. */
export function usualStep(track: Pick<Plotted<string>, "t" | "begin" | "length">): number {
  const n = Math.min(track.length, 200);
  return n < 2 ? 0.001 : (track.t[track.begin + n - 1]! - track.t[track.begin]!) / (n - 1);
}

/** Mode of a step with a fresh force (core/base/mode.h). */
const kActive = 2;

export interface Shares {
  /** Of them that have each reason bit. */ readonly share: Map<number, number>;
  /** Of them with any that limits the force. */ readonly any: number;
  /** N, median and 95th percentile: how much the force differed from the one asked for, in steps with any. */ readonly apart: readonly [number, number];
  readonly n: number;
  /** They reach from the first one with a fresh force to the last; else there was none, and they are all. */ readonly served: boolean;
}

/** Statistics of [from, to], restricted to the range from the first to the last step with a fresh force. */
export function shares(track: Track, from: number, to: number, limiting: number): Shares {
  let [first, last] = [track.at(from), track.after(to)];
  const all = [first, last] as const;
  while (first < last && track.mode[first] !== kActive) ++first;
  while (first < last && track.mode[last - 1] !== kActive) --last;
  const served = first < last;
  if (!served) [first, last] = all;
  const counts = new Uint32Array(32);
  const [wx, wy, wz, ax, ay, az] = (["wx", "wy", "wz", "ax", "ay", "az"] as const).map((name) => track.column(name)) as [
    Float32Array, Float32Array, Float32Array, Float32Array, Float32Array, Float32Array];
  const apart: number[] = [];
  let any = 0;
  for (let i = first; i < last; ++i) {
    const bits = track.reasons[i]!;
    if (bits === 0) continue;
    if ((bits & limiting) !== 0) {
      ++any;
      const by = Math.hypot(wx[i]! - ax[i]!, wy[i]! - ay[i]!, wz[i]! - az[i]!);
      if (Number.isFinite(by)) apart.push(by);
    }
    for (let b = 0; b < 16; ++b) counts[b]! += (bits >>> b) & 1;
  }
  const n = last - first;
  const share = new Map<number, number>();
  counts.forEach((c, bit) => c > 0 && share.set(bit, c / n));
  const sorted = Float64Array.from(apart).sort();
  const at = (q: number): number => (sorted.length === 0 ? NaN : sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))]!);
  return { share, any: n > 0 ? any / n : 0, apart: [at(0.5), at(0.95)], n, served };
}

/** Quantiles of one column over the steps in [from, to]; NaN without numbers. */
export function quantiles(track: Track, name: Column, from: number, to: number, wanted: readonly number[]): number[] {
  const values = track.column(name).slice(track.at(from), track.after(to)).filter((v) => Number.isFinite(v)).sort();
  return wanted.map((q) => (values.length === 0 ? NaN : values[Math.min(values.length - 1, Math.floor(q * values.length))]!));
}

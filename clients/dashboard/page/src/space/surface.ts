// SPDX-License-Identifier: Apache-2.0
import type { Track } from "../track.js";
import { rotated, type Quat, type Vec } from "./figure.js";

/** A place where the tool was in contact: the position of the proxy (m), and the normal, which points away from the hand. */
export interface Patch {
  readonly generation: number;
  readonly at: Vec;
  readonly normal: Vec;
}

/** m. There is at most one patch per cell of this size. */
export const kPatchCell = 2e-3;
/** If there are more, the oldest ones are removed. */
export const kMostPatches = 4096;
/** m. At a smaller depth, the direction from the hand to the proxy is not accurate. */
const kLeastDepth = 2e-4;

/**
 * The part of the surface of a field that the tool has touched, in the base frame of the device. The proxy is on the
 * surface, and the shape is not sent to observers. If the object moves, its earlier places remain.
 */
export class TouchedSurface {
  readonly #patches = new Map<string, Patch>();
  #track: Track | undefined;
  #seen = -Infinity;
  /** Increases with each change. */
  version = 0;

  /** Adds the steps of `track` that are newer than those of the previous call. A different track replaces the previous
   * one. */
  follow(track: Track): void {
    if (track !== this.#track || track.last < this.#seen) {
      this.#track = track;
      this.#seen = -Infinity;
      this.#patches.clear();
      ++this.version;
    }
    if (!track.hasField) return;
    const [x, y, z, px, py, pz] = (["x", "y", "z", "px", "py", "pz"] as const).map((name) => track.column(name)) as [
      Float32Array, Float32Array, Float32Array, Float32Array, Float32Array, Float32Array];
    const [depth, field] = [track.column("depth"), track.column("field")];
    for (let i = Math.max(track.after(this.#seen), track.begin); i < track.end; ++i) {
      if (!(depth[i]! > kLeastDepth && field[i]! > 0)) continue;
      const at: Vec = [px[i]!, py[i]!, pz[i]!];
      const key = [field[i]!, ...at.map((v) => Math.round(v / kPatchCell))].join(" ");
      if (this.#patches.has(key)) continue;
      const way: Vec = [at[0] - x[i]!, at[1] - y[i]!, at[2] - z[i]!];
      const length = Math.hypot(...way);
      if (!(length > 0)) continue;
      this.#patches.set(key, { generation: field[i]!, at, normal: [way[0] / length, way[1] / length, way[2] / length] });
      if (this.#patches.size > kMostPatches) this.#patches.delete(this.#patches.keys().next().value!);
      ++this.version;
    }
    this.#seen = track.last;
  }

  /** Returns the patches of a generation in the frame that `frame` rotates to. */
  patches(generation: number, frame: Quat): Patch[] {
    return [...this.#patches.values()].filter((patch) => patch.generation === generation)
      .map((patch) => ({ ...patch, at: rotated(frame, patch.at), normal: rotated(frame, patch.normal) }));
  }
}

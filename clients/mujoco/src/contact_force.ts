// SPDX-License-Identifier: Apache-2.0
import type { DoubleBuffer, MainModule, MjData, MjModel } from "@mujoco/mujoco";

export type Triple = readonly [number, number, number];

/** Reads the contact forces on the geoms of one body. */
export class ContactForce {
  readonly #mj: MainModule;
  readonly #model: MjModel;
  readonly #geoms: ReadonlySet<number>;
  /** The force and the torque of one contact in its own frame. The first component is along the normal. */
  readonly #wrench: DoubleBuffer;

  constructor(mj: MainModule, model: MjModel, geoms: Iterable<number>) {
    [this.#mj, this.#model, this.#geoms] = [mj, model, new Set(geoms)];
    this.#wrench = new mj.DoubleBuffer(6);
  }

  /** Returns the force (N) in the newest step, in the frame of the scene. */
  on(data: MjData): Triple {
    const force: [number, number, number] = [0, 0, 0];
    const contacts = data.contact; // these are copies, and each copy that is not deleted leaks 1 kB
    for (let i = 0; i < contacts.size(); ++i) {
      const contact = contacts.get(i)!;
      const [first, second] = contact.geom;
      // The force acts on the second geom. If it is on a flex, the geom is not in the set.
      const sign = Number(this.#geoms.has(second)) - Number(this.#geoms.has(first));
      if (sign !== 0) {
        this.#mj.mj_contactForce(this.#model, data, i, this.#wrench);
        const wrench = this.#wrench.GetView(); // must not be kept: it becomes invalid when the heap grows
        const frame = contact.frame; // the rows are the axes
        for (let k = 0; k < 3; ++k)
          force[k]! += sign * (frame[k] * wrench[0] + frame[3 + k] * wrench[1] + frame[6 + k] * wrench[2]);
      }
      contact.delete();
    }
    contacts.delete();
    return force;
  }

  delete(): void {
    this.#wrench.delete();
  }
}

// SPDX-License-Identifier: Apache-2.0
import type { DoubleBuffer, MainModule, MjData, MjModel } from "@mujoco/mujoco";

/** x, y, z */
export type Triple = readonly [number, number, number];

/** Reads what contacts exert on the geoms of one body. */
export class ContactForce {
  readonly #mj: MainModule;
  readonly #model: MjModel;
  readonly #geoms: ReadonlySet<number>;
  /** One contact's force and torque in its own frame, the normal first. */
  readonly #wrench: DoubleBuffer;

  constructor(mj: MainModule, model: MjModel, geoms: Iterable<number>) {
    [this.#mj, this.#model, this.#geoms] = [mj, model, new Set(geoms)];
    this.#wrench = new mj.DoubleBuffer(6);
  }

  /** N, in the scene's frame, of the newest step. */
  on(data: MjData): Triple {
    const force: [number, number, number] = [0, 0, 0];
    const contacts = data.contact; // a copy, as is each of its members: who does not delete them leaks 1 kB each
    for (let i = 0; i < contacts.size(); ++i) {
      const contact = contacts.get(i)!;
      const [first, second] = contact.geom;
      // A contact's force is that on the second of the two; a flex is none of our geoms.
      const sign = Number(this.#geoms.has(second)) - Number(this.#geoms.has(first));
      if (sign !== 0) {
        this.#mj.mj_contactForce(this.#model, data, i, this.#wrench);
        const wrench = this.#wrench.GetView(); // anew each time: a view dies when the heap grows
        const frame = contact.frame; // its axes are the rows
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

// SPDX-License-Identifier: Apache-2.0
// Tests the upload and the use of fields in virtual time, with cases of tests/clients/python/test_upload.py.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import type { ControlAck } from "../../../clients/typescript/src/codec.js";
import type { FieldDescription } from "../../../clients/typescript/src/field.js";
import { Code, type FieldBrick, type FieldPose, type Request } from "../../../clients/typescript/src/messages.js";
import type { LinkStats } from "../../../clients/typescript/src/session.js";
import { kMillisecond as kMs, type Nanoseconds } from "../../../clients/typescript/src/time.js";
import { FieldUser, type FieldSession, type Motion } from "../../../clients/typescript/src/upload.js";
import { toHex } from "./support/bytes.js";
import { Random } from "./support/random.js";

const kDelay = 100n * kMs;
const kOffset = 1_000_000n * kMs;
const kAtRest: Motion = { position: { x: 0, y: 0, z: 0 }, turn: { w: 1, x: 0, y: 0, z: 0 } };

/** Bricks of random bytes, whose manifest has two parts. */
function randomField(count: number, seed: number): FieldDescription {
  const random = new Random(seed);
  const bytes = (size: number): Uint8Array => Uint8Array.from({ length: size }, () => Math.floor(256 * random.uniform()));
  const bricks = Array.from({ length: count }, () => ({ hash: bytes(16), weights: bytes(1024) }));
  const materials = [{ stiffness: 1500, branchStiffness: 0, relaxation: 0, friction: 0 }];
  return { name: bytes(32), manifest: bytes(1500), bricks, materials, fixtures: [], tables: [{ material: 0, step: 0.001, force: [0.5] }] };
}

/** A session over a network with a constant delay, and the receiver of a server, which keeps `store`. */
class Stage {
  readonly user = new FieldUser();
  now: Nanoseconds = 1000n * kMs;
  holds = true;
  loss = 0;
  readonly uses: (Request & { kind: "useField" })[] = [];
  readonly drops: string[] = [];
  readonly poses: FieldPose[] = [];
  bricks = 0;
  refusals: { code: Code; detail: string }[] = [];
  #offers = new Map<string, { field: FieldDescription; received: number; due: Nanoseconds }>();
  #later: [Nanoseconds, () => void][] = [];
  #ids = 0;
  readonly #random = new Random(7);

  constructor(readonly store: Set<string>, readonly fields: readonly FieldDescription[]) {
    this.open();
  }

  open(): void {
    this.#offers.clear();
    const session: FieldSession = {
      stats: { smoothedRoundTripMs: 200 } as LinkStats,
      peerTime: (now) => now + kOffset,
      request: (request) => {
        const id = ++this.#ids;
        this.#after(() => {
          const answer = this.#answer(request);
          this.#after(() => this.user.takeAnswer(this.now, { id, ...answer } as ControlAck));
        });
        return id;
      },
      sendBrick: (brick) => {
        if (this.#random.uniform() >= this.loss) this.#after(() => this.#take(brick));
        ++this.bricks;
      },
      sendPose: (pose) => this.#after(() => this.poses.push(pose)),
    };
    this.user.opened(session, { device: 1, channel: 2 });
  }

  run(ms: number, done = (): boolean => false): boolean {
    for (let i = 0; i < ms; ++i, this.now += kMs) {
      if (done()) return true;
      const due = this.#later.filter(([at]) => at <= this.now);
      this.#later = this.#later.filter(([at]) => at > this.now);
      for (const [, event] of due) event();
      for (const offer of this.#offers.values()) if (offer.due <= this.now) this.#tell(offer);
      this.user.tick(this.now, this.holds);
      while (this.user.hasBrick(this.now)) ;
    }
    return done();
  }

  #after(event: () => void): void {
    this.#later.push([this.now + kDelay, event]);
  }
  #take({ hash }: FieldBrick): void {
    this.store.add(toHex(hash));
  }
  #tell(offer: { field: FieldDescription; received: number; due: Nanoseconds }): void {
    const missing = new Uint8Array(128);
    const { bricks, manifest, name } = offer.field;
    if (offer.received < manifest.length) missing[127] = 0x80;
    else bricks.forEach(({ hash }, i) => (missing[i >> 3]! |= this.store.has(toHex(hash)) ? 0 : 1 << (i & 7)));
    offer.due = this.now + (missing.every((bits) => bits === 0) ? 1000n : 50n) * kMs;
    this.#after(() => this.user.takeStatus(this.now, { field: name, missing }));
  }
  #answer(request: Request): { code: Code; detail: string } {
    if (request.kind === "offerField") {
      const name = toHex(request.field);
      const field = this.fields.find((one) => toHex(one.name) === name)!;
      const offer = this.#offers.get(name) ?? { field, received: 0, due: this.now };
      assert.deepEqual(request.part, field.manifest.slice(request.offset, request.offset + 1000));
      offer.received = Math.max(offer.received, request.offset + request.part.length);
      this.#offers.set(name, offer);
    } else if (request.kind === "useField") {
      this.uses.push(request);
      return this.refusals.shift() ?? { code: Code.OK, detail: "" };
    } else if (request.kind === "dropField") {
      this.drops.push(toHex(request.field));
      this.#offers.delete(toHex(request.field));
    }
    return { code: Code.OK, detail: "" };
  }
}

describe("an upload", () => {
  it("uses the field when all bricks are there, at the rate of the server", () => {
    const field = randomField(200, 1);
    const stage = new Stage(new Set(), [field]);
    stage.user.use(field);
    assert.ok(stage.run(5000, () => stage.uses.length > 0));
    assert.equal(stage.bricks, 200, "no brick is repeated in vain");
    assert.ok(stage.now >= (1000n + 372n) * kMs, "183 bricks at 500 kB/s, after a burst of 17");
    const { device, channel, generation, materials, tables } = stage.uses[0]!;
    assert.deepEqual([device, channel, generation, materials[0]!.stiffness, tables![0]!.force], [1, 2, 1, 1500, [0.5]]);
  });

  it("sends lost bricks again", () => {
    const field = randomField(100, 2);
    const stage = new Stage(new Set(), [field]);
    stage.loss = 0.2;
    stage.user.use(field);
    assert.ok(stage.run(5000, () => stage.uses.length > 0));
    assert.equal(stage.store.size, 100);
    assert.ok(stage.bricks > 100 && stage.bricks < 150, `${stage.bricks} bricks`);
  });

  it("of a restarted engine sends nothing, and of a cut its bricks only", () => {
    const field = randomField(50, 3);
    const store = new Set(field.bricks.map(({ hash }) => toHex(hash)));
    const cut = { ...randomField(7, 4), bricks: [...field.bricks.slice(7), ...randomField(7, 5).bricks] };
    const stage = new Stage(store, [field, cut]);
    stage.user.use(field);
    assert.ok(stage.run(3000, () => stage.uses.length > 0));
    assert.equal(stage.bricks, 0);
    stage.user.use(cut);
    assert.ok(stage.run(3000, () => stage.uses.length > 1));
    assert.deepEqual([stage.bricks, stage.drops], [7, []]);
    stage.run(500);
    assert.deepEqual(stage.drops, [toHex(field.name)], "when the server has accepted the new one");
  });

  it("is done again in a new session", () => {
    const field = randomField(3, 6);
    const stage = new Stage(new Set(), [field]);
    stage.user.use(field);
    assert.ok(stage.run(3000, () => stage.uses.length > 0));
    stage.user.closed();
    stage.open();
    assert.ok(stage.run(3000, () => stage.uses.length > 1));
    assert.deepEqual([stage.bricks, stage.uses[1]!.generation], [3, 1]);
  });

  it("ends with a refusal, which is told; a busy server is asked again", () => {
    const field = randomField(3, 7);
    const stage = new Stage(new Set(), [field]);
    stage.refusals = [{ code: Code.BUSY, detail: "" }, { code: Code.INVALID, detail: "too stiff" }];
    stage.user.use(field);
    stage.run(5000);
    assert.deepEqual([stage.uses.length, stage.user.refused], [2, "too stiff"]);
    stage.user.use({ ...field, materials: [{ ...field.materials[0]!, stiffness: 500 }] });
    assert.ok(stage.run(1000, () => stage.uses.length === 3));
    assert.deepEqual([stage.uses[2]!.materials[0]!.stiffness, stage.user.refused, stage.bricks], [500, "", 3]);
  });

  it("needs the lease, and a use after each loss of it", () => {
    const field = randomField(3, 8);
    const stage = new Stage(new Set(), [field]);
    stage.holds = false;
    stage.user.use(field);
    stage.run(3000);
    assert.equal(stage.uses.length, 0);
    stage.holds = true;
    stage.run(500);
    stage.user.lostLease();
    stage.run(500);
    assert.deepEqual(stage.uses.map(({ generation }) => generation), [1, 2]);
  });

  it("stops with no field", () => {
    const field = randomField(3, 9);
    const stage = new Stage(new Set(), [field]);
    stage.user.use(field);
    assert.ok(stage.run(3000, () => stage.uses.length > 0));
    stage.user.use(undefined);
    stage.run(500);
    assert.deepEqual(stage.drops, [toHex(field.name)]);
  });
});

describe("poses", () => {
  it("are for the clock of the server, and at most 250 per second", () => {
    const stage = new Stage(new Set(), []);
    for (let i = 0; i < 500; ++i) {
      const moved = { ...kAtRest, position: { x: i / 1000, y: 0, z: 0 } };
      assert.ok(stage.user.move(stage.now, moved, 300n * kMs));
      stage.run(1);
    }
    const last = stage.now - kMs;
    stage.run(300);
    assert.ok(stage.poses.length >= 120 && stage.poses.length <= 127, `${stage.poses.length} poses`);
    assert.deepEqual(stage.poses.map(({ sequence }) => Number(sequence)), stage.poses.map((_, i) => i + 1));
    const { device, channel, position, timeNs } = stage.poses.at(-1)!;
    assert.deepEqual([device, channel, position.x], [1, 2, 0.499], "the newest one is not left out");
    assert.equal(timeNs, last + kOffset + 300n * kMs);
    stage.user.closed();
    assert.equal(stage.user.move(stage.now, kAtRest, 0n), false);
  });

  it("out of bounds are refused", () => {
    const user = new FieldUser();
    const far = { x: 11, y: 0, z: 0 };
    assert.throws(() => user.move(0n, { ...kAtRest, position: far }, 0n), /pose.position = 11: expected at most 10 m/);
    assert.throws(() => user.move(0n, { ...kAtRest, velocity: { ...far, x: NaN } }, 0n), /pose.velocity = NaN/);
    assert.throws(() => user.move(0n, { ...kAtRest, turn: { w: 1, x: 1, y: 0, z: 0 } }, 0n), /pose.turn = .*: expected a quaternion/);
  });
});

// SPDX-License-Identifier: Apache-2.0
// Sends a field to a server, and asks the server to use it. These are state machines, whose inputs are times and the
// messages of the session. clients/python/tendon/upload.py does the same.
import { expect } from "./expect.js";
import type { FieldDescription } from "./field.js";
import { kUnitTolerance } from "./limits.js";
import { Code, type FieldBrick, type FieldPose, type FieldStatus, type OfferField, type Quat, type Vec3 } from "./messages.js";
import type { ControlAck } from "./codec.js";
import type { Session } from "./session.js";
import { earliest, fromMilliseconds, kMillisecond, kNever, kSecond, latest, type Nanoseconds } from "./time.js";

/** Bytes of a manifest in one request, so that it fits into a datagram. */
const kMaxPart = 1000;
/** 1024 bytes at 500 kB/s. */
const kBrickInterval = 2_048_000n;
/** The number of bricks that can be sent at once after a pause is limited to this time. */
const kBurst = 33n * kMillisecond;
/** Jitter of a status, beyond the round trip. */
const kJitter = 10n * kMillisecond;
/** If no status is received for this time, the manifest is sent again, because the server may have dropped it. */
const kSilence = 2n * kSecond;
const kAskAgain = 50n * kMillisecond;
/** The limit of a server is 250 poses per second. */
const kPosePeriod = 4n * kMillisecond;
/** The maximum number of pending parts, so that other requests do not have to wait. */
const kMostParts = 12;

const isSame = (a: Uint8Array, b: Uint8Array): boolean => a.length === b.length && a.every((byte, i) => byte === b[i]);

/**
 * Uploads a field. It sends the manifest, waits for a status, and sends the missing bricks at a limited rate. If a brick
 * was sent more than a round trip before a status and is still missing, it is lost and has the highest priority. If the
 * server already has all bricks, only the manifest is sent.
 */
export class FieldSender {
  /** Whether the server has all bricks according to the newest status. */
  complete = false;
  /** The number of sent bricks, including repetitions. */
  sent = 0;
  #field: FieldDescription;
  /** Bytes of the manifest. */
  #offered = 0;
  /** Time of the newest status. */
  #heard: Nanoseconds | undefined;
  readonly #sentAt: (Nanoseconds | undefined)[];
  /** To be sent before the next status. */
  #queue: number[] = [];
  #next = 0n;

  constructor(field: FieldDescription) {
    this.#field = field;
    this.#sentAt = field.bricks.map(() => undefined);
  }

  get field(): FieldDescription {
    return this.#field;
  }
  /** `field` must have the same name. */
  change(field: FieldDescription): void {
    this.#field = field;
  }

  /** Returns the next part of the manifest, if any. Call partSent() if the request was added to the session. */
  nextPart(now: Nanoseconds): OfferField | undefined {
    const { name, manifest } = this.#field;
    this.#heard ??= now;
    if (this.#offered === manifest.length && !this.complete && now - this.#heard >= kSilence) {
      this.#offered = 0;
      this.#heard = now;
    }
    const part = manifest.slice(this.#offered, this.#offered + kMaxPart);
    return part.length > 0 ? { field: name, size: manifest.length, offset: this.#offered, part } : undefined;
  }
  partSent(): void {
    this.#offered = Math.min(this.#offered + kMaxPart, this.#field.manifest.length);
  }

  /** `roundTrip` is the smoothed round trip of the session. Returns false if this is the status of another field. */
  take(now: Nanoseconds, { field, missing }: FieldStatus, roundTrip: Nanoseconds): boolean {
    if (!isSame(field, this.#field.name)) return false;
    this.#heard = now;
    this.complete = missing.every((bits) => bits === 0);
    const arrivedBefore = now - roundTrip - roundTrip / 8n - kJitter;
    const absent = this.#sentAt.flatMap((_, i) => ((missing[i >> 3] ?? 0) >> (i & 7)) & 1 ? [i] : []);
    const fresh = absent.filter((i) => this.#sentAt[i] === undefined);
    const lost = absent.filter((i) => this.#sentAt[i] !== undefined && this.#sentAt[i]! < arrivedBefore);
    this.#queue = [...lost.sort((a, b) => Number(this.#sentAt[a]! - this.#sentAt[b]!)), ...fresh];
    return true;
  }

  /** Returns the next brick if it is due. The rate is limited by the generic cell rate algorithm (ITU-T I.371). */
  nextBrick(now: Nanoseconds): FieldBrick | undefined {
    const i = this.#next <= now ? this.#queue.shift() : undefined;
    if (i === undefined) return undefined;
    this.#next = latest(this.#next, now - kBurst) + kBrickInterval;
    this.#sentAt[i] = now;
    ++this.sent;
    return this.#field.bricks[i];
  }

  /** Returns when nextPart() and nextBrick() must be called next, if no status is received before. */
  due(): Nanoseconds {
    if (this.#offered < this.#field.manifest.length || this.#heard === undefined) return 0n;
    if (this.complete) return kNever;
    const again = this.#heard + kSilence;
    return this.#queue.length > 0 ? earliest(again, this.#next) : again;
  }
}

/** A pose of an object and its velocities, in the base frame of the device. */
export interface Motion {
  readonly position: Vec3;
  readonly turn: Quat;
  /** m/s and rad/s. Default: 0. */
  readonly velocity?: Vec3;
  readonly angularVelocity?: Vec3;
}

/** The part of Session that is used by FieldUser. */
export type FieldSession = Pick<Session, "request" | "sendBrick" | "sendPose" | "peerTime" | "stats">;

const kZero: Vec3 = { x: 0, y: 0, z: 0 };
const kFirst = { device: 0, channel: 0 };

/** The bounds of a server (core/field/field_pose.h). */
function checkMotion({ position, turn, velocity = kZero, angularVelocity = kZero }: Motion): void {
  for (const [name, { x, y, z }, most, unit] of
    [["position", position, 10, "m"], ["velocity", velocity, 10, "m/s"], ["angularVelocity", angularVelocity, 100, "rad/s"]] as const) {
    const length = Math.hypot(x, y, z);
    expect(length <= most, `pose.${name}`, length, `at most ${most} ${unit}`);
  }
  const length = Math.hypot(turn.w, turn.x, turn.y, turn.z);
  expect(Math.abs(length - 1) <= kUnitTolerance, "pose.turn", length, "a quaternion of length 1");
}

/**
 * Uploads the field of a client in each session, asks the server to use it in the channel, and sends poses. When the
 * server accepts a new field, the previous one is dropped.
 */
export class FieldUser {
  #field: FieldDescription | undefined;
  #session: FieldSession | undefined;
  #state = freshState();

  /** The reason why the server has refused the field. Empty if it was not refused. */
  get refused(): string {
    return this.#state.refused;
  }

  /** Must be called at the start of a session, if the server supports fields. */
  opened(session: FieldSession, place: { readonly device: number; readonly channel: number }): void {
    this.#session = session;
    this.#state = { ...freshState(), place, sender: this.#field && new FieldSender(this.#field) };
  }
  closed(refused = ""): void {
    this.#session = undefined;
    this.#state = { ...freshState(), refused };
  }

  /** Sets the field. If only the materials or fixtures have changed, no bricks are sent. */
  use(field: FieldDescription | undefined): void {
    this.#field = field;
    const state = this.#state;
    if (!this.#session) return;
    state.refused = "";
    state.asked = false;
    state.use = undefined;
    state.parts.clear(); // ignore the answers
    if (field && state.sender && isSame(field.name, state.sender.field.name)) {
      state.sender.change(field);
      return;
    }
    if (state.sender) state.old.push(state.sender.field.name);
    state.sender = field && new FieldSender(field);
    if (field) state.old = state.old.filter((name) => !isSame(name, field.name));
  }

  /**
   * Sends the predicted pose at `ahead` after `now`. If the rate is higher than the limit of the server, poses are skipped,
   * but the newest one is always sent. Returns false if there is no session, or if the server does not support fields.
   * Throws a RangeError if a value is larger than 10 m, 10 m/s or 100 rad/s.
   */
  move(now: Nanoseconds, motion: Motion, ahead: Nanoseconds): boolean {
    checkMotion(motion);
    const at = this.#session?.peerTime(now);
    if (at === undefined) return false;
    const { position, turn: orientation, velocity = kZero, angularVelocity = kZero } = motion;
    const { place, poses } = this.#state;
    this.#state.pose = { ...place, sequence: poses + 1n, timeNs: at + ahead, position, orientation, velocity, angularVelocity };
    this.#sendPose(now);
    return true;
  }

  /** Must be called if the lease is lost. The server then stops rendering the field until the next UseField request. */
  lostLease(): void {
    this.#state.asked = false;
  }

  tick(now: Nanoseconds, holds: boolean): void {
    const [session, state] = [this.#session, this.#state];
    if (!session) return;
    const { sender, place } = state;
    [state.holds, state.full] = [holds, false];
    this.#sendPose(now);
    const kept = sender ? [state.inUse, ...state.uses.values()] : [];
    state.old = state.old.filter((name) =>
      kept.some((one) => one && isSame(one, name)) || session.request({ kind: "dropField", field: name }) === undefined);
    if (!sender || state.refused) return;
    for (let part; state.parts.size < kMostParts && !state.full && (part = sender.nextPart(now)); ) {
      const id = session.request({ kind: "offerField", ...part });
      state.full = id === undefined;
      if (id === undefined) break;
      sender.partSent();
      state.parts.add(id);
    }
    if (!sender.complete || !holds || state.asked || now < state.askAt) return;
    const { name: field, materials, fixtures, tables } = sender.field;
    state.use = session.request({ kind: "useField", ...place, generation: state.generation + 1, field, materials, fixtures, tables });
    state.full = state.use === undefined;
    if (state.use === undefined) return;
    ++state.generation;
    state.asked = true;
    state.uses.set(state.use, field);
  }

  /** Queues the next brick in the session if it is due. */
  hasBrick(now: Nanoseconds): boolean {
    const brick = this.#state.refused ? undefined : this.#state.sender?.nextBrick(now);
    if (brick) this.#session?.sendBrick(brick);
    return brick !== undefined;
  }

  takeStatus(now: Nanoseconds, status: FieldStatus): void {
    const { sender } = this.#state;
    const roundTrip = fromMilliseconds(this.#session?.stats.smoothedRoundTripMs ?? 0);
    if (!sender?.take(now, status, roundTrip) || !this.#state.refused || sender.complete) return;
    [this.#state.refused, this.#state.asked] = ["", false]; // the server has removed bricks after the last status
  }

  takeAnswer(now: Nanoseconds, { id, code, detail, waitMs = 0 }: ControlAck): void {
    const state = this.#state;
    const used = state.uses.get(id);
    const ours = state.parts.has(id) || id === state.use;
    state.parts.delete(id);
    state.uses.delete(id);
    if (used && code === Code.OK) {
      state.inUse = used;
    } else if (id === state.use && code === Code.BUSY) {
      state.asked = false;
      state.askAt = now + latest(fromMilliseconds(waitMs), kAskAgain);
    } else if (ours && code !== Code.OK) {
      state.refused = detail || Code[code];
    }
  }

  /** Returns when tick() and hasBrick() must be called next. */
  due(): Nanoseconds {
    const { sender, pose, poseDue, refused, holds, asked, askAt, full, parts } = this.#state;
    const next = pose ? poseDue : kNever;
    if (!sender || refused) return next;
    if (sender.complete) return earliest(next, holds && !asked && !full ? askAt : kNever);
    return full || parts.size >= kMostParts ? next : earliest(next, sender.due());
  }

  #sendPose(now: Nanoseconds): void {
    const state = this.#state;
    if (!state.pose || now < state.poseDue) return;
    this.#session?.sendPose(state.pose);
    [state.pose, state.poseDue] = [undefined, now + kPosePeriod];
    ++state.poses;
  }
}

/** The state of a session. */
const freshState = () => ({
  place: kFirst as { readonly device: number; readonly channel: number },
  refused: "",
  sender: undefined as FieldSender | undefined,
  /** Names of fields to be dropped. */
  old: [] as Uint8Array[],
  /** Ids of pending requests. */
  parts: new Set<number>(),
  /** Id of the newest UseField, and the fields of the pending ones. */
  use: undefined as number | undefined,
  uses: new Map<number, Uint8Array>(),
  /** The field of the last UseField that was accepted. */
  inUse: undefined as Uint8Array | undefined,
  /** For the use of the newest field. */
  asked: false,
  askAt: 0n,
  holds: false,
  /** Too many requests are pending. */
  full: false,
  generation: 0,
  pose: undefined as FieldPose | undefined,
  poseDue: 0n,
  poses: 0n,
});

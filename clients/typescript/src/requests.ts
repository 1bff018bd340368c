// SPDX-License-Identifier: Apache-2.0
// Reliable requests of a session. They arrive exactly once and in order, and each of them is answered. A request is
// repeated until it is answered. The receiver stores its last 16 answers and repeats an answer if the request is
// repeated. This is sufficient because at most 16 requests are pending: when n + 16 arrives, the answer to n has been
// received.
import type { Control, ControlAck } from "./codec.js";
import { kRequestWindow } from "./limits.js";
import { Code, type Request } from "./messages.js";
import { earliest, kNever, kSecond, type Nanoseconds } from "./time.js";

const kMaxId = 0xffffffff;

interface Asked {
  readonly control: Control;
  /** This is undefined before the first transmission. */
  due: Nanoseconds | undefined;
  timesSent: number;
  answer: ControlAck | undefined;
}

/** The requesting side. */
export class OutgoingRequests {
  /** The upper limit of the exponential back-off, unless the round trip is longer. */
  static readonly kMaxWait = kSecond;

  /** In the order of the ids. The first one is the oldest request whose answer has not been taken. */
  readonly #asked: Asked[] = [];
  #next = 1;

  /** Queues a request and returns its id, or undefined if 16 are pending. */
  add(request: Request): number | undefined {
    if (this.#asked.length === kRequestWindow || this.#next === kMaxId) return undefined;
    this.#asked.push({ control: { id: this.#next, request }, due: undefined, timesSent: 0, answer: undefined });
    return this.#next++;
  }

  /** Returns the first request to send or repeat now. */
  nextDue(now: Nanoseconds): Control | undefined {
    return this.#asked.find(({ due, answer }) => !answer && (due === undefined || due <= now))?.control;
  }

  /** Schedules a repetition after `timeout`, doubled for each previous transmission up to `kMaxWait`. */
  sent(id: number, now: Nanoseconds, timeout: Nanoseconds): void {
    const asked = this.#find(id);
    if (!asked) return;
    asked.due = now + earliest(timeout << BigInt(Math.min(asked.timesSent, 30)), OutgoingRequests.kMaxWait);
    ++asked.timesSent;
  }

  /** Returns the time of the next repetition. */
  nextDueTime(): Nanoseconds {
    return this.#asked.reduce((next, { due, answer }) => (answer ? next : earliest(next, due ?? 0n)), kNever);
  }

  /** Returns false if the answer does not belong to a request. */
  acknowledge(ack: ControlAck): boolean {
    const asked = this.#find(ack.id);
    if (!asked) return ack.id < this.#next; // true if repeated
    if (asked.timesSent === 0) return false;
    asked.answer ??= ack;
    return true;
  }

  /** Returns the next answer in the order of the requests. */
  nextAnswer(): ControlAck | undefined {
    return this.#asked[0]?.answer && this.#asked.shift()?.answer;
  }

  #find(id: number): Asked | undefined {
    return this.#asked.find(({ control }) => control.id === id);
  }
}

interface Answering {
  readonly control: Control;
  stage: "arrived" | "taken" | "answered";
  answer?: ControlAck;
  due: boolean;
}

/** The answering side. */
export class IncomingRequests {
  readonly #slots: (Answering | undefined)[] = new Array<Answering | undefined>(kRequestWindow).fill(undefined);
  #next = 1;

  /** Accepts requests in any order. Returns false if a correct peer could not use this id yet. */
  take(control: Control): boolean {
    const mine = this.#slot(control.id);
    if (control.id < this.#next) {
      if (mine?.control.id === control.id && mine.stage === "answered") mine.due = true;
      return true;
    }
    if (control.id - this.#next >= kRequestWindow || mine?.stage === "taken") return false;
    this.#slots[control.id % kRequestWindow] = { control, stage: "arrived", due: false };
    return true;
  }

  /** Returns the next request, exactly once and in order. Answers unknown or invalid requests itself. */
  next(): { id: number; request: Request } | undefined {
    for (let mine = this.#slot(this.#next); mine?.stage === "arrived"; mine = this.#slot(this.#next)) {
      ++this.#next;
      mine.stage = "taken";
      const { id, request, invalid } = mine.control;
      if (request) return { id, request };
      this.answer(invalid === undefined
        ? { id, code: Code.UNSUPPORTED, detail: "this version does not support this request" }
        : { id, code: Code.INVALID, detail: `${invalid} is out of bounds` });
    }
    return undefined;
  }

  /** Answers a request returned by `next`. Other ids are ignored. */
  answer(answer: ControlAck): void {
    const mine = this.#slot(answer.id);
    if (mine?.control.id !== answer.id || mine.stage !== "taken") return;
    mine.stage = "answered";
    mine.answer = answer;
    mine.due = true;
  }

  /** Returns the first answer to send now. */
  nextDue(): ControlAck | undefined {
    return this.#slots.find((slot) => slot?.due)?.answer;
  }
  sent(id: number): void {
    const mine = this.#slot(id);
    if (mine) mine.due = false;
  }

  #slot(id: number): Answering | undefined {
    return this.#slots[id % kRequestWindow];
  }
}

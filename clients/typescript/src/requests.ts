// SPDX-License-Identifier: Apache-2.0
// The reliable part of a session: requests arrive exactly once and in order, and each gets its answer. The requester
// repeats each until the answer has come; the answerer keeps its last 16 answers and repeats one whenever its request
// comes again. That is enough: the requester has at most 16 open, so when n + 16 arrives, the answer to n has.
import type { Control, ControlAck } from "./codec.js";
import { kRequestWindow } from "./limits.js";
import { Code, type Request } from "./messages.js";
import { earliest, kNever, kSecond, type Nanoseconds } from "./time.js";

const kMaxId = 0xffffffff;

interface Asked {
  readonly control: Control;
  /** Undefined: never sent. */
  due: Nanoseconds | undefined;
  timesSent: number;
  answer: ControlAck | undefined;
}

/** The asking end. */
export class OutgoingRequests {
  /** Waits double with every repetition up to this; a longer round trip wins. */
  static readonly kMaxWait = kSecond;

  /** In the order of the ids; the first is the oldest whose answer was not taken out. */
  readonly #asked: Asked[] = [];
  #next = 1;

  /** Queues a request and returns its id; undefined when 16 are open. */
  add(request: Request): number | undefined {
    if (this.#asked.length === kRequestWindow || this.#next === kMaxId) return undefined;
    this.#asked.push({ control: { id: this.#next, request }, due: undefined, timesSent: 0, answer: undefined });
    return this.#next++;
  }

  /** The first request to be sent (again) now. */
  nextDue(now: Nanoseconds): Control | undefined {
    return this.#asked.find(({ due, answer }) => !answer && (due === undefined || due <= now))?.control;
  }

  /** It has been sent; it is due again after `timeout`, doubled for every time before, at most `kMaxWait`. */
  sent(id: number, now: Nanoseconds, timeout: Nanoseconds): void {
    const asked = this.#find(id);
    if (!asked) return;
    asked.due = now + earliest(timeout << BigInt(Math.min(asked.timesSent, 30)), OutgoingRequests.kMaxWait);
    ++asked.timesSent;
  }

  /** When the next one is due to be repeated. */
  nextDueTime(): Nanoseconds {
    return this.#asked.reduce((next, { due, answer }) => (answer ? next : earliest(next, due ?? 0n)), kNever);
  }

  /** Takes an answer. False when the answer belongs to no request. */
  acknowledge(ack: ControlAck): boolean {
    const asked = this.#find(ack.id);
    if (!asked) return ack.id < this.#next; // repeated
    if (asked.timesSent === 0) return false;
    asked.answer ??= ack;
    return true;
  }

  /** The next answer, in the order of the requests. */
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

/** The answering end. */
export class IncomingRequests {
  readonly #slots: (Answering | undefined)[] = new Array<Answering | undefined>(kRequestWindow).fill(undefined);
  #next = 1;

  /** Takes a request in any order. False when the id is one that a correct peer cannot use yet. */
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

  /** The next request, exactly once and in order. This also answers requests that are unknown or invalid. */
  next(): { id: number; request: Request } | undefined {
    for (let mine = this.#slot(this.#next); mine?.stage === "arrived"; mine = this.#slot(this.#next)) {
      ++this.#next;
      mine.stage = "taken";
      const { id, request, invalid } = mine.control;
      if (request) return { id, request };
      this.answer(invalid === undefined
        ? { id, code: Code.UNSUPPORTED, detail: "this version does not know that request" }
        : { id, code: Code.INVALID, detail: `${invalid} is out of bounds` });
    }
    return undefined;
  }

  /** Answers a request that `next` returned; any other id is ignored. */
  answer(answer: ControlAck): void {
    const mine = this.#slot(answer.id);
    if (mine?.control.id !== answer.id || mine.stage !== "taken") return;
    mine.stage = "answered";
    mine.answer = answer;
    mine.due = true;
  }

  /** The first answer to be sent now. */
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

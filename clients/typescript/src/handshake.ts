// SPDX-License-Identifier: Apache-2.0
import { decodeAnswerMessage, encodeHelloMessage } from "./codec.js";
import {
  CipherSuite, concat, decodeAnswer, decodeRetry, encodeHello, equal, helloHeader, type AnswerDatagram,
} from "./datagram.js";
import { Code, type Hello, type Refused, type Welcome } from "./messages.js";
import { Initiator, keyId, keyOfSuite2, type Finished } from "./noise.js";
import { NoiseSeal, PlainSeal, type Seal } from "./seal.js";
import { kFeatureAesGcm, kUsableSuites, namesOf } from "./suites.js";
import { kMillisecond, kNever, type Nanoseconds } from "./time.js";

export type Outcome =
  | { readonly kind: "accepted"; readonly connectionId: number; readonly welcome: Welcome; readonly seal: Seal }
  | { readonly kind: "refused"; readonly refused: Refused };

/** An attempt to connect, without I/O. It sends a Hello every 100 ms until it is answered. It has no timeout. */
export class ClientHandshake {
  static readonly kResend = 100n * kMillisecond;

  readonly #hello: Hello;
  readonly #random: Uint8Array;
  readonly #suite: CipherSuite;
  readonly #content: Uint8Array;
  readonly #initiator: Initiator | undefined;
  #cookie: Uint8Array | undefined;
  #due = false;
  #nextTick: Nanoseconds;
  #outcome: Outcome | undefined;

  /**
   * `random` must return cryptographically secure bytes. With a `key` of 32 bytes, the session is encrypted with one
   * of `suites`, which the server selects, and the answer proves that the server knows the key.
   */
  constructor(
    hello: Hello,
    key: Uint8Array | undefined,
    random: (size: number) => Uint8Array,
    now: Nanoseconds,
    private readonly suites: readonly CipherSuite[] = kUsableSuites,
  ) {
    this.#hello = hello;
    this.#random = random(16);
    this.#nextTick = now;
    const offers = key && suites.includes(CipherSuite.AesGcm) ? [kFeatureAesGcm] : [];
    const message = encodeHelloMessage({ ...hello, features: [...hello.features, ...offers] });
    if (key) {
      const id = keyId(key);
      this.#suite = CipherSuite.Noise;
      const prologue = concat(new TextEncoder().encode("tendon-1"), helloHeader(this.#suite), id, this.#random);
      this.#initiator = new Initiator(key, prologue, random(32), message);
      this.#content = concat(id, this.#initiator.message1);
    } else {
      this.#suite = CipherSuite.Plain;
      this.#content = message;
    }
  }

  /** Handles a datagram. Anything but an answer to this attempt is ignored. */
  receive(now: Nanoseconds, datagram: Uint8Array): void {
    if (this.#outcome) return;
    const retry = decodeRetry(datagram);
    if (retry && retry.suite === this.#suite && equal(retry.random, this.#random)) {
      // Only the first cookie is answered immediately, to prevent a loop with a server that rejects the cookie.
      if (!this.#cookie) {
        this.#due = true;
        this.#nextTick = now;
      }
      this.#cookie = retry.cookie;
      return;
    }
    const answer = decodeAnswer(datagram);
    if (!answer || answer.suite !== this.#suite || !equal(answer.random, this.#random)) return;
    this.#outcome = this.#read(now, answer);
    if (this.#outcome) {
      this.#due = false;
      this.#nextTick = kNever;
    }
  }

  tick(now: Nanoseconds): void {
    if (!this.#outcome && now >= this.#nextTick) this.#due = true;
  }

  /** Returns the next datagram to send, or undefined. */
  nextDatagram(now: Nanoseconds): Uint8Array | undefined {
    if (!this.#due) return undefined;
    this.#due = false;
    this.#nextTick = now + ClientHandshake.kResend;
    return encodeHello({
      suite: this.#suite, random: this.#random, cookie: this.#cookie ?? new Uint8Array(16), content: this.#content,
    });
  }

  nextTick(): Nanoseconds {
    return this.#nextTick;
  }
  get outcome(): Outcome | undefined {
    return this.#outcome;
  }

  #read(now: Nanoseconds, answer: AnswerDatagram): Outcome | undefined {
    const finished = this.#initiator?.readMessage2(answer.content);
    if (this.#initiator && !finished) return undefined;
    const message = decodeAnswerMessage(finished?.payload ?? answer.content);
    if (!message) return undefined;
    if ("code" in message) return { kind: "refused", refused: message };
    if (message.version < this.#hello.versionMin || message.version > this.#hello.versionMax) return undefined;
    const accepted = { kind: "accepted", connectionId: answer.connectionId, welcome: message } as const;
    if (!finished) return { ...accepted, seal: new PlainSeal() };
    const aes = this.suites.includes(CipherSuite.AesGcm) && message.features.includes(kFeatureAesGcm);
    const suite = aes ? CipherSuite.AesGcm : CipherSuite.Noise;
    if (!this.suites.includes(suite)) {
      const [theirs, ours] = [namesOf([suite]), namesOf(this.suites)];
      const detail = `no common cipher suite: the server uses ${theirs}, this client only accepts ${ours}`;
      return { kind: "refused", refused: { code: Code.UNSUPPORTED, detail, versionMin: 0, versionMax: 0 } };
    }
    return { ...accepted, seal: new NoiseSeal(aes ? keysOfSuite2(finished) : finished, now, NoiseSeal.kRenewAfter, suite) };
  }
}

const keysOfSuite2 = ({ sendKey, receiveKey, hash }: Finished): Pick<Finished, "sendKey" | "receiveKey"> => ({
  sendKey: keyOfSuite2(sendKey, hash),
  receiveKey: keyOfSuite2(receiveKey, hash),
});

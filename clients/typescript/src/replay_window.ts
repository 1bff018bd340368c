// SPDX-License-Identifier: Apache-2.0

/** There are 2048 bits. Since 64 of them are being filled, at least 1984 numbers are remembered. */
const kWords = 32n;
const kRemembered = (kWords - 1n) * 64n;

/**
 * Remembers recently received packet numbers, so that each packet is accepted only once. A bit ring as in RFC 6479:
 * the bit of a number never moves, and advancing clears whole words.
 *
 * Call `contains` before using a packet, and `insert` after it was authenticated, so that a forged packet cannot
 * consume the number of a real one.
 */
export class ReplayWindow {
  readonly #words = new BigUint64Array(Number(kWords));
  #highest = -1n;
  /** maskBefore(highest). */
  #mask = 0;
  #count = 0n;

  /** Returns true if `number` was inserted or is older than the window. */
  contains(number: bigint): boolean {
    if (number > this.#highest) return false;
    return this.#highest - number >= kRemembered || this.#has(number);
  }

  /** `number` must not be contained. */
  insert(number: bigint): void {
    if (number > this.#highest) {
      const from = this.#highest < 0n ? -1n : this.#highest / 64n;
      const to = number / 64n;
      const steps = to - from < kWords ? to - from : kWords;
      for (let i = 0n; i < steps; ++i) this.#words[Number((to - i) % kWords)] = 0n;
      const ahead = this.#highest < 0n ? 33 : Math.min(Number(number - this.#highest), 33);
      this.#mask = ahead > 32 ? 0 : ((ahead > 31 ? 0 : this.#mask << ahead) | (1 << (ahead - 1))) >>> 0;
      this.#highest = number;
    } else {
      const before = this.#highest - number;
      if (before <= 32n) this.#mask = (this.#mask | (1 << (Number(before) - 1))) >>> 0;
    }
    this.#words[word(number)]! |= bit(number);
    ++this.#count;
  }

  /** Returns a bit mask in which bit i is set if (number − 1 − i) was inserted. */
  maskBefore(number: bigint): number {
    if (number === this.#highest) return this.#mask; // the common case
    let mask = 0;
    for (let i = 0; i < 32; ++i) {
      const earlier = number - 1n - BigInt(i);
      if (earlier < 0n) break;
      if (this.#highest - earlier < kRemembered && this.#has(earlier)) mask |= 1 << i;
    }
    return mask >>> 0;
  }

  /** −1 before the first insertion. */
  get highest(): bigint {
    return this.#highest;
  }
  /** Number of missing packets from 0 to the highest number. */
  get missing(): bigint {
    return this.#highest + 1n - this.#count;
  }

  #has(number: bigint): boolean {
    return (this.#words[word(number)]! & bit(number)) !== 0n;
  }
}

const word = (number: bigint): number => Number((number / 64n) % kWords);
const bit = (number: bigint): bigint => 1n << number % 64n;

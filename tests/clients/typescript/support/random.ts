// SPDX-License-Identifier: Apache-2.0

/** SplitMix64, reproducible on all platforms. */
export class Random {
  #state: bigint;

  constructor(seed: number) {
    this.#state = BigInt(seed);
  }

  bits(): bigint {
    this.#state = BigInt.asUintN(64, this.#state + 0x9e3779b97f4a7c15n);
    let z = this.#state;
    z = BigInt.asUintN(64, (z ^ (z >> 30n)) * 0xbf58476d1ce4e5b9n);
    z = BigInt.asUintN(64, (z ^ (z >> 27n)) * 0x94d049bb133111ebn);
    return z ^ (z >> 31n);
  }
  /** 0 ≤ x < 1 */
  uniform(): number {
    return Number(this.bits() >> 11n) * 2 ** -53;
  }
  below(end: number): number {
    return Math.floor(this.uniform() * end);
  }
  bytes(size: number): Uint8Array {
    return Uint8Array.from({ length: size }, () => this.below(256));
  }
}

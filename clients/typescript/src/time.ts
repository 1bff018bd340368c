// SPDX-License-Identifier: Apache-2.0

/**
 * A time or duration in nanoseconds, exact like the 64 bits of the protocol. Local times and times of the peer must
 * not be subtracted. The core does not read a clock. All times are arguments and must not decrease.
 */
export type Nanoseconds = bigint;

export const kMillisecond = 1_000_000n;
export const kSecond = 1_000_000_000n;
/** Later than any time. */
export const kNever: Nanoseconds = 1n << 62n;

export const fromMilliseconds = (ms: number): Nanoseconds => BigInt(Math.round(ms * 1e6));
export const toMilliseconds = (time: Nanoseconds): number => Number(time) / 1e6;
export const earliest = (a: Nanoseconds, b: Nanoseconds): Nanoseconds => (a < b ? a : b);
export const latest = (a: Nanoseconds, b: Nanoseconds): Nanoseconds => (a > b ? a : b);

// SPDX-License-Identifier: Apache-2.0

/**
 * A time or a duration in nanoseconds: exact, because the wire has 64 bits for it. A local time and a time of the peer
 * do not subtract. The core never reads a clock: it is told the time, and the time it is told never goes back.
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

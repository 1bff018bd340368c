// SPDX-License-Identifier: Apache-2.0

/** Green, amber and red, also shown by shape and text. */
export type Level = "good" | "notice" | "bad" | "off";

export interface ReasonWords {
  readonly bit: number;
  readonly name: string;
  readonly meaning: string;
  /** The reason reduces or delays the force. Others are informational. */
  readonly limits: boolean;
}

/** Bits of core/base/reason.h. */
export const kReasons: readonly ReasonWords[] = [
  { bit: 8, name: "Fault", meaning: "a latched fault holds the force at zero", limits: true },
  { bit: 13, name: "Disarmed", meaning: "an operator has disarmed the device: zero until it is armed again", limits: true },
  { bit: 6, name: "Safe stop", meaning: "no fresh force for too long: zero until one comes", limits: true },
  { bit: 5, name: "Fading", meaning: "no fresh force has come, and the last one fades", limits: true },
  { bit: 4, name: "Held", meaning: "the newest force has outlived its validity and is held", limits: true },
  { bit: 0, name: "Energy limit", meaning: "a larger force would give out energy that the device never took in", limits: true },
  { bit: 14, name: "Damped", meaning: "the hand vibrates in contact, and is damped", limits: true },
  { bit: 1, name: "Force limit", meaning: "the largest force of the device or the scene", limits: true },
  { bit: 2, name: "Growth limit", meaning: "the force may not grow that fast", limits: true },
  { bit: 3, name: "Ramp-in", meaning: "forces have just begun again", limits: true },
  { bit: 7, name: "Not a number", meaning: "NaN or infinity was asked for or measured", limits: true },
  { bit: 9, name: "Device clamp", meaning: "the device gave out less than it was told to", limits: true },
  { bit: 12, name: "Unseen", meaning: "the device gave no position, so it gives no force", limits: true },
  { bit: 10, name: "Overrun", meaning: "a step came later than the control law allows for", limits: false },
  { bit: 15, name: "Hard hand", meaning: "the hand accelerated harder than the limiter counts on: in that step it counted on friction alone", limits: false },
  { bit: 11, name: "Watchdog", meaning: "a step came so late that the device's own watchdog let go", limits: false },
];

export interface StateWords {
  readonly name: string;
  readonly meaning: string;
  readonly level: Level;
}

/** Values of Mode in the protocol and in recordings. */
export const kModes: Readonly<Record<number, StateWords>> = {
  1: { name: "Idle", meaning: "no engine has sent a force yet", level: "off" },
  2: { name: "Active", meaning: "a fresh force is rendered", level: "good" },
  3: { name: "Holding", meaning: "the force is older than it may be, and is held a little longer", level: "notice" },
  4: { name: "Fading", meaning: "no fresh force has come, and the last one fades", level: "notice" },
  5: { name: "Safe stop", meaning: "no force until a fresh one comes", level: "bad" },
  6: { name: "Fault", meaning: "latched: no force until the device is armed again", level: "bad" },
};

export const kSafety: Readonly<Record<string, StateWords>> = {
  absent: { name: "Not plugged in", meaning: "the server looks for the device", level: "bad" },
  opening: { name: "Being opened", meaning: "the device answers soon", level: "notice" },
  firmware: { name: "Without firmware", meaning: "the firmware is being loaded into the device", level: "notice" },
  unhomed: { name: "Not homed", meaning: "move the handle as the device asks, so that it knows where it is", level: "notice" },
  homed: { name: "Ready, not armed", meaning: "gives no force until it is armed", level: "notice" },
  armed: { name: "Armed", meaning: "gives forces", level: "good" },
  fault: { name: "Fault", meaning: "gives no force until it is armed again", level: "bad" },
  unguarded: { name: "Gives forces", meaning: "its scene lists no safety layer: there is nothing to arm", level: "good" },
};

export const kPhases: Readonly<Record<string, StateWords>> = {
  alone: { name: "Alone", meaning: "nothing is heard of another end", level: "off" },
  coupled: { name: "Coupled", meaning: "hears the other end and waits to be engaged: no force", level: "off" },
  aligning: { name: "Aligning", meaning: "the leader is led to where the follower is", level: "notice" },
  engaged: { name: "Engaged", meaning: "the two handles move together", level: "good" },
  clutched: { name: "Clutched", meaning: "the leader is free, the follower stays where it is", level: "notice" },
  lost: { name: "Lost", meaning: "the other end fell silent: to be engaged anew", level: "bad" },
  fault: { name: "Fault", meaning: "its device gives no force", level: "bad" },
};

/** Reason bit 13: no force, independent of the last reported safety state. */
export const kDisarmedBit = 1 << 13;
export const kDisarmed: StateWords = { name: "Disarmed", meaning: "gives no force until it is armed again", level: "notice" };

/** Formats three significant digits: "0.42", "12.3", "1234". */
export function digits(value: number, most = 3): string {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size === 0) return "0";
  const before = Math.max(0, Math.floor(Math.log10(size)) + 1);
  return value.toFixed(Math.min(Math.max(most - before, 0), size < 0.001 ? 6 : 3)).replace("-", "−");
}

/** Formats a count with thin spaces: "12 345". */
export const count = (value: number): string => Math.round(value).toLocaleString("en-US").replaceAll(",", "\u202f");

export const percent = (share: number): string =>
  !Number.isFinite(share) ? "–" : share > 0 && share < 0.001 ? "< 0.1 %" : `${digits(100 * share, share < 0.1 ? 2 : 3)} %`;

/** "2026-11-23 14:05:09 UTC+1", in the local time zone. The Swedish locale uses the format of ISO 8601. */
export const dateTime = (when: Date): string => when.toLocaleString("sv-SE", {
  year: "numeric", month: "2-digit", day: "2-digit", hour: "2-digit", minute: "2-digit", second: "2-digit", timeZoneName: "short",
});

/** Formats "64 µs", "1.02 ms", "2.1 s". */
export function duration(seconds: number): string {
  if (!Number.isFinite(seconds)) return "–";
  const [value, unit] = seconds < 1e-3 ? [seconds * 1e6, "µs"] : seconds < 1 ? [seconds * 1e3, "ms"] : [seconds, "s"];
  return `${Number(value.toPrecision(3))}\u00a0${unit}`;
}

/** Formats a time in a recording: "59.5 s", "10 min 4 s". */
export function moment(seconds: number): string {
  if (seconds < 60) return `${digits(seconds)}\u00a0s`;
  return `${Math.floor(seconds / 60)}\u00a0min ${Math.floor(seconds % 60)}\u00a0s`;
}

export function bytes(size: number): string {
  return size < 1e6 ? `${digits(size / 1e3)} kB` : size < 1e9 ? `${digits(size / 1e6)} MB` : `${digits(size / 1e9)} GB`;
}

// SPDX-License-Identifier: Apache-2.0
// Validation of single values against the bounds of protocol/WIRE.md, for gen/codec.ts.
import type { Quat, Stiffness, Vec3 } from "./messages.js";
import { kMaxValue, kUnitTolerance } from "./limits.js";

/** Returns false for NaN. */
export const isWithin = (value: number, least: number, most: number): boolean => value >= least && value <= most;
export const isWhole = (value: number, least: number, most: number): boolean =>
  Number.isInteger(value) && value >= least && value <= most;
export const isBounded = (value: number): boolean => isWithin(value, -kMaxValue, kMaxValue);
export const isVec3 = (v: Vec3): boolean => isBounded(v.x) && isBounded(v.y) && isBounded(v.z);

const isUnit = (length: number): boolean => Math.abs(length - 1) <= kUnitTolerance;
export const isRotation = ({ w, x, y, z }: Quat): boolean => isUnit(Math.hypot(w, x, y, z));
export const isNormal = (v: Vec3 | undefined): boolean =>
  v !== undefined && isVec3(v) && isUnit(Math.hypot(v.x, v.y, v.z));

/** Returns true if both corners are present and min ≤ max, or if neither is present. */
export const isBox = (min: Vec3 | undefined, max: Vec3 | undefined): boolean =>
  min && max ? min.x <= max.x && min.y <= max.y && min.z <= max.z : !min && !max;

export const isStiffness = (stiffness: Stiffness): boolean =>
  (stiffness.length === 1 || stiffness.length === 3 || stiffness.length === 9) && stiffness.every(isBounded);

export const areNumbers = (
  values: readonly number[], fewest: number, most: number, least: number, largest: number,
): boolean => isWithin(values.length, fewest, most) && values.every((value) => isWithin(value, least, largest));
export const areCounts = (values: readonly bigint[], fewest: number, most: number): boolean =>
  isWithin(values.length, fewest, most);
export const sum = (values: readonly bigint[]): bigint => values.reduce((total, value) => total + value, 0n);

/** If a message is out of bounds, `refused` returns the name of the first wrong field. */
export const areMessages = <Message>(
  messages: readonly Message[], fewest: number, most: number, refused: (message: Message) => string | undefined,
): boolean => isWithin(messages.length, fewest, most) && messages.every((message) => refused(message) === undefined);

/** Returns false for 0 and unknown values. */
export const isEnum = (value: number, schema: { readonly value: Record<number, unknown> }): boolean =>
  value !== 0 && schema.value[value] !== undefined;

const kEncoder = new TextEncoder();
export const isText = (text: string, bytes: number): boolean => kEncoder.encode(text).length <= bytes;
export const areTexts = (texts: readonly string[], fewest: number, most: number, bytes: number): boolean =>
  isWithin(texts.length, fewest, most) && texts.every((text) => isText(text, bytes));

// The next two functions check the answer of an engine. An infinite radius is the same as an absent one.
export const isRadius = (metres: number | undefined): boolean =>
  metres === undefined || metres === Infinity || isWithin(metres, 0, kMaxValue);
export const isError = (newtons: number | undefined): boolean =>
  newtons === undefined || isWithin(newtons, 0, kMaxValue);

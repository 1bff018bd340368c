// SPDX-License-Identifier: Apache-2.0
// Which values a peer accepts (protocol/WIRE.md).
import * as limits from "./limits.js";
import type { Contact, LocalModel, Quat, RotationModel, Stiffness, Vec3 } from "./messages.js";

export const isBounded = (value: number): boolean => Math.abs(value) <= limits.kMaxValue; // false for NaN
export const isMagnitude = (value: number): boolean => value >= 0 && value <= limits.kMaxValue;
export const isTime = (ns: bigint): boolean => ns >= -limits.kMaxTime && ns <= limits.kMaxTime;
export const isLength = (ns: bigint): boolean => ns <= limits.kMaxTime; // of time; it has no sign on the wire
export const isDevice = (number: number): boolean => number < limits.kMaxDevices;
export const isChannel = (number: number): boolean => number < limits.kMaxChannels;
export const isVec3 = (v: Vec3): boolean => isBounded(v.x) && isBounded(v.y) && isBounded(v.z);
/** Of length 1. */
export const isRotation = ({ w, x, y, z }: Quat): boolean =>
  Math.abs(Math.hypot(w, x, y, z) - 1) <= limits.kUnitTolerance;

/** 1 entry, 3 or 9, all of them within bounds. */
export const isStiffness = (stiffness: Stiffness): boolean =>
  (stiffness.length === 1 || stiffness.length === 3 || stiffness.length === 9) && stiffness.every(isBounded);
/** Every number of it is within its bounds. */
export function isContact({ normal, gap, table }: Contact): boolean {
  const isTable = !table || (table.step > 0 && isBounded(table.step) && isBounded(table.first) &&
    table.force.length >= limits.kMinTable && table.force.length <= limits.kMaxTable && table.force.every(isBounded));
  return isVec3(normal) && Math.abs(Math.hypot(normal.x, normal.y, normal.z) - 1) <= limits.kUnitTolerance &&
    isBounded(gap) && isTable;
}
/** Infinity means the same as absent. */
export const isRadius = (metres: number | undefined): boolean =>
  metres === undefined || metres === Infinity || isMagnitude(metres);
export const isError = (newtons: number | undefined): boolean => newtons === undefined || isMagnitude(newtons);

export const isModel = ({ at, stiffness, validRadius, contact }: LocalModel): boolean =>
  isVec3(at) && isStiffness(stiffness) && isRadius(validRadius) && (!contact || isContact(contact));

export const isRotationModel = ({ at, stiffness }: RotationModel): boolean => isRotation(at) && isStiffness(stiffness);

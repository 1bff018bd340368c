// SPDX-License-Identifier: Apache-2.0
// Conversion of single fields of protobuf messages, for gen/codec.ts.
import { create } from "@bufbuild/protobuf";
import * as pb from "./gen/tendon_pb.js";
import type { Quat, Vec3 } from "./messages.js";

const kEncoder = new TextEncoder();
/** Truncates `text` to whole characters and at most `limit` bytes of UTF-8. */
export function clip(text: string, limit: number): string {
  const { read } = kEncoder.encodeInto(text, new Uint8Array(limit));
  return text.slice(0, read);
}
/** Returns only the first `most` texts, and truncates them. */
export const clipAll = (texts: readonly string[], most: number, limit: number): string[] =>
  texts.slice(0, most).map((text) => clip(text, limit));

/** Returns `length` values, padded with 0. */
export const padded = (values: readonly number[], length: number): readonly number[] =>
  Array.from({ length }, (_, i) => values[i] ?? 0);

const kZero: Vec3 = Object.freeze({ x: 0, y: 0, z: 0 });
export const readVec3 = (v: pb.Vec3 | undefined): Vec3 => (v ? { x: v.x, y: v.y, z: v.z } : kZero);
export const writeVec3 = ({ x, y, z }: Vec3): pb.Vec3 => create(pb.Vec3Schema, { x, y, z });
export const readQuat = (q: pb.Quat | undefined): Quat => ({ w: q?.w ?? 0, x: q?.x ?? 0, y: q?.y ?? 0, z: q?.z ?? 0 });
export const writeQuat = ({ w, x, y, z }: Quat): pb.Quat => create(pb.QuatSchema, { w, x, y, z });

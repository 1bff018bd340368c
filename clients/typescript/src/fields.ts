// SPDX-License-Identifier: Apache-2.0
// Single fields of protobuf messages and back, for the codec only.
import { create } from "@bufbuild/protobuf";
import * as pb from "./gen/tendon_pb.js";
import * as limits from "./limits.js";
import type { Quat, Vec3 } from "./messages.js";

/** Number 0 of every enumeration is refused, as are those that this version does not know. */
export const isEnum = (value: number, schema: { readonly value: Record<number, unknown> }): boolean =>
  value !== 0 && schema.value[value] !== undefined;

const kEncoder = new TextEncoder();
export const isText = (text: string, limit: number): boolean => kEncoder.encode(text).length <= limit;
export const areFeatures = (features: readonly string[]): boolean =>
  features.length <= limits.kMaxFeatures && features.every((feature) => isText(feature, limits.kMaxFeature));

/** The front of `text`, in whole characters of at most `limit` bytes. */
export function clip(text: string, limit: number): string {
  const { read } = kEncoder.encodeInto(text, new Uint8Array(limit));
  return text.slice(0, read);
}

export const writeFeatures = (features: readonly string[]): string[] =>
  features.slice(0, limits.kMaxFeatures).map((feature) => clip(feature, limits.kMaxFeature));

const kZero: Vec3 = Object.freeze({ x: 0, y: 0, z: 0 });
export const readVec3 = (v: pb.Vec3 | undefined): Vec3 => (v ? { x: v.x, y: v.y, z: v.z } : kZero);
export const readQuat = ({ w, x, y, z }: pb.Quat): Quat => ({ w, x, y, z });
export const writeQuat = ({ w, x, y, z }: Quat): pb.Quat => create(pb.QuatSchema, { w, x, y, z });
export const writeVec3 = (v: Vec3): pb.Vec3 => create(pb.Vec3Schema, { x: v.x, y: v.y, z: v.z });

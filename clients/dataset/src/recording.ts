// SPDX-License-Identifier: Apache-2.0
// Reads the output of `tendon-replay --merge`: both ends of a coupling, with times on the clock of the leader.
import { createFileRegistry, fromBinary, type DescMessage, type FileRegistry } from "@bufbuild/protobuf";
import { FileDescriptorSetSchema } from "@bufbuild/protobuf/wkt";
import { McapStreamReader } from "@mcap/core";
import { parse as parseToml } from "smol-toml";
import { createReadStream } from "node:fs";

export type Vec3 = readonly [number, number, number];

/** A haptic step at one end of the coupling. */
export interface Step {
  /** The time on the clock of the leader, s. */
  readonly t: number;
  readonly tick: bigint;
  readonly position: Vec3;
  readonly velocity: Vec3;
  /** The contact force, N. It is undefined if it was not measured. */
  readonly contact?: Vec3 | undefined;
}

/** The state that was sent from one end to the other in a step. */
export interface Port {
  readonly t: number;
  readonly tick: bigint;
  /** 4: engaged, 5: clutched. */
  readonly phase: number;
  readonly engagement: bigint;
  /** The position relative to the offset, in its own frame and scale, m. */
  readonly displacement: Vec3;
}

export interface End {
  readonly steps: Step[];
  readonly ports: Port[];
}

/** Mapping of displacements from leader to follower: u_f = scale · R · u_l. */
export interface PoseMap {
  readonly scale: number;
  /** Rows of R. */
  readonly rotation: readonly [Vec3, Vec3, Vec3];
}

export interface Coupling {
  readonly leader: End;
  readonly follower: End;
  readonly map: PoseMap;
}

interface Vec3Message { readonly x: number; readonly y: number; readonly z: number }
interface StepMessage {
  readonly tick: bigint;
  readonly positionM?: Vec3Message;
  readonly velocityMps?: Vec3Message;
  readonly handForceN?: Vec3Message;
}
interface PortMessage {
  readonly tick: bigint;
  readonly sent?: { readonly phase: number; readonly engagement: bigint; readonly displacementM?: Vec3Message };
}

const vec3 = (from: Vec3Message | undefined): Vec3 => (from ? [from.x, from.y, from.z] : [0, 0, 0]);

const kIdentity: PoseMap = { scale: 1, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] };

/** Converts a rotation vector in degrees by Rodrigues' formula. */
function rotationOf(degrees: readonly number[]): PoseMap["rotation"] {
  const [x = 0, y = 0, z = 0] = degrees.map((value) => (value * Math.PI) / 180);
  const angle = Math.hypot(x, y, z);
  if (angle === 0) return kIdentity.rotation;
  const [i, j, k] = [x / angle, y / angle, z / angle];
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  return [
    [c + i * i * (1 - c), i * j * (1 - c) - k * s, i * k * (1 - c) + j * s],
    [j * i * (1 - c) + k * s, c + j * j * (1 - c), j * k * (1 - c) - i * s],
    [k * i * (1 - c) - j * s, k * j * (1 - c) + i * s, c + k * k * (1 - c)],
  ];
}

/** Reads the map from the text of a scene. */
export function mapOf(scene: string): PoseMap {
  const { teleoperation } = parseToml(scene) as {
    teleoperation?: { map?: { position_scale?: number; rotation_deg?: number[] } };
  };
  const map = teleoperation?.map;
  return { scale: map?.position_scale ?? 1, rotation: rotationOf(map?.rotation_deg ?? []) };
}

/** Throws an Error with the file name if it is not a merged recording. */
export async function readCoupling(file: string): Promise<Coupling> {
  const ends: Record<string, End> = { leader: { steps: [], ports: [] }, follower: { steps: [], ports: [] } };
  const types = new Map<number, { readonly topic: string; readonly message: DescMessage }>();
  const registries = new Map<number, { readonly registry: FileRegistry; readonly name: string }>();
  let scene: string | undefined;
  let began: bigint | undefined;
  const reader = new McapStreamReader();
  let ended = false;
  const take = (topic: string, message: DescMessage, logTime: bigint, data: Uint8Array): void => {
    const [, end = "", kind = ""] = /^\/(leader|follower)(\/.*)$/.exec(topic) ?? [];
    const place = ends[end];
    if (!place) return;
    began ??= logTime;
    const t = Number(logTime - began) * 1e-9;
    if (kind === "/haptic/step") {
      const step = fromBinary(message, data) as unknown as StepMessage;
      place.steps.push({
        t, tick: step.tick, position: vec3(step.positionM), velocity: vec3(step.velocityMps),
        contact: step.handForceN && vec3(step.handForceN),
      });
    } else if (kind === "/haptic/port") {
      const { tick, sent } = fromBinary(message, data) as unknown as PortMessage;
      if (!sent) return;
      place.ports.push({ t, tick, phase: sent.phase, engagement: sent.engagement, displacement: vec3(sent.displacementM) });
    } else if (kind === "/scene" && end === "leader") {
      scene = (fromBinary(message, data) as unknown as { readonly text: string }).text;
    }
  };
  try {
    for await (const piece of createReadStream(file)) {
      reader.append(piece as Uint8Array);
      for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
        if (record.type === "Schema") {
          const registry = createFileRegistry(fromBinary(FileDescriptorSetSchema, record.data));
          registries.set(record.id, { registry, name: record.name });
        } else if (record.type === "Channel") {
          const { registry, name } = registries.get(record.schemaId) ?? {};
          const message = name === undefined ? undefined : registry?.getMessage(name);
          if (message) types.set(record.id, { topic: record.topic, message });
        } else if (record.type === "DataEnd") {
          ended = true;
        } else if (record.type === "Message") {
          const type = types.get(record.channelId);
          if (type) take(type.topic, type.message, record.logTime, record.data);
        }
      }
    }
  } catch (error) {
    const { code, message } = error as { code?: string; message: string };
    if (code === "ENOENT") throw new Error(`cannot read ${file}: no such file`);
    if (code !== undefined) throw new Error(`cannot read ${file}: ${message}`);
    throw new Error(`${file}: ${message}; tendon-replay ${file} --repair whole.mcap recovers the readable part`);
  }
  const { leader, follower } = ends as { leader: End; follower: End };
  if (scene === undefined || leader.ports.length === 0 || follower.ports.length === 0) {
    if (!ended) throw new Error(`${file}: truncated before the data of both ends of a coupling`);
    throw new Error(`${file}: expected both ends of a coupling: tendon-replay LEADER.mcap --merge FOLLOWER.mcap --into pair.mcap`);
  }
  return { leader, follower, map: mapOf(scene) };
}

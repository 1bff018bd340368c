// SPDX-License-Identifier: Apache-2.0
// Reads the output of `tendon-replay --merge`, which contains both ends of a coupling. The times are those of the clock of
// the leader. A recording of one hour has about 15 million messages, so a message is only decoded if it is needed.
import { createFileRegistry, fromBinary, type DescMessage, type FileRegistry } from "@bufbuild/protobuf";
import { FileDescriptorSetSchema } from "@bufbuild/protobuf/wkt";
import { BinaryReader } from "@bufbuild/protobuf/wire";
import { McapStreamReader } from "@mcap/core";
import { parse as parseToml } from "smol-toml";
import { createReadStream } from "node:fs";
import type { Quat, Vec3 } from "./geometry.js";

/** A haptic step at one end of the coupling. */
export interface Step {
  readonly position: Vec3;
  readonly velocity: Vec3;
  /** It is undefined if the device does not measure it. */
  readonly orientation?: Quat | undefined;
  /** The contact force, N. It is undefined if it was not measured. */
  readonly contact?: Vec3 | undefined;
  /** N and N·m, exerted by the device on the hand. */
  readonly force: Vec3;
  readonly torque: Vec3;
}

/** The phase of a coupling and the number of its act. */
export interface Act {
  /** 4: engaged, 5: clutched. */
  readonly phase: number;
  readonly engagement: bigint;
}

/** The state that was sent from one end to the other in a step. */
export interface Port extends Act {
  /** The position relative to the offset, in its own frame and scale, m. */
  readonly displacement: Vec3;
  /** The rotation relative to the offset, in its base axes. It is undefined if orientations are not coupled. */
  readonly turn?: Quat | undefined;
  /** The opening of the gripper, which a leader requests, m. It is undefined if grippers are not coupled. */
  readonly opening?: number | undefined;
  /** The scale that the leader uses from this state on. If it is 0, the scale of the scene is used. */
  readonly positionScale: number;
}

/** Mapping of displacements from leader to follower: u_f = scale · R · u_l. */
export interface PoseMap {
  readonly scale: number;
  /** Rows of R. */
  readonly rotation: readonly [Vec3, Vec3, Vec3];
}

export type End = "leader" | "follower";

/** Receives the messages of a coupling. For each end and kind, they are sorted by `t` (s, clock of the leader). */
export interface CouplingSink {
  map(map: PoseMap): void;
  /** `bound` is the maximum error of the times of the follower, s. */
  clockError(bound: number): void;
  step(end: End, t: number, read: () => Step): void;
  port(end: End, t: number, act: Act, read: () => Port): void;
}

type Message<Names extends string, T> = { readonly [name in Names]?: T };
type Vec3Message = { readonly x: number; readonly y: number; readonly z: number };
type QuatMessage = Vec3Message & { readonly w: number };
type StepMessage = Message<"positionM" | "velocityMps" | "handForceN" | "forceAppliedN", Vec3Message> & {
  readonly turn?: { readonly orientation?: QuatMessage; readonly torqueAppliedNm?: Vec3Message };
};
type PortStateMessage = Act & Message<"displacementM", Vec3Message> & {
  readonly turn?: { readonly turn?: QuatMessage };
  readonly grip?: { readonly openingM: number };
  readonly positionScale: number;
};

const vec3 = (from: Vec3Message | undefined): Vec3 => (from ? [from.x, from.y, from.z] : [0, 0, 0]);
const quat = (from: QuatMessage | undefined): Quat | undefined => from && [from.w, from.x, from.y, from.z];

function stepOf(from: StepMessage): Step {
  return {
    position: vec3(from.positionM), velocity: vec3(from.velocityMps), orientation: quat(from.turn?.orientation),
    contact: from.handForceN && vec3(from.handForceN),
    force: vec3(from.forceAppliedN), torque: vec3(from.turn?.torqueAppliedNm),
  };
}

function portOf({ sent }: { readonly sent?: PortStateMessage }): Port {
  const { phase, engagement, displacementM, turn, grip, positionScale } = sent!;
  return { phase, engagement, displacement: vec3(displacementM), turn: quat(turn?.turn), opening: grip?.openingM, positionScale };
}

/** Field numbers of server/recording/recording.proto. */
const kSent = 6;
const kPhase = 7;
const kEngagement = 8;

/** Reads only the act of a Port, which is needed in each step. It is undefined if no state was sent. */
function actOf(bytes: Uint8Array): Act | undefined {
  const reader = new BinaryReader(bytes);
  let sent = false;
  let [phase, engagement] = [0, 0n];
  for (let end = reader.len; reader.pos < end;) {
    const [field, type] = reader.tag();
    if (!sent && field === kSent) {
      sent = true;
      end = reader.uint32() + reader.pos;
    } else if (sent && field === kPhase) phase = reader.uint32();
    else if (sent && field === kEngagement) engagement = BigInt(reader.uint64());
    else reader.skip(type, field);
  }
  return sent ? { phase, engagement } : undefined;
}

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

const kNeeded = ["/leader/scene", "/leader/haptic/port", "/follower/haptic/port"];
const kTopics = new Set([...kNeeded, "/leader/haptic/step", "/follower/haptic/step", "/merge/clock"]);

/** Passes a merged recording to `sink`. Throws an Error with the file name if it is not one. */
export async function readCoupling(file: string, sink: CouplingSink): Promise<void> {
  const types = new Map<number, { readonly topic: string; readonly message: DescMessage }>();
  const registries = new Map<number, { readonly registry: FileRegistry; readonly name: string }>();
  const found = new Set<string>();
  let began: bigint | undefined;
  let ended = false;
  const take = (topic: string, message: DescMessage, logTime: bigint, data: Uint8Array): void => {
    const decode = <T>(bytes: Uint8Array): T => fromBinary(message, bytes) as unknown as T;
    began ??= logTime;
    const t = Number(logTime - began) * 1e-9;
    const [, end, kind] = topic.split("/", 3) as [string, End, string];
    if (topic === "/merge/clock") {
      const { errorNs } = decode<{ readonly errorNs: bigint }>(data);
      sink.clockError(Number(errorNs) * 1e-9);
    } else if (topic === "/leader/scene") {
      sink.map(mapOf(decode<{ readonly text: string }>(data).text));
    } else if (kind === "haptic") {
      const bytes = data.slice();  // the reader uses its buffer again
      if (topic.endsWith("/step")) return sink.step(end, t, () => stepOf(decode(bytes)));
      const act = actOf(bytes);
      if (!act) return;
      sink.port(end, t, act, () => portOf(decode(bytes)));
    }
    found.add(topic);
  };
  const reader = new McapStreamReader();
  try {
    for await (const piece of createReadStream(file, { highWaterMark: 1 << 20 })) {
      reader.append(piece as Uint8Array);
      for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
        if (record.type === "Schema") {
          const registry = createFileRegistry(fromBinary(FileDescriptorSetSchema, record.data));
          registries.set(record.id, { registry, name: record.name });
        } else if (record.type === "Channel") {
          const { registry, name } = registries.get(record.schemaId) ?? {};
          const message = name === undefined ? undefined : registry?.getMessage(name);
          if (message && kTopics.has(record.topic)) types.set(record.id, { topic: record.topic, message });
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
  if (kNeeded.some((topic) => !found.has(topic))) {
    if (!ended) throw new Error(`${file}: truncated before the data of both ends of a coupling`);
    throw new Error(`${file}: expected both ends of a coupling: tendon-replay LEADER.mcap --merge FOLLOWER.mcap --into pair.mcap`);
  }
}

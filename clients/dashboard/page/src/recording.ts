// SPDX-License-Identifier: Apache-2.0
import { fromBinary, type Message } from "@bufbuild/protobuf";
import { FileDescriptorSetSchema, type DescriptorProto, type FileDescriptorSet } from "@bufbuild/protobuf/wkt";
import { BinaryReader } from "@bufbuild/protobuf/wire";
import { McapIndexedReader, type McapTypes } from "@mcap/core";
import { Salvage, type Readable } from "./salvage.js";
import { contactOf, frameOfScene, type Quat } from "./space/figure.js";
import { Track, noHandle, type HandleColumn, type HandleSample, type Sample } from "./track.js";
import { moment } from "./words.js";

/** The maximum number of steps to read at once: ten minutes at 1 kHz. Longer recordings are split. */
const kMaxSteps = 600_000;
/** Files up to this size are fetched with one request instead of hundreds. */
const kWhole = 48 * 1024 * 1024;
const kStepTopic = /(?:^|\/)haptic\/step$/;
const kSceneTopic = /(?:^|\/)scene$/;

export interface DeviceTrack {
  /** Name of the device in its topic; empty: the first one of the recording. */
  readonly name: string;
  readonly track: Track;
  /** Rotation from its base frame to the operator frame; undefined: not in its scene. */
  readonly frame: Quat | undefined;
}

export interface Recording {
  readonly name: string;
  readonly devices: readonly DeviceTrack[];
  readonly scene: { readonly text: string; readonly version: string; readonly commit: string } | undefined;
  /** ns since 1970-01-01 of the first step. */
  readonly began: bigint;
  /** Warnings, for example that the recording is truncated. */
  readonly remarks: readonly string[];
  /** Start of the part that was read and of the next one, in s since the start of the recording. */
  readonly from: number;
  readonly next: number | undefined;
}

/**
 * Reads a limited number of steps of a recording, starting `from` s after its beginning. Calls `progress` with the
 * number of steps. Throws an Error if it is not a recording.
 */
export async function readRecording(url: string, name: string, from: number, progress: (steps: number) => void): Promise<Recording> {
  const file = await openFile(url);
  return (await readIndexed(file, new Collector(name, from), progress)) ?? readAll(file, new Collector(name, from), progress);
}

/** Uses the index at the end of the file. Returns undefined if there is no index, or if the file is damaged. */
async function readIndexed(file: Readable, collected: Collector, progress: (steps: number) => void): Promise<Recording | undefined> {
  try {
    const reader = await McapIndexedReader.Initialize({ readable: file });
    const topics = [...reader.channelsById.values()].map((c) => c.topic).filter((t) => kStepTopic.test(t) || kSceneTopic.test(t));
    for (const channel of reader.channelsById.values()) collected.channel(channel, reader.schemasById.get(channel.schemaId));
    if (collected.from > 0) {
      for await (const message of reader.readMessages({ topics })) {
        collected.message(message);
        if (collected.began !== undefined) break;
      }
    }
    const startTime = collected.began === undefined ? undefined : collected.began + BigInt(Math.floor(1e9 * collected.from));
    for await (const message of reader.readMessages({ topics, ...(startTime !== undefined && { startTime }) })) {
      if (!collected.message(message)) break;
      if (collected.steps % 5000 === 0) {
        progress(collected.steps);
        await new Promise((resolve) => setTimeout(resolve));
      }
    }
  } catch {
    return undefined;
  }
  return collected.recording();
}

/** Reads the complete file without the index. This is needed if the server was killed or is still running, or if the file is damaged. */
async function readAll(file: Readable, collected: Collector, progress: (steps: number) => void): Promise<Recording> {
  const salvage = new Salvage(file);
  for await (const record of salvage.records()) {
    if (record.type === "Schema") collected.schema(record);
    else if (record.type === "Channel") collected.channel(record, collected.schemas.get(record.schemaId));
    else if (!collected.message(record)) return collected.recording(...damageOf(salvage));
    if (record.type === "Message" && collected.steps % 5000 === 0) {
      progress(collected.steps);
      await new Promise((resolve) => setTimeout(resolve));
    }
  }
  if (collected.began === undefined) throw new Error(`${collected.name} is no recording: no haptic step can be read in it.`);
  const end = "The recording has no end: the server was killed, or is still recording. Everything up to its last whole chunk is shown.";
  return collected.recording(...(salvage.ended ? [] : [end]), ...damageOf(salvage));
}

function damageOf({ damaged }: Salvage): string[] {
  if (damaged === 0) return [];
  const places = damaged === 1 ? "one place" : `${damaged} places`;
  return [`The recording is damaged in ${places}: steps are missing. tendon-report says where, and tendon-replay --repair writes a whole file.`];
}

/** Returns NAME of /NAME/haptic/step; empty: the first device. */
const deviceOf = (topic: string, end: RegExp): string => topic.replace(end, "").replace(/^\//, "");

class Collector {
  steps = 0;
  readonly schemas = new Map<number, McapTypes.TypedMcapRecords["Schema"]>();
  readonly #tracks = new Map<number, { name: string; track: Track; decode: (data: Uint8Array) => Sample }>();
  readonly #sceneChannels = new Map<number, { device: string; fields: Map<string, number> }>();
  readonly #frames = new Map<string, Quat | undefined>();
  #scene: Recording["scene"];
  /** Log time of the first step, shown or not. */
  began: bigint | undefined;
  #next: number | undefined;

  constructor(readonly name: string, readonly from: number) {}

  schema(schema: McapTypes.TypedMcapRecords["Schema"]): void {
    this.schemas.set(schema.id, schema);
  }

  channel(channel: McapTypes.TypedMcapRecords["Channel"], schema: McapTypes.TypedMcapRecords["Schema"] | undefined): void {
    if (!schema || channel.messageEncoding !== "protobuf" || schema.encoding !== "protobuf") return;
    const types = fromBinary(FileDescriptorSetSchema, schema.data);
    if (kSceneTopic.test(channel.topic)) {
      this.#sceneChannels.set(channel.id, { device: deviceOf(channel.topic, kSceneTopic), fields: fieldsOf(types, schema.name) });
    } else if (kStepTopic.test(channel.topic) && !this.#tracks.has(channel.id)) {
      const device = deviceOf(channel.topic, kStepTopic);
      this.#tracks.set(channel.id, { name: device, track: new Track(), decode: stepDecoder(types, schema.name) });
    }
  }

  /** Returns false if the limit of steps is reached. */
  message(message: McapTypes.TypedMcapRecords["Message"]): boolean {
    const ofScene = this.#sceneChannels.get(message.channelId);
    if (ofScene) {
      const scene = decodeScene(message.data, ofScene.fields);
      this.#frames.set(ofScene.device, frameOfScene(scene.text));
      if (ofScene.device === "") this.#scene = scene;
      return true;
    }
    const device = this.#tracks.get(message.channelId);
    if (!device) return true;
    this.began ??= message.logTime;
    const t = Number(message.logTime - this.began) / 1e9;
    if (t < this.from) return true;
    if (this.steps >= kMaxSteps) {
      this.#next = t;
      return false;
    }
    const sample = device.decode(message.data);
    sample.t = t;
    device.track.push(sample);
    ++this.steps;
    return true;
  }

  #none(): string {
    return this.from > 0 && this.began !== undefined ? `${this.name} ends before ${moment(this.from)}.` : `There is no haptic step in ${this.name}.`;
  }

  recording(...remarks: string[]): Recording {
    const devices = [...this.#tracks.values()].filter((d) => d.track.length > 0).map(({ name, track }) => ({ name, track, frame: this.#frames.get(name) }));
    if (devices.length === 0) throw new Error(this.#none());
    return { name: this.name, devices, scene: this.#scene, began: this.began ?? 0n, remarks, from: this.from, next: this.#next };
  }
}

/** Returns the field numbers of a message type by name. The types are read from the file, because recordings outlive
 * programs. */
function fieldsOf(types: FileDescriptorSet & Message, fullName: string): Map<string, number> {
  let found: DescriptorProto | undefined;
  for (const file of types.file) {
    for (const type of file.messageType) if (`${file.package}.${type.name}` === fullName) found = type;
  }
  if (!found) throw new Error(`the file does not describe ${fullName}`);
  return new Map(found.field.map((field) => [field.name, field.number]));
}

const kVectors = { position_m: ["x", "y", "z"], force_wanted_n: ["wx", "wy", "wz"], force_applied_n: ["ax", "ay", "az"] } as const;

/** Reads a message of numbers, such as Vec3: field 1 is `names[0]`. */
function readNumbers(reader: BinaryReader, names: readonly HandleColumn[], into: HandleSample): void {
  const end = reader.uint32() + reader.pos;
  // Zeros are not encoded.
  for (const name of names) into[name] = 0;
  while (reader.pos < end) {
    const [number, type] = reader.tag();
    const name = names[number - 1];
    if (name !== undefined && type === 1) into[name] = reader.double();
    else reader.skip(type, number);
  }
}

/** Reads one part of the handle, by the field names of its type in the file. */
type PartReader = (reader: BinaryReader, into: HandleSample) => void;
function partDecoder(fields: Map<string, number>, parts: Readonly<Record<string, PartReader>>): PartReader {
  const readers: PartReader[] = [];
  for (const [name, how] of Object.entries(parts)) {
    const number = fields.get(name);
    if (number !== undefined) readers[number] = how;
  }
  return (reader, into) => {
    const end = reader.uint32() + reader.pos;
    while (reader.pos < end) {
      const [number, type] = reader.tag();
      const how = readers[number];
      if (how) how(reader, into);
      else reader.skip(type, number);
    }
  };
}

const kTurn: Readonly<Record<string, PartReader>> = {
  orientation: (reader, into) => readNumbers(reader, ["qw", "qx", "qy", "qz"], into),
  torque_applied_nm: (reader, into) => readNumbers(reader, ["tx", "ty", "tz"], into),
};
const kGrip: Readonly<Record<string, PartReader>> = {
  opening_rad: (reader, into) => (into.grip = reader.double()),
  force_applied_n: (reader, into) => (into.gripForce = reader.double()),
};

const kField: Readonly<Record<string, PartReader>> = {
  generation: (reader, into) => (into.field = reader.uint32()),
  depth_m: (reader, into) => (into.depth = reader.double()),
  proxy_m: (reader, into) => readNumbers(reader, ["px", "py", "pz"], into),
};

function stepDecoder(types: FileDescriptorSet & Message, step: string): (data: Uint8Array) => Sample {
  const fields = fieldsOf(types, step);
  const beside = (name: string): string => step.replace(/[^.]*$/, name);
  const handle = (s: Sample): HandleSample => (s.handle ??= noHandle());
  const stiffness: number[] = [];
  const readers: ((reader: BinaryReader, s: Sample) => void)[] = [];
  const read = (name: string, how: (reader: BinaryReader, s: Sample) => void): void => {
    const number = fields.get(name);
    if (number !== undefined) readers[number] = how;
  };
  for (const [name, [x, y, z]] of Object.entries(kVectors)) {
    read(name, (reader, s) => {
      const end = reader.uint32() + reader.pos;
      while (reader.pos < end) {
        const [number, type] = reader.tag();
        if (number === 1) s[x] = reader.double();
        else if (number === 2) s[y] = reader.double();
        else if (number === 3) s[z] = reader.double();
        else reader.skip(type, number);
      }
    });
  }
  read("permitted_n", (reader, s) => (s.permitted = reader.double()));
  read("energy_j", (reader, s) => (s.energy = reader.double()));
  read("reason_bits", (reader, s) => (s.reasons = reader.uint32()));
  read("mode", (reader, s) => (s.mode = reader.int32()));
  read("late_ns", (reader, s) => (s.late = Number(reader.sint64()) / 1e9));
  read("loop_age_ns", (reader, s) => (s.age = Number(reader.sint64()) / 1e9));
  // Missing in recordings from before rotations were supported.
  if (fields.has("turn")) {
    const turn = partDecoder(fieldsOf(types, beside("Turn")), kTurn);
    read("turn", (reader, s) => turn(reader, handle(s)));
  }
  if (fields.has("grip")) {
    const grip = partDecoder(fieldsOf(types, beside("Grip")), kGrip);
    read("grip", (reader, s) => {
      // Zeros are not encoded, so a closed gripper has no opening field.
      handle(s).grip = handle(s).gripForce = 0;
      grip(reader, handle(s));
    });
  }
  if (fields.has("field")) {
    const field = partDecoder(fieldsOf(types, beside("Field")), kField);
    read("field", (reader, s) => {
      handle(s).depth = 0; // not encoded without contact
      field(reader, handle(s));
    });
  }
  read("hand_force_n", (reader, s) => readNumbers(reader, ["hx", "hy", "hz"], handle(s)));
  read("buttons", (reader, s) => (handle(s).buttons = reader.fixed32()));
  read("stiffness_wanted_n_per_m", (reader) => {
    const end = reader.uint32() + reader.pos;
    while (reader.pos < end) stiffness.push(reader.double());
  });
  return (data) => {
    stiffness.length = 0;
    const s: Sample = { t: 0, x: 0, y: 0, z: 0, wx: 0, wy: 0, wz: 0, ax: 0, ay: 0, az: 0, permitted: 0, energy: 0, reasons: 0, mode: 0, age: 0, late: 0 };
    const reader = new BinaryReader(data);
    while (reader.pos < reader.len) {
      const [number, type] = reader.tag();
      const how = readers[number];
      if (how) how(reader, s);
      else reader.skip(type, number);
    }
    const contact = stiffness.length > 0 ? contactOf(stiffness, [s.wx, s.wy, s.wz]) : undefined;
    if (contact) {
      const into = handle(s);
      [into.nx, into.ny, into.nz] = contact.normal;
      into.gap = contact.gap;
    }
    return s;
  };
}

function decodeScene(data: Uint8Array, fields: Map<string, number>): NonNullable<Recording["scene"]> {
  const scene = { text: "", version: "", commit: "" };
  const reader = new BinaryReader(data);
  while (reader.pos < reader.len) {
    const [number, type] = reader.tag();
    if (number === fields.get("text")) scene.text = reader.string();
    else if (number === fields.get("version")) scene.version = reader.string();
    else if (number === fields.get("commit")) scene.commit = reader.string();
    else reader.skip(type, number);
  }
  return scene;
}

/** Opens a file of the server: entirely if it is small, otherwise by ranges. */
async function openFile(url: string): Promise<Readable> {
  const head = await fetch(url, { method: "HEAD" });
  if (!head.ok) throw new Error(head.status === 404 ? "There is no such recording." : `The server says ${head.status}.`);
  const size = Number(head.headers.get("Content-Length"));
  if (size <= kWhole) {
    // Reads only up to the current size, because the file may grow.
    const all = size === 0 ? new Uint8Array() : await fetchRange(url, 0, size);
    return { size: async () => BigInt(all.length), read: async (offset, length) => all.subarray(Number(offset), Number(offset + length)) };
  }
  return { size: async () => BigInt(size), read: (offset, length) => fetchRange(url, Number(offset), Number(length)) };
}

async function fetchRange(url: string, offset: number, length: number): Promise<Uint8Array> {
  const answer = await fetch(url, { headers: { Range: `bytes=${offset}-${offset + length - 1}` } });
  if (answer.status !== 206) throw new Error(`The server says ${answer.status}.`);
  return new Uint8Array(await answer.arrayBuffer());
}

// SPDX-License-Identifier: Apache-2.0
import { McapStreamReader, type McapTypes } from "@mcap/core";

export interface Readable {
  size(): Promise<bigint>;
  read(offset: bigint, size: bigint): Promise<Uint8Array>;
}

type Salvaged = McapTypes.TypedMcapRecords["Schema" | "Channel" | "Message"];

const kMagic = 8;
const kHead = 9;
const kChunkHead = 40;
const kSchema = 0x03;
const kChannel = 0x04;
const kChunk = 0x06;
const kMessageIndex = 0x07;
const kDataEnd = 0x0f;
const kBehindChunks: ReadonlySet<number> = new Set([kSchema, kChannel, kChunk, kMessageIndex, kDataEnd]);
/** tendond writes chunks of 256 KiB. */
const kMaxRecord = 64 * 1024 * 1024;
const kBlock = 4 * 1024 * 1024;

/**
 * Reads a recording that is truncated or damaged. This does not use the index at the end of the file. A chunk is skipped if its CRC
 * or its length is wrong.
 */
export class Salvage {
  damaged = 0;
  /** True if the file is complete. */
  ended = false;
  readonly #file: Readable;
  #size = 0;
  #block: Uint8Array = new Uint8Array();
  #blockAt = 0;
  /** The last message of each channel. */
  readonly #newest = new Map<number, { sequence: number; damaged: number }>();

  constructor(file: Readable) {
    this.#file = file;
  }

  async *records(): AsyncGenerator<Salvaged> {
    this.#size = Number(await this.#file.size());
    const channels: Uint8Array[] = [];
    for (let at = kMagic; at + kHead <= this.#size; ) {
      const record = await this.#record(at);
      const opcode = record?.[0];
      if (opcode === kDataEnd) {
        this.ended = true;
        return;
      }
      let next = record && at + record.length;
      let whole = record !== undefined && (opcode !== kMessageIndex || isIndex(record));
      if (!whole) next = undefined;
      if (record && (opcode === kChunk || opcode === kSchema || opcode === kChannel)) {
        const behind = behindChunk(record, at);
        const found = recordsOf(record, opcode === kChunk ? channels : []);
        whole = found !== undefined;
        if (opcode === kChannel && whole) channels.push(record.slice());
        for (const one of found ?? []) {
          if (one.type === "Message") this.#count(one.channelId, one.sequence);
          yield one;
        }
        if (opcode === kChunk) next = behind ?? next;
        if (!whole && !kBehindChunks.has((next !== undefined && (await this.#record(next))?.[0]) || 0)) next = undefined;
      }
      at = next ?? (await this.#findChunk(at + 1));
      // If this is the end of the file, it is truncated and not damaged.
      if (!whole && at < this.#size) ++this.damaged;
    }
  }

  /** If a complete chunk is missing, this can only be detected by the sequence numbers. */
  #count(channel: number, sequence: number): void {
    const before = this.#newest.get(channel) ?? { sequence: -1, damaged: 0 };
    if (sequence > before.sequence + 1 && before.damaged === this.damaged) ++this.damaged;
    this.#newest.set(channel, { sequence, damaged: this.damaged });
  }

  /** Returns undefined if the record is too large or extends past the end of the file. */
  async #record(at: number): Promise<Uint8Array | undefined> {
    const head = await this.#bytes(at, kHead);
    const length = head && lengthIn(head, 1);
    if (head?.[0] === 0 || length === undefined || length > kMaxRecord) return undefined;
    return this.#bytes(at, kHead + length);
  }

  /** Returns the position of the next chunk, or the size of the file if there is none. */
  async #findChunk(from: number): Promise<number> {
    const heads = kHead + kChunkHead;
    for (let at = from; at + heads <= this.#size; ) {
      const block = await this.#bytes(at, Math.min(kBlock, this.#size - at));
      if (block === undefined) break;
      for (let i = block.indexOf(kChunk); i >= 0 && i + heads <= block.length; i = block.indexOf(kChunk, i + 1)) {
        const length = lengthIn(block, i + heads - 8);
        if (length !== undefined && lengthIn(block, i + 1) === kChunkHead + length && lengthIn(block, i + kHead + 16) === length) return at + i;
      }
      at += block.length - heads + 1;
    }
    return this.#size;
  }

  async #bytes(at: number, length: number): Promise<Uint8Array | undefined> {
    if (at + length > this.#size) return undefined;
    if (at < this.#blockAt || at + length > this.#blockAt + this.#block.length) {
      this.#block = await this.#file.read(BigInt(at), BigInt(Math.min(Math.max(length, kBlock), this.#size - at)));
      this.#blockAt = at;
    }
    return this.#block.subarray(at - this.#blockAt, at - this.#blockAt + length);
  }
}

/** Returns undefined if the length is too large. */
function lengthIn(bytes: Uint8Array, at: number): number | undefined {
  const length = new DataView(bytes.buffer, bytes.byteOffset).getBigUint64(at, true);
  return length <= BigInt(kMaxRecord) ? Number(length) : undefined;
}

/** Returns the position after the chunk. Returns undefined if the lengths of its records do not match. */
function behindChunk(record: Uint8Array, at: number): number | undefined {
  if (record.length < kHead + kChunkHead) return undefined;
  const length = lengthIn(record, kHead + 16);
  return length !== undefined && length === lengthIn(record, kHead + kChunkHead - 8) ? at + kHead + kChunkHead + length : undefined;
}

/** Returns true if the length of the entries matches the length of the record. */
function isIndex(record: Uint8Array): boolean {
  const entries = kHead + 2;
  return record.length >= entries + 4 && new DataView(record.buffer, record.byteOffset).getUint32(entries, true) === record.length - entries - 4;
}

/** Returns the schema, channel or messages in a record. Returns undefined if the record is damaged. */
function recordsOf(record: Uint8Array, channels: readonly Uint8Array[]): Salvaged[] | undefined {
  const reader = new McapStreamReader({ noMagicPrefix: true });
  for (const channel of channels) reader.append(channel);
  reader.append(record);
  const found: Salvaged[] = [];
  try {
    for (let one = reader.nextRecord(); one; one = reader.nextRecord()) {
      if (one.type === "Message" || one.type === "Schema" || (one.type === "Channel" && channels.length === 0)) found.push(one);
    }
  } catch {
    return undefined;
  }
  return found;
}

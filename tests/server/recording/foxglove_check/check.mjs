// SPDX-License-Identifier: Apache-2.0
//
// node check.mjs FILE [TOPIC=COUNT …]
//
// Reads an MCAP file like Foxglove: through its index, or as a stream if the file has no end. For each channel, it uses
// the protobuf schema in the file. All messages are decoded, and the result is printed as one line of JSON. The exit
// status is 1 if there is an error in the file, or if a topic does not have the expected number of messages
// ("TOPIC=COUNT", or "TOPIC=some" for at least one).

import { open, readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import protobuf from "protobufjs";
import descriptor from "protobufjs/ext/descriptor/index.js";

const kMagic = Buffer.from([0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a]);

/** Returns the decoder of a channel for the schema in the file. */
function decoderOf(channel, schema) {
  if (channel.messageEncoding !== "protobuf" || schema?.encoding !== "protobuf")
    throw new Error(`${channel.topic} is not protobuf`);
  const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
  root.resolveAll();
  const type = root.lookupType(schema.name);
  return (data) =>
    type.toObject(type.decode(data), { defaults: true, longs: String, enums: String, bytes: String });
}

class Summary {
  counts = {};
  first = undefined;
  last = undefined;
  scene = undefined;
  lost = { steps: 0, datagrams: 0 };

  add(topic, logTime, message) {
    this.counts[topic] = (this.counts[topic] ?? 0) + 1;
    if (topic === "/haptic/step") {
      this.last = { log_time: String(logTime), ...message };
      this.first ??= this.last;
    } else if (topic === "/scene") {
      this.scene = message;
    } else if (topic === "/recording/lost") {
      this.lost.steps += Number(message.steps);
      this.lost.datagrams += Number(message.datagrams);
    }
  }
}

async function readWhole(path) {
  const file = await open(path);
  try {
    const size = BigInt((await file.stat()).size);
    const reader = await McapIndexedReader.Initialize({
      readable: {
        size: async () => size,
        read: async (offset, length) => {
          const buffer = new Uint8Array(Number(length));
          const { bytesRead } = await file.read(buffer, 0, buffer.length, Number(offset));
          if (bytesRead !== buffer.length) throw new Error(`read past the end at ${offset}`);
          return buffer;
        },
      },
    });
    const decoders = new Map();
    for (const channel of reader.channelsById.values())
      decoders.set(channel.id, decoderOf(channel, reader.schemasById.get(channel.schemaId)));
    const summary = new Summary();
    let time = 0n;
    for await (const message of reader.readMessages()) {
      if (message.logTime < time) throw new Error(`the index gives ${message.logTime} after ${time}`);
      time = message.logTime;
      summary.add(
        reader.channelsById.get(message.channelId).topic,
        message.logTime,
        decoders.get(message.channelId)(message.data),
      );
    }
    const total = Object.values(summary.counts).reduce((a, b) => a + b, 0);
    if (BigInt(total) !== reader.statistics.messageCount)
      throw new Error(`${total} messages, but the statistics say ${reader.statistics.messageCount}`);
    for (const channel of reader.channelsById.values()) {
      const stated = Number(reader.statistics.channelMessageCounts.get(channel.id) ?? 0n);
      if (stated !== (summary.counts[channel.topic] ?? 0))
        throw new Error(`${channel.topic}: the statistics say ${stated} messages`);
    }
    return summary;
  } finally {
    await file.close();
  }
}

function readTruncated(bytes) {
  const reader = new McapStreamReader({ validateCrcs: true });
  reader.append(bytes);
  const schemas = new Map();
  const channels = new Map();
  const decoders = new Map();
  const summary = new Summary();
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") {
      channels.set(record.id, record);
      decoders.set(record.id, decoderOf(record, schemas.get(record.schemaId)));
    }
    if (record.type === "Message")
      summary.add(channels.get(record.channelId).topic, record.logTime, decoders.get(record.channelId)(record.data));
  }
  if (reader.done()) throw new Error("the file has an end after all");
  return summary;
}

async function main() {
  const [path, ...expected] = process.argv.slice(2);
  if (path === undefined) throw new Error("usage: node check.mjs FILE [TOPIC=COUNT …]");
  const bytes = await readFile(path);
  const whole = bytes.length > kMagic.length && bytes.subarray(-kMagic.length).equals(kMagic);
  const summary = whole ? await readWhole(path) : readTruncated(bytes);

  for (const expectation of expected) {
    const [topic, count] = expectation.split("=");
    const found = summary.counts[topic] ?? 0;
    if (count === "some" ? found === 0 : found !== Number(count))
      throw new Error(`${topic}: ${found} messages, expected ${count}`);
  }
  if (summary.scene === undefined) throw new Error("there is no scene");

  console.log(
    JSON.stringify({
      path,
      truncated: !whole,
      messages: summary.counts,
      seed: summary.scene.seed,
      lost: summary.lost,
      first_step: summary.first,
      last_step: summary.last,
    }),
  );
}

main().catch((error) => {
  console.error(`${process.argv[2] ?? "check.mjs"}: ${error.message}`);
  process.exitCode = 1;
});

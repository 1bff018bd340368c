// SPDX-License-Identifier: Apache-2.0
// node turnaround.mjs RECORDING FOXGLOVE_CHECK
//
// Reads a recording of tendond. For each client, it prints the time from sending a state until the force that answers
// it has arrived, on the clock of the server. FOXGLOVE_CHECK is build/<preset>/foxglove_check, which contains the
// packages that are used to read MCAP.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { decodeData, decodeHelloMessage } from "../../../clients/typescript/dist/codec.js";
import { decodeAnswer, decodeHello, kHeaderSize } from "../../../clients/typescript/dist/datagram.js";

const [recording, packages] = process.argv.slice(2);
const require = createRequire(resolve(packages, "package.json"));
const { McapStreamReader } = require("@mcap/core");
const protobuf = require("protobufjs");
const descriptor = require("protobufjs/ext/descriptor");

const reader = new McapStreamReader();
reader.append(await readFile(recording));
const [schemas, channels, types] = [new Map(), new Map(), new Map()];
const names = new Map();
const guests = new Map();

function take(logTime, { connection_id: connectionId, payload, type }) {
  if (type === 1) {
    const hello = decodeHello(payload);
    if (hello) names.set(hello.random.join(), decodeHelloMessage(hello.content)?.name);
  } else if (type === 4) {
    const answer = decodeAnswer(payload);
    if (answer) guests.set(answer.connectionId, { name: names.get(answer.random.join()), left: new Map(), times: [], states: 0 });
  } else if (type === 3) {
    const guest = guests.get(connectionId);
    for (const { kind, value } of decodeData(payload.subarray(kHeaderSize))?.frames ?? []) {
      if (kind === "state" && ++guest.states) guest.left.set(value.tick, logTime);
      if (kind === "force") guest.times.push(Number(logTime - guest.left.get(value.basedOnTick)) / 1000);
    }
  }
}

for (let record; (record = reader.nextRecord()); ) {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel" && record.topic === "/net/datagram") {
    const schema = schemas.get(record.schemaId);
    const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
    types.set(record.id, root.resolveAll().lookupType(schema.name));
    channels.set(record.id, record);
  }
  if (record.type === "Message" && channels.has(record.channelId))
    take(record.logTime, types.get(record.channelId).decode(record.data));
}

const all = new Map();
for (const { name, times, states } of guests.values()) {
  const sum = all.get(name) ?? { times: [], states: 0 };
  all.set(name, { times: [...sum.times, ...times], states: sum.states + states });
}
for (const [name, { times, states }] of all) {
  times.sort((a, b) => a - b);
  const at = (q) => Math.round(times[Math.floor(q * (times.length - 1))]);
  console.log(`${name}: ${states} states, n = ${times.length} forces, p50 ${at(0.5)} µs, p99 ${at(0.99)} µs, max ${at(1)} µs`);
}

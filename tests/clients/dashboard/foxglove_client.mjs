// SPDX-License-Identifier: Apache-2.0
// Connects the client of Foxglove's package @foxglove/ws-protocol to /foxglove of tendon-dash.
import { once } from "node:events";
import { createRequire } from "node:module";
import { join } from "node:path";
import { until } from "./support.mjs";

const require = createRequire(join(process.env.TENDON_FOXGLOVE, "package.json"));
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const protobuf = require("protobufjs");
const descriptor = require("protobufjs/ext/descriptor");
export const { WebSocket } = require("ws");
export const { foxgloveEnumSchemas, foxgloveMessageSchemas, generateProto } = require("@foxglove/schemas/internal");
export { protobuf };

export const kNames = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

export async function refusal(address, protocols, options = {}) {
  const socket = new WebSocket(`ws://${address}/foxglove`, protocols, options);
  socket.on("error", () => {});
  socket.on("open", () => socket.emit("unexpected-response", undefined, { statusCode: 101 }));
  const [, response] = await once(socket, "unexpected-response");
  socket.terminate();
  return response.statusCode;
}

/** Collects all messages and decodes each channel with the schema that the server advertised. */
export class Viewer {
  channels = new Map();
  statuses = [];
  messages = new Map();
  subscriptions = new Map();
  errors = [];

  constructor(test, address, protocols = kNames) {
    this.socket = new WebSocket(`ws://${address}/foxglove`, protocols);
    this.client = new FoxgloveClient({ ws: this.socket });
    this.client.on("serverInfo", (info) => (this.info = info));
    this.client.on("status", (status) => this.statuses.push(status));
    this.client.on("error", (error) => this.errors.push(error));
    this.client.on("advertise", (channels) => channels.forEach((channel) => this.#add(channel)));
    this.client.on("message", ({ subscriptionId, timestamp, data }) => {
      const topic = this.subscriptions.get(subscriptionId);
      const { type } = this.channels.get(topic);
      const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
      this.messages.get(topic).push({ time: timestamp, now: process.hrtime.bigint(), ...type.toObject(type.decode(bytes), { defaults: true, longs: Number }) });
    });
    test.after(() => this.socket.terminate());
  }

  #add(channel) {
    const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(Buffer.from(channel.schema, "base64")));
    root.resolveAll();
    this.channels.set(channel.topic, { ...channel, root, type: root.lookupType(channel.schemaName) });
  }

  async subscribe(topic) {
    await until(`${topic} is there`, () => this.channels.has(topic), () => [...this.channels.keys()].join(" "));
    const subscription = this.client.subscribe(this.channels.get(topic).id);
    this.subscriptions.set(subscription, topic);
    const messages = [];
    this.messages.set(topic, messages);
    return { subscription, messages };
  }

  status(what, fits) {
    return until(what, () => this.statuses.find(fits), () => JSON.stringify(this.statuses));
  }
}

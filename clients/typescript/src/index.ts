// SPDX-License-Identifier: Apache-2.0
// Exports for all runtimes. "tendon-client/node" adds UDP and the command line.
export { connect, type ConnectConfig, type Guest, type OpenTransport, type Transport } from "./connect.js";
export type { ClientConfig, ClientStats, Phase } from "./config.js";
export { ForceClient, type Physics, type Watch } from "./force_client.js";
export type { Touch } from "./answer.js";
export { depthTableOf, Field, type DepthTable, type FieldDescription, type MaterialOptions } from "./field.js";
export { Follower, type FollowerConfig, type Following, type Pose, type ToolContact } from "./follower.js";
export type { ForceDeadband } from "./deadband.js";
export { parseKeyFile, type ClientKey } from "./key_file.js";
export {
  ChannelRule, Code, Hand, Mode, OutputKind, reasonNames, Role, Safety, type ChannelDescription, type Contact, type Delays,
  type DeviceDescription, type DeviceReport, type DeviceState, type ForceTable, type Grip, type HandleDescription, type Joints,
  type LampColour, type LinkReport, type OutputDescription, type PeerReport, type Quat, type StateDeadband, type Stiffness,
  type Turning, type Vec3, type Vibration, type Welcome,
} from "./messages.js";
export type { LinkStats } from "./session.js";
export { distanceTo, rotated, type Primitive } from "./shape.js";
export type { Nanoseconds } from "./time.js";
export type { Motion } from "./upload.js";
export { webSocket } from "./websocket.js";

// SPDX-License-Identifier: Apache-2.0
// Additions for Node: UDP and the command line shared by all clients.
export * from "./index.js";
export { readClientKey } from "./client_key.js";
export { commandLine, type Options } from "./options.js";
export { run } from "./run.js";
export { NoSuchHost, udp } from "./udp.js";

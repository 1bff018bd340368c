#!/usr/bin/env node
// SPDX-License-Identifier: Apache-2.0
import { parseArgs } from "node:util";
import { Bridge, kBridgeDefaults, type BridgeConfig } from "./bridge.js";
import { parseAddress, parseServer } from "./udp.js";

const kHelp = `tendon-bridge: connect web pages to tendond. One WebSocket message is one datagram; the bridge has no key.

Usage: tendon-bridge [OPTIONS]

  -h, --help              Print this help and exit
  --listen HOST:PORT      Address for WebSockets; port 0: a free port [${kBridgeDefaults.listen}]
  --to HOST:PORT          Address of tendond [${kBridgeDefaults.to}]
  --origin URL            Also accept pages from this origin; otherwise only from this machine. Repeatable
  --max-peers NUMBER      Maximum number of WebSockets [${kBridgeDefaults.maxPeers}]
  --max-rate-hz NUMBER    Maximum number of datagrams per second from one page [${kBridgeDefaults.maxRateHz}]
  --json                  Print JSON on stdout, one object per line: listening, stopped

From pages on other machines, only encrypted datagrams are forwarded.

Example: tendon-bridge --to 127.0.0.1:47100 --origin https://lab.example
`;

function whole(option: string, text: string): number {
  const value = Number(text);
  if (text.trim() !== "" && Number.isInteger(value) && value >= 1 && value <= 1e6) return value;
  throw new RangeError(`--${option}: expected a whole number from 1 to 1000000, got "${text}"`);
}

function address(option: string, text: string, read: (text: string) => unknown): void {
  try {
    read(text);
  } catch (error) {
    throw new RangeError(`--${option}: ${(error as Error).message}`);
  }
}

function origin(text: string): string {
  if (URL.canParse(text) && new URL(text).origin === text) return text;
  throw new RangeError(`--origin: expected an origin like https://lab.example, got "${text}"`);
}

function parse(): { readonly config: BridgeConfig; readonly json: boolean } {
  const { values } = parseArgs({
    options: {
      help: { type: "boolean", short: "h", default: false },
      listen: { type: "string", default: kBridgeDefaults.listen },
      to: { type: "string", default: kBridgeDefaults.to },
      origin: { type: "string", multiple: true, default: [] },
      "max-peers": { type: "string", default: String(kBridgeDefaults.maxPeers) },
      "max-rate-hz": { type: "string", default: String(kBridgeDefaults.maxRateHz) },
      json: { type: "boolean", default: false },
    },
  });
  if (values.help) {
    process.stdout.write(kHelp);
    process.exit(0);
  }
  const { listen, to, json } = values;
  address("listen", listen, parseAddress);
  address("to", to, parseServer);
  return {
    config: {
      listen, to, origins: values.origin.map(origin), maxPeers: whole("max-peers", values["max-peers"]),
      maxRateHz: whole("max-rate-hz", values["max-rate-hz"]),
    },
    json,
  };
}

/** Exits with 0 after --help and with 2 if the command line is invalid. */
function commandLine(): { readonly config: BridgeConfig; readonly json: boolean } {
  try {
    return parse();
  } catch (error) {
    process.stderr.write(`tendon-bridge: ${(error as Error).message}\nRun with --help for more information.\n`);
    process.exit(2);
  }
}

async function main(): Promise<void> {
  const { config, json } = commandLine();
  const bridge = await Bridge.open(config);
  if (json) console.log(JSON.stringify({ event: "listening", address: bridge.address }));
  else console.error(`tendon-bridge: ws://${bridge.address} to ${config.to}`);
  const stop = async (): Promise<void> => {
    await bridge.close();
    const counts = Object.entries(bridge.counts)
      .map(([name, count]) => [name.replace(/[A-Z]/g, (letter) => `_${letter.toLowerCase()}`), count]);
    if (json) console.log(JSON.stringify({ event: "stopped", ...Object.fromEntries(counts) }));
    else console.error(`tendon-bridge: ${counts.map(([name, count]) => `${name} ${count}`).join(", ")}`);
  };
  process.once("SIGINT", () => void stop()).once("SIGTERM", () => void stop());
}

main().catch((error: Error) => {
  process.stderr.write(`tendon-bridge: ${error.message}\n`);
  process.exitCode = 1;
});

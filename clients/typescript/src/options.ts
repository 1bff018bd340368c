// SPDX-License-Identifier: Apache-2.0
import { parseArgs, type ParseArgsConfig } from "node:util";
import { readClientKey } from "./client_key.js";
import type { ClientConfig } from "./config.js";
import { kMaxLabel } from "./limits.js";
import { parseServer } from "./udp.js";

/** Options of run(), filled by commandLine(). */
export interface Options extends ClientConfig {
  /** Address of tendond. */
  readonly server: string;
  /** The duration of the run. If it is 0, it is run until SIGINT or SIGTERM. */
  readonly durationS: number;
  /** Print the final summary to stdout as one JSON object instead of to stderr as text. */
  readonly json: boolean;
}

/** The default and the description of an option, which is a number ≥ 0 or a flag. */
type Extra = readonly [number, string] | readonly [false, string];
type ValueOf<E extends Extra> = E extends readonly [number, string] ? number : boolean;

interface Shared {
  readonly name: string;
  readonly rateHz: number;
}

/** Parses 0 or a number from `least` to `most`. */
function number(option: string, text: string, least: number, most: number): number {
  const value = text.trim() === "" ? NaN : Number(text);
  if (value === 0 || (value >= least && value <= most)) return value;
  throw new RangeError(`--${option}: expected ${least > 0 ? "0, or " : ""}${least} to ${most}, got "${text}"`);
}

/** Parses the name of a device or channel. */
function label(option: string, text: string): string {
  const size = new TextEncoder().encode(text).length;
  if (size <= kMaxLabel) return text;
  throw new RangeError(`--${option}: expected at most ${kMaxLabel} bytes, got ${size}: "${text}"`);
}

/**
 * Parses the command line shared by all clients, --server, --key, --device, --channel, --take-lease, --rate-hz,
 * --duration-s, --json and --help, and the options of the program: `{ "stiffness-n-per-m": [2000, "Stiffness of
 * the wall, N/m"] }`. Exits with 0 after --help, with 1 if the key cannot be read, and with 2 if the command line is
 * invalid.
 */
export function commandLine<Extras extends Record<string, Extra> = Record<never, never>>(
  purpose: string,
  defaults: Shared,
  extras: Extras = {} as Extras,
): { readonly options: Options; readonly values: { readonly [Name in keyof Extras]: ValueOf<Extras[Name]> } } {
  const config: NonNullable<ParseArgsConfig["options"]> = {
    help: { type: "boolean", short: "h" },
    server: { type: "string", default: "127.0.0.1:47100" },
    key: { type: "string" },
    device: { type: "string", default: "" },
    channel: { type: "string", default: "" },
    "take-lease": { type: "boolean", default: false },
    "rate-hz": { type: "string", default: String(defaults.rateHz) },
    "duration-s": { type: "string", default: "0" },
    json: { type: "boolean", default: false },
  };
  for (const [name, [value]] of Object.entries(extras)) {
    config[name] = value === false ? { type: "boolean", default: false } : { type: "string", default: String(value) };
  }
  try {
    const { values } = parseArgs({ options: config });
    if (values.help) {
      process.stdout.write(help(purpose, defaults, extras));
      process.exit(0);
    }
    const text = (name: string): string => String(values[name]);
    const server = text("server");
    try {
      parseServer(server);
    } catch (error) {
      throw new RangeError(`--server: ${(error as Error).message}`);
    }
    const key = typeof values.key === "string" ? readKey(defaults.name, values.key) : undefined;
    const options: Options = {
      name: defaults.name,
      server,
      key,
      device: label("device", text("device")),
      channel: label("channel", text("channel")),
      takeLease: values["take-lease"] === true,
      rateHz: number("rate-hz", text("rate-hz"), 1e-3, 1e5),
      durationS: number("duration-s", text("duration-s"), 0, 1e9),
      json: values.json === true,
    };
    const more = Object.entries(extras).map(([name, [value]]) =>
      [name, value === false ? values[name] : number(name, text(name), 0, Number.MAX_VALUE)]);
    return { options, values: Object.fromEntries(more) };
  } catch (error) {
    process.stderr.write(`${(error as Error).message}\nRun with --help for more information.\n`);
    process.exit(2);
  }
}

function readKey(program: string, file: string): Uint8Array {
  try {
    return readClientKey(file).key;
  } catch (error) {
    process.stderr.write(`${program}: --key: ${(error as Error).message}\n`);
    process.exit(1);
  }
}

function help(purpose: string, { name, rateHz }: Shared, extras: Record<string, Extra>): string {
  const lines: [string, string][] = [
    ["-h, --help", "Print this help and exit"],
    ["--server HOST:PORT", "Address of tendond: a host name or an IP address [127.0.0.1:47100]"],
    ["--key FILE", "Key file from `tendond keygen`. Not required for a server on this machine without keys"],
    ["--device NAME", "Name of the device, for a server with several devices"],
    ["--channel NAME", "Name of the channel of the device"],
    ["--take-lease", "Request the channel until this client holds it"],
    ["--rate-hz NUMBER", `Rate of the answers, Hz. 0: answer every state [${rateHz}]`],
    ["--duration-s NUMBER", "Stop after this time, s. 0: run until Ctrl-C [0]"],
    ["--json", "Print JSON on stdout, one object per line"],
    ...Object.entries(extras).map(([option, [value, meaning]]): [string, string] =>
      value === false ? [`--${option}`, meaning] : [`--${option} NUMBER`, `${meaning} [${value}]`]),
  ];
  const table = lines.map(([option, meaning]) => `  ${option.padEnd(30)}${meaning}\n`).join("");
  return `${purpose}\n\nUsage: ${name} [OPTIONS]\n\n${table}\nExample: ${name} --server 127.0.0.1:47100 --duration-s 10\n`;
}

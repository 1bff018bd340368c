// SPDX-License-Identifier: Apache-2.0
// Starts Tendon's programs and waits for their output.
import { spawn } from "node:child_process";
import { createSocket } from "node:dgram";
import { copyFileSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { connect } from "node:net";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";

export const kRoot = join(dirname(fileURLToPath(import.meta.url)), "../../..");
const kPatienceMs = 60_000;

export const packageOf = (folder, name) => createRequire(join(kRoot, folder, "package.json"))(name);

export function scratch(test) {
  const folder = mkdtempSync(join(tmpdir(), "tendon-dash-"));
  test.after(() => rmSync(folder, { recursive: true }));
  return folder;
}

/** A running program and the lines of its stdout and stderr. The test kills it at the end. */
export class Program {
  lines = [];
  constructor(test, name, args, folder) {
    this.process = spawn(join(process.env.TENDON_PROGRAMS, name), args, { stdio: ["ignore", "pipe", "pipe"], cwd: folder });
    this.ended = new Promise((resolve) => this.process.once("close", resolve));
    for (const stream of [this.process.stdout, this.process.stderr]) createInterface(stream).on("line", (line) => this.lines.push(line));
    test.after(async () => {
      this.process.kill("SIGKILL");
      await this.ended;
    });
  }
  async line(text) {
    await until(`${text} in ${this.process.spawnfile}`, () => this.lines.some((line) => line.includes(text)) || this.process.exitCode !== null, () => this.lines.join("\n"));
    const found = this.lines.find((line) => line.includes(text));
    if (!found) throw new Error(`it ended without: ${text}\n${this.lines.join("\n")}`);
    return found;
  }
  async stop() {
    this.process.kill("SIGTERM");
    return this.ended;
  }
}

export async function until(what, done, more = () => "") {
  const deadline = performance.now() + kPatienceMs;
  for (;;) {
    const result = await done();
    if (result) return result;
    if (performance.now() > deadline) throw new Error(`never came to be: ${what}\n${more()}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

/**
 * Writes NAME.key to `folder` and a copy to its subfolder `keys`, which is the folder for `keys = "keys"` in a scene.
 */
export async function makeKeys(test, folder, names, ...more) {
  mkdirSync(join(folder, "keys"), { recursive: true });
  for (const name of names) {
    const made = new Program(test, "tendond", ["keygen", name, ...more], folder);
    if ((await made.ended) !== 0) throw new Error(made.lines.join("\n"));
    copyFileSync(join(folder, `${name}.key`), join(folder, "keys", `${name}.key`));
  }
}

export async function startServer(test, folder, scenes, ...more) {
  const paths = scenes.map((scene) => (scene.endsWith(".toml") ? scene : join(kRoot, "deploy/scenes", `${scene}.toml`)));
  const program = new Program(test, "tendond", [...paths, ...(more.includes("--listen") ? [] : ["--listen", "127.0.0.1:0"]), "--json", ...more], folder);
  return { program, address: JSON.parse(await program.line('"listening"')).address };
}

/**
 * Starts the coupled servers of leader.toml and follower.toml. operator.key can connect to the leader, which is
 * engaged by request. `network` is the profile of the tendon-inject between them.
 */
export async function startPair(test, folder, network = "delay=10ms") {
  await makeKeys(test, folder, ["operator"]);
  const scene = readFileSync(join(kRoot, "deploy/scenes/leader.toml"), "utf8")
    .replace(/\[\[device\.hand\.press\]\] {9}# the act[^[]*/, "")
    .replace('by = "button"\nbutton = 0', 'by = "request"');
  writeFileSync(join(folder, "leader.toml"), `${scene}\n[network]\nkeys = "keys"\n`);
  const follower = await startServer(test, folder, ["follower"], "--record", "/dev/null");
  const inject = new Program(test, "tendon-inject", ["--listen", "127.0.0.1:0", "--to", follower.address, "--profile", network, "--seed", "8", "--json"]);
  const dial = JSON.parse(await inject.line('"start"')).listen;
  const leader = await startServer(test, folder, [join(folder, "leader.toml")], "--record", "/dev/null", "--dial", dial);
  return { leader, follower };
}

export async function startDash(test, server, ...more) {
  const program = new Program(test, "tendon-dash", ["--server", server, "--listen", "127.0.0.1:0", "--json", ...more]);
  const { address, operator_url: operatorUrl } = JSON.parse(await program.line('"listening"'));
  return { program, address, url: `http://${address}`, operatorUrl };
}

/**
 * Opens a UDP socket that replaces a server, and collects the Data datagrams. Since the observer of the dashboard never
 * connects, it does not send any.
 */
export async function fakeServer(test) {
  const socket = createSocket("udp4");
  const arrived = [];
  socket.on("message", (datagram, from) => (datagram[1] & 0xf) === 3 && arrived.push({ datagram, from }));
  await new Promise((resolve) => socket.bind(0, "127.0.0.1", resolve));
  test.after(() => socket.close());
  return { socket, arrived, address: `127.0.0.1:${socket.address().port}` };
}

export async function raw(address, bytes, localAddress = "127.0.0.1") {
  const [host, port] = address.split(":");
  const socket = connect({ port: Number(port), host, localAddress });
  let answer = "";
  socket.setEncoding("latin1").on("data", (text) => (answer += text));
  socket.on("error", () => {});
  socket.write(bytes);
  await new Promise((resolve) => socket.once("close", resolve));
  return answer;
}

export async function metric(url, sample) {
  const text = await (await fetch(`${url}/metrics`)).text();
  const line = text.split("\n").find((one) => one.startsWith(`${sample} `));
  return line === undefined ? undefined : Number(line.slice(sample.length + 1));
}

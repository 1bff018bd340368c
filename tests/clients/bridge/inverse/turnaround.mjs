#!/usr/bin/env node
// SPDX-License-Identifier: Apache-2.0
// turnaround.mjs [SECONDS]: measures tendon-bridge inverse and prints a table. It is not run in CI.
//
// Measures the time from request to reply against a plain WebSocket echo with the same library (ws), the time until a
// requested force is reported as applied, the maximum rate of one client, eight clients at 500 Hz, and the CPU time.
// TENDON_PROGRAMS is the folder with the programs.
import { fork } from "node:child_process";
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { Program, packageOf, scratch, startServer } from "../../dashboard/support.mjs";

const { WebSocket, WebSocketServer } = packageOf("clients/typescript", "ws");
process.env.TENDON_PROGRAMS ??= fileURLToPath(new URL("../../../../build/release/bin", import.meta.url));

if (process.argv[2] === "echo") {
  const options = { host: "127.0.0.1", port: 0, perMessageDeflate: false };
  const server = new WebSocketServer(options, () => process.send(server.address().port));
  server.on("connection", (socket) => socket.on("message", () => socket.send(process.argv[3])));
} else {
  const seconds = Number(process.argv[2] ?? 5);
  const ends = [];
  const run = { after: (end) => ends.push(end) };
  const quantile = (sorted, q) => sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))];
  const us = (values) => {
    const sorted = [...values].sort((a, b) => a - b);
    const at = (q) => `${(1000 * quantile(sorted, q)).toFixed(0)} µs`;
    return `p50 ${at(0.5)}, p99 ${at(0.99)}, n = ${sorted.length}`;
  };
  const open = async (url) => {
    const socket = new WebSocket(url, { perMessageDeflate: false });
    const waiting = [];
    const early = [];
    socket.on("message", (text) => (waiting.length ? waiting.shift()(text) : early.push(text)));
    await new Promise((resolve, reject) => socket.on("open", resolve).on("error", reject));
    const next = () => (early.length ? Promise.resolve(early.shift()) : new Promise((resolve) => waiting.push(resolve)));
    return { socket, next, ask: (text) => (socket.send(text), next()) };
  };
  const cpu = (pid) => Number(readFileSync(`/proc/${pid}/schedstat`, "utf8").split(" ")[0]) / 1e6; // ms
  const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

  const server = await startServer(run, scratch(run), ["demo"], "--record", "/dev/null");
  const listen = ["--listen", "127.0.0.1:0", "--json"];
  const bridge = new Program(run, "tendon-bridge", ["inverse", "--server", server.address, ...listen]);
  const url = `ws://${JSON.parse(await bridge.line('"listening"')).address}`;
  await bridge.line("connected to");
  const client = await open(url);
  const id = JSON.parse(await client.next()).inverse3[0].device_id;
  const push = (z) =>
    JSON.stringify({ inverse3: [{ device_id: id, commands: { set_cursor_force: { vector: { x: 0, y: 0, z } } } }] });
  const reply = String(await client.ask(push(0.1)));
  const child = fork(fileURLToPath(import.meta.url), ["echo", reply]);
  run.after(() => child.kill());
  const echo = await open(`ws://127.0.0.1:${await new Promise((resolve) => child.once("message", resolve))}`);

  // The time from a request to the reply. There is one request to the bridge and one to the echo per millisecond.
  const ours = [];
  const floor = [];
  const time = async (one, text, into) => {
    const begin = performance.now();
    await one.ask(text);
    into.push(performance.now() - begin);
  };
  const start = performance.now();
  for (let i = 1; performance.now() - start < 1000 * seconds; ++i) {
    await time(client, push(0.1), ours);
    await time(echo, push(0.1), floor);
    if (performance.now() < start + i) await wait(start + i - performance.now());
  }
  console.log(`request to reply     ${us(ours.slice(100))}`);
  console.log(`  a plain echo       ${us(floor.slice(100))}`);

  // The time until a requested force is reported as applied. The limiter does not change forces this small.
  const felt = [];
  for (let i = 0; i < 500; ++i) {
    const wanted = 0.1 + 0.01 * (i % 10) + (i % 2) * 0.05;
    const begin = performance.now();
    let text = await client.ask(push(wanted));
    const differs = () => Math.abs(JSON.parse(text).inverse3[0].state.current_cursor_force.z - wanted) > 0.004;
    while (differs() && performance.now() - begin < 100) text = await client.ask(push(wanted));
    felt.push(performance.now() - begin);
    await wait(1 + 3 * ((i * 0.618) % 1));
  }
  console.log(`force until felt     ${us(felt)} (a haptic step is 1000 µs)`);

  // Measures the maximum rate of one client and of the echo.
  for (const [name, one] of [["turns of one client", client], ["  of a plain echo", echo]]) {
    let turns = 0;
    const begin = performance.now();
    while (performance.now() - begin < 1000 * seconds) {
      await one.ask(push(0.1));
      ++turns;
    }
    console.log(`${name.padEnd(20)} ${(turns / (performance.now() - begin) * 1000).toFixed(0)} a second`);
  }

  // The CPU time of the bridge with one silent client, one client at 1 kHz, and eight clients at 500 Hz.
  const paced = async (one, hz, into) => {
    const begin = performance.now();
    for (let i = 1; performance.now() - begin < 1000 * seconds; ++i) {
      await time(one, push(0.1), into);
      const due = begin + (1000 * i) / hz;
      if (performance.now() < due) await wait(due - performance.now());
    }
  };
  const share = async (what, work) => {
    const before = cpu(bridge.process.pid);
    const begin = performance.now();
    const said = await work();
    const part = (cpu(bridge.process.pid) - before) / (performance.now() - begin);
    console.log(`${what.padEnd(20)} ${(100 * part).toFixed(1)} % of a core${said}`);
  };
  await share("no client asks", async () => (await wait(1000 * seconds), ""));
  await share("one at 1000 Hz", async () => {
    const times = [];
    await paced(client, 1000, times);
    return `, ${(times.length / seconds).toFixed(0)} turns/s`;
  });
  const eight = await Promise.all(Array.from({ length: 8 }, () => open(url)));
  for (const one of eight) await one.next();
  await share("eight at 500 Hz", async () => {
    const times = eight.map(() => []);
    await Promise.all(eight.map((one, i) => paced(one, 500, times[i])));
    const rates = times.map((one) => (one.length / seconds).toFixed(0));
    return `, ${rates.join(" ")} turns/s, ${us(times.flat())}`;
  });
  for (const one of [client, echo, ...eight]) one.socket.terminate();
  for (const end of ends) await end();
  process.exit(0);
}

// SPDX-License-Identifier: Apache-2.0
// Tests tendon-bridge inverse with regular and hostile clients that use the npm package ws. The client loops follow
// clients/bridge/inverse/README.md.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { connect as connectTcp } from "node:net";
import { test } from "node:test";
import { Program, packageOf, raw, scratch, startServer, until } from "../../dashboard/support.mjs";

const { WebSocket } = packageOf("clients/typescript", "ws");

async function startBridge(test, server, ...more) {
  const listen = ["--listen", "127.0.0.1:0", "--duration-s", "120", "--json"];
  const program = new Program(test, "tendon-bridge", ["inverse", "--server", server, ...listen, ...more]);
  const { address } = JSON.parse(await program.line('"listening"'));
  await program.line("connected to");
  return { program, address, url: `ws://${address}` };
}

async function startBoth(test, scene = "demo", ...more) {
  const server = await startServer(test, scratch(test), [scene], "--record", "/dev/null");
  return { server, bridge: await startBridge(test, server.address, ...more) };
}

/** Returns a message that requests an upward force of `z` N. */
const pushing = (id, z) =>
  JSON.stringify({ inverse3: [{ device_id: id, commands: { set_cursor_force: { vector: { x: 0, y: 0, z } } } }] });

async function come(test, url, options = {}) {
  const socket = new WebSocket(url, options);
  const got = [];
  let wake = () => {};
  socket.on("message", (data, binary) => {
    assert.equal(binary, false, "replies are text");
    got.push(JSON.parse(data));
    wake();
  });
  const ended = new Promise((resolve) => socket.on("close", (code) => resolve(code)));
  test.after(() => socket.terminate());
  await new Promise((resolve, reject) => socket.on("open", resolve).on("error", reject));
  let seen = 0;
  const next = async () => {
    while (got.length <= seen) await new Promise((resolve) => (wake = resolve));
    return got[seen++];
  };
  const first = await next();
  const id = first.inverse3[0].device_id;
  const push = (z) => pushing(id, z);
  const ask = async (message) => {
    socket.send(message);
    return next();
  };
  return { socket, got, ended, first, id, push, ask, next };
}

const refusal = (url, options = {}) =>
  new Promise((resolve, reject) => {
    const socket = new WebSocket(url, options);
    socket.on("open", () => reject(new Error("let in")));
    socket.on("error", () => {});
    socket.on("unexpected-response", (request, response) => {
      let text = "";
      response.on("data", (more) => (text += more)).on("end", () => resolve({ status: response.statusCode, text }));
    });
  });

const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

test("one reply for each message, never one unasked, even in a burst", async (t) => {
  const { bridge } = await startBoth(t);
  const client = await come(t, bridge.url);
  let asked = 0;
  let tick = 0;
  for (let i = 0; i < 2000; ++i) {
    const reply = await client.ask(i % 50 === 49 ? "nonsense" : client.push(0.3));
    ++asked;
    assert.equal(client.got.length, asked + 1);
    const [ours] = reply.tendon.devices;
    assert.ok(ours.tick >= tick);
    tick = ours.tick;
    if (i % 500 === 0) await wait(200);
  }
  for (let i = 0; i < 2000; ++i) client.socket.send(client.push(0.3));
  asked += 2000;
  await until("all replies", () => client.got.length === asked + 1);
  await wait(300);
  assert.equal(client.got.length, asked + 1);
  assert.ok(client.got.some((reply) => reply.inverse3[0].state.current_cursor_force.z > 0.2), "the hand was pushed up");
});

test("the seventeenth client is refused, and comes in when another has left", async (t) => {
  const { bridge } = await startBoth(t);
  const clients = [];
  for (let i = 0; i < 16; ++i) clients.push(await come(t, bridge.url));
  assert.deepEqual(await refusal(bridge.url), { status: 503, text: "16 clients are already connected\n" });
  await bridge.program.line("was refused: 16 clients are already connected");
  for (const client of clients) await client.ask("{}");
  clients[3].socket.close();
  await bridge.program.line("client 4 left");
  await (await come(t, bridge.url)).ask("{}");
  const ids = new Set(clients.map((client) => client.first.session_id));
  assert.equal(ids.size, 16);
});

test("a client that never reads is dropped, and the others are served", async (t) => {
  const { bridge } = await startBoth(t);
  const other = await come(t, bridge.url);
  const deaf = await come(t, bridge.url);
  deaf.socket._socket.pause();
  let left = false;
  bridge.program.line("client 2 left: no reply was read for 1 s").then(() => (left = true));
  for (let i = 0; i < 3000 && !left; ++i) {
    if (deaf.socket.bufferedAmount < 1e6) for (let k = 0; k < 50; ++k) deaf.socket.send(deaf.push(0.1));
    await other.ask("{}");
    await wait(1);
  }
  assert.ok(left);
  await other.ask("{}");
});

test("pages from elsewhere, plain HTTP and long messages are refused", async (t) => {
  const { bridge } = await startBoth(t, "demo", "--origin", "https://lab.example");
  const from = (origin) => ({ headers: { Origin: origin } });
  const { status, text } = await refusal(bridge.url, from("https://evil.example"));
  assert.equal(status, 403);
  assert.match(text, /--origin/);
  for (const origin of ["http://localhost:8000", "https://lab.example"]) {
    await (await come(t, bridge.url, from(origin))).ask("{}");
  }

  const response = await fetch(`http://${bridge.address}/inverse3/0/config`);
  assert.equal(response.status, 404);
  assert.match(await response.text(), /only serves a WebSocket/);
  assert.match(await raw(bridge.address, "hello\r\n\r\n"), /^HTTP\/1.1 400 /);
  assert.match(await raw(bridge.address, `GET / HTTP/1.1\r\nX: ${"x".repeat(20000)}\r\n\r\n`), /^HTTP\/1.1 400 /);

  const client = await come(t, bridge.url);
  const longest = await client.ask(`{"a":"${"x".repeat(65536 - 8)}"}`);
  assert.deepEqual(longest.tendon.refused, []);
  client.socket.send("x".repeat(65537));
  assert.equal(await client.ended, 1009);
  await bridge.program.line("left: a message was longer than 64 kB");
});

test("broken frames and half requests end nobody else's connection", async (t) => {
  const { bridge } = await startBoth(t);
  const other = await come(t, bridge.url);
  const [host, port] = bridge.address.split(":");
  let random = 22; // a linear congruential generator is used, so that each run has the same bytes
  const byte = () => (random = (random * 1103515245 + 12345) % 2147483648) >> 16 & 255;
  const hello = [
    "GET / HTTP/1.1",
    `Host: ${bridge.address}`,
    "Upgrade: websocket",
    "Connection: Upgrade",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    "Sec-WebSocket-Version: 13",
    "\r\n",
  ].join("\r\n");
  for (let i = 0; i < 200; ++i) {
    const socket = connectTcp(Number(port), host);
    socket.on("error", () => {});
    const ended = new Promise((resolve) => socket.once("close", resolve));
    socket.resume();
    if (i % 4 === 0) {
      socket.end(hello.slice(0, byte()));
    } else {
      socket.write(hello);
      socket.end(Buffer.from(Array.from({ length: 1 + byte() }, byte)));
    }
    await ended;
    await other.ask("{}");
  }
  const said = (what) => bridge.program.lines.filter((line) => what.test(line)).length;
  await until("all have left", () => said(/client \d+ left/) === said(/client \d+ connected/) - 1);
});

test("beyond this machine only with --anybody", async (t) => {
  const refused = new Program(t, "tendon-bridge", ["inverse", "--listen", "0.0.0.0:0"]);
  assert.equal(await refused.ended, 2);
  assert.match(refused.lines.join("\n"), /or --anybody: anyone who can reach this port can move the motors/);
  const server = await startServer(t, scratch(t), ["demo"], "--record", "/dev/null");
  const anybody = ["--server", server.address, "--listen", "0.0.0.0:0", "--anybody", "--json"];
  const open = new Program(t, "tendon-bridge", ["inverse", ...anybody]);
  await open.line('"listening"');
  await open.line("can move the motors");
});

test("two devices are two arms with forces of their own", async (t) => {
  const server = await startServer(t, scratch(t), ["left", "right"], "--record", "/dev/null");
  const bridge = await startBridge(t, server.address, "--device", "left", "--device", "right");
  const client = await come(t, bridge.url);
  assert.deepEqual(client.first.tendon.devices.map((one) => one.name), ["left", "right"]);
  const message = pushing(client.first.inverse3[1].device_id, 0.3);
  await until("the right one is pushed up", async () => {
    const { inverse3 } = await client.ask(message);
    assert.equal(inverse3[0].state.current_cursor_force.z, 0);
    return inverse3[1].state.current_cursor_force.z > 0.1;
  });
});

test("one client at 1 kHz costs little of a core", async (t) => {
  const { bridge } = await startBoth(t);
  const client = await come(t, bridge.url);
  const ticks = () => {
    const fields = readFileSync(`/proc/${bridge.program.process.pid}/stat`, "utf8").split(") ")[1].split(" ");
    return Number(fields[11]) + Number(fields[12]); // utime + stime, in units of 10 ms
  };
  const begin = ticks();
  const start = performance.now();
  let turns = 0;
  while (performance.now() - start < 5000) {
    await client.ask(client.push(0.2));
    ++turns;
    const due = start + turns;
    if (performance.now() < due) await wait(due - performance.now());
  }
  const share = (ticks() - begin) * 10 / (performance.now() - start);
  t.diagnostic(`${turns} turns in 5 s, ${(100 * share).toFixed(1)} % of a core`);
  assert.ok(share < 0.24, "three times what is aimed at, for a loaded machine");
});

// SPDX-License-Identifier: Apache-2.0
// Tests tendon-dash between a tendond and web clients, which are regular or hostile.
import assert from "node:assert/strict";
import { once } from "node:events";
import { truncateSync, writeFileSync } from "node:fs";
import { connect } from "node:net";
import { it } from "node:test";
import { gunzipSync } from "node:zlib";
import { fakeServer, kRoot, metric, packageOf, Program, raw, scratch, startDash, startServer, until } from "./support.mjs";

const { WebSocket } = packageOf("clients/typescript", "ws");

async function open(test, url, options = {}) {
  const socket = new WebSocket(url, options);
  // Registered before "open", because the first message may arrive with the response of the handshake.
  socket.said = [];
  socket.on("message", (data, binary) => binary || socket.said.push(JSON.parse(data)));
  test.after(() => socket.terminate());
  socket.on("error", () => {});
  await Promise.race([once(socket, "open"), once(socket, "close")]);
  return socket;
}

/** Returns the HTTP status if a WebSocket is refused, or 101 if it is accepted. */
async function refusal(url, options = {}) {
  const socket = new WebSocket(url, options);
  socket.on("error", () => {});
  socket.on("open", () => socket.emit("unexpected-response", undefined, { statusCode: 101 }));
  const [, response] = await once(socket, "unexpected-response");
  socket.terminate();
  return response.statusCode;
}

/** Returns a datagram that claims cipher suite 0 (plain) or 1 (sealed). */
function datagram(number, suite = 0, size = 40) {
  const bytes = Buffer.alloc(size, number & 0xff);
  bytes.set([0x54, 0x13, 0, suite, 1, 0, 0, 0]);
  bytes.writeBigUInt64LE(BigInt(number), 8);
  return bytes;
}

const get = (host, target, more = "") => `GET ${target} HTTP/1.1\r\nHost: ${host}\r\nConnection: close\r\n${more}\r\n`;
const statusOf = (answer) => Number(answer.split(" ")[1]);

it("shows a server, its device and its engine, live and as metrics", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["demo"], "--record", "run.mcap");
  new Program(test, "virtual_wall", ["--server", server.address, "--rate-hz", "200"]);
  const { url, address } = await startDash(test, server.address, "--recordings", folder);

  const page = await open(test, `ws://${address}/live`, { origin: url });
  const { said } = page;
  const find = (what, fits) => until(what, () => said.find(fits), () => said.slice(-2).map((s) => JSON.stringify(s).slice(0, 400)).join("\n"));
  const about = await find("the device is described", (m) => m.type === "server" && m.contact === "open" && m.devices.length === 1);
  assert.deepEqual([about.devices[0].name, about.devices[0].model, about.devices[0].loop_hz, about.address], ["demo", "falcon", 1000, server.address]);
  await find("an engine's force is wanted, and given", (m) => m.type === "states" && m.wanted_n[0].some((f) => f < -0.1) && m.applied_n[0].some((f) => f < -0.1));
  const loop = await find("the loop's lateness is reported", (m) => m.type === "reports" && m.loop?.lateness_us_log2.some((n) => n > 0));
  assert.equal(loop.loop.safety, "unguarded");
  const { engines } = await find("the engine is reported", (m) => m.type === "reports" && m.engines.length > 0 && m.engines[0].round_trip_ms);
  assert.equal(engines[0].name, "virtual_wall");
  const ticks = said.filter((m) => m.type === "states").flatMap((m) => m.tick);
  assert.ok(ticks.every((tick, i) => i === 0 || tick > ticks[i - 1]));

  assert.equal(await metric(url, "tendon_up"), 1);
  assert.equal(await metric(url, "tendon_dash_pages"), 1);
  assert.ok((await metric(url, 'tendon_device_states_total{device="demo"}')) >= ticks.length);
  assert.ok((await metric(url, 'tendon_device_wakeup_lateness_seconds_count{device="demo"}')) > 0);
  assert.ok((await metric(url, 'tendon_engine_forces_total{device="demo",channel="main",engine="virtual_wall"}')) > 0);

  const [recording] = await (await fetch(`${url}/api/recordings`)).json();
  assert.equal(recording.name, "run.mcap");
  const magic = await fetch(`${url}/recordings/run.mcap`, { headers: { Range: "bytes=0-7" } });
  assert.equal(magic.status, 206);
  assert.deepEqual(Buffer.from(await magic.arrayBuffer()), Buffer.from([0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a]));

  await server.program.stop();
  await find("the end is told", (m) => m.type === "server" && m.contact === "lost");
  assert.equal(await metric(url, "tendon_up"), 0);
  page.close();
  await until("its place is free", async () => (await metric(url, "tendon_dash_pages")) === 0);
});

it("watches all devices of a server; a page gets the one that it chose", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["left", "right"], "--record", "/dev/null");
  const { address } = await startDash(test, server.address);
  const page = await open(test, `ws://${address}/live`);
  const { said } = page;
  await until("both are described", () => said.some((m) => m.type === "server" && m.devices.length === 2));
  await until("states of the first one come", () => said.some((m) => m.type === "states" && m.device === 0));
  page.send("watch 1");
  await until("states of the second one come", () => said.some((m) => m.type === "states" && m.device === 1));
  const change = said.findIndex((m) => m.type === "states" && m.device === 1);
  await until("more of them come", () => said.slice(change).filter((m) => m.type === "states").length > 10);
  assert.ok(said.slice(change).every((m) => m.type !== "states" || m.device === 1));
});

it("serves the page under a strict policy, compressed on request", async (test) => {
  const { socket, address: nobody } = await fakeServer(test);
  const { url, address } = await startDash(test, nobody);
  const page = await fetch(`${url}/`);
  assert.equal(page.status, 200);
  assert.match(page.headers.get("content-security-policy"), /default-src 'none'; script-src 'self'/);
  const html = await page.text();
  const script = /src="(\/assets\/[^"]+\.js)"/.exec(html)?.[1];
  assert.ok(script, html);
  assert.doesNotMatch(html, /<script(?![^>]*\bsrc=)|<style|\son\w+=|https?:\/\/(?!www\.w3\.org)/);
  const plain = await raw(address, get(address, script));
  const zipped = await raw(address, get(address, script, "Accept-Encoding: gzip\r\n"));
  const body = (answer) => Buffer.from(answer.slice(answer.indexOf("\r\n\r\n") + 4), "latin1");
  assert.match(zipped, /Content-Encoding: gzip/);
  assert.deepEqual(gunzipSync(body(zipped)), body(plain));
  assert.ok(body(zipped).length < body(plain).length / 2);
  const head = await raw(address, get(address, script).replace("GET", "HEAD"));
  assert.equal(body(head).length, 0);
  assert.match(head, new RegExp(`Content-Length: ${body(plain).length}\r\n`));
  assert.ok(socket.address());
});

it("refuses who is not what it says, and stays for the others", async (test) => {
  const folder = scratch(test);
  writeFileSync(`${folder}/run.mcap`, "0123456789");
  const { address: nobody } = await fakeServer(test);
  const { url, address } = await startDash(test, nobody, "--recordings", folder);
  const status = async (bytes) => statusOf(await raw(address, bytes));
  assert.equal(await status(get("evil.example", "/metrics")), 421);
  assert.equal(await status(get(`evil.example:${address.split(":")[1]}`, "/")), 421);
  assert.equal(await status("GET / HTTP/1.1\r\nConnection: close\r\n\r\n"), 421);
  assert.equal(await status(get(address, "/", "Host: evil.example\r\n")), 400);
  for (const path of ["/../../etc/passwd", "/recordings/../run.mcap", "/recordings/..%2f..%2fetc%2fpasswd", "/recordings/%2fetc%2fpasswd", "/assets/../../../etc/passwd", "/recordings/", "/recordings/run.mcap%00", "/etc/passwd", "/.git/config"]) {
    assert.equal(await status(get(address, path)), 404, path);
  }
  assert.equal(await status(get(address, "/recordings/run.mcap")), 200);
  assert.equal(await status(get(address, "/recordings/run.mcap", "Range: bytes=99-\r\n")), 416);
  for (const method of ["POST", "PUT", "DELETE", "OPTIONS", "TRACE"]) assert.equal(await status(get(address, "/").replace("GET", method)), 405, method);
  assert.equal(await status(`POST / HTTP/1.1\r\nHost: ${address}\r\nContent-Length: 5\r\n\r\nhello`), 413);
  assert.equal(await status("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03 hello over TLS\r\n\r\n"), 400);
  assert.equal(await status(`GET / HTTP/1.1\r\nHost: ${address}\r\nX: ${"a".repeat(40_000)}\r\n\r\n`), 431);
  assert.equal(await status(get(address, `/${"a".repeat(40_000)}`)), 431);

  for (const origin of ["http://evil.example", "null", "http://localhost:1", `https://${address}.evil.example`]) {
    assert.equal(await refusal(`ws://${address}/live`, { headers: { origin } }), 403, origin);
  }
  assert.equal(await refusal(`ws://${address}/live`, { headers: { host: "evil.example" } }), 421);
  for (const line of ["hello", "watch 99", "x".repeat(1000), Buffer.from("watch 0")]) {
    const page = await open(test, `ws://${address}/live`);
    page.send(line);
    await once(page, "close");
  }
  const crowd = await Promise.all(Array.from({ length: 16 }, () => open(test, `ws://${address}/live`)));
  assert.ok(crowd.every((page) => page.readyState === WebSocket.OPEN));
  assert.equal(await refusal(`ws://${address}/live`), 503);
  assert.equal((await fetch(`${url}/metrics`)).status, 200);
});

/** Opens connections from the same address. Each of them sends `words` and does not read anything. */
async function crowd(test, address, count, words) {
  const [host, port] = address.split(":");
  const sockets = Array.from({ length: count }, () => connect(Number(port), host).on("error", () => {}));
  test.after(() => sockets.forEach((socket) => socket.destroy()));
  await Promise.all(sockets.map((socket) => once(socket, "connect")));
  for (const socket of sockets) socket.pause().write(words);
  return sockets;
}

it("serves others while 300 slow connections wait, ends those after 5 s", async (test) => {
  const { address: nobody } = await fakeServer(test);
  const { url, address } = await startDash(test, nobody);
  const sockets = await crowd(test, address, 300, "GET /metrics HTTP/1.1\r\nHost: ");
  const began = performance.now();
  assert.equal(statusOf(await raw(address, get(address, "/metrics"))), 200);
  assert.ok(performance.now() - began < 2000, "it did not wait for the slow ones to be given up");
  assert.ok((await metric(url, "tendon_dash_requests_refused_total")) >= 300 - 64);
  const last = sockets.at(-1).resume();
  const drip = setInterval(() => last.write("a"), 500);
  test.after(() => clearInterval(drip));
  await once(last, "close");
  const took = performance.now() - began;
  assert.ok(took > 3000 && took < 15_000, `a request that drips is given up after ${took} ms`);
});

it("answers 503 at once when an address has no place left", async (test) => {
  const folder = scratch(test);
  writeFileSync(`${folder}/large.mcap`, "");
  truncateSync(`${folder}/large.mcap`, 256 << 20);
  const { address: nobody } = await fakeServer(test);
  const { address } = await startDash(test, nobody, "--recordings", folder);
  const sockets = await crowd(test, address, 64, get(address, "/recordings/large.mcap"));
  const ask = (localAddress) => raw(address, get(address, "/metrics"), localAddress).then(statusOf);
  await until("all 64 are being answered", async () => (await ask("127.0.0.1")) === 503);
  const began = performance.now();
  assert.equal(await ask("127.0.0.1"), 503);
  assert.ok(performance.now() - began < 2000);
  assert.equal(await ask("127.0.0.2"), 200);
  for (const socket of sockets) socket.destroy();
  await until("it serves again", async () => (await ask("127.0.0.1")) === 200);
});

it("says how to listen beyond this machine, and which folder is none", async (test) => {
  const dash = (...args) => new Program(test, "tendon-dash", args);
  const far = dash("--listen", "0.0.0.0:0");
  assert.equal(await far.ended, 2);
  assert.match(far.lines.join("\n"), /or --host NAME/);
  const none = dash("--listen", "127.0.0.1:0", "--recordings", "/nowhere/at/all");
  assert.equal(await none.ended, 1);
  assert.match(none.lines.join("\n"), /\/nowhere\/at\/all: not a folder/);
  const { address: nobody } = await fakeServer(test);
  const { address } = await startDash(test, nobody);
  const taken = dash("--listen", address);
  assert.equal(await taken.ended, 1);
  assert.match(taken.lines.join("\n"), /cannot listen on .*: Address already in use/);
});

it("bridge: passes datagrams unchanged; each WebSocket has its own port", async (test) => {
  const { socket, arrived, address: server } = await fakeServer(test);
  const { url, address } = await startDash(test, server);
  const [a, b] = [await open(test, `ws://${address}/bridge`), await open(test, `ws://${address}/bridge`)];
  const back = [];
  a.on("message", (data, binary) => binary && back.push(data));
  for (let i = 0; i < 100; ++i) a.send(datagram(i, 0, 16 + i * 11));
  b.send(datagram(200));
  await until("all have arrived", () => arrived.length === 101);
  const port = arrived.find((one) => one.datagram[8] === 7).from.port;
  const of = (from) => arrived.filter((one) => (one.from.port === port) === from).map((one) => one.datagram);
  assert.deepEqual(of(true), Array.from({ length: 100 }, (_, i) => datagram(i, 0, 16 + i * 11)));
  assert.deepEqual(of(false), [datagram(200)]);
  for (let i = 0; i < 10; ++i) socket.send(datagram(i, 0, 1200), port);
  await until("the answers have come", () => back.length === 10);
  assert.deepEqual(back, Array.from({ length: 10 }, (_, i) => datagram(i, 0, 1200)));
  assert.equal(await metric(url, 'tendon_bridge_datagrams_total{way="to_server"}'), 101);
  assert.equal(await metric(url, 'tendon_bridge_datagrams_total{way="to_page"}'), 10);
  a.close();
  await until("the place is free", async () => (await metric(url, "tendon_bridge_pages")) === 1);
});

it("bridge: lets in this machine's pages, named origins and programs only", async (test) => {
  const { address: server } = await fakeServer(test);
  const { url, address } = await startDash(test, server, "--origin", "https://lab.example");
  for (const origin of ["http://localhost:8000", "http://127.0.0.1", "http://[::1]:3000", "https://lab.example", undefined]) {
    const page = await open(test, `ws://${address}/bridge`, origin ? { origin } : {});
    assert.equal(page.readyState, WebSocket.OPEN, origin);
  }
  const foreign = ["https://evil.example", "http://lab.example", "https://lab.example.evil.example", "null", "http://localhost.evil.example", "http://127.0.0.1.evil.example", ""];
  for (const origin of foreign) assert.equal(await refusal(`ws://${address}/bridge`, { origin, headers: { origin } }), 403, origin);
  assert.equal(await metric(url, 'tendon_bridge_refused_total{cause="origin"}'), foreign.length);
});

it("bridge: passes sealed datagrams only on for others than this machine", async (test) => {
  const { arrived, address: server } = await fakeServer(test);
  const { url, address } = await startDash(test, server);
  for (const header of ["x-forwarded-for", "forwarded", "via", "x-real-ip"]) {
    const page = await open(test, `ws://${address}/bridge`, { headers: { [header]: "192.0.2.1" } });
    page.send(datagram(1, 0));
    page.send(datagram(2, 1));
  }
  await until("the sealed ones have arrived", () => arrived.length === 4);
  assert.ok(arrived.every((one) => one.datagram[3] === 1));
  assert.equal(await metric(url, 'tendon_bridge_dropped_total{cause="plain"}'), 4);
});

it("bridge: counts what is no datagram, and closes for what is too large", async (test) => {
  const { arrived, address: server } = await fakeServer(test);
  const { url, address } = await startDash(test, server);
  const page = await open(test, `ws://${address}/bridge`);
  page.send("a text");
  page.send(Buffer.alloc(0));
  page.send(Buffer.alloc(100, 7));
  page.send(datagram(1).subarray(0, 15));
  page.send(datagram(7));
  await until("the good one has arrived", () => arrived.length === 1);
  assert.equal(await metric(url, 'tendon_bridge_dropped_total{cause="malformed"}'), 4);
  page.send(Buffer.alloc(1201));
  const [code] = await once(page, "close");
  assert.equal(code, 1009);
  assert.equal(arrived.length, 1);
});

it("bridge: has a limit on WebSockets, and one on the datagrams of each", async (test) => {
  const { arrived, address: server } = await fakeServer(test);
  const { url, address } = await startDash(test, server);
  const pages = await Promise.all(Array.from({ length: 32 }, () => open(test, `ws://${address}/bridge`)));
  assert.equal(await refusal(`ws://${address}/bridge`), 503);
  for (let i = 0; i < 5000; ++i) pages[0].send(datagram(i));
  const [passed, dropped] = ['tendon_bridge_datagrams_total{way="to_server"}', 'tendon_bridge_dropped_total{cause="too_fast"}'];
  await until("all have been looked at", async () => (await metric(url, passed)) + (await metric(url, dropped)) === 5000);
  assert.ok((await metric(url, passed)) >= 400);
  assert.ok(arrived.length > 0);
});

it("bridge: a page that does not read gets a newer state, not a queue", async (test) => {
  const { socket, arrived, address: server } = await fakeServer(test);
  const { url, address } = await startDash(test, server);
  const page = await open(test, `ws://${address}/bridge`);
  page.send(datagram(0));
  await until("the page is known", () => arrived.length === 1);
  page.pause();
  await until("it has dropped some", async () => {
    for (let i = 0; i < 200; ++i) socket.send(datagram(i, 0, 1200), arrived[0].from.port);
    return (await metric(url, 'tendon_bridge_dropped_total{cause="too_slow"}')) > 0;
  });
});

it("bridge: carries the TypeScript client's session to a tendond and back", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["demo"], "--record", "/dev/null");
  const { address } = await startDash(test, server.address);
  const { connect: join } = await import(`${kRoot}/clients/typescript/dist/index.js`);
  const { webSocket } = await import(`${kRoot}/clients/typescript/dist/websocket.js`);
  let states = 0;
  const guest = join(webSocket(`ws://${address}/bridge`, WebSocket), { name: "page", rateHz: 200 }, { physics: ({ position }) => (++states, { x: -100 * position.x, y: 0, z: 0 }) });
  test.after(() => guest.stop());
  await until("states come and forces go", () => states > 50 && guest.stats().forces > 20);
});

// SPDX-License-Identifier: Apache-2.0
// Tests the WebSocket bridge of the package between WebSockets and a UDP socket of the test.
import assert from "node:assert/strict";
import { createSocket, type RemoteInfo, type Socket } from "node:dgram";
import { once } from "node:events";
import { it, type TestContext } from "node:test";
import { WebSocket, type ClientOptions } from "ws";
import { Bridge, type BridgeConfig } from "../../../clients/typescript/src/bridge.js";
import { CipherSuite, concat, DatagramType, encodeHeader } from "../../../clients/typescript/src/datagram.js";
import { webSocket } from "../../../clients/typescript/src/websocket.js";
import { Random } from "./support/random.js";
import { until } from "./support/program.js";

interface Stage {
  readonly bridge: Bridge;
  readonly url: string;
  readonly server: Socket;
  readonly arrived: { readonly datagram: Buffer; readonly from: RemoteInfo }[];
}

async function setStage(test: TestContext, config: Partial<BridgeConfig> = {}): Promise<Stage> {
  const server = createSocket("udp4");
  await new Promise<void>((resolve) => server.bind(0, "127.0.0.1", resolve));
  const arrived: Stage["arrived"][number][] = [];
  server.on("message", (datagram, from) => arrived.push({ datagram, from }));
  const bridge = await Bridge.open({ listen: "127.0.0.1:0", to: `127.0.0.1:${server.address().port}`, ...config });
  test.after(async () => {
    await bridge.close();
    server.close();
  });
  return { bridge, url: `ws://${bridge.address}`, server, arrived };
}

async function openPage(test: TestContext, url: string, options: ClientOptions = {}): Promise<WebSocket> {
  const page = new WebSocket(url, options);
  test.after(() => page.terminate());
  page.on("error", () => {});
  await Promise.race([once(page, "open"), once(page, "close")]);
  return page;
}

async function refusal(url: string, options: ClientOptions): Promise<number> {
  const page = new WebSocket(url, options);
  page.on("error", () => {});
  page.on("open", () => page.emit("unexpected-response", undefined, { statusCode: 101 }));
  const [, response] = await once(page, "unexpected-response");
  page.terminate();
  return response.statusCode;
}

function datagram(packetNumber: number, suite: CipherSuite = CipherSuite.Plain): Uint8Array {
  const header = { type: DatagramType.Data, epoch: 0, suite, connectionId: 1, packetNumber: BigInt(packetNumber) };
  return concat(encodeHeader(header), new Random(packetNumber).bytes(packetNumber % 1184));
}

it("passes datagrams unchanged both ways; each WebSocket has its own port", async (test) => {
  const { bridge, url, server, arrived } = await setStage(test);
  const [a, b] = [await openPage(test, url), await openPage(test, url)];
  const back: Buffer[] = [];
  a.on("message", (data, isBinary) => isBinary && back.push(data as Buffer));
  for (let i = 0; i < 100; ++i) a.send(datagram(i));
  b.send(datagram(100));
  await until("all have arrived", () => arrived.length === 101);
  const port = arrived.find((one) => one.datagram[8] !== 100)!.from.port;
  const [ofA, ofB] = [arrived.filter((one) => one.from.port === port), arrived.filter((one) => one.from.port !== port)];
  assert.deepEqual(ofA.map((one) => one.datagram), Array.from({ length: 100 }, (_, i) => Buffer.from(datagram(i))));
  assert.deepEqual(ofB.map((one) => one.datagram), [Buffer.from(datagram(100))]);
  for (let i = 0; i < 50; ++i) server.send(datagram(1000 + i), port);
  await until("the answers have come", () => back.length === 50);
  assert.deepEqual(back, Array.from({ length: 50 }, (_, i) => Buffer.from(datagram(1000 + i))));
  const { toServer, toPage, peers, malformed } = bridge.counts;
  assert.deepEqual({ toServer, toPage, peers, malformed }, { toServer: 101, toPage: 50, peers: 2, malformed: 0 });
  a.close();
  await until("the place is free", () => bridge.counts.peers === 1);
});

it("lets in this machine's pages, named origins and programs only", async (test) => {
  const { bridge, url } = await setStage(test, { origins: ["https://lab.example"] });
  const welcome = ["http://localhost:8000", "http://127.0.0.1", "http://[::1]:3000", "https://lab.example", undefined];
  for (const origin of welcome) {
    const page = await openPage(test, url, origin ? { origin } : {});
    assert.equal(page.readyState, WebSocket.OPEN, origin);
  }
  const foreign = ["https://evil.example", "http://lab.example", "https://lab.example.evil.example", "null",
    "http://localhost.evil.example", "http://127.0.0.1.evil.example", ""];
  for (const origin of foreign) assert.equal(await refusal(url, { origin, headers: { origin } }), 403, origin);
  assert.equal(bridge.counts.refusedOrigin, foreign.length);
});

it("passes sealed datagrams only on for others than this machine", async (test) => {
  const { bridge, url, arrived } = await setStage(test);
  for (const header of ["x-forwarded-for", "forwarded", "via", "x-real-ip"]) {
    const page = await openPage(test, url, { headers: { [header]: "192.0.2.1" } });
    page.send(datagram(1, CipherSuite.Plain));
    page.send(datagram(2, CipherSuite.Noise));
  }
  await until("the sealed ones have arrived", () => arrived.length === 4);
  assert.ok(arrived.every((one) => one.datagram[3] === CipherSuite.Noise));
  assert.equal(bridge.counts.plain, 4);
});

it("counts what is no datagram, and closes for what is too large", async (test) => {
  const { bridge, url, arrived } = await setStage(test);
  const page = await openPage(test, url);
  page.send("a text");
  page.send(new Uint8Array(0));
  page.send(new Random(1).bytes(100));
  page.send(datagram(1).subarray(0, 15));
  page.send(datagram(7));
  await until("the good one has arrived", () => arrived.length === 1);
  assert.equal(bridge.counts.malformed, 4);
  page.send(new Uint8Array(1201));
  const [code] = await once(page, "close");
  assert.equal(code, 1009);
  assert.equal(arrived.length, 1);
});

it("has a limit on WebSockets, and one on the datagrams of each", async (test) => {
  const { bridge, url, arrived } = await setStage(test, { maxPeers: 2, maxRateHz: 100 });
  const page = await openPage(test, url);
  await openPage(test, url);
  assert.equal(await refusal(url, {}), 503);
  for (let i = 0; i < 500; ++i) page.send(datagram(i));
  await until("all have been looked at", () => bridge.counts.toServer + bridge.counts.tooFast === 500);
  assert.ok(bridge.counts.tooFast > 0 && bridge.counts.toServer >= 10, JSON.stringify(bridge.counts));
  await until("what was passed on has arrived", () => arrived.length === bridge.counts.toServer);
});

it("keeps nothing for a page that does not read: a newer state follows", async (test) => {
  const { bridge, url, server, arrived } = await setStage(test);
  const page = await openPage(test, url);
  page.send(datagram(0));
  await until("the page is known", () => arrived.length === 1);
  page.pause();
  const send = (): void => {
    for (let i = 0; i < 50; ++i) server.send(datagram(1183), arrived[0]!.from.port);
  };
  await until("it has dropped some", () => {
    send();
    return bridge.counts.tooSlow > 0;
  });
});

it("says what it is to a browser that asks without WebSocket", async (test) => {
  const { bridge } = await setStage(test);
  const response = await fetch(`http://${bridge.address}/`);
  assert.equal(response.status, 426);
  assert.match(await response.text(), /tendon-bridge/);
});

it("webSocket() opens another WebSocket after the bridge was gone", async (test) => {
  const { bridge, url, server, arrived } = await setStage(test);
  const transport = webSocket(url, WebSocket as unknown as typeof globalThis.WebSocket)(() => {}, assert.fail);
  test.after(() => transport.close());
  transport.send(datagram(1));
  await until("the first has arrived", () => arrived.length === 1);
  await bridge.close();
  await until("it is gone", () => bridge.counts.peers === 0);
  transport.send(datagram(2)); // this is lost, because there is no socket
  const again = await Bridge.open({ listen: url.slice("ws://".length), to: `127.0.0.1:${server.address().port}` });
  test.after(() => again.close());
  await until("another has arrived", () => {
    transport.send(datagram(3));
    return arrived.some((one) => one.datagram[8] === 3);
  });
});

// SPDX-License-Identifier: Apache-2.0
// Tests host names as server addresses: known names, unknown names, and names with several addresses.
import assert from "node:assert/strict";
import { createSocket } from "node:dgram";
import { describe, it, type TestContext } from "node:test";
import { connect } from "../../../clients/typescript/src/connect.js";
import { lookUp, NoSuchHost, parseServer, udp } from "../../../clients/typescript/src/udp.js";
import { startNode } from "./support/program.js";

async function echo(test: TestContext): Promise<number> {
  const socket = createSocket("udp4");
  await new Promise<void>((resolve) => socket.bind(0, "127.0.0.1", resolve));
  test.after(() => socket.close());
  socket.on("message", (datagram, from) => socket.send(datagram, from.port, from.address));
  return socket.address().port;
}

describe("the name of a server", () => {
  it("is a host name or an address, and a port", () => {
    assert.deepEqual(parseServer("haptics.lab:47100"), { host: "haptics.lab", port: 47100 });
    assert.deepEqual(parseServer("localhost:1"), { host: "127.0.0.1", port: 1 });
    assert.deepEqual(parseServer("[::1]:5000"), { host: "::1", port: 5000 });
    for (const text of ["nowhere", "haptics.lab", "haptics.lab:65536", ":1", "::1:47100", "[haptics]:1", "a b:1", "-x:1", "a:1:2"]) {
      assert.throws(() => parseServer(text), /expected HOST:PORT/, text);
    }
  });

  it("is looked up by the system, and named when it is not known", async () => {
    assert.deepEqual(await lookUp("192.0.2.7"), ["192.0.2.7"]);
    for (const ip of await lookUp("LOCALHOST")) assert.match(ip, /^(127\.|::1$)/);
    await assert.rejects(lookUp("haptics.invalid"), (error: Error) => error instanceof NoSuchHost && error.message.startsWith("cannot find haptics.invalid: "));
  });

  it("leads there, and datagrams sent before it is connected arrive too", async (test) => {
    const port = await echo(test);
    const came: number[] = [];
    const way = udp(`LOCALHOST:${port}`)((datagram) => came.push(datagram[0]!), assert.fail);
    test.after(() => way.close());
    for (let i = 0; i < 20; ++i) way.send(Uint8Array.of(i));
    // If the name resolves to ::1 first, no server answers, and the next address must be tried.
    for (let round = 0; came.length === 0 && round < 50; ++round) {
      await new Promise((resolve) => setTimeout(resolve, 100));
      if (came.length > 0) break;
      way.again!(true);
      way.send(Uint8Array.of(19));
    }
    assert.equal(came.at(-1), 19);
  });

  it("of nobody ends a guest, and the command line says so", async (test) => {
    const guest = connect(udp("haptics.invalid:47100"), {}, { watch: () => {} });
    await assert.rejects(guest.ended, /^Error: cannot find haptics\.invalid: |cannot find haptics\.invalid/);
    assert.equal(guest.phase === "open", false);
    const program = startNode(test, "examples/echo_motion", "--server", "haptics.invalid:47100");
    await program.line((line) => line.startsWith("echo_motion: cannot find haptics.invalid: "));
    assert.equal(await program.end(), 1);
  });
});

// SPDX-License-Identifier: Apache-2.0
// Tests the reports that a ForceClient receives as an observer, with a server in virtual time.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { decodeData } from "../../../clients/typescript/src/codec.js";
import { ForceClient } from "../../../clients/typescript/src/force_client.js";
import { Code, type DeviceState } from "../../../clients/typescript/src/messages.js";
import { fromHex } from "./support/bytes.js";
import { readVectors } from "./support/vectors.js";
import { kFair, kPush, World } from "./support/world.js";

describe("diagnostics", () => {
  const [device, peer] = decodeData(fromHex(readVectors("plain.json").data.find(
    ({ name }: { name: string }) => name === "reports on a device and on an engine")!.body))!.frames;
  assert.ok(device?.kind === "deviceReport" && peer?.kind === "peerReport");

  it("an observer that asks has the newest reports, until its session ends", () => {
    const seen: (DeviceState["forceWanted"])[] = [];
    const world = new World(1, kFair, { diagnostics: true }, { watch: ({ forceWanted }) => seen.push(forceWanted) });
    const { state } = world.server.conduct;
    world.server.conduct.state = (tick) => ({ ...state(tick), forceWanted: { x: -8, y: 0, z: 0.5 } });
    world.runMs(100);
    assert.ok(world.server.hellos[0]!.hello.features.includes("diagnostics"));
    assert.deepEqual(seen.at(-1), { x: -8, y: 0, z: 0.5 });
    assert.equal(world.client.deviceReport, undefined);
    const engine = (channel: number, name: string, number: bigint) =>
      ({ ...peer, value: { ...peer.value, channel, name, link: { ...peer.value.link, number } } });
    const loop = (number: bigint) => ({ ...device, value: { ...device.value, number } });
    for (const diagnosis of [loop(7n), engine(0, "guidance", 3n), engine(1, "wall", 3n)]) {
      world.server.session!.sendDiagnosis(diagnosis);
    }
    world.runMs(100);
    assert.deepEqual(world.client.deviceReport, loop(7n).value);
    const engines = world.client.peerReports;
    assert.deepEqual([...engines], [[0, engine(0, "guidance", 3n).value], [1, engine(1, "wall", 3n).value]]);
    world.server.session!.sendDiagnosis(loop(6n));
    world.server.session!.sendDiagnosis(engine(1, "wall", 4n));
    world.runMs(100);
    assert.deepEqual(world.client.deviceReport, loop(7n).value);
    assert.equal(world.client.peerReports.get(1)!.link.number, 4n);
    assert.equal(engines.get(1)!.link.number, 3n);
    assert.equal(world.client.stats().link!.stale, 1);
    world.server.session!.close(Code.SHUTDOWN, "");
    world.runMs(1000);
    assert.equal(world.client.phase, "open");
    assert.equal(world.client.deviceReport, undefined);
    assert.equal(world.client.peerReports.size, 0);
  });

  it("of many channels, more than a datagram holds, each arrives", () => {
    const world = new World(1, kFair, { diagnostics: true }, { watch: () => {} });
    world.runMs(100);
    const words = "w".repeat(200);
    for (let channel = 0; channel < 8; ++channel) {
      const link = { ...peer.value.link, words };
      world.server.session!.sendDiagnosis({ ...peer, value: { ...peer.value, channel, link } });
    }
    world.runMs(100);
    assert.deepEqual([...world.client.peerReports.keys()].sort(), [0, 1, 2, 3, 4, 5, 6, 7]);
  });

  it("neither a controller nor an untold observer asks for them", () => {
    assert.throws(() => new ForceClient({ diagnostics: true }, { physics: () => kPush }, () => {}, 0n),
      /diagnostics = true: expected false: only observers can use diagnostics/);
    const world = new World(1, kFair, {}, { watch: () => {} });
    world.runMs(100);
    assert.deepEqual(world.server.hellos[0]!.hello.features, ["local-model", "channels", "handle"]);
  });
});

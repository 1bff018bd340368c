// SPDX-License-Identifier: Apache-2.0
// Tests ForceClient with a server in virtual time, over a network whose loss and delay depend on a seed.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { kHasAes } from "../../../clients/typescript/src/aes.js";
import { decodeData, encodeAnswerMessage } from "../../../clients/typescript/src/codec.js";
import { CipherSuite, encodeAnswer } from "../../../clients/typescript/src/datagram.js";
import type { ClientConfig } from "../../../clients/typescript/src/config.js";
import { ForceClient } from "../../../clients/typescript/src/force_client.js";
import { Code, Mode, PortPhase, Role, type DeviceState, type PortState } from "../../../clients/typescript/src/messages.js";
import { NoiseSeal } from "../../../clients/typescript/src/seal.js";
import { Session } from "../../../clients/typescript/src/session.js";
import { fromMilliseconds, kSecond } from "../../../clients/typescript/src/time.js";
import { flipped, fromHex } from "./support/bytes.js";
import { Random } from "./support/random.js";
import { readVectors } from "./support/vectors.js";
import { controller, kFair, kFoul, kPush, kWelcome, World, type ServerConduct } from "./support/world.js";

const kKey = new Random(99).bytes(32);
const kNowhere = { x: 0, y: 0, z: 0 };
const kSuites = [
  ["suite 0", undefined, false], ["suite 1", kKey, false], ...(kHasAes ? [["suite 2", kKey, true] as const] : []),
] as const;

for (const [suite, key, aes] of kSuites) {
  describe(`over a fair network, ${suite}`, () => {
    it("a controller sees every state once and answers it with a force", () => {
      const { seen, world } = controller(1, kFair, { name: "wall", key }, { key, aes });
      world.runMs(1000);
      const { forces, hellos, session } = world.server;
      assert.equal(hellos.length, 1);
      assert.equal(hellos[0]!.hello.role, Role.CONTROLLER);
      assert.equal(hellos[0]!.hello.name, "wall");
      assert.ok(seen.length > 950, `${seen.length} states`);
      seen.forEach((hand, i) => assert.equal(hand.tick, seen[0]!.tick + BigInt(i)));
      forces.forEach(({ command }, i) => {
        assert.equal(command.sequence, BigInt(i + 1));
        assert.equal(command.basedOnTick, seen[i]!.tick);
        assert.deepEqual(command.force, kPush);
      });
      assert.ok(forces.length >= seen.length - 10);
      const { link } = world.client.stats();
      assert.equal(link!.lost + link!.lostOutgoing + link!.duplicated + link!.malformed + link!.forged + link!.invalid, 0);
      assert.ok(Math.abs(link!.smoothedRoundTripMs - 10) < 0.1, `${link!.smoothedRoundTripMs} ms`);
      assert.equal(session!.stats.invalid + session!.stats.malformed + session!.stats.forged, 0);
    });

    it("an observer sees every state and sends no force", () => {
      let seen = 0;
      const world = new World(1, kFair, { key }, { watch: () => ++seen }, { key });
      world.runMs(1000);
      assert.equal(world.server.hellos[0]!.hello.role, Role.OBSERVER);
      assert.ok(seen > 950);
      assert.equal(world.server.forces.length, 0);
    });
  });

  describe(`over a network that loses 30 %, reorders and doubles, ${suite}`, () => {
    it("the newest states and forces arrive; requests are answered in order", () => {
      for (let seed = 1; seed <= 3; ++seed) {
        const renewAfter = { datagrams: 50n, time: 600n * kSecond };
        const { seen, world } = controller(seed, kFoul, { key, stateHz: 1000 }, { key, aes, renewAfter });
        world.runMs(3000);
        for (let i = 0; i < 9; ++i) assert.equal(world.client.rearm(), true);
        assert.equal(world.client.disarm(), true);
        world.runMs(3000);
        const context = `seed ${seed}`;
        assert.deepEqual([world.client.phase, world.client.stats().sessions], ["open", 1], context);
        assert.ok(seen.length > 1000, `${context}: ${seen.length} states`);
        seen.forEach((hand, i) => assert.ok(i === 0 || hand.tick > seen[i - 1]!.tick, context));
        world.server.forces.forEach(({ command }, i, all) =>
          assert.ok(i === 0 || command.sequence > all[i - 1]!.command.sequence, context));
        assert.ok(world.server.forces.length > 500, `${context}: ${world.server.forces.length} forces`);
        const rearms = [...new Array(9).fill({ kind: "rearm", device: 0 }), { kind: "disarm", device: 0 }];
        assert.deepEqual(world.server.requests, [{ kind: "setStateRate", hz: 1000, device: 0 }, ...rearms], context);
        const link = world.client.stats().link!;
        assert.ok(link.lost > 0 && link.lostOutgoing > 0 && link.duplicated > 0 && link.reordered > 0, context);
        assert.equal(link.malformed + link.forged + link.invalid, 0, context);
      }
    });

    it("a session outlives 1.5 s of silence; after 2 s a new one opens", () => {
      for (let seed = 1; seed <= 2; ++seed) {
        const { world } = controller(seed, kFoul, { key }, { key });
        assert.ok(world.runUntil(() => world.client.phase === "open", 10_000));
        world.runMs(1000);
        world.weather = { ...kFair, loss: 1 };
        world.runMs(1500);
        world.weather = kFoul;
        world.runMs(1000);
        assert.equal(world.client.stats().sessions, 1, `seed ${seed}`);
        world.weather = { ...kFair, loss: 1 };
        world.runMs(2500);
        assert.equal(world.client.stats().code, Code.TIMED_OUT);
        world.weather = kFoul;
        world.server.restart();
        assert.ok(world.runUntil(() => world.client.phase === "open", 20_000), `seed ${seed}`);
        assert.equal(world.client.stats().sessions, 2);
      }
    });
  });
}

describe("the same seed", () => {
  it("gives the same run", () => {
    const run = () => {
      const { seen, world } = controller(7, kFoul, { key: kKey }, { key: kKey });
      world.runMs(2000);
      return [seen.map(({ tick }) => tick), world.client.stats()];
    };
    assert.deepEqual(run(), run());
  });
});

describe("the handshake", () => {
  it("keeps its random and Noise message 1; the next attempt draws new ones", () => {
    const sent: Uint8Array[] = [];
    const random = new Random(3);
    const config = { key: kKey, random: (size: number) => random.bytes(size), patienceMs: 250 };
    const client = new ForceClient(config, { watch: () => {} }, (datagram) => sent.push(datagram), 0n);
    for (let ms = 0; ms < 500; ++ms) client.turn(fromMilliseconds(ms));
    const [first, second, third, next] = sent;
    assert.deepEqual(second, first);
    assert.deepEqual(third, first);
    assert.equal(sent.length, 5); // at 0, 100 and 200 ms, and in the next attempt at 350 and 450 ms
    assert.ok(sent.every((datagram) => datagram.length === 1200));
    const differs = (from: number, to: number): boolean =>
      Buffer.compare(first!.subarray(from, to), next!.subarray(from, to)) !== 0;
    assert.ok(differs(16, 32), "random");
    assert.ok(!differs(50, 58), "key id");
    assert.ok(differs(58, 90), "ephemeral key");
  });

  it("lets no forged Answer in, and takes the true one that comes after it", () => {
    const { world } = controller(1, kFair, { key: kKey }, { key: kKey });
    const forge = (datagram: Uint8Array): void => {
      for (const at of [20, 40, datagram.length - 1]) world.client.receive(world.now, flipped(datagram, at));
      const random = datagram.slice(16, 32);
      world.client.receive(world.now, encodeAnswer({ suite: 0, connectionId: 9, random, content: new Uint8Array(0) }));
      world.client.receive(world.now, encodeAnswer({ suite: 1, connectionId: 9, random, content: new Uint8Array(48) }));
      const plain = encodeAnswerMessage({ ...kWelcome, features: [], role: Role.CONTROLLER });
      for (const suite of [0, 1] as const) {
        world.client.receive(world.now, encodeAnswer({ suite, connectionId: 9, random, content: plain }));
      }
      assert.equal(world.client.phase, "greeting");
    };
    const send = world.toClient.send.bind(world.toClient);
    world.toClient.send = (datagram) => {
      if (datagram[1] === 0x14) forge(datagram);
      send(datagram);
    };
    assert.ok(world.runUntil(() => world.client.phase === "open", 200));
  });

  it("opens only with the server's key, and not in the clear when it has one", () => {
    for (const [mine, theirs] of [[kKey, flipped(kKey, 0)], [kKey, undefined], [undefined, kKey]] as const) {
      const { world } = controller(1, kFair, { key: mine }, { key: theirs });
      world.runMs(5000);
      assert.equal(world.client.stats().sessions, 0);
      assert.equal(world.server.hellos.length, 0);
    }
  });

  const both: readonly CipherSuite[] = [CipherSuite.AesGcm, CipherSuite.Noise];
  const old: readonly CipherSuite[] = [CipherSuite.Noise];
  const aesOnly: readonly CipherSuite[] = [CipherSuite.AesGcm];
  for (const [what, suites, aes, agreed] of [
    ["both have it", both, true, 2], ["an older server", both, false, 1], ["an older client", old, true, 1],
    ["a client that forbids suite 1", aesOnly, true, 2], ["suite 1 forbidden, and an older server", aesOnly, false, undefined],
  ] as const) {
    it(`seals by the fastest suite that both have: ${what}`, { skip: !kHasAes }, () => {
      const { world } = controller(1, kFair, { key: kKey, suites }, { key: kKey, aes });
      world.runMs(500);
      if (agreed === undefined) {
        assert.equal(world.client.phase, "refused");
        assert.equal(world.client.stats().code, Code.UNSUPPORTED);
        const reason = "no common cipher suite: the server uses chacha20-poly1305, this client only accepts aes-256-gcm";
        assert.equal(world.client.stats().reason, reason);
        return;
      }
      assert.equal(world.client.phase, "open");
      assert.ok(world.server.forces.length > 300);
      assert.equal(world.server.session!.suite, agreed);
      assert.equal(world.server.hellos[0]!.datagram.suite, CipherSuite.Noise);
      assert.equal(world.server.hellos[0]!.hello.features.includes("aes-256-gcm"), suites.includes(CipherSuite.AesGcm));
    });
  }

  it("does not take a suite that it has not offered", () => {
    const { world } = controller(1, kFair, { key: kKey, suites: old }, { key: kKey, features: ["aes-256-gcm"] });
    world.runMs(500);
    assert.equal(world.client.phase, "open");
    assert.equal(world.server.session!.suite, CipherSuite.Noise);
    assert.ok(world.server.forces.length > 300);
  });

  it("says Hello at once after the first Retry only", () => {
    let now = 0n;
    const retry = new Uint8Array(48);
    retry.set([0x54, 0x12]);
    const hellos: Uint8Array[] = [];
    const config = { random: (size: number) => new Uint8Array(size) };
    const client = new ForceClient(config, { watch: () => {} }, (datagram) => hellos.push(datagram), now);
    client.turn(now);
    for (let i = 0; i < 5; ++i) {
      now += fromMilliseconds(1);
      client.receive(now, retry);
      client.turn(now);
    }
    assert.equal(hellos.length, 2);
  });
});

describe("reconnection", () => {
  it("waits 100 ms, doubled up to 2 s; a session with states resets that", () => {
    const { world } = controller(1, kFair, { patienceMs: 100 }, { up: false });
    const begins: number[] = [];
    let attempts = 0;
    world.runUntil(() => {
      const now = world.client.stats().attempts;
      if (now > attempts) begins.push(Number((world.now - kSecond) / 1_000_000n));
      attempts = now;
      return begins.length === 8;
    }, 60_000);
    const waits = begins.slice(1).map((at, i) => at - begins[i]! - 100);
    assert.deepEqual(waits, [100, 200, 400, 800, 1600, 2000, 2000]);

    world.server.conduct.up = true;
    assert.ok(world.runUntil(() => world.client.stats().states > 0, 5000));
    world.server.session!.close(Code.SHUTDOWN, "SIGTERM");
    assert.ok(world.runUntil(() => world.client.phase === "lost", 100));
    assert.deepEqual([world.client.stats().code, world.client.stats().reason], [Code.SHUTDOWN, "SIGTERM"]);
    const lost = world.now;
    world.server.restart();
    assert.ok(world.runUntil(() => world.client.phase === "greeting", 1000));
    assert.equal(world.now - lost, fromMilliseconds(100));
  });

  it("tells the server's reason of a refusal and asks again", () => {
    const refused = { code: Code.BUSY, detail: "one controller", versionMin: 1, versionMax: 1 };
    const { world } = controller(1, kFair, { key: kKey }, { key: kKey, refuse: refused });
    assert.ok(world.runUntil(() => world.client.phase === "refused", 1000));
    assert.equal(world.client.stats().reason, "one controller");
    world.server.conduct.refuse = undefined;
    assert.ok(world.runUntil(() => world.client.phase === "open", 1000));
  });

  it("numbers the forces of each session from 1", () => {
    const { world } = controller(1, kFair);
    world.runMs(500);
    world.server.session!.close(Code.SHUTDOWN, "");
    world.runMs(20);
    world.server.restart();
    world.server.forces.length = 0;
    world.runMs(1000);
    assert.equal(world.server.forces[0]!.command.sequence, 1n);
  });
});

describe("the two ends of a coupling", () => {
  it("are streams of their own", () => {
    const [ours, theirs] = [new Session({ connectionId: 1 }, 0n), new Session({ connectionId: 1 }, 0n)];
    const port = (epoch: bigint, peer: boolean): PortState => ({
      device: 1, channel: 1, epoch, sequence: 1n, answersEpoch: 0n, answers: 0n, timeNs: 0n, roundTripNs: 0n,
      phase: PortPhase.ENGAGED, engagement: 0n, buttons: 0, position: kNowhere, velocity: kNowhere, force: kNowhere, account: 0,
      need: 0, given: 0, taken: 0, ...(peer && { ofPeer: true }),
    });
    const arrived = (...ports: PortState[]): PortState[] => {
      for (const one of ports) theirs.sendPort(one);
      for (let datagram; (datagram = theirs.nextDatagram(0n)); ) ours.receive(0n, datagram);
      const out: PortState[] = [];
      for (let event; (event = ours.nextEvent()); ) if (event.kind === "port") out.push(event.port);
      return out;
    };
    assert.deepEqual(arrived(port(9n, true), port(5n, false)), [port(9n, true), port(5n, false)]);
    assert.equal(ours.stats.stale, 0);
    assert.deepEqual(arrived(port(4n, false)), []);
    assert.equal(ours.stats.stale, 1);
  });
});

describe("a session's end", () => {
  it("by the age of a day is told with a Bye, and a new one opens by itself", () => {
    const day = 86_400n * kSecond;
    const seal = new NoiseSeal({ sendKey: kKey, receiveKey: kKey }, 0n);
    const session = new Session({ connectionId: 1, seal, timeout: 2n * day }, 0n);
    session.tick(day - 1n);
    assert.equal(session.open, true);
    session.tick(day);
    assert.deepEqual([session.open, session.nextEvent()?.kind], [false, "closed"]);
    assert.ok(session.nextDatagram(day) && session.nextDatagram(day) && session.nextDatagram(day));
    assert.equal(session.nextDatagram(day), undefined);

    const { world } = controller(1, kFair, { key: kKey }, { key: kKey });
    assert.ok(world.runUntil(() => world.client.stats().states > 0, 1000));
    world.server.session!.close(Code.EXPIRED, "a day");
    world.runMs(20);
    world.server.restart();
    assert.ok(world.runUntil(() => world.client.stats().sessions === 2, 1000));
  });

  it("by another program with the same key is for good", () => {
    const { world } = controller(1, kFair, { key: kKey }, { key: kKey });
    assert.ok(world.runUntil(() => world.client.stats().states > 0, 1000));
    world.server.session!.close(Code.REPLACED, "another has this key");
    world.runMs(5000);
    const { phase, code, attempts } = world.client.stats();
    assert.deepEqual([phase, code, attempts], ["stopped", Code.REPLACED, 1]);
  });
});

describe("the callback", () => {
  it("sees the newest state since its last call, at multiples of its period", () => {
    const times: bigint[] = [];
    const seen: DeviceState[] = [];
    const world: World = new World(1, kFair, { rateHz: 100 }, {
      physics: (hand) => {
        times.push(world.now);
        seen.push(hand);
        return kPush;
      },
    });
    world.runMs(1000);
    const period = fromMilliseconds(10);
    times.slice(1).forEach((at, i) => assert.equal((at - times[1]!) % period, 0n, `call ${i}`));
    assert.ok(seen.length >= 96 && seen.length <= 100, `${seen.length} calls`);
    seen.slice(2).forEach((hand, i) => assert.equal(hand.tick - seen[i + 1]!.tick, 10n));
    const { states, statesSkipped } = world.client.stats();
    assert.ok(states - statesSkipped - seen.length <= 1);
  });

  it("sees a press that was in a state which it skipped", () => {
    let pressed = 0;
    const world: World = new World(1, kFair, { rateHz: 20 }, {
      physics: (hand) => {
        if (hand.buttons === 2) ++pressed;
        return kPush;
      },
    });
    const { state } = world.server.conduct;
    world.server.conduct.state = (tick) => ({ ...state(tick), buttons: tick % 100n === 0n ? 2 : 0 });
    world.runMs(4000);
    assert.ok(Math.abs(pressed - 40) <= 1, `${pressed} calls saw one, of 1 ms in 100 ms`);
  });

  it("its forces are valid for three periods, at least 20 ms, or as asked", () => {
    const validity = (config: ClientConfig, stateEvery = 1): number => {
      const { world } = controller(1, kFair, config);
      const plain = world.server.conduct.state;
      let skipped = 0n;
      world.server.conduct.state = (tick) => plain(tick * BigInt(stateEvery) + skipped);
      world.runMs(1000);
      return world.server.forces.at(-1)!.command.validForUs;
    };
    assert.equal(validity({}), 20_000);
    assert.equal(validity({ rateHz: 50 }), 60_000);
    assert.equal(validity({}, 30), 90_000); // the states answered are 30 ms apart
    assert.equal(validity({}, 500), 300_000); // the period is at most 100 ms
    assert.equal(validity({ validForMs: 12.5, rateHz: 50 }), 12_500);
  });

  it("sends no force that is not finite or beyond 10¹², and counts it", () => {
    for (const bad of [NaN, Infinity, -1.1e12]) {
      const answers = [{ x: bad, y: 0, z: 0 }, { force: kPush, stiffness: [bad] }, { force: kPush, stiffness: [1, 2] }];
      for (const touch of answers) {
        const world = new World(1, kFair, {}, { physics: () => touch });
        world.runMs(100);
        assert.equal(world.server.forces.length, 0);
        assert.ok(world.client.stats().forcesUnusable > 0);
        assert.match(world.client.stats().unusable, "x" in touch ? (Number.isFinite(bad) ? /exceeds 1e12/ : /not finite/) : /stiffness/);
        assert.equal(world.client.phase, "open");
      }
    }
  });

  it("sends its stiffness only to a server that knows the feature", () => {
    for (const features of [["local-model"], []]) {
      const world = new World(1, kFair, {}, { physics: () => ({ force: kPush, stiffness: [2000, 0, 0] }) }, { features });
      world.runMs(100);
      const { command } = world.server.forces.at(-1)!;
      if (features.length === 0) assert.equal(command.model, undefined);
      else assert.deepEqual(command.model!.stiffness, [2000, 0, 0]);
    }
  });

  it("says which of its ways a force was, to a server that knows them", () => {
    const cases = [[2, true, 2], [undefined, true, undefined], [2, false, undefined], [3, true, undefined], [-1, true, undefined],
      [0.5, true, undefined]] as const;
    for (const [way, agreed, sent] of cases) {
      const world = new World(1, kFair, { ways: ["tabulated", "near"] }, { physics: () => ({ force: kPush, way }) },
        { features: agreed ? ["ways"] : [] });
      world.runMs(100);
      assert.equal(world.server.forces.at(-1)!.command.way, sent);
      const hasName = way === undefined || way === 2;
      assert.equal(world.client.stats().leftOut, hasName ? "" : "the solver path: its number is not in the ways of the config");
    }
  });

  it("sends all that the engine knows, except numbers out of bounds", () => {
    const kContact = { normal: { x: 0, y: 0, z: 1 }, gap: -1e-3, table: { first: -1e-3, step: 1e-3, force: [0, 1, 3] } };
    const kAll = { force: kPush, validRadius: 3e-3, contact: kContact, topologyChanged: true, error: 0.02 };
    const world = new World(1, kFair, {}, { physics: () => kAll });
    world.runMs(100);
    const { command } = world.server.forces.at(-1)!;
    assert.deepEqual([command.topologyChanged, command.error, command.model!.validRadius], [true, 0.02, 3e-3]);
    assert.deepEqual([command.model!.stiffness, command.model!.contact], [[0], kContact]);

    const table = kContact.table;
    const spoiled = [
      { ...kAll, validRadius: -1e-3 }, { ...kAll, error: NaN }, { ...kAll, contact: { ...kContact, gap: NaN } },
      { ...kAll, contact: { ...kContact, normal: { x: 0, y: 0, z: 2 } } },
      ...[{ ...table, step: 0 }, { ...table, first: Infinity }, { ...table, force: [1] }, { ...table, force: [0, NaN] },
        { ...table, force: Array<number>(17).fill(0) }].map((bad) => ({ ...kAll, contact: { ...kContact, table: bad } })),
    ];
    for (const touch of spoiled) {
      const refused = new World(1, kFair, {}, { physics: () => touch });
      refused.runMs(100);
      assert.equal(refused.server.forces.length, 0);
      assert.ok(refused.client.stats().forcesUnusable > 0);
    }
  });

  it("ends the session with a Bye when it throws, and rethrows", () => {
    const world = new World(1, kFair, { name: "wall" }, { physics: () => { throw new Error("no world"); } });
    assert.throws(() => world.runMs(1000), /no world/);
    assert.equal(world.client.phase, "stopped");
    assert.ok(world.runUntil(() => world.server.session?.open === false, 100));
  });
});

describe("stop()", () => {
  it("says Bye three times and nothing after that", () => {
    const { world } = controller(1, kFair, { name: "wall" });
    world.runMs(500);
    const before = world.client.stats().link!.sent;
    world.client.stop(world.now);
    world.runMs(1000);
    assert.equal(world.client.stats().link!.sent, before + 3);
    assert.equal(world.server.session!.open, false);
    assert.equal(world.client.turn(world.now), 1n << 62n);
  });
});

describe("an impossible configuration", () => {
  it("is refused with field, value and expectation", () => {
    const bad: [ClientConfig, RegExp][] = [
      [{ name: "ä".repeat(33) }, /^RangeError: name.size = 66: expected at most 64 bytes$/],
      [{ device: "ä".repeat(13) }, /^RangeError: device.size = 26: expected at most 24 bytes$/],
      [{ channel: "c".repeat(25) }, /^RangeError: channel.size = 25: expected at most 24 bytes$/],
      [{ ways: new Array<string>(9).fill("x") }, /^RangeError: ways.size = 9: expected at most 8 names$/],
      [{ ways: ["near", ""] }, /^RangeError: ways\[1\].size = 0: expected at least 1 byte$/],
      [{ ways: ["x".repeat(25)] }, /^RangeError: ways\[0\].size = 25: expected at most 24 bytes$/],
      [{ ways: ["near", "near"] }, /^RangeError: ways\[1\] = near: expected unique names$/],
      [{ key: new Uint8Array(31) }, /^RangeError: key.size = 31: expected 32 bytes$/],
      [{ suites: [0] }, /^RangeError: suites = \[0\]: expected numbers of some of /],
      [{ suites: [] }, /^RangeError: suites = \[\]: expected/],
      [{ rateHz: -1 }, /^RangeError: rateHz = -1: expected 0, or 0.001 to 100000$/], [{ rateHz: NaN }, /^RangeError: rateHz = NaN: expected 0/],
      [{ stateHz: 1.5 }, /^RangeError: stateHz = 1.5: expected a whole number from 0 to 1000000$/],
      [{ validForMs: 10_001 }, /^RangeError: validForMs = 10001: expected 0 to 10000$/],
      [{ patienceMs: 0 }, /^RangeError: patienceMs = 0: expected more than 0$/],
      [{ retryMinMs: 0 }, /^RangeError: retryMinMs = 0: expected more than 0$/],
      [{ retryMaxMs: 50 }, /^RangeError: retryMaxMs = 50: expected at least retryMinMs$/],
    ];
    for (const [config, message] of bad) {
      assert.throws(() => new ForceClient(config, { watch: () => {} }, () => {}, 0n), message);
    }
  });
});

describe("what need not be sent", () => {
  const stateDeadband = { share: 0.1, floor: 1e-3, maxSilenceUs: 20_000 };
  /** The speed of the hand is 0.1 m/s, and one tick in `every` is sent to the client. */
  const moving = (every: bigint): Partial<ServerConduct> => ({
    every,
    state: (tick) => ({
      tick, sampledNs: tick * 1_000_000n, position: { x: Number(tick) * 1e-4, y: 0, z: 0 }, velocity: { x: 0.1, y: 0, z: 0 },
      forceApplied: { x: 0, y: 0, z: 0 }, energy: 0, permittedForce: Infinity, reasons: 0, forceSequence: 0n,
      forceAgeNs: 0n, mode: Mode.ACTIVE, device: 0, channel: 0, buttons: 0,
    }),
  });

  it("states left out are predicted, time included, at the callback's rate", () => {
    const { seen, world } = controller(1, kFair, { rateHz: 500, stateDeadband }, moving(10n));
    world.runMs(1000);
    assert.deepEqual(world.server.requests, [{ kind: "setStateDeadband", ...stateDeadband }]);
    const { states, statesPredicted } = world.client.stats();
    assert.ok(states < 110 && statesPredicted > 300 && seen.length > 440, `${states} ${statesPredicted} ${seen.length}`);
    seen.forEach((hand, i) => {
      assert.ok(i === 0 || hand.tick > seen[i - 1]!.tick);
      assert.ok(Math.abs(hand.position.x - Number(hand.tick) * 1e-4) < 1e-12);
      assert.equal(hand.sampledNs, hand.tick * 1_000_000n);
    });
    assert.ok(world.server.forces.every(({ command }) => seen.some(({ tick }) => tick === command.basedOnTick)));
  });

  it("nothing is predicted after the longest silence or without a grant", () => {
    const silent = controller(1, kFair, { rateHz: 500, stateDeadband }, moving(200n));
    silent.world.runMs(1000);
    assert.ok(silent.seen.length > 30 && silent.seen.length < 65, `${silent.seen.length}`);
    const old = controller(1, kFair, { rateHz: 500, stateDeadband }, { answer: () => ({ code: Code.UNSUPPORTED, detail: "" }) });
    old.world.runMs(1000);
    assert.equal(old.world.client.stats().statesPredicted, 0);
    assert.ok(old.seen.length > 450);
  });

  it("forces that feel alike are left out, for the silence at most", () => {
    const deadband = { share: 0.1, floor: 0.05, longestSilenceMs: 20 };
    const { seen, world } = controller(1, kFair, { deadband });
    world.runMs(1000);
    const { forces, forcesAlike } = world.client.stats();
    assert.equal(forces + forcesAlike, seen.length);
    assert.ok(forces > 45 && forces < 55, `${forces}`);
    assert.ok(world.server.forces.slice(1).every(({ command }) => command.validForUs === 60_000));
  });

  it("an impossible deadband is refused with a sentence that names the field", () => {
    const wrong = (config: ClientConfig, message: RegExp) =>
      assert.throws(() => new ForceClient(config, { watch: () => {} }, () => {}, 0n), message);
    wrong({ stateDeadband: { ...stateDeadband, share: 0.51 } }, /^RangeError: stateDeadband.share = 0.51: expected 0 to 0.5$/);
    wrong({ stateDeadband: { ...stateDeadband, floor: NaN } }, /^RangeError: stateDeadband.floor = NaN: expected 0 to 0.1 m\/s$/);
    wrong({ stateDeadband: { ...stateDeadband, maxSilenceUs: 999 } }, /^RangeError: stateDeadband.maxSilenceUs = 999: expected 0, or a whole number from 1000 to 20000$/);
    wrong({ deadband: { share: -1, floor: 0, longestSilenceMs: 20 } }, /^RangeError: deadband.share = -1: expected 0 to 1$/);
    wrong({ deadband: { share: 0, floor: 0, longestSilenceMs: 0 } }, /^RangeError: deadband.longestSilenceMs = 0: expected more than 0$/);
  });
});

describe("what the server says of our forces", () => {
  it("is there for the asking, the newest only, and goes with the session", () => {
    const { world } = controller(1, kFair);
    world.runMs(100);
    assert.equal(world.client.report, undefined);
    const [frame] = decodeData(fromHex(readVectors("plain.json").data.find(
      ({ name }: { name: string }) => name === "report on a client's forces")!.body))!.frames;
    assert.ok(frame?.kind === "report");
    world.server.session!.sendReport(frame.value);
    world.runMs(100);
    assert.deepEqual(world.client.report, frame.value);
    world.server.session!.sendReport({ ...frame.value, number: 2n });
    world.runMs(100);
    assert.deepEqual(world.client.report, frame.value);
    world.server.session!.close(Code.SHUTDOWN, "");
    world.runMs(1000);
    assert.equal(world.client.phase, "open");
    assert.equal(world.client.report, undefined);
  });
});

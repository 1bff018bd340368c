// SPDX-License-Identifier: Apache-2.0
// Tests the devices, channels and leases of a ForceClient, with a server in virtual time.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { ChannelRule, Code, Hand, Role, type DeviceDescription, type HandleDescription, type Request } from "../../../clients/typescript/src/messages.js";
import { controller, kFair, World, type ServerConduct } from "./support/world.js";

describe("devices and channels", () => {
  const kNamed = { device: "right", channel: "tissue" };
  const kPlace = { device: 1, channel: 2 };
  const kHeld = [{ ...kPlace, role: Role.CONTROLLER }];
  const kAnothers = [{ ...kPlace, role: Role.OBSERVER }];
  const kRight: DeviceDescription = {
    device: 1, name: "right", model: "simulated", positionDof: 3, forceDof: 3, workspace: undefined, maxForce: 8,
    continuousForce: 0, maxStiffness: 0, positionResolution: 0, loopHz: 1000,
    channels: [{ name: "tissue", rule: ChannelRule.PRIORITY, leaseMs: 300, holder: "" }],
  };
  const ok = { code: Code.OK, detail: "" };
  const busy = (waitMs: number) => ({ code: Code.BUSY, detail: "another holds it", waitMs });
  /** Answers `takeLease` with lease() and accepts all other requests. */
  const answering = (lease: () => ReturnType<ServerConduct["answer"]>): Partial<ServerConduct> => ({
    answer: ({ kind }: Request) => (kind === "takeLease" ? lease() : kind === "describe" ? { ...ok, device: kRight } : ok),
  });
  const taken = answering(() => busy(0));
  const asked = ({ server }: World, kind: Request["kind"]): number =>
    server.requests.filter((request) => request.kind === kind).length;
  const loseTo = (world: World, to: string, place = kPlace): void => {
    world.server.session!.request({ kind: "leaseLost", ...place, to });
    world.runMs(20);
  };

  it("are claimed by name, and their numbers are in all that is said of them", () => {
    const { seen, world } = controller(1, kFair, { ...kNamed, stateHz: 500 }, { grants: kHeld, ...taken });
    world.runMs(200);
    const { hello } = world.server.hellos[0]!;
    assert.deepEqual(hello.claims, [{ ...kNamed, role: Role.CONTROLLER }]);
    assert.ok(hello.features.includes("channels"));
    assert.equal(world.client.holds, true);
    assert.ok(seen.length > 100);
    for (const ask of ["rearm", "disarm", "engage", "disengage", "giveLease", "takeLease"] as const) {
      assert.equal(world.client[ask](), true);
    }
    world.runMs(20);
    const device = kPlace.device;
    assert.deepEqual(world.server.requests, [
      { kind: "describe", device }, { kind: "setStateRate", hz: 500, device }, { kind: "rearm", device },
      { kind: "disarm", device }, { kind: "engage", device }, { kind: "disengage", device },
      { kind: "giveLease", ...kPlace }, { kind: "takeLease", ...kPlace },
    ]);
    assert.ok(world.server.forces.length > 100);
    for (const { command } of world.server.forces) assert.deepEqual([command.device, command.channel], [1, 2]);
  });

  it("are claimed when only one is named; an observer claims as observer", () => {
    for (const [config, device, channel] of [[{ device: "right" }, "right", ""], [{ channel: "tissue" }, "", "tissue"]] as const) {
      const world = new World(1, kFair, config, { watch: () => {} }, { grants: kAnothers });
      world.runMs(100);
      assert.deepEqual(world.server.hellos[0]!.hello.claims, [{ device, channel, role: Role.OBSERVER }]);
      assert.equal(world.client.phase, "open");
    }
  });

  it("the device that was named is described, anew in each session", () => {
    const { world } = controller(1, kFair, kNamed, { grants: kHeld, ...taken });
    assert.equal(world.client.description, undefined);
    world.runMs(100);
    assert.deepEqual(world.client.description, kRight);
    world.server.session!.close(Code.SHUTDOWN, "");
    world.runMs(20);
    world.server.conduct.answer = () => ({ code: Code.INVALID, detail: "no such device" });
    world.server.restart();
    world.runMs(500);
    assert.deepEqual([world.client.phase, world.client.description], ["open", undefined]);
  });

  it("joints are asked for by those who want them", () => {
    const { world } = controller(1, kFair, { joints: true }, {});
    world.runMs(100);
    assert.deepEqual(world.server.hellos[0]!.hello.features, ["local-model", "channels", "handle", "joints"]);
  });

  it("outputs are set by those who asked for them, and within their bounds", () => {
    for (const outputs of [true, false]) {
      const { world } = controller(1, kFair, { outputs }, { features: ["local-model", ...(outputs ? ["outputs"] : [])] });
      world.runMs(100);
      assert.equal(world.server.hellos[0]!.hello.features.includes("outputs"), outputs);
      const setting = { amplitude: 0.5, frequency: 200, durationMs: 40 };
      const sent = world.client.setOutput(2, setting);
      world.runMs(20);
      const requests = world.server.requests.filter(({ kind }) => kind === "setOutput");
      assert.equal(sent, outputs);
      assert.deepEqual(requests, outputs ? [{ kind: "setOutput", device: 0, output: 2, setting }] : []);
      for (const [output, wrong] of [[8, { rgb: 1 }], [0, { rgb: 0x1000000 }], [0, { ...setting, amplitude: 1.5 }]] as const) {
        assert.throws(() => world.client.setOutput(output, wrong), /setOutput/);
      }
    }
  });

  it("scales and shares of a coupling are asked for within their bounds", () => {
    const { world } = controller(1, kFair, kNamed, { grants: kHeld });
    assert.equal(world.client.setScale(1, 1) || world.client.setShare(0, 0), false, "there is no session to ask in");
    world.runMs(100);
    assert.ok(world.client.setScale(0.01, 100) && world.client.setShare(7, 0) && world.client.setShare(0, 1));
    world.runMs(20);
    assert.deepEqual(world.server.requests.slice(-3), [
      { kind: "setScale", device: 1, positionScale: 0.01, forceScale: 100 },
      { kind: "setShare", device: 1, channel: 7, share: 0 }, { kind: "setShare", device: 1, channel: 0, share: 1 },
    ]);
    for (const [position, force] of [[0.0099, 1], [1, 100.1], [NaN, 1]] as const) {
      assert.throws(() => world.client.setScale(position, force), /setScale/);
    }
    for (const [channel, share] of [[8, 0.5], [-1, 0.5], [0.5, 0.5], [0, -0.001], [0, 1.001], [0, NaN]] as const) {
      assert.throws(() => world.client.setShare(channel, share), /setShare/);
    }
  });

  it("the handle is described where the server knows that, anew each session", () => {
    const kHandle: HandleDescription = {
      device: 0, operatorFromDevice: { w: 0.5, x: -0.5, y: 0.5, z: 0.5 }, buttons: ["right", "forward"],
      orientationMeasured: true, maxTorque: 0.125, gripperOpen: 0.5, maxGripperForce: 8, group: "arms", hand: Hand.RIGHT,
    };
    for (const features of [["local-model", "handle"], ["local-model"]]) {
      const knows = features.includes("handle");
      const { world } = controller(1, kFair, {}, {
        features, answer: (request: Request) => (request.kind === "describe" ? { ...ok, handle: kHandle } : ok),
      });
      world.runMs(100);
      assert.deepEqual(world.client.handle, knows ? kHandle : undefined);
      assert.deepEqual(world.server.requests, knows ? [{ kind: "describe", device: 0, handle: true }] : []);
      world.server.session!.close(Code.SHUTDOWN, "");
      world.runMs(20);
      world.server.conduct.answer = () => ({ code: Code.INVALID, detail: "no such device" });
      world.server.restart();
      world.runMs(500);
      assert.deepEqual([world.client.phase, world.client.handle], ["open", undefined]);
    }
  });

  it("that nobody named are the first ones, neither claimed nor described", () => {
    const { world } = controller(1, kFair);
    world.runMs(100);
    assert.equal(world.server.hellos[0]!.hello.claims, undefined);
    assert.equal(world.client.holds, true);
    assert.equal(world.client.rearm(), true);
    world.runMs(20);
    assert.deepEqual(world.server.requests, [{ kind: "rearm", device: 0 }]);
    const { device, channel } = world.server.forces[0]!.command;
    assert.deepEqual([device, channel], [0, 0]);
    loseTo(world, "another", { device: 0, channel: 0 });
    assert.equal(world.client.holds, false);
    const observer = new World(1, kFair, {}, { watch: () => {} });
    observer.runMs(100);
    assert.equal(observer.client.holds, false);
  });

  it("a server that grants none, or a wrong number, is refused in a sentence", () => {
    for (const grants of [[], [...kHeld, ...kHeld]]) {
      const { world } = controller(1, kFair, kNamed, { grants });
      assert.ok(world.runUntil(() => world.client.phase === "refused", 200));
      const { code, reason, sessions } = world.client.stats();
      assert.deepEqual([code, sessions], [Code.UNSUPPORTED, 0]);
      assert.equal(reason, "this server has one device with one channel: omit their names");
    }
  });

  it("a channel that another holds gets no force; takeLease asks once", () => {
    const { seen, world } = controller(1, kFair, kNamed, { grants: kAnothers, ...taken });
    world.runMs(500);
    assert.deepEqual([world.client.phase, world.client.holds, seen.length], ["open", false, 0]);
    assert.ok(world.client.stats().states > 400);
    assert.equal(asked(world, "takeLease"), 0);
    assert.equal(world.client.takeLease(), true);
    world.runMs(500);
    assert.deepEqual([asked(world, "takeLease"), world.client.holds], [1, false]);
    Object.assign(world.server.conduct, answering(() => ok));
    assert.equal(world.client.takeLease(), true);
    world.runMs(20);
    assert.deepEqual([asked(world, "takeLease"), world.client.holds], [2, true]);
    world.runMs(20);
    assert.ok(seen.length > 10);
  });

  it("takeLease asks again when the lease may be over, every 50 ms at most", () => {
    let answer: ReturnType<ServerConduct["answer"]> = busy(300);
    const { seen, world } = controller(1, kFair, { ...kNamed, takeLease: true },
      { grants: kAnothers, ...answering(() => answer) });
    assert.ok(world.runUntil(() => asked(world, "takeLease") === 1, 100));
    world.runMs(290);
    assert.equal(asked(world, "takeLease"), 1);
    answer = busy(0);
    world.runMs(30);
    assert.equal(asked(world, "takeLease"), 2);
    world.runMs(600);
    const often = asked(world, "takeLease");
    assert.ok(often >= 9 && often <= 13, `${often}`); // 50 ms and the round-trip time each
    assert.equal(seen.length, 0);
    answer = ok;
    world.runMs(100);
    assert.equal(world.client.holds, true);
    assert.ok(seen.length > 0);
    const last = asked(world, "takeLease");
    world.runMs(500);
    assert.equal(asked(world, "takeLease"), last);
  });

  it("a denied lease is not asked for again; an observer asks for none", () => {
    const denied = answering(() => ({ code: Code.DENIED, detail: "" }));
    const { world } = controller(1, kFair, { ...kNamed, takeLease: true }, { grants: kAnothers, ...denied });
    world.runMs(1000);
    assert.deepEqual([asked(world, "takeLease"), world.client.holds], [1, false]);
    const observer = new World(1, kFair, { ...kNamed, takeLease: true }, { watch: () => {} }, { grants: kAnothers });
    observer.runMs(1000);
    assert.equal(asked(observer, "takeLease"), 0);
    const holder = controller(1, kFair, { ...kNamed, takeLease: true }, { grants: kHeld });
    holder.world.runMs(1000);
    assert.equal(asked(holder.world, "takeLease"), 0);
  });

  it("a lost lease ends the forces and names the taker, until it is retaken", () => {
    const { seen, world } = controller(1, kFair, kNamed, { grants: kHeld, ...answering(() => ok) });
    world.runMs(100);
    loseTo(world, "surgeon");
    assert.deepEqual(world.server.answers, [ok]);
    assert.deepEqual([world.client.holds, world.client.stats().leaseLostTo], [false, "surgeon"]);
    const before = seen.length;
    world.runMs(500);
    assert.deepEqual([seen.length, asked(world, "takeLease"), world.client.phase], [before, 0, "open"]);
    world.client.takeLease();
    world.runMs(50);
    assert.deepEqual([world.client.holds, world.client.stats().leaseLostTo], [true, ""]);
    assert.ok(seen.length > before);
    loseTo(world, "surgeon");
    world.server.session!.close(Code.SHUTDOWN, "");
    world.runMs(20);
    assert.equal(world.client.stats().leaseLostTo, "surgeon");
    world.server.restart();
    world.runMs(500);
    assert.deepEqual([world.client.holds, world.client.stats().leaseLostTo], [true, ""]);
  });

  it("with takeLease a lease that is lost is asked for again, after 50 ms", () => {
    const { world } = controller(1, kFair, { ...kNamed, takeLease: true }, { grants: kHeld, ...answering(() => ok) });
    world.runMs(100);
    loseTo(world, "surgeon");
    world.runMs(25);
    assert.deepEqual([asked(world, "takeLease"), world.client.holds], [0, false]);
    world.runMs(50);
    assert.deepEqual([asked(world, "takeLease"), world.client.holds], [1, true]);
  });

  it("a lease is asked for as soon as there is room for one more request", () => {
    const { world } = controller(1, kFair, { ...kNamed, takeLease: true }, { grants: kHeld, ...answering(() => ok) });
    world.runMs(100);
    loseTo(world, "surgeon");
    world.weather = { ...kFair, loss: 1 };
    while (world.client.rearm());
    world.runMs(200);
    assert.deepEqual([world.client.takeLease(), world.client.giveLease(), asked(world, "takeLease")], [false, false, 0]);
    world.weather = kFair;
    loseTo(world, "surgeon");
    world.runMs(1500);
    assert.equal(world.client.holds, true);
  });

  it("a request that its session never answered is not awaited in the next", () => {
    const { world } = controller(1, kFair, { ...kNamed, takeLease: true }, { grants: kAnothers });
    const { server } = world;
    Object.assign(server.conduct, answering(() => {
      server.session!.close(Code.SHUTDOWN, "");
      return ok;
    }));
    assert.ok(world.runUntil(() => world.client.phase === "lost", 200));
    Object.assign(server.conduct, answering(() => ok));
    server.restart();
    world.runMs(500);
    assert.deepEqual([world.client.phase, asked(world, "takeLease"), world.client.holds], ["open", 2, true]);
    server.session!.close(Code.SHUTDOWN, "");
    world.runMs(20);
    assert.deepEqual([world.client.phase, world.client.holds], ["lost", false]);
  });

  it("another place's lease may be lost; a server may ask for nothing else", () => {
    const { world } = controller(1, kFair, kNamed, { grants: kHeld });
    world.runMs(100);
    loseTo(world, "surgeon", { device: 0, channel: 2 });
    loseTo(world, "surgeon", { device: 1, channel: 0 });
    assert.deepEqual([world.client.holds, world.client.stats().leaseLostTo], [true, ""]);
    world.server.session!.request({ kind: "rearm", device: 1 });
    world.runMs(50);
    const no = { code: Code.UNSUPPORTED, detail: "only a client can send this request" };
    assert.deepEqual(world.server.answers, [ok, ok, no]);
    assert.equal(world.client.phase, "open");
  });

  for (const onceMore of [busy(0), ok]) {
    const then = onceMore === ok ? "given once more" : "busy";
    it(`a lease gained and lost unheard is asked for again, once: ${then}`, () => {
      const { world } = controller(1, kFair, kNamed, { grants: kAnothers });
      const { server } = world;
      let asks = 0;
      Object.assign(server.conduct, answering(() => {
        if (++asks > 1) return onceMore;
        server.session!.request({ kind: "leaseLost", ...kPlace, to: "surgeon" });
        return ok;
      }));
      world.runMs(100);
      assert.equal(world.client.takeLease(), true);
      world.runMs(1000);
      assert.equal(asks, 2);
      assert.deepEqual([world.client.holds, world.client.stats().leaseLostTo], onceMore === ok ? [true, ""] : [false, "surgeon"]);
    });
  }

  it("a server that knows no leases leaves it the channel that it has", () => {
    const unknown = { code: Code.UNSUPPORTED, detail: "this version does not support this request" };
    const { seen, world } = controller(1, kFair, {}, answering(() => unknown));
    world.runMs(100);
    assert.equal(world.client.takeLease(), true);
    world.runMs(1000);
    assert.ok(world.client.holds && seen.length > 900);
  });

  it("a lease given up is gone at once; an earlier request for it is void", () => {
    const { seen, world } = controller(1, kFair, { ...kNamed, takeLease: true }, { grants: kHeld, ...answering(() => ok) });
    world.runMs(100);
    assert.equal(world.client.takeLease(), true);
    assert.equal(world.client.giveLease(), true);
    assert.equal(world.client.holds, false);
    const before = seen.length;
    world.runMs(500);
    assert.deepEqual([world.client.holds, seen.length], [false, before]);
    assert.deepEqual(world.server.requests.slice(1), [{ kind: "takeLease", ...kPlace }, { kind: "giveLease", ...kPlace }]);
    const waiting = controller(1, kFair, { ...kNamed, takeLease: true }, { grants: kAnothers, ...taken }).world;
    waiting.runMs(100);
    assert.equal(waiting.client.giveLease(), true);
    waiting.runMs(20);
    const last = asked(waiting, "takeLease");
    waiting.runMs(500);
    assert.deepEqual([asked(waiting, "takeLease"), asked(waiting, "giveLease")], [last, 1]);
    const idle = controller(1, kFair, kNamed, { grants: kAnothers, ...taken });
    assert.deepEqual([idle.world.client.takeLease(), idle.world.client.giveLease()], [false, false]);
  });
});

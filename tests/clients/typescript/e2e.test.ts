// SPDX-License-Identifier: Apache-2.0
// This test runs tendond, the compiled examples, and the bridge. TENDON_PROGRAMS is the folder that contains tendond.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createSocket } from "node:dgram";
import { chmodSync, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { describe, it, type TestContext } from "node:test";
import { WebSocket } from "ws";
import { Bridge } from "../../../clients/typescript/src/bridge.js";
import { concat, decodeHello, encodeAnswer } from "../../../clients/typescript/src/datagram.js";
import { encodeAnswerMessage, encodeFrame, encodeHead } from "../../../clients/typescript/src/codec.js";
import { Role } from "../../../clients/typescript/src/messages.js";
import {
  connect, distanceTo, Field, readClientKey, udp, webSocket, type DeviceState, type Guest, type Primitive,
} from "../../../clients/typescript/src/node.js";
import { PlainSeal } from "../../../clients/typescript/src/seal.js";
import { findTendond, kDemoScene, scene, startNode, startTendond, until } from "./support/program.js";
import { kRoot } from "./support/paths.js";
import { Random } from "./support/random.js";
import { kWelcome, Server } from "./support/world.js";

/** Returns whether the hand is inside the wall and is pushed out, in a line of echo_motion. */
function isPush(line: string): boolean {
  if (!line.includes('"tick"')) return false;
  const { position_m: position, force_n: force } = JSON.parse(line);
  return position[0] > 0.0005 && force[0] < -0.5;
}
const wall = ({ position }: DeviceState) => ({ x: position.x > 0 ? -2000 * position.x : 0, y: 0, z: 0 });

function guest(test: TestContext, made: Guest): Guest {
  test.after(() => made.stop());
  return made;
}
const inNode = (url: string) => webSocket(url, WebSocket as unknown as typeof globalThis.WebSocket);

describe("a TypeScript wall", () => {
  for (const options of [[], ["--rate-hz", "0", "--local-model"]]) {
    it(`is felt over UDP: virtual_wall ${options.join(" ")}`, async (test) => {
      const tendond = await startTendond(test);
      if (!tendond) return;
      const push = startNode(test, "examples/virtual_wall", "--server", tendond.address, "--json", ...options);
      const echo = startNode(test, "examples/echo_motion", "--server", tendond.address, "--json", "--rate-hz", "0");
      await echo.line(isPush);
      assert.equal(await echo.end("SIGINT"), 0);
      assert.equal(await push.end("SIGINT"), 0);
      const { summary } = JSON.parse(push.lines.at(-1)!);
      assert.equal(summary.sessions, 1);
      assert.ok(summary.forces > 0 && summary.forces <= summary.states);
      assert.equal(await tendond.program.end("SIGINT"), 0);
      const stopped = JSON.parse(tendond.program.lines.find((line) => line.includes('"stopped"'))!);
      assert.deepEqual([stopped.welcomed, stopped.invalid, stopped.fault], [2, 0, 0]);
      assert.ok(stopped.forces > 0);
    });
  }

  it("is felt through the bridge, whose page is a WebSocket", async (test) => {
    const tendond = await startTendond(test);
    if (!tendond) return;
    const bridge = startNode(test, "bridge_main", "--listen", "127.0.0.1:0", "--to", tendond.address, "--json");
    const { address } = JSON.parse(await bridge.line((line) => line.includes('"listening"')));
    const page = guest(test, connect(inNode(`ws://${address}`), { name: "page" }, { physics: wall }));
    const echo = startNode(test, "examples/echo_motion", "--server", tendond.address, "--json", "--rate-hz", "0");
    await echo.line(isPush);
    assert.equal(page.phase, "open");
    assert.equal(await bridge.end("SIGINT"), 0);
    const { to_server, to_page, malformed } = JSON.parse(bridge.lines.at(-1)!);
    assert.ok(to_server > 0 && to_page > 0 && malformed === 0);
  });
});

describe("a field", () => {
  it("that was uploaded is felt, and truths are sent while it is rendered", async (test) => {
    const channel = '\n[[channel]]\nname = "peg"\n[field]\nallow = ["peg"]\nmax_stiffness_n_per_m = 1500\n';
    const folder = mkdtempSync(join(tmpdir(), "tendon-field-"));
    test.after(() => rmSync(folder, { recursive: true }));
    writeFileSync(join(folder, "peg.toml"), readFileSync(kDemoScene, "utf8") + channel);
    const tendond = await startTendond(test, { scenes: [join(folder, "peg.toml")] });
    if (!tendond) return;
    const ball: Primitive = { kind: "sphere", centre: { x: 0.015, y: 0, z: 0 }, radius: 0.015 };
    const corner = (x: number) => ({ x, y: x, z: x });
    const field = Field.fromFunction((x) => distanceTo(ball, x), corner(-0.02), corner(0.036), 2);
    field.material("steel", { stiffness: 1000, friction: 0.3 });
    let [felt, truths, depth] = [0, 0, 0];
    const hand: Guest = guest(test, connect(udp(tendond.address), { channel: "peg", fields: true, rateHz: 100 }, {
      physics: (state) => {
        hand.pose({ position: { x: 0, y: 0, z: 0 }, turn: { w: 1, x: 0, y: 0, z: 0 } });
        if (hand.truth(state, { x: -1000 * Math.max(state.position.x, 0), y: 0, z: 0 })) ++truths;
        felt = Math.min(felt, state.forceApplied.x);
        depth = Math.max(depth, state.field?.depth ?? 0);
        return null;
      },
    }));
    hand.use(field);
    await until("the ball is felt", () => felt < -0.5 && truths > 100);
    assert.equal(hand.fieldRefused, "");
    assert.ok(depth > 0.5e-3, `${depth}`);
    field.material("steel", { stiffness: 1600 });
    hand.use(field);
    await until("a refusal", () => hand.fieldRefused.includes("stiffness = 1600: expected"));
  });
});

describe("of several", () => {
  it("a TypeScript wall is felt at the device that it names, and no other", async (test) => {
    const tendond = await startTendond(test, { scenes: [scene("left"), scene("right")] });
    if (!tendond) return;
    let felt = 0;
    const left = guest(test, connect(udp(tendond.address), { device: "left" }, {
      watch: ({ forceApplied: { x, y, z } }) => {
        felt = Math.max(felt, Math.hypot(x, y, z));
      },
    }));
    const at = ["--server", tendond.address, "--json", "--device", "right"];
    const push = startNode(test, "examples/virtual_wall", ...at);
    const echo = startNode(test, "examples/echo_motion", ...at, "--rate-hz", "0");
    await echo.line(isPush);
    await until("the device is described", () => left.description !== undefined);
    assert.deepEqual([left.description!.device, left.description!.name], [0, "left"]);
    assert.ok(left.stats().states > 0);
    assert.equal(felt, 0);
    assert.equal(await push.end("SIGINT"), 0);
    const nowhere = startNode(test, "examples/virtual_wall", "--server", tendond.address, "--device", "middle");
    assert.equal(await nowhere.end(), 1);
    assert.match(nowhere.lines.join("\n"), /refused the connection: there is no device "middle", only "left", "right"/);
  });

  it("a lease goes from a silent engine to a waiting one, then to the next", async (test) => {
    const tendond = await startTendond(test, { scenes: [scene("two-engines")] });
    if (!tendond) return;
    let silent = false;
    const first = guest(test, connect(udp(tendond.address), { channel: "tissue" }, {
      physics: (hand) => (silent ? { x: NaN, y: 0, z: 0 } : wall(hand)), // a force is not sent if it is not finite
    }));
    await until("the first holds it", () => first.holds && first.stats().forces > 0);
    const options = ["--server", tendond.address, "--channel", "tissue", "--take-lease"];
    const second = startNode(test, "examples/virtual_wall", ...options);
    await second.line((line) => line.includes("connected"));
    silent = true;
    await until("the first has lost it", () => first.stats().leaseLostTo === "virtual_wall");
    assert.deepEqual([first.holds, first.phase], [false, "open"]);
    const echo = startNode(test, "examples/echo_motion", "--server", tendond.address, "--json", "--rate-hz", "0");
    await echo.line(isPush);
    const third = guest(test, connect(udp(tendond.address), { channel: "tissue", takeLease: true }, { physics: wall }));
    await until("the third has come", () => third.description !== undefined);
    assert.deepEqual(third.description!.channels.map(({ name }) => name), ["wall", "tissue", "guidance"]);
    assert.equal(await second.end("SIGINT"), 0);
    await until("the third has it", () => third.holds && third.stats().forces > 0);
    assert.deepEqual([third.giveLease(), third.holds, third.takeLease()], [true, false, true]);
    await until("the third has it again", () => third.holds);
  });
});

describe("with a key", () => {
  it("a TypeScript wall is felt over UDP and the bridge; others are kept out", async (test) => {
    const folder = mkdtempSync(join(tmpdir(), "tendon-"));
    test.after(() => rmSync(folder, { recursive: true }));
    const tool = findTendond(test);
    if (!tool) return;
    if (!execFileSync(tool, ["--help"], { encoding: "utf8" }).includes("keygen")) return test.skip("tendond has no keys yet");
    const keys = join(folder, "wall.key");
    execFileSync(tool, ["keygen", "wall", "--out", keys], { stdio: "ignore" });
    const withKeys = join(folder, "scene.toml");
    writeFileSync(withKeys, `${readFileSync(kDemoScene, "utf8")}\n[network]\nkeys = "."\n`);
    const tendond = await startTendond(test, { scenes: [withKeys] });
    if (!tendond) return;

    const push = startNode(test, "examples/virtual_wall", "--server", tendond.address, "--key", keys, "--json");
    const look = ["--server", tendond.address, "--key", keys, "--json", "--rate-hz", "0"];
    await startNode(test, "examples/echo_motion", ...look).line(isPush);
    assert.equal(await push.end("SIGINT"), 0);

    const bridge = await Bridge.open({ listen: "127.0.0.1:0", to: tendond.address });
    test.after(() => bridge.close());
    const { key } = readClientKey(keys);
    guest(test, connect(inNode(`ws://${bridge.address}`), { name: "page", key }, { physics: wall }));
    await startNode(test, "examples/echo_motion", ...look).line(isPush);

    const another = join(folder, "another.key.of_nobody");
    execFileSync(tool, ["keygen", "another", "--out", another], { stdio: "ignore" });
    const stranger = startNode(test, "examples/echo_motion", "--server", tendond.address, "--key", another);
    await stranger.line((line) => line.includes("no answer"));
    const plain = startNode(test, "examples/echo_motion", "--server", tendond.address, "--duration-s", "3");
    assert.equal(await plain.end(), 1);
  });
});

describe("a guest", () => {
  it("waits for the server, and finds it again after it was killed", async (test) => {
    const first = await startTendond(test);
    if (!first) return;
    const here = guest(test, connect(udp(first.address), { retryMaxMs: 200 }, { watch: () => {} }));
    await until("open", () => here.phase === "open" && here.stats().states > 0);
    await first.program.end("SIGKILL");
    await until("lost", () => here.phase !== "open");
    await startTendond(test, { listen: first.address });
    await until("open again", () => here.phase === "open" && here.stats().sessions === 2);
  });

  it("prints a server's words so that they cannot forge a line", async (test) => {
    const server = createSocket("udp4");
    await new Promise<void>((resolve) => server.bind(0, "127.0.0.1", resolve));
    test.after(() => server.close());
    server.on("message", (datagram, from) => {
      const hello = decodeHello(datagram);
      if (!hello) return;
      const deviceName = "arm\n12:00 tendond: no limits\x1b[2J\x9b1A";
      const content = encodeAnswerMessage({ ...kWelcome, deviceName, features: [], role: Role.OBSERVER });
      server.send(encodeAnswer({ suite: 0, connectionId: 1, random: hello.random, content }), from.port);
    });
    const there = startNode(test, "examples/echo_motion", "--server", `127.0.0.1:${server.address().port}`);
    await there.line((line) => line.includes("connected to arm\\n12:00 tendond: no limits\\x1b[2J\\x9b1A at"));
  });

  it("after slow physics it sees the newest state, not the oldest that waits", async (test) => {
    const server = createSocket("udp4");
    await new Promise<void>((resolve) => server.bind(0, "127.0.0.1", resolve));
    test.after(() => server.close());
    let port = 0;
    server.on("message", (datagram, from) => {
      port = from.port;
      const hello = decodeHello(datagram);
      if (!hello) return;
      const content = encodeAnswerMessage({ ...kWelcome, features: [], role: Role.CONTROLLER });
      server.send(encodeAnswer({ suite: 0, connectionId: 1, random: hello.random, content }), from.port);
    });
    const { state } = new Server(new Random(1)).conduct;
    let number = 0n;
    const send = (): void => {
      const body = concat(encodeHead(number, undefined), encodeFrame({ kind: "state", value: state(++number) }));
      server.send(new PlainSeal().close(0n, 1, number, body), port, "127.0.0.1");
    };
    const seen: bigint[] = [];
    const here = guest(test, connect(udp(`127.0.0.1:${server.address().port}`), {}, {
      watch: ({ tick }) => {
        seen.push(tick);
        // 100 more states arrive while this callback runs. libuv reads 32 datagrams at once.
        if (seen.length === 1) for (let i = 0; i < 100; ++i) send();
      },
    }));
    await until("open", () => here.phase === "open");
    send();
    await until("it has seen all there is", () => here.stats().states >= 1 && seen.at(-1) === number);
    assert.deepEqual(seen, [1n, 101n]);
  });
});

describe("the programs", () => {
  const programs = ["examples/virtual_wall", "examples/echo_motion", "bridge_main"];

  it("have a --help with an example", async (test) => {
    for (const name of programs) {
      const program = startNode(test, name, "--help");
      assert.equal(await program.end(), 0);
      assert.match(program.lines.join("\n"), /Example: /);
    }
  });

  it("end with 2 for wrong usage and with 1 for a bad key, and say why", async (test) => {
    const folder = mkdtempSync(join(tmpdir(), "tendon-"));
    test.after(() => rmSync(folder, { recursive: true }));
    const open = join(folder, "open.key");
    writeFileSync(open, "controller bc795700d5499e7507c56d6b31e4ecb5f7869bc746395172bfa650b552994153\n");
    chmodSync(open, 0o644);
    const wrong: [string, string[], RegExp][] = [
      ["examples/virtual_wall", ["--server", "there"], /--server: expected HOST:PORT .* got "there"/],
      ["examples/virtual_wall", ["--server", "127.0.0.1:70000"], /--server.*127.0.0.1:70000/],
      ["examples/virtual_wall", ["--server", "[evil.example]:1"], /--server/],
      ["examples/virtual_wall", ["--stiffness-n-per-m", "nan"], /--stiffness-n-per-m: expected 0 to .* got "nan"/],
      ["examples/virtual_wall", ["--key", join(folder, "none")], /--key: .*none: .*no such file/],
      ["examples/virtual_wall", ["--key", open], /--key: .*other users can read or write this key/],
      ["examples/virtual_wall", ["--device", "d".repeat(25)], /--device: expected at most 24 bytes, got 25: "d+"/],
      ["examples/virtual_wall", ["--channel", "ä".repeat(13)], /--channel: expected at most 24 bytes, got 26: "ä+"/],
      ["examples/echo_motion", ["--rate-hz", "-1"], /rate-hz/],
      ["examples/echo_motion", ["--sevrer", "127.0.0.1:47100"], /--sevrer/],
      ["bridge_main", ["--listen", "here"], /expected HOST:PORT .* got "here"/],
      ["bridge_main", ["--listen", "192.0.2.1:0"], /cannot listen on 192.0.2.1:0/],
      ["bridge_main", ["--origin", "lab.example/page"], /--origin: expected an origin/],
      ["bridge_main", ["--max-peers", "0"], /--max-peers: expected a whole number/],
    ];
    const fails = /--key|cannot listen/;
    for (const [name, args, says] of wrong) {
      const program = startNode(test, name, ...args);
      const code = fails.test(says.source) ? 1 : 2;
      assert.equal(await program.end(), code, `${name} ${args.join(" ")}: ${program.lines.join("\n")}`);
      assert.match(program.lines.join("\n"), says);
    }
  });

  it("leave with exit code 1 when nobody has answered", async (test) => {
    const program = startNode(test, "examples/echo_motion", "--server", "127.0.0.1:9", "--duration-s", "0.2");
    assert.equal(await program.end(), 1);
    assert.match(program.lines.join("\n"), /was never connected/);
  });
});

describe("what is published", () => {
  const client = join(kRoot, "clients/typescript");

  it("has an index that knows nothing of Node", () => {
    const seen = new Set<string>();
    const check = (file: string): void => {
      if (seen.has(file)) return;
      seen.add(file);
      const text = readFileSync(join(client, "dist", file), "utf8");
      assert.doesNotMatch(text, /from "(node:|ws")/, file);
      for (const [, next] of text.matchAll(/from "(\.\.?\/.*?)"/g)) check(join(dirname(file), next!));
    };
    check("index.js");
    assert.ok(seen.size > 10);
  });

  it("has an example in its README that compiles, word for word", () => {
    const [, example] = /```ts\n([\s\S]*?)```/.exec(readFileSync(join(client, "README.md"), "utf8"))!;
    const file = join(client, "build/readme_example.ts");
    writeFileSync(file, example!);
    const options = ["--noEmit", "--strict", "--skipLibCheck", "--target", "es2022", "--module", "nodenext", "--types", "node"];
    execFileSync(process.execPath, [join(client, "node_modules/typescript/bin/tsc"), ...options, file], { stdio: "inherit" });
  });

  it("is what a stranger needs, and names no registry", () => {
    const lock = readFileSync(join(client, "package-lock.json"), "utf8");
    assert.doesNotMatch(lock, /"resolved"|https?:\/\/[^"]*registry/);
    const { name, exports, bin, scripts, files } = JSON.parse(readFileSync(join(client, "package.json"), "utf8"));
    assert.equal(name, "tendon-client");
    assert.ok(!("install" in scripts || "postinstall" in scripts || "preinstall" in scripts));
    assert.deepEqual(files, ["dist", "src"]);
    for (const { types, default: code } of Object.values<{ types: string; default: string }>(exports)) {
      assert.ok(existsSync(join(client, types)) && existsSync(join(client, code)), code);
    }
    assert.match(readFileSync(join(client, bin["tendon-bridge"]), "utf8"), /^#!\/usr\/bin\/env node\n/);
  });
});

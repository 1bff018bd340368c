// SPDX-License-Identifier: Apache-2.0
// Decodes and encodes the golden datagrams in protocol/vectors/golden.md.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { describe, it } from "node:test";
import {
  decodeAnswerMessage, decodeData, decodeHelloMessage, encodeAnswerMessage, encodeFrame, encodeHead, encodeHelloMessage,
  type DataContent,
} from "../../../clients/typescript/src/codec.js";
import {
  concat, DatagramType, decodeAnswer, decodeHeader, decodeHello, decodeRetry, encodeAnswer, encodeHello, encodeRetry,
  kHeaderSize,
} from "../../../clients/typescript/src/datagram.js";
import {
  Code, CouplingMethod, Hand, Mode, OutputKind, PortPhase, PortRole, reasonNames, Role, Safety, type Couple, type DeviceReport,
  type PeerReport, type PortGrip, type PortState, type PortTurn, type RateControl, type Request,
} from "../../../clients/typescript/src/messages.js";
import { PlainSeal } from "../../../clients/typescript/src/seal.js";
import { toHex } from "./support/bytes.js";
import { kRoot } from "./support/paths.js";

/** Parses the golden blocks. "00 x9" means nine zeros, and ";" is the beginning of a comment. */
function goldenDatagrams(page: string): Map<string, Uint8Array> {
  const found = new Map<string, Uint8Array>();
  for (const [, name, block] of page.matchAll(/^```golden (\S+)\n([\s\S]*?)^```$/gm)) {
    const words = block!.replace(/;.*$/gm, "").trim().split(/\s+/);
    const bytes: number[] = [];
    for (const word of words) {
      if (word.startsWith("x")) bytes.push(...new Array<number>(Number(word.slice(1)) - 1).fill(bytes.at(-1)!));
      else bytes.push(Number.parseInt(word, 16));
    }
    found.set(name!, Uint8Array.from(bytes));
  }
  return found;
}

const kGolden = goldenDatagrams(readFileSync(join(kRoot, "protocol/vectors/golden.md"), "utf8"));

function golden(name: string): Uint8Array {
  const bytes = kGolden.get(name);
  assert.ok(bytes, `golden.md has no datagram "${name}"`);
  return bytes;
}

function contentOf(name: string): DataContent {
  const content = decodeData(golden(name).subarray(kHeaderSize));
  assert.ok(content, `${name} does not decode`);
  assert.equal(content.invalid, 0);
  return content;
}

function roundTrip(datagram: Uint8Array): Uint8Array {
  const header = decodeHeader(datagram);
  assert.ok(header);
  switch (header.type) {
    case DatagramType.Hello: {
      const hello = decodeHello(datagram);
      const message = hello && decodeHelloMessage(hello.content);
      assert.ok(message);
      return encodeHello({ ...hello, content: encodeHelloMessage(message) });
    }
    case DatagramType.Retry: {
      const retry = decodeRetry(datagram);
      assert.ok(retry);
      return encodeRetry(retry);
    }
    case DatagramType.Answer: {
      const answer = decodeAnswer(datagram);
      const message = answer && decodeAnswerMessage(answer.content);
      assert.ok(message);
      return encodeAnswer({ ...answer, content: encodeAnswerMessage(message) });
    }
    case DatagramType.Data: {
      const content = decodeData(datagram.subarray(kHeaderSize));
      assert.ok(content);
      const body = concat(encodeHead(content.sent, content.echo), ...content.frames.map(encodeFrame));
      return new PlainSeal().close(0n, header.connectionId, header.packetNumber, body);
    }
  }
}

describe("golden.md", () => {
  it("has golden datagrams of every kind", () => {
    const expected = ["hello", "retry", "welcome", "refused", "keep-alive", "state", "force", "control", "control-ack", "bye",
      "report", "state-deadband"];
    for (const name of expected) golden(name);
  });

  it("states in columns, which this client does not ask for, are left out", () => {
    const content = contentOf("state-columns");
    assert.deepEqual(content.frames, []);
  });

  for (const [name, datagram] of kGolden) {
    if (decodeHeader(datagram)?.suite === 1) continue; // tested in vectors.test.ts
    if (name === "state-columns") continue;
    it(`${name}: decoding and encoding gives the very bytes of the page`, () => {
      assert.equal(toHex(roundTrip(datagram)), toHex(datagram));
    });
  }

  it("hello says what the page says", () => {
    const hello = decodeHello(golden("hello"))!;
    assert.deepEqual(decodeHelloMessage(hello.content), {
      versionMin: 1, versionMax: 1, role: Role.CONTROLLER, name: "wall", features: ["local-model"],
    });
  });

  it("welcome and refused say what the page says", () => {
    const welcome = decodeAnswer(golden("welcome"))!;
    assert.equal(welcome.connectionId, 0x11223344);
    assert.deepEqual(decodeAnswerMessage(welcome.content), {
      version: 1, features: ["local-model"], role: Role.CONTROLLER, deviceName: "simulated", maxForce: 8,
      positionResolution: 0, loopHz: 1000, timeoutMs: 2000, server: "tendond",
    });
    assert.deepEqual(decodeAnswerMessage(decodeAnswer(golden("refused"))!.content), {
      code: Code.BUSY, detail: "one controller", versionMin: 1, versionMax: 1,
    });
  });

  it("state says what the page says", () => {
    const { sent, echo, frames } = contentOf("state");
    assert.equal(sent, 1_000_100_000n);
    assert.deepEqual(echo, { sent: 5_000_000n, received: 999_000_000n, packetNumber: 3n, receivedMask: 5 });
    assert.deepEqual(frames, [{
      kind: "state",
      value: {
        tick: 1000n, sampledNs: 1_000_000_000n, position: { x: 0.01, y: 0, z: -0.02 }, velocity: { x: 0.5, y: 0, z: 0 },
        forceApplied: { x: -2, y: 0, z: 0 }, energy: 0.25, permittedForce: 8, reasons: 3, forceSequence: 99n,
        forceAgeNs: 1_500_000n, mode: Mode.ACTIVE, device: 0, channel: 0, buttons: 0,
      },
    }]);
    assert.deepEqual(reasonNames(3), ["energy", "max force"]);
  });

  it("state-buttons and control-ack-handle say what the page says", () => {
    const [state] = contentOf("state-buttons").frames;
    assert.ok(state?.kind === "state");
    assert.equal(state.value.buttons, 0b1001);
    const [ack] = contentOf("control-ack-handle").frames;
    assert.ok(ack?.kind === "controlAck" && ack.value.handle);
    assert.deepEqual(ack.value.handle, {
      device: 1, operatorFromDevice: { w: 0.5, x: -0.5, y: 0.5, z: 0.5 }, buttons: ["right", "forward", "centre", "left"],
      orientationMeasured: true, maxTorque: 0.125, gripperOpen: 0.5, maxGripperForce: 8, group: "arms", hand: Hand.RIGHT,
    });
  });

  it("state-joints and control-ack-joints say what the page says", () => {
    const [state] = contentOf("state-joints").frames;
    assert.ok(state?.kind === "state");
    assert.deepEqual(state.value.joints, { angles: [0.5, -0.25, 1.5], velocities: [0.125, 0, -2] });
    const [ack] = contentOf("control-ack-joints").frames;
    assert.ok(ack?.kind === "controlAck");
    assert.deepEqual(ack.value.handle?.joints, ["turntable", "upper arm", "forearm"]);
  });

  it("state-handle and force-torque say what the page says", () => {
    const [state] = contentOf("state-handle").frames;
    assert.ok(state?.kind === "state");
    const { buttons, turning, torqueApplied, grip, gripApplied, handForce } = state.value;
    assert.deepEqual({ buttons, turning, torqueApplied, grip, gripApplied, handForce }, {
      buttons: 1,
      turning: { orientation: { w: 0.6, x: 0, y: 0.8, z: 0 }, angularVelocity: { x: 0, y: 1.5, z: 0 } },
      torqueApplied: { x: 0, y: -0.0625, z: 0 }, grip: { opening: 0.25, velocity: -0.5 }, gripApplied: 0.75,
      handForce: { x: 1.5, y: 0, z: -0.25 },
    });
    const [force] = contentOf("force-torque").frames;
    assert.ok(force?.kind === "force");
    assert.deepEqual(force.value.torque, {
      torque: { x: 0, y: -0.0625, z: 0 },
      model: { at: { w: 0.6, x: 0, y: 0.8, z: 0 }, stiffness: [0, 0.25, 0] },
    });
    assert.equal(force.value.gripForce, 0.75);
  });

  it("report says what the page says", () => {
    const [frame] = contentOf("report").frames;
    assert.ok(frame?.kind === "report");
    const report = frame.value;
    assert.deepEqual([report.number, report.untilNs, report.spanNs, report.forces], [3n, 1_000_000_000n, 1_000_000_000n, 97n]);
    assert.deepEqual([report.lateServer, report.lateNetwork, report.lateEngine], [0n, 2n, 1n]);
    assert.deepEqual([report.worstLateNs, report.longestGapNs], [75_000_000n, 90_000_000n]);
    assert.deepEqual(report.roundTrip, { medianNs: 41_000_000n, p99Ns: 131_000_000n });
    assert.deepEqual(report.toServer, { medianNs: 20_500_000n, p99Ns: 110_000_000n });
    assert.deepEqual(report.toClient, { medianNs: 20_500_000n, p99Ns: 22_000_000n });
    assert.deepEqual([report.clockOffsetNs, report.clockDriftPpm, report.clockErrorNs], [-5_000_000n, 16, 250_000n]);
    assert.deepEqual([report.received, report.lost, report.reordered, report.duplicated], [3000n, 12n, 1n, 0n]);
    assert.match(report.words, /^forces were late 3 times, .* usually 41 ms\)$/);
  });

  it("state-wanted says what the page says", () => {
    const [frame] = contentOf("state-wanted").frames;
    assert.ok(frame?.kind === "state");
    assert.deepEqual(frame.value.forceWanted, { x: -8, y: 0, z: 0.5 });
    assert.deepEqual(frame.value.stiffnessWanted, [800, 0, 0]);
  });

  const kDeviceReport: DeviceReport = {
    number: 7n, untilNs: 1_000_000_000n, spanNs: 1_000_000_000n, device: 1, steps: 990n, missed: 10n, overruns: 2n, unseen: 1n,
    lateness: [3, 0, 0, 0, 0, 0, 981, 0, 0, 0, 0, 0, 0, 3].map(BigInt), safety: Safety.FAULT,
    fault: "the handle was faster than a hand", degraded: "the log thread does not follow",
  };

  function peerReport(): PeerReport {
    const [frame] = contentOf("peer-report").frames;
    assert.ok(frame?.kind === "peerReport");
    return frame.value;
  }

  it("device-report says what the page says", () => {
    assert.deepEqual(contentOf("device-report").frames, [{ kind: "deviceReport", value: kDeviceReport }]);
  });

  it("peer-report says what the page says", () => {
    const { link, ...rest } = peerReport();
    assert.deepEqual(rest, { device: 1, channel: 1, name: "wall", stateOneIn: 4, forcesRefused: true });
    const [report] = contentOf("report").frames;
    assert.ok(report?.kind === "report");
    assert.deepEqual(link, report.value);
  });

  it("an engine that says its ways is read as the page has it", () => {
    const hello = decodeHelloMessage(decodeHello(golden("hello-ways"))!.content);
    assert.deepEqual([hello?.features, hello?.ways], [["local-model", "ways"], ["tabulated", "near"]]);
    const [force] = contentOf("force-way").frames;
    assert.ok(force?.kind === "force");
    assert.deepEqual([force.value.error, force.value.way], [0.125, 2]);
    const [report] = contentOf("peer-report-way").frames;
    assert.ok(report?.kind === "peerReport");
    assert.deepEqual([report.value.error, report.value.way], [0.125, "near"]);
  });

  it("a report out of bounds is left out and counted", () => {
    const link = peerReport().link;
    const devices: Partial<DeviceReport>[] = [
      { number: 0n }, { untilNs: 2n ** 60n + 1n }, { spanNs: 2n ** 60n + 1n }, { device: 16 }, { steps: 986n }, { overruns: 991n },
      { unseen: 991n }, { lateness: new Array<bigint>(25).fill(1n) }, { safety: 0 as Safety }, { safety: 9 as Safety },
    ];
    const peers: Partial<PeerReport>[] = [
      { device: 16 }, { channel: 8 }, { stateOneIn: 0 }, { stateOneIn: 1001 }, { link: { ...link, number: 0n } },
      { error: -0.1 }, { error: NaN },
    ];
    const frames = [
      ...devices.map((change) => encodeFrame({ kind: "deviceReport", value: { ...kDeviceReport, ...change } })),
      ...peers.map((change) => encodeFrame({ kind: "peerReport", value: { ...peerReport(), ...change } })),
    ];
    for (const [i, frame] of frames.entries()) {
      const good = encodeFrame({ kind: "deviceReport", value: kDeviceReport });
      const content = decodeData(concat(encodeHead(1n, undefined), frame, good));
      assert.equal(content?.invalid, 1, `frame ${i}`);
      assert.equal(content?.frames.length, 1, `frame ${i}`);
    }
  });

  const kPort: PortState = {
    device: 1, channel: 1, epoch: 5n, sequence: 1000n, answersEpoch: 3n, answers: 960n, timeNs: 1_000_000_000n,
    roundTripNs: 40_000_000n, phase: PortPhase.ENGAGED, engagement: 2n, buttons: 2, position: { x: 0.01, y: 0, z: -0.02 },
    velocity: { x: 0.5, y: 0, z: 0 }, force: { x: -0.75, y: 0, z: 0 }, account: 0.125, need: 0.0625, given: 1.5, taken: 0.5,
  };
  const kCouple: Couple = {
    device: 1, channel: 1, role: PortRole.FOLLOWER, method: CouplingMethod.POSITION_FORCE, positionScale: 0.5, forceScale: 2,
    rotation: { w: 0.6, x: 0, y: 0.8, z: 0 }, axes: 5, stiffness: 400, mutualDamping: 2, damping: 4, adaptToDelay: true,
    purse: true, periodUs: 1000,
  };

  const kTurn: PortTurn = {
    turn: { w: 0.6, x: 0, y: 0.8, z: 0 }, angularVelocity: { x: 0, y: 0.25, z: 0 }, torque: { x: 0, y: -0.5, z: 0 },
  };
  const kGrip: PortGrip = { opening: 0.0625, velocity: -0.125, force: 2, account: -0.25, need: 0.5, given: 0.75, taken: 1.25 };
  const kRate: RateControl = { deadZone: 0.125, gain: 2.5, maxSpeed: 0.75 };

  it("port, port-contact, port-model and port-all say what the page says", () => {
    assert.deepEqual(contentOf("port").frames, [{ kind: "port", value: kPort }]);
    const value = { ...kPort, contactForce: { x: -2, y: 0, z: 0.5 }, account: -0.25, need: 0, given: 0, taken: 0 };
    assert.deepEqual(contentOf("port-contact").frames, [{ kind: "port", value }]);
    const model = {
      ...value, waveIntegral: { x: 0.25, y: 0, z: -1 }, waveEnergy: 0.5,
      surface: { normal: { x: 0, y: 0.6, z: 0.8 }, offset: -0.125, stiffness: 500 },
    };
    assert.deepEqual(contentOf("port-model").frames, [{ kind: "port", value: model }]);
    const all = {
      ...model, phase: PortPhase.ALIGNING, turn: kTurn, grip: kGrip, energyIn: 3.5, share: 0.25, positionScale: 0.5, forceScale: 2,
      ofPeer: true,
    };
    assert.deepEqual(contentOf("port-all").frames, [{ kind: "port", value: all }]);
  });

  it("a share of nothing is not the same as none", () => {
    for (const port of [kPort, { ...kPort, share: 0 }]) {
      const content = decodeData(concat(encodeHead(1n, undefined), encodeFrame({ kind: "port", value: port })));
      assert.deepEqual(content?.frames, [{ kind: "port", value: port }]);
    }
  });

  it("couple, engage, disengage, scales and shares say what the page says", () => {
    const requestOf = (name: string): unknown => contentOf(name).frames.map((frame) => frame.kind === "control" && frame.value);
    assert.deepEqual(requestOf("control-couple"), [{ id: 15, request: { kind: "couple", ...kCouple } }]);
    const all = {
      ...kCouple, method: CouplingMethod.RATE, absolute: true, turnStiffness: 0.5, turnDamping: 0.0625, gripStiffness: 200,
      gripDamping: 1.5, driftRate: 0.25, rate: kRate,
    };
    assert.deepEqual(requestOf("control-couple-all"), [{ id: 20, request: { kind: "couple", ...all } }]);
    const scales = { kind: "setScale", device: 1, positionScale: 0.25, forceScale: 4 };
    assert.deepEqual(requestOf("control-set-scale"), [{ id: 21, request: scales }]);
    assert.deepEqual(requestOf("control-set-share"), [{ id: 22, request: { kind: "setShare", device: 1, channel: 1, share: 0.75 } }]);
    assert.deepEqual(requestOf("control-engage"), [{ id: 16, request: { kind: "engage", device: 1 } }]);
    assert.deepEqual(requestOf("control-disengage"), [{ id: 17, request: { kind: "disengage", device: 1 } }]);
  });

  it("lamp, pulse and outputs say what the page says", () => {
    const requestOf = (name: string): unknown => contentOf(name).frames.map((frame) => frame.kind === "control" && frame.value);
    assert.deepEqual(requestOf("control-set-output-lamp"),
      [{ id: 18, request: { kind: "setOutput", device: 1, output: 0, setting: { rgb: 0xff8000 } } }]);
    const setting = { amplitude: 0.5, frequency: 200, durationMs: 40 };
    assert.deepEqual(requestOf("control-set-output-vibration"),
      [{ id: 19, request: { kind: "setOutput", device: 1, output: 1, setting } }]);
    const [ack] = contentOf("control-ack-outputs").frames;
    const outputs = [{ name: "ring", kind: OutputKind.LAMP }, { name: "tip", kind: OutputKind.VIBRATION }];
    assert.deepEqual(ack?.kind === "controlAck" && ack.value.handle?.outputs, outputs);
  });

  it("a port or a couple out of bounds is left out and counted", () => {
    const ports: Partial<PortState>[] = [
      { device: 16 }, { channel: 8 }, { epoch: 0n }, { sequence: 0n }, { timeNs: 2n ** 60n + 1n }, { roundTripNs: 10_000_000_001n },
      { phase: 0 as PortPhase }, { phase: 8 as PortPhase }, { position: { x: NaN, y: 0, z: 0 } }, { velocity: { x: 0, y: Infinity, z: 0 } },
      { force: { x: 0, y: 0, z: 1.1e12 } }, { contactForce: { x: NaN, y: 0, z: 0 } }, { account: 1000.1 }, { account: -1000.1 },
      { account: NaN }, { need: -0.1 }, { need: 1000.1 }, { given: -0.1 }, { given: 1e6 + 1 }, { taken: -0.1 }, { taken: Infinity },
      { waveIntegral: { x: NaN, y: 0, z: 0 } }, { waveEnergy: -0.1 }, { waveEnergy: 1e6 + 1 },
      { surface: { normal: { x: 0, y: 0.6, z: 0.802 }, offset: 0, stiffness: 1 } },
      { surface: { normal: { x: 0, y: 0.6, z: 0.8 }, offset: 1.1e12, stiffness: 1 } },
      { surface: { normal: { x: 0, y: 0.6, z: 0.8 }, offset: 0, stiffness: -1 } },
      { turn: { ...kTurn, turn: { w: 0.602, x: 0, y: 0.8, z: 0 } } }, { turn: { ...kTurn, angularVelocity: { x: NaN, y: 0, z: 0 } } },
      { turn: { ...kTurn, torque: { x: 0, y: Infinity, z: 0 } } }, { grip: { ...kGrip, opening: NaN } },
      { grip: { ...kGrip, velocity: Infinity } }, { grip: { ...kGrip, force: 1.1e12 } }, { grip: { ...kGrip, account: -1000.1 } },
      { grip: { ...kGrip, need: -0.1 } }, { grip: { ...kGrip, given: 1e6 + 1 } }, { grip: { ...kGrip, taken: -0.1 } },
      { energyIn: -0.1 }, { energyIn: 1e6 + 1 }, { share: -0.001 }, { share: 1.001 }, { share: NaN }, { positionScale: 0.0099 },
      { positionScale: -1 }, { forceScale: 100.1 }, { forceScale: NaN },
    ];
    const couples: Partial<Couple>[] = [
      { device: 16 }, { channel: 8 }, { role: 0 as PortRole }, { role: 3 as PortRole }, { method: 0 as CouplingMethod },
      { method: 8 as CouplingMethod }, { positionScale: 0.0099 }, { positionScale: NaN }, { forceScale: 100.1 },
      { rotation: { w: 0.602, x: 0, y: 0.8, z: 0 } }, { axes: 0 }, { axes: 8 }, { stiffness: -1 }, { mutualDamping: Infinity },
      { damping: NaN }, { periodUs: 0 }, { periodUs: 10_000_001 }, { turnStiffness: -1 }, { turnDamping: Infinity },
      { gripStiffness: NaN }, { gripDamping: -1 }, { driftRate: 1.1e12 }, { rate: { ...kRate, deadZone: -1 } },
      { rate: { ...kRate, gain: 0 } }, { rate: { ...kRate, maxSpeed: 0 } }, { rate: { ...kRate, maxSpeed: Infinity } },
    ];
    const requests: Request[] = [
      { kind: "setScale", device: 16, positionScale: 1, forceScale: 1 }, { kind: "setScale", device: 1, positionScale: 0.0099, forceScale: 1 },
      { kind: "setScale", device: 1, positionScale: 1, forceScale: NaN }, { kind: "setShare", device: 16, channel: 1, share: 0.5 },
      { kind: "setShare", device: 1, channel: 8, share: 0.5 }, { kind: "setShare", device: 1, channel: 1, share: 1.001 },
    ];
    const frames = [
      ...ports.map((change) => encodeFrame({ kind: "port", value: { ...kPort, ...change } })),
      ...couples.map((change) =>
        encodeFrame({ kind: "control", value: { id: 0, request: { kind: "couple", ...kCouple, ...change } } })),
      ...requests.map((request) => encodeFrame({ kind: "control", value: { id: 0, request } })),
    ];
    const good = encodeFrame({ kind: "port", value: kPort });
    for (const [i, frame] of frames.entries()) {
      const content = decodeData(concat(encodeHead(1n, undefined), frame, good));
      assert.equal(content?.invalid, 1, `frame ${i}`);
      assert.deepEqual(content?.frames, [{ kind: "port", value: kPort }], `frame ${i}`);
    }
    // A request with an id must be answered.
    for (const request of [...couples.map((change): Request => ({ kind: "couple", ...kCouple, ...change })), ...requests]) {
      const frame = encodeFrame({ kind: "control", value: { id: 7, request } });
      const content = decodeData(concat(encodeHead(1n, undefined), frame, good));
      const [control] = content?.frames ?? [];
      assert.ok(control?.kind === "control");
      assert.deepEqual([content?.invalid, content?.frames.length, control.value.id], [1, 2, 7]);
      assert.equal(control.value.request, undefined);
      assert.ok(control.value.invalid, JSON.stringify(request, (_, value) => (typeof value === "bigint" ? `${value}` : value)));
    }
  });

  it("state-deadband says what the page says", () => {
    assert.deepEqual(contentOf("state-deadband").frames, [{
      kind: "control",
      value: { id: 9, request: { kind: "setStateDeadband", share: 0.1, floor: 0.001, maxSilenceUs: 20_000 } },
    }]);
  });

  it("force says what the page says", () => {
    assert.deepEqual(contentOf("force").frames, [{
      kind: "force",
      value: {
        sequence: 100n, basedOnTick: 1000n, force: { x: -2, y: 0, z: 0 },
        model: { at: { x: 0.01, y: 0, z: 0 }, stiffness: [2000, 0, 0] }, validForUs: 20_000,
        device: 0, channel: 0,
      },
    }]);
  });

  it("force-with-all says what the page says", () => {
    const [frame] = contentOf("force-with-all").frames;
    assert.ok(frame?.kind === "force");
    const { model, topologyChanged, error } = frame.value;
    assert.deepEqual([topologyChanged, error], [true, 0.125]);
    assert.deepEqual(model, {
      at: { x: 0.01, y: 0, z: 0 }, stiffness: [2000, 0, 0], validRadius: 0.0025,
      contact: {
        normal: { x: -1, y: 0, z: 0 }, gap: -0.002, table: { first: -0.002, step: 0.001, force: [0, 0.75, 2, 3.5] },
      },
    });
  });

  it("control, its answer and bye say what the page says", () => {
    const request = { kind: "setStateRate", hz: 500, device: 0 };
    assert.deepEqual(contentOf("control").frames, [{ kind: "control", value: { id: 7, request } }]);
    const acknowledged = { id: 7, code: Code.OK, detail: "500 Hz" };
    assert.deepEqual(contentOf("control-ack").frames, [{ kind: "controlAck", value: acknowledged }]);
    assert.deepEqual(contentOf("bye").frames, [{ kind: "bye", value: { code: Code.SHUTDOWN, reason: "SIGTERM" } }]);
  });
});

describe("tendon_pb.ts", () => {
  it("is what protoc makes of tendon.proto", (test) => {
    const client = join(kRoot, "clients/typescript");
    const folder = mkdtempSync(join(tmpdir(), "tendon-"));
    try {
      execFileSync("protoc", [
        `-I${join(kRoot, "protocol/wire")}`, `--plugin=${join(client, "node_modules/.bin/protoc-gen-es")}`, `--es_out=${folder}`,
        "--es_opt=target=ts,import_extension=js", "tendon.proto",
      ]);
      const made = readFileSync(join(folder, "tendon_pb.ts"), "utf8");
      const committed = readFileSync(join(client, "src/gen/tendon_pb.ts"), "utf8");
      assert.ok(made === committed, "stale; run protocol/generate");
    } catch (error) {
      if ((error as NodeJS.ErrnoException).code !== "ENOENT") throw error;
      test.skip("protoc is not installed");
    } finally {
      rmSync(folder, { recursive: true });
    }
  });
});

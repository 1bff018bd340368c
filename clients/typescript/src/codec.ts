// SPDX-License-Identifier: Apache-2.0
// Values to protobuf and back: no file but this one, codec_*.ts and fields.ts knows the generated messages.
// Encoding trusts its input, except that texts and lists are cut to their bounds. Decoding trusts nothing: undefined for
// what it refuses, and never throws.
import { create, fromBinary, toBinary, type DescMessage, type MessageShape } from "@bufbuild/protobuf";
import {
  isBounded, isChannel, isDevice, isError, isLength, isMagnitude, isModel, isRotation, isRotationModel, isStiffness, isTime,
  isVec3,
} from "./bounds.js";
import {
  readDeviceReport, readPeerReport, readReport, writeDeviceReport, writePeerReport, writeReport,
} from "./codec_reports.js";
import { isSetScale, isSetShare, readCouple, readPort, writeCouple, writePort } from "./codec_ports.js";
import {
  areFeatures, clip, isEnum, isText, readQuat, readVec3, writeFeatures, writeQuat, writeVec3,
} from "./fields.js";
import * as pb from "./gen/tendon_pb.js";
import * as limits from "./limits.js";
import type {
  Claim, Contact, DeviceDescription, DeviceReport, DeviceState, ForceCommand, Grant, HandleDescription, Hello, LampColour,
  LinkReport, LocalModel, OutputDescription, PeerReport, PortState, Refused, Request, SetOutput, Torque, Vibration, Welcome,
} from "./messages.js";
import type { Nanoseconds } from "./time.js";

/** The newest datagram received from the peer, reported back to it. */
export interface Echo {
  /** T1: when it was sent, on its sender's clock. */
  readonly sent: Nanoseconds;
  /** T2: when it arrived, on its receiver's clock. */
  readonly received: Nanoseconds;
  readonly packetNumber: bigint;
  /** Bit i: packet (packetNumber − 1 − i) has arrived too. */
  readonly receivedMask: number;
}

export interface Control {
  readonly id: number;
  /** Absent: a request that this version does not know. */
  readonly request?: Request | undefined;
}
export interface ControlAck {
  readonly id: number;
  readonly code: pb.Code;
  readonly detail: string;
  /** With BUSY of takeLease; 0 = nobody knows. */
  readonly waitMs?: number | undefined;
  /** With OK of describe. */
  readonly device?: DeviceDescription | undefined;
  /** With OK of describe that asks for the handle. */
  readonly handle?: HandleDescription | undefined;
}
export interface Bye {
  readonly code: pb.Code;
  readonly reason: string;
}

export type Frame =
  | { readonly kind: "state"; readonly value: DeviceState }
  | { readonly kind: "force"; readonly value: ForceCommand }
  | { readonly kind: "control"; readonly value: Control }
  | { readonly kind: "controlAck"; readonly value: ControlAck }
  | { readonly kind: "bye"; readonly value: Bye }
  | { readonly kind: "report"; readonly value: LinkReport }
  | { readonly kind: "deviceReport"; readonly value: DeviceReport }
  | { readonly kind: "peerReport"; readonly value: PeerReport }
  | { readonly kind: "port"; readonly value: PortState };

/** What a Data datagram holds. */
export interface DataContent {
  readonly sent: Nanoseconds;
  readonly echo: Echo | undefined;
  /** In the order of the datagram, every value within bounds. */
  readonly frames: readonly Frame[];
  /** Frames and echoes left out because a value was out of bounds. */
  readonly invalid: number;
}

// ---- Data. Protobuf defines the concatenation of two messages as their merge, so a datagram is written piece by piece.

/** The first piece of a Data body. */
export function encodeHead(sent: Nanoseconds, echo: Echo | undefined): Uint8Array {
  const head: pb.Datagram = create(pb.DatagramSchema, { txTimeNs: sent });
  if (echo) {
    head.echo = create(pb.EchoSchema, {
      peerTxTimeNs: echo.sent,
      rxTimeNs: echo.received,
      peerPacketNumber: echo.packetNumber,
      receivedMask: echo.receivedMask,
    });
  }
  return toBinary(pb.DatagramSchema, head);
}

/** A further piece of a Data body: one frame. */
export const encodeFrame = (frame: Frame): Uint8Array =>
  toBinary(pb.DatagramSchema, create(pb.DatagramSchema, { frames: [{ body: writeBody(frame) }] }));

/** Undefined when the body is malformed: not protobuf, too many frames, or without a usable time. */
export function decodeData(body: Uint8Array): DataContent | undefined {
  const datagram = parse(pb.DatagramSchema, body);
  if (!datagram || datagram.frames.length > limits.kMaxFrames || !isTime(datagram.txTimeNs)) return undefined;
  const frames: Frame[] = [];
  let invalid = 0;
  for (const { body } of datagram.frames) {
    if (body.case === undefined || body.case === "states") continue; // of a newer peer, or not asked for
    const frame = readBody(body);
    if (frame) frames.push(frame);
    else ++invalid;
  }
  const echo = datagram.echo && readEcho(datagram.echo);
  if (datagram.echo && !echo) ++invalid;
  return { sent: datagram.txTimeNs, echo, frames, invalid };
}

// ---- Handshake

export const encodeHelloMessage = (hello: Hello): Uint8Array =>
  toBinary(pb.HelloSchema, create(pb.HelloSchema, {
    versionMin: hello.versionMin,
    versionMax: hello.versionMax,
    role: hello.role,
    name: clip(hello.name, limits.kMaxName),
    features: writeFeatures(hello.features),
    claims: (hello.claims ?? []).slice(0, limits.kMaxClaims).map(({ device, channel, role }) =>
      create(pb.ClaimSchema, { device: clip(device, limits.kMaxLabel), channel: clip(channel, limits.kMaxLabel), role })),
    ways: (hello.ways ?? []).slice(0, limits.kMaxWays).map((way) => clip(way, limits.kMaxLabel)),
  }));

export function decodeHelloMessage(bytes: Uint8Array): Hello | undefined {
  const hello = parse(pb.HelloSchema, bytes);
  if (!hello) return undefined;
  const { versionMin, versionMax, role, name, features, ways } = hello;
  const claims = hello.claims.map(({ device, channel, role }): Claim => ({ device, channel, role }));
  const good = versionMin >= 1 && versionMin <= versionMax && isEnum(role, pb.RoleSchema) &&
    isText(name, limits.kMaxName) && areFeatures(features) && claims.length <= limits.kMaxClaims &&
    claims.every(({ device, channel, role }) =>
      isText(device, limits.kMaxLabel) && isText(channel, limits.kMaxLabel) && isEnum(role, pb.RoleSchema)) &&
    ways.length <= limits.kMaxWays && ways.every((way) => isText(way, limits.kMaxLabel));
  return good
    ? { versionMin, versionMax, role, name, features, ...(claims.length && { claims }), ...(ways.length && { ways }) }
    : undefined;
}

export function encodeAnswerMessage(answer: Welcome | Refused): Uint8Array {
  const body: pb.Answer["body"] = "code" in answer
    ? { case: "refused", value: create(pb.RefusedSchema, { ...answer, detail: clip(answer.detail, limits.kMaxDetail) }) }
    : { case: "welcome", value: writeWelcome(answer) };
  return toBinary(pb.AnswerSchema, create(pb.AnswerSchema, { body }));
}

export function decodeAnswerMessage(bytes: Uint8Array): Welcome | Refused | undefined {
  const body = parse(pb.AnswerSchema, bytes)?.body;
  switch (body?.case) {
    case "welcome":
      return readWelcome(body.value);
    case "refused": {
      const { code, detail, versionMin, versionMax } = body.value;
      const good = isEnum(code, pb.CodeSchema) && isText(detail, limits.kMaxDetail);
      return good ? { code, detail, versionMin, versionMax } : undefined;
    }
    default:
      return undefined;
  }
}

function parse<Schema extends DescMessage>(schema: Schema, bytes: Uint8Array): MessageShape<Schema> | undefined {
  try {
    return fromBinary(schema, bytes, { readUnknownFields: false });
  } catch {
    return undefined;
  }
}

// ---- Messages

type Body = Exclude<pb.Frame["body"], { case: undefined } | { case: "states" }>;

function readBody(body: Body): Frame | undefined {
  switch (body.case) {
    case "state": {
      const value = readState(body.value);
      return value && { kind: "state", value };
    }
    case "force": {
      const value = readForce(body.value);
      return value && { kind: "force", value };
    }
    case "control": {
      const { id, op } = body.value;
      const request = readRequest(op);
      const isLost = kBounded.has(op.case) && !request; // it is known, and out of bounds
      const good = id > 0 && !isLost && (!request || isRequest(request));
      return good ? { kind: "control", value: { id, request } } : undefined;
    }
    case "controlAck": {
      const { id, code, detail, waitMs } = body.value;
      const device = body.value.device && readDescription(body.value.device);
      const handle = body.value.handle && readHandle(body.value.handle);
      const good = id > 0 && isEnum(code, pb.CodeSchema) && isText(detail, limits.kMaxDetail) &&
        waitMs <= limits.kMaxTimeoutMs && (device !== undefined || !body.value.device) &&
        (handle !== undefined || !body.value.handle);
      if (!good) return undefined;
      const described = { ...(device && { device }), ...(handle && { handle }) };
      return { kind: "controlAck", value: { id, code, detail, ...(waitMs && { waitMs }), ...described } };
    }
    case "bye": {
      const { code, reason } = body.value;
      const good = isEnum(code, pb.CodeSchema) && isText(reason, limits.kMaxDetail);
      return good ? { kind: "bye", value: { code, reason } } : undefined;
    }
    case "report": {
      const value = readReport(body.value);
      return value && { kind: "report", value };
    }
    case "deviceReport": {
      const value = readDeviceReport(body.value);
      return value && { kind: "deviceReport", value };
    }
    case "peerReport": {
      const value = readPeerReport(body.value);
      return value && { kind: "peerReport", value };
    }
    case "portState": {
      const value = readPort(body.value);
      return value && { kind: "port", value };
    }
  }
}

function writeBody(frame: Frame): Body {
  switch (frame.kind) {
    case "state":
      return { case: "state", value: writeState(frame.value) };
    case "force":
      return { case: "force", value: writeForce(frame.value) };
    case "control":
      return { case: "control", value: create(pb.ControlSchema, { id: frame.value.id, op: writeRequest(frame.value.request) }) };
    case "controlAck": {
      const { id, code, detail, waitMs, device, handle } = frame.value;
      const ack = create(pb.ControlAckSchema, { id, code, detail: clip(detail, limits.kMaxDetail), waitMs: waitMs ?? 0 });
      if (device) ack.device = writeDescription(device);
      if (handle) ack.handle = writeHandle(handle);
      return { case: "controlAck", value: ack };
    }
    case "bye": {
      const { code, reason } = frame.value;
      return { case: "bye", value: create(pb.ByeSchema, { code, reason: clip(reason, limits.kMaxDetail) }) };
    }
    case "report":
      return { case: "report", value: writeReport(frame.value) };
    case "deviceReport":
      return { case: "deviceReport", value: writeDeviceReport(frame.value) };
    case "peerReport":
      return { case: "peerReport", value: writePeerReport(frame.value) };
    case "port":
      return { case: "portState", value: writePort(frame.value) };
  }
}

function readEcho(from: pb.Echo): Echo | undefined {
  if (!isTime(from.peerTxTimeNs) || !isTime(from.rxTimeNs)) return undefined;
  return {
    sent: from.peerTxTimeNs,
    received: from.rxTimeNs,
    packetNumber: from.peerPacketNumber,
    receivedMask: from.receivedMask,
  };
}

/** What only a client with the feature `handle` is told, but for the buttons. */
function readHandleOf(from: pb.DeviceState): Partial<DeviceState> {
  const { orientation, angularVelocityRadps, torqueAppliedNm, gripperRad, gripperForceAppliedN, handForceN } = from;
  return {
    ...(orientation && { turning: { orientation: readQuat(orientation), angularVelocity: readVec3(angularVelocityRadps) } }),
    ...(torqueAppliedNm && { torqueApplied: readVec3(torqueAppliedNm) }),
    ...(gripperRad !== undefined && { grip: { opening: gripperRad, velocity: from.gripperVelocityRadps ?? 0 } }),
    ...(gripperForceAppliedN !== undefined && { gripApplied: gripperForceAppliedN }),
    ...(handForceN && { handForce: readVec3(handForceN) }),
  };
}

/** What only a client with the feature `joints` is told. */
function readJoints({ jointRad: angles, jointVelocityRadps: told }: pb.DeviceState): Partial<DeviceState> {
  return angles.length > 0 ? { joints: { angles, velocities: angles.map((_, i) => told[i] ?? 0) } } : {};
}

function readState(from: pb.DeviceState): DeviceState | undefined {
  const state: DeviceState = {
    tick: from.tick,
    sampledNs: from.sampledNs,
    position: readVec3(from.positionM),
    velocity: readVec3(from.velocityMps),
    forceApplied: readVec3(from.forceAppliedN),
    energy: from.energyJ,
    permittedForce: from.permittedForceN,
    reasons: from.reasons,
    forceSequence: from.forceSequence,
    forceAgeNs: from.forceAgeNs,
    mode: from.mode,
    device: from.device,
    channel: from.channel,
    ...(from.forceWantedN && { forceWanted: readVec3(from.forceWantedN) }),
    ...(from.stiffnessWantedNpm.length > 0 && { stiffnessWanted: from.stiffnessWantedNpm }),
    buttons: from.buttons,
    ...readHandleOf(from),
    ...readJoints(from),
  };
  const { turning, forceWanted, torqueApplied, handForce } = state;
  const joints = [from.jointRad, from.jointVelocityRadps];
  const good = joints.every((values) => values.length <= limits.kMaxJoints && values.every(isBounded)) &&
    [forceWanted, torqueApplied, handForce, from.angularVelocityRadps].every((v) => !v || isVec3(v)) &&
    (!turning || isRotation(turning.orientation)) && (!state.stiffnessWanted || isStiffness(state.stiffnessWanted)) &&
    [from.gripperRad, from.gripperVelocityRadps, from.gripperForceAppliedN].every((n) => n === undefined || isBounded(n)) &&
    isTime(state.sampledNs) && isVec3(state.position) && isVec3(state.velocity) &&
    isVec3(state.forceApplied) && isBounded(state.energy) &&
    (state.permittedForce === Infinity || isMagnitude(state.permittedForce)) && isLength(state.forceAgeNs) &&
    isEnum(state.mode, pb.ModeSchema) && isDevice(state.device) && isChannel(state.channel);
  return good ? state : undefined;
}

const writeState = (from: DeviceState): pb.DeviceState =>
  create(pb.DeviceStateSchema, {
    tick: from.tick,
    sampledNs: from.sampledNs,
    positionM: writeVec3(from.position),
    velocityMps: writeVec3(from.velocity),
    forceAppliedN: writeVec3(from.forceApplied),
    energyJ: from.energy,
    permittedForceN: from.permittedForce,
    reasons: from.reasons,
    forceSequence: from.forceSequence,
    forceAgeNs: from.forceAgeNs,
    mode: from.mode,
    device: from.device,
    channel: from.channel,
    ...(from.forceWanted && { forceWantedN: writeVec3(from.forceWanted) }),
    ...(from.stiffnessWanted && { stiffnessWantedNpm: [...from.stiffnessWanted] }),
    buttons: from.buttons,
    ...(from.turning && {
      orientation: writeQuat(from.turning.orientation), angularVelocityRadps: writeVec3(from.turning.angularVelocity),
    }),
    ...(from.torqueApplied && { torqueAppliedNm: writeVec3(from.torqueApplied) }),
    ...(from.grip && { gripperRad: from.grip.opening, gripperVelocityRadps: from.grip.velocity }),
    ...(from.gripApplied !== undefined && { gripperForceAppliedN: from.gripApplied }),
    ...(from.handForce && { handForceN: writeVec3(from.handForce) }),
    ...(from.joints && { jointRad: [...from.joints.angles], jointVelocityRadps: [...from.joints.velocities] }),
  });

function readContact({ normal, gapM, table }: pb.Contact): Contact {
  return {
    normal: readVec3(normal), gap: gapM,
    ...(table && { table: { first: table.firstDepthM, step: table.stepM, force: table.forceN } }),
  };
}

function writeContact({ normal, gap, table }: Contact): pb.Contact {
  return create(pb.ContactSchema, {
    normal: writeVec3(normal), gapM: gap,
    ...(table && { table: { firstDepthM: table.first, stepM: table.step, forceN: [...table.force] } }),
  });
}

const readModel = ({ atM, stiffnessNpm, validRadiusM, contact }: pb.LocalModel): LocalModel => ({
  at: readVec3(atM), stiffness: stiffnessNpm,
  ...(validRadiusM !== undefined && validRadiusM !== Infinity && { validRadius: validRadiusM }),
  ...(contact && { contact: readContact(contact) }),
});

const writeModel = ({ at, stiffness, validRadius, contact }: LocalModel): pb.LocalModel =>
  create(pb.LocalModelSchema, {
    atM: writeVec3(at), stiffnessNpm: [...stiffness],
    ...(validRadius !== undefined && validRadius !== Infinity && { validRadiusM: validRadius }),
    ...(contact && { contact: writeContact(contact) }),
  });

function readTorque({ torqueNm, rotationModel }: pb.ForceCommand): Torque | undefined {
  if (!torqueNm && !rotationModel) return undefined;
  const { atOrientation: at, angularStiffnessNmprad: stiffness } = rotationModel ?? {};
  const model = stiffness && { at: at ? readQuat(at) : { w: 0, x: 0, y: 0, z: 0 }, stiffness };
  return { torque: readVec3(torqueNm), ...(model && { model }) };
}

const writeTorque = ({ torque, model }: Torque): Partial<pb.ForceCommand> => ({
  torqueNm: writeVec3(torque),
  ...(model && {
    rotationModel: create(pb.RotationModelSchema, {
      atOrientation: writeQuat(model.at), angularStiffnessNmprad: [...model.stiffness],
    }),
  }),
});

function readForce(from: pb.ForceCommand): ForceCommand | undefined {
  const model = from.model && readModel(from.model);
  const torque = readTorque(from);
  const command: ForceCommand = {
    sequence: from.sequence,
    basedOnTick: from.basedOnTick,
    force: readVec3(from.forceN),
    model,
    validForUs: from.validForUs,
    device: from.device,
    channel: from.channel,
    ...(from.topologyChanged && { topologyChanged: true }),
    ...(from.errorN !== undefined && { error: from.errorN }),
    ...(torque && { torque }),
    ...(from.gripperForceN !== undefined && { gripForce: from.gripperForceN }),
    ...(from.way > 0 && { way: from.way }),
  };
  const good = isDevice(command.device) && isChannel(command.channel) && command.sequence > 0n && isVec3(command.force) && command.validForUs >= 1 &&
    command.validForUs <= limits.kMaxValidForMs * 1000 && (!model || isModel(model)) && isError(command.error) &&
    (!torque || (isVec3(torque.torque) && (!torque.model || isRotationModel(torque.model)))) &&
    (command.gripForce === undefined || isBounded(command.gripForce)) && from.way <= limits.kMaxWays;
  return good ? command : undefined;
}

const writeForce = (from: ForceCommand): pb.ForceCommand =>
  create(pb.ForceCommandSchema, {
    sequence: from.sequence,
    basedOnTick: from.basedOnTick,
    forceN: writeVec3(from.force),
    ...(from.model && { model: writeModel(from.model) }),
    validForUs: from.validForUs,
    device: from.device,
    channel: from.channel,
    topologyChanged: from.topologyChanged ?? false,
    ...(from.error !== undefined && { errorN: from.error }),
    ...(from.torque && writeTorque(from.torque)),
    ...(from.gripForce !== undefined && { gripperForceN: from.gripForce }),
    way: from.way ?? 0,
  });

/** readRequest() itself looks at the bounds of these. */
const kBounded = new Set<pb.Control["op"]["case"]>(["couple", "setOutput", "setScale", "setShare"]);

/** Its values are within bounds. */
function isRequest(request: Request): boolean {
  if (request.kind === "setStateDeadband") return isBounded(request.share) && isBounded(request.floor);
  return isDevice(request.device) && (!("channel" in request) || isChannel(request.channel)) &&
    (!("to" in request) || isText(request.to, limits.kMaxName));
}

function readDescription(from: pb.DeviceDescription): DeviceDescription | undefined {
  const { device, name, model, positionDof, forceDof, workspaceMinM: min, workspaceMaxM: max, loopHz } = from;
  const channels = from.channels.map(({ name, rule, leaseMs, holder }) => ({ name, rule, leaseMs, holder }));
  const isDof = (axes: number): boolean => axes >= 1 && axes <= limits.kMaxDof;
  const sizes = [from.maxForceN, from.continuousForceN, from.maxStiffnessNpm, from.positionResolutionM] as const;
  const workspace = min && max && { min: readVec3(min), max: readVec3(max) };
  const isBox = !min === !max && (!workspace || (isVec3(workspace.min) && isVec3(workspace.max) &&
    workspace.min.x <= workspace.max.x && workspace.min.y <= workspace.max.y && workspace.min.z <= workspace.max.z));
  const good = isDevice(device) && isText(name, limits.kMaxLabel) && isText(model, limits.kMaxName) && isDof(positionDof) &&
    isDof(forceDof) && isBox && sizes.every(isMagnitude) && loopHz >= 1 && loopHz <= limits.kMaxLoopHz &&
    channels.length >= 1 && channels.length <= limits.kMaxChannels && channels.every((channel) =>
      isText(channel.name, limits.kMaxLabel) && isEnum(channel.rule, pb.ChannelRuleSchema) &&
      channel.leaseMs <= limits.kMaxTimeoutMs && isText(channel.holder, limits.kMaxLabel));
  if (!good) return undefined;
  const [maxForce, continuousForce, maxStiffness, positionResolution] = sizes;
  return {
    device, name, model, positionDof, forceDof, workspace, maxForce, continuousForce, maxStiffness, positionResolution, loopHz,
    channels,
  };
}

function writeDescription(from: DeviceDescription): pb.DeviceDescription {
  const { device, positionDof, forceDof, workspace, loopHz } = from;
  return create(pb.DeviceDescriptionSchema, {
    device, positionDof, forceDof, loopHz,
    name: clip(from.name, limits.kMaxLabel),
    model: clip(from.model, limits.kMaxName),
    ...(workspace && { workspaceMinM: writeVec3(workspace.min), workspaceMaxM: writeVec3(workspace.max) }),
    maxForceN: from.maxForce,
    continuousForceN: from.continuousForce,
    maxStiffnessNpm: from.maxStiffness,
    positionResolutionM: from.positionResolution,
    channels: from.channels.slice(0, limits.kMaxChannels).map(({ name, rule, leaseMs, holder }) =>
      create(pb.ChannelDescriptionSchema, {
        name: clip(name, limits.kMaxLabel), rule, leaseMs, holder: clip(holder, limits.kMaxLabel),
      })),
  });
}

function readHandle(from: pb.HandleDescription): HandleDescription | undefined {
  const { device, buttons, operatorFromDevice: axes, orientationMeasured, gripperOpenRad: gripperOpen } = from;
  const { maxTorqueNm: maxTorque, maxGripperForceN: maxGripperForce, group, hand } = from;
  const { joints } = from;
  const outputs = from.outputs.map(({ name, kind }): OutputDescription => ({ name, kind: kind as number }));
  const good = isDevice(device) && isText(group, limits.kMaxLabel) && (hand === pb.Hand.ANY || isEnum(hand, pb.HandSchema)) &&
    buttons.length <= limits.kMaxButtons && joints.length <= limits.kMaxJoints &&
    outputs.length <= limits.kMaxOutputs && from.outputs.every(({ kind }) => isEnum(kind, pb.OutputKindSchema)) &&
    [...buttons, ...joints, ...outputs.map(({ name }) => name)].every((name) => isText(name, limits.kMaxLabel)) && (!axes || isRotation(axes)) &&
    [maxTorque, gripperOpen ?? 0, maxGripperForce].every(isMagnitude);
  if (!good) return undefined;
  return {
    device, buttons: [...buttons], orientationMeasured, maxTorque, maxGripperForce, group, hand,
    ...(axes && { operatorFromDevice: readQuat(axes) }), ...(gripperOpen !== undefined && { gripperOpen }),
    ...(joints.length > 0 && { joints: [...joints] }), ...(outputs.length > 0 && { outputs }),
  };
}

function writeHandle(from: HandleDescription): pb.HandleDescription {
  const { device, operatorFromDevice: axes, orientationMeasured, maxTorque, gripperOpen, maxGripperForce } = from;
  return create(pb.HandleDescriptionSchema, {
    device,
    ...(axes && { operatorFromDevice: writeQuat(axes) }),
    buttons: from.buttons.slice(0, limits.kMaxButtons).map((name) => clip(name, limits.kMaxLabel)),
    orientationMeasured,
    maxTorqueNm: maxTorque,
    ...(gripperOpen !== undefined && { gripperOpenRad: gripperOpen }),
    maxGripperForceN: maxGripperForce,
    group: clip(from.group, limits.kMaxLabel),
    hand: from.hand,
    joints: (from.joints ?? []).slice(0, limits.kMaxJoints).map((name) => clip(name, limits.kMaxLabel)),
    outputs: (from.outputs ?? []).slice(0, limits.kMaxOutputs).map(({ name, kind }) =>
      create(pb.OutputDescriptionSchema, { name: clip(name, limits.kMaxLabel), kind: kind as number })),
  });
}

/** Whether a receiver accepts it. */
export const isSetting = (output: number, setting: LampColour | Vibration): boolean => {
  if (!Number.isInteger(output) || output < 0 || output >= limits.kMaxOutputs) return false;
  if ("rgb" in setting) return Number.isInteger(setting.rgb) && setting.rgb >= 0 && setting.rgb <= 0xffffff;
  const { amplitude, frequency, durationMs } = setting;
  return amplitude >= 0 && amplitude <= 1 && Number.isInteger(durationMs) && durationMs >= 0 &&
    durationMs <= limits.kMaxVibrationMs &&
    (frequency === 0 || (frequency >= limits.kMinVibrationHz && frequency <= limits.kMaxVibrationHz));
};

function readSetOutput({ device, output, setting: from }: pb.SetOutput): Request | undefined {
  if (from.case === undefined) return undefined;
  const setting: LampColour | Vibration = from.case === "rgb" ? { rgb: from.value } :
    { amplitude: from.value.amplitude, frequency: from.value.frequencyHz, durationMs: from.value.durationMs };
  return isSetting(output, setting) ? { kind: "setOutput", device, output, setting } : undefined;
}

function writeSetOutput({ device, output, setting }: SetOutput): pb.SetOutput {
  return create(pb.SetOutputSchema, {
    device, output,
    setting: "rgb" in setting ? { case: "rgb", value: setting.rgb } :
      {
        case: "vibration",
        value: create(pb.VibrationSchema, {
          amplitude: setting.amplitude, frequencyHz: setting.frequency, durationMs: setting.durationMs,
        }),
      },
  });
}

function readRequest(op: pb.Control["op"]): Request | undefined {
  switch (op.case) {
    case "setStateRate":
      return { kind: op.case, hz: op.value.hz, device: op.value.device };
    case "rearm":
    case "disarm":
    case "engage":
    case "disengage":
      return { kind: op.case, device: op.value.device };
    case "setOutput":
      return readSetOutput(op.value);
    case "couple": {
      const couple = readCouple(op.value);
      return couple && { kind: op.case, ...couple };
    }
    case "setScale": {
      const { device, positionScale, forceScale } = op.value;
      return isSetScale(op.value) ? { kind: op.case, device, positionScale, forceScale } : undefined;
    }
    case "setShare": {
      const { device, channel, share } = op.value;
      return isSetShare(op.value) ? { kind: op.case, device, channel, share } : undefined;
    }
    case "describe":
      return { kind: op.case, device: op.value.device, ...(op.value.handle && { handle: true }) };
    case "takeLease":
    case "giveLease":
      return { kind: op.case, device: op.value.device, channel: op.value.channel };
    case "leaseLost":
      return { kind: op.case, device: op.value.device, channel: op.value.channel, to: op.value.to };
    case "setStateDeadband": {
      const { share, floorMps, maxSilenceUs } = op.value;
      return { kind: "setStateDeadband", share, floor: floorMps, maxSilenceUs };
    }
    default:
      return undefined;
  }
}

function writeRequest(request: Request | undefined): pb.Control["op"] {
  switch (request?.kind) {
    case "setStateRate":
      return { case: request.kind, value: create(pb.SetStateRateSchema, { hz: request.hz, device: request.device }) };
    case "rearm":
      return { case: request.kind, value: create(pb.RearmSchema, { device: request.device }) };
    case "disarm":
      return { case: request.kind, value: create(pb.DisarmSchema, { device: request.device }) };
    case "engage":
      return { case: request.kind, value: create(pb.EngageSchema, { device: request.device }) };
    case "disengage":
      return { case: request.kind, value: create(pb.DisengageSchema, { device: request.device }) };
    case "setOutput":
      return { case: request.kind, value: writeSetOutput(request) };
    case "couple": {
      const { kind, ...couple } = request;
      return { case: kind, value: writeCouple(couple) };
    }
    case "setScale": {
      const { kind, ...scales } = request;
      return { case: kind, value: create(pb.SetScaleSchema, scales) };
    }
    case "setShare": {
      const { kind, ...of } = request;
      return { case: kind, value: create(pb.SetShareSchema, of) };
    }
    case "describe":
      return { case: request.kind, value: create(pb.DescribeSchema, { device: request.device, handle: request.handle ?? false }) };
    case "takeLease":
      return { case: request.kind, value: create(pb.TakeLeaseSchema, { device: request.device, channel: request.channel }) };
    case "giveLease":
      return { case: request.kind, value: create(pb.GiveLeaseSchema, { device: request.device, channel: request.channel }) };
    case "leaseLost": {
      const { device, channel, to } = request;
      return { case: request.kind, value: create(pb.LeaseLostSchema, { device, channel, to: clip(to, limits.kMaxName) }) };
    }
    case "setStateDeadband": {
      const { share, floor, maxSilenceUs } = request;
      return { case: "setStateDeadband", value: create(pb.SetStateDeadbandSchema, { share, floorMps: floor, maxSilenceUs }) };
    }
    case undefined:
      return { case: undefined };
  }
}

function readWelcome(from: pb.Welcome): Welcome | undefined {
  const { version, features, role, deviceName, loopHz, timeoutMs, server } = from;
  const grants = from.grants.map(({ device, channel, role }): Grant => ({ device, channel, role }));
  const good = version >= 1 && grants.length <= limits.kMaxClaims && grants.every(({ device, channel, role }) =>
      isDevice(device) && isChannel(channel) && isEnum(role, pb.RoleSchema)) && areFeatures(features) && isEnum(role, pb.RoleSchema) &&
    isText(deviceName, limits.kMaxName) && isMagnitude(from.maxForceN) && isMagnitude(from.positionResolutionM) &&
    loopHz >= 1 && loopHz <= limits.kMaxLoopHz && timeoutMs >= 1 && timeoutMs <= limits.kMaxTimeoutMs &&
    isText(server, limits.kMaxName);
  if (!good) return undefined;
  return {
    version, features, role, deviceName, maxForce: from.maxForceN, positionResolution: from.positionResolutionM, loopHz,
    timeoutMs, server, ...(grants.length && { grants }),
  };
}

const writeWelcome = (from: Welcome): pb.Welcome =>
  create(pb.WelcomeSchema, {
    version: from.version,
    features: writeFeatures(from.features),
    role: from.role,
    deviceName: clip(from.deviceName, limits.kMaxName),
    maxForceN: from.maxForce,
    positionResolutionM: from.positionResolution,
    loopHz: from.loopHz,
    timeoutMs: from.timeoutMs,
    server: clip(from.server, limits.kMaxName),
    grants: (from.grants ?? []).slice(0, limits.kMaxClaims).map((grant) => create(pb.GrantSchema, grant)),
  });

// SPDX-License-Identifier: Apache-2.0
// Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
// The messages of tendon.proto: bounds, values to protobuf and back.
import { create } from "@bufbuild/protobuf";
import {
  areCounts,
  areMessages,
  areNumbers,
  areTexts,
  isBox,
  isEnum,
  isNormal,
  isRotation,
  isStiffness,
  isText,
  isVec3,
  isWhole,
  isWithin,
  sum,
} from "../bounds.js";
import { clip, clipAll, padded, readQuat, readVec3, writeQuat, writeVec3 } from "../fields.js";
import { kMaxTime } from "../limits.js";
import type {
  Bye,
  ChannelDescription,
  Claim,
  Contact,
  ControlAck,
  Couple,
  Delays,
  Describe,
  DeviceDescription,
  DeviceReport,
  DeviceState,
  Disarm,
  Disengage,
  DropField,
  Echo,
  Engage,
  FieldBrick,
  FieldDepthTable,
  FieldFixture,
  FieldMaterial,
  FieldPose,
  FieldStatus,
  ForceCommand,
  ForceTable,
  GiveLease,
  Grant,
  HandleDescription,
  Hello,
  LeaseLost,
  LinkReport,
  LocalModel,
  OfferField,
  OutputDescription,
  PeerReport,
  PlainFrame,
  PortGrip,
  PortState,
  PortSurface,
  PortTurn,
  RateControl,
  Rearm,
  Refused,
  Request,
  RotationModel,
  SetOutput,
  SetScale,
  SetShare,
  SetStateRate,
  StateDeadband,
  TakeLease,
  UseField,
  Vibration,
  Welcome,
} from "./messages.js";
import * as pb from "./tendon_pb.js";

/** Returns the name of the first field that is out of bounds. */
export function refusedEcho(m: pb.Echo): string | undefined {
  if (m.peerTxTimeNs < -kMaxTime || m.peerTxTimeNs > kMaxTime) return "peer_tx_time_ns";
  if (m.rxTimeNs < -kMaxTime || m.rxTimeNs > kMaxTime) return "rx_time_ns";
  return undefined;
}

export const readEcho = (m: pb.Echo): Echo => ({
  sent: m.peerTxTimeNs,
  received: m.rxTimeNs,
  packetNumber: m.peerPacketNumber,
  receivedMask: m.receivedMask,
});

export const writeEcho = (value: Echo): pb.Echo =>
  create(pb.EchoSchema, {
    peerTxTimeNs: value.sent,
    rxTimeNs: value.received,
    peerPacketNumber: value.packetNumber,
    receivedMask: value.receivedMask,
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedDeviceState(m: pb.DeviceState): string | undefined {
  if (m.sampledNs < -kMaxTime || m.sampledNs > kMaxTime) return "sampled_ns";
  if (m.positionM && !isVec3(m.positionM)) return "position_m";
  if (m.velocityMps && !isVec3(m.velocityMps)) return "velocity_mps";
  if (m.forceAppliedN && !isVec3(m.forceAppliedN)) return "force_applied_n";
  if (!isWithin(m.energyJ, -1e12, 1e12)) return "energy_j";
  if (m.permittedForceN !== Infinity && !isWithin(m.permittedForceN, 0, 1e12)) return "permitted_force_n";
  if (m.forceAgeNs > kMaxTime) return "force_age_ns";
  if (!isEnum(m.mode, pb.ModeSchema)) return "mode";
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (m.forceWantedN && !isVec3(m.forceWantedN)) return "force_wanted_n";
  if (m.orientation && !isRotation(m.orientation)) return "orientation";
  if (m.angularVelocityRadps && !isVec3(m.angularVelocityRadps)) return "angular_velocity_radps";
  if (m.torqueAppliedNm && !isVec3(m.torqueAppliedNm)) return "torque_applied_nm";
  if (m.gripperRad !== undefined && !isWithin(m.gripperRad, -1e12, 1e12)) return "gripper_rad";
  if (m.gripperVelocityRadps !== undefined && !isWithin(m.gripperVelocityRadps, -1e12, 1e12)) {
    return "gripper_velocity_radps";
  }
  if (m.gripperForceAppliedN !== undefined && !isWithin(m.gripperForceAppliedN, -1e12, 1e12)) {
    return "gripper_force_applied_n";
  }
  if (m.handForceN && !isVec3(m.handForceN)) return "hand_force_n";
  if (!areNumbers(m.jointRad, 0, 8, -1e12, 1e12)) return "joint_rad";
  if (!areNumbers(m.jointVelocityRadps, 0, 8, -1e12, 1e12)) return "joint_velocity_radps";
  if (m.stiffnessWantedNpm.length > 0 && !isStiffness(m.stiffnessWantedNpm)) return "stiffness_wanted_npm";
  if (!isWithin(m.fieldDepthM, 0, 1e12)) return "field_depth_m";
  if (m.fieldProxyM && !isVec3(m.fieldProxyM)) return "field_proxy_m";
  return undefined;
}

export const readDeviceState = (m: pb.DeviceState): DeviceState => ({
  tick: m.tick,
  sampledNs: m.sampledNs,
  position: readVec3(m.positionM),
  velocity: readVec3(m.velocityMps),
  forceApplied: readVec3(m.forceAppliedN),
  energy: m.energyJ,
  permittedForce: m.permittedForceN,
  reasons: m.reasons,
  forceSequence: m.forceSequence,
  forceAgeNs: m.forceAgeNs,
  mode: m.mode,
  device: m.device,
  channel: m.channel,
  buttons: m.buttons,
  ...(m.forceWantedN && { forceWanted: readVec3(m.forceWantedN) }),
  ...(m.stiffnessWantedNpm.length > 0 && { stiffnessWanted: m.stiffnessWantedNpm }),
  ...(m.orientation && {
    turning: { orientation: readQuat(m.orientation), angularVelocity: readVec3(m.angularVelocityRadps) },
  }),
  ...(m.torqueAppliedNm && { torqueApplied: readVec3(m.torqueAppliedNm) }),
  ...(m.gripperRad !== undefined && { grip: { opening: m.gripperRad, velocity: m.gripperVelocityRadps ?? 0 } }),
  ...(m.gripperForceAppliedN !== undefined && { gripApplied: m.gripperForceAppliedN }),
  ...(m.handForceN && { handForce: readVec3(m.handForceN) }),
  ...(m.jointRad.length > 0 && {
    joints: { angles: m.jointRad, velocities: padded(m.jointVelocityRadps, m.jointRad.length) },
  }),
  ...(m.field !== 0 && { field: { generation: m.field, depth: m.fieldDepthM, proxy: readVec3(m.fieldProxyM) } }),
});

export const writeDeviceState = (value: DeviceState): pb.DeviceState =>
  create(pb.DeviceStateSchema, {
    tick: value.tick,
    sampledNs: value.sampledNs,
    positionM: writeVec3(value.position),
    velocityMps: writeVec3(value.velocity),
    forceAppliedN: writeVec3(value.forceApplied),
    energyJ: value.energy,
    permittedForceN: value.permittedForce,
    reasons: value.reasons,
    forceSequence: value.forceSequence,
    forceAgeNs: value.forceAgeNs,
    mode: value.mode,
    device: value.device,
    channel: value.channel,
    ...(value.forceWanted && { forceWantedN: writeVec3(value.forceWanted) }),
    ...(value.stiffnessWanted && { stiffnessWantedNpm: [...value.stiffnessWanted] }),
    buttons: value.buttons,
    ...(value.turning && {
      orientation: writeQuat(value.turning.orientation),
      angularVelocityRadps: writeVec3(value.turning.angularVelocity),
    }),
    ...(value.torqueApplied && { torqueAppliedNm: writeVec3(value.torqueApplied) }),
    ...(value.grip && { gripperRad: value.grip.opening, gripperVelocityRadps: value.grip.velocity }),
    ...(value.gripApplied !== undefined && { gripperForceAppliedN: value.gripApplied }),
    ...(value.handForce && { handForceN: writeVec3(value.handForce) }),
    ...(value.joints && { jointRad: [...value.joints.angles], jointVelocityRadps: [...value.joints.velocities] }),
    ...(value.field && {
      field: value.field.generation,
      fieldDepthM: value.field.depth,
      fieldProxyM: writeVec3(value.field.proxy),
    }),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedForceCommand(m: pb.ForceCommand): string | undefined {
  if (m.sequence < 1n) return "sequence";
  if (m.forceN && !isVec3(m.forceN)) return "force_n";
  const model = m.model && refusedLocalModel(m.model);
  if (model !== undefined) return `model.${model}`;
  if (!isWhole(m.validForUs, 1, 10_000_000)) return "valid_for_us";
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (m.errorN !== undefined && !isWithin(m.errorN, 0, 1e12)) return "error_n";
  if (m.torqueNm && !isVec3(m.torqueNm)) return "torque_nm";
  if (m.gripperForceN !== undefined && !isWithin(m.gripperForceN, -1e12, 1e12)) return "gripper_force_n";
  const rotationModel = m.rotationModel && refusedRotationModel(m.rotationModel);
  if (rotationModel !== undefined) return `rotation_model.${rotationModel}`;
  if (!isWhole(m.way, 0, 8)) return "way";
  return undefined;
}

export const readForceCommand = (m: pb.ForceCommand): ForceCommand => ({
  sequence: m.sequence,
  basedOnTick: m.basedOnTick,
  force: readVec3(m.forceN),
  validForUs: m.validForUs,
  device: m.device,
  channel: m.channel,
  ...(m.model && { model: readLocalModel(m.model) }),
  ...(m.topologyChanged && { topologyChanged: m.topologyChanged }),
  ...(m.errorN !== undefined && { error: m.errorN }),
  ...((m.torqueNm || m.rotationModel) && {
    torque: { torque: readVec3(m.torqueNm), ...(m.rotationModel && { model: readRotationModel(m.rotationModel) }) },
  }),
  ...(m.gripperForceN !== undefined && { gripForce: m.gripperForceN }),
  ...(m.way !== 0 && { way: m.way }),
  ...(m.field !== 0 && { field: m.field }),
});

export const writeForceCommand = (value: ForceCommand): pb.ForceCommand =>
  create(pb.ForceCommandSchema, {
    sequence: value.sequence,
    basedOnTick: value.basedOnTick,
    forceN: writeVec3(value.force),
    ...(value.model && { model: writeLocalModel(value.model) }),
    validForUs: value.validForUs,
    device: value.device,
    channel: value.channel,
    topologyChanged: value.topologyChanged ?? false,
    ...(value.error !== undefined && { errorN: value.error }),
    ...(value.torque && {
      torqueNm: writeVec3(value.torque.torque),
      ...(value.torque.model && { rotationModel: writeRotationModel(value.torque.model) }),
    }),
    ...(value.gripForce !== undefined && { gripperForceN: value.gripForce }),
    way: value.way ?? 0,
    field: value.field ?? 0,
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedRotationModel(m: pb.RotationModel): string | undefined {
  if (!m.atOrientation || !isRotation(m.atOrientation)) return "at_orientation";
  if (!isStiffness(m.angularStiffnessNmprad)) return "angular_stiffness_nmprad";
  return undefined;
}

export const readRotationModel = (m: pb.RotationModel): RotationModel => ({
  at: readQuat(m.atOrientation),
  stiffness: m.angularStiffnessNmprad,
});

export const writeRotationModel = (value: RotationModel): pb.RotationModel =>
  create(pb.RotationModelSchema, { atOrientation: writeQuat(value.at), angularStiffnessNmprad: [...value.stiffness] });

/** Returns the name of the first field that is out of bounds. */
export function refusedLocalModel(m: pb.LocalModel): string | undefined {
  if (m.atM && !isVec3(m.atM)) return "at_m";
  if (!isStiffness(m.stiffnessNpm)) return "stiffness_npm";
  if (m.validRadiusM !== undefined && m.validRadiusM !== Infinity && !isWithin(m.validRadiusM, 0, 1e12)) {
    return "valid_radius_m";
  }
  const contact = m.contact && refusedContact(m.contact);
  if (contact !== undefined) return `contact.${contact}`;
  return undefined;
}

export const readLocalModel = (m: pb.LocalModel): LocalModel => ({
  at: readVec3(m.atM),
  stiffness: m.stiffnessNpm,
  ...(m.validRadiusM !== undefined && m.validRadiusM !== Infinity && { validRadius: m.validRadiusM }),
  ...(m.contact && { contact: readContact(m.contact) }),
});

export const writeLocalModel = (value: LocalModel): pb.LocalModel =>
  create(pb.LocalModelSchema, {
    atM: writeVec3(value.at),
    stiffnessNpm: [...value.stiffness],
    ...(value.validRadius !== undefined && value.validRadius !== Infinity && { validRadiusM: value.validRadius }),
    ...(value.contact && { contact: writeContact(value.contact) }),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedContact(m: pb.Contact): string | undefined {
  if (!isNormal(m.normal)) return "normal";
  if (!isWithin(m.gapM, -1e12, 1e12)) return "gap_m";
  const table = m.table && refusedForceTable(m.table);
  if (table !== undefined) return `table.${table}`;
  return undefined;
}

export const readContact = (m: pb.Contact): Contact => ({
  normal: readVec3(m.normal),
  gap: m.gapM,
  ...(m.table && { table: readForceTable(m.table) }),
});

export const writeContact = (value: Contact): pb.Contact =>
  create(pb.ContactSchema, {
    normal: writeVec3(value.normal),
    gapM: value.gap,
    ...(value.table && { table: writeForceTable(value.table) }),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedForceTable(m: pb.ForceTable): string | undefined {
  if (!isWithin(m.firstDepthM, -1e12, 1e12)) return "first_depth_m";
  if (!(m.stepM > 0 && m.stepM <= 1e12)) return "step_m";
  if (!areNumbers(m.forceN, 2, 16, -1e12, 1e12)) return "force_n";
  return undefined;
}

export const readForceTable = (m: pb.ForceTable): ForceTable => ({
  first: m.firstDepthM,
  step: m.stepM,
  force: m.forceN,
});

export const writeForceTable = (value: ForceTable): pb.ForceTable =>
  create(pb.ForceTableSchema, { firstDepthM: value.first, stepM: value.step, forceN: [...value.force] });

/** Returns the name of the first field that is out of bounds. */
export function refusedOfferField(m: pb.OfferField): string | undefined {
  if (m.field.length !== 32) return "field";
  if (!isWhole(m.size, 1, 65_535)) return "size";
  if (!isWhole(m.offset, 0, 65_535)) return "offset";
  if (m.part.length < 1 || m.part.length > 1000) return "part";
  return undefined;
}

export const readOfferField = (m: pb.OfferField): OfferField => ({
  field: m.field,
  size: m.size,
  offset: m.offset,
  part: m.part,
});

export const writeOfferField = (value: OfferField): pb.OfferField =>
  create(pb.OfferFieldSchema, {
    field: value.field.subarray(0, 32),
    size: value.size,
    offset: value.offset,
    part: value.part.subarray(0, 1000),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedUseField(m: pb.UseField): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (m.generation < 1) return "generation";
  if (m.field.length !== 32) return "field";
  if (!areMessages(m.materials, 1, 8, refusedFieldMaterial)) return "materials";
  if (!areMessages(m.fixtures, 0, 4, refusedFieldFixture)) return "fixtures";
  if (!areMessages(m.tables, 0, 3, refusedFieldDepthTable)) return "tables";
  return undefined;
}

export const readUseField = (m: pb.UseField): UseField => ({
  device: m.device,
  channel: m.channel,
  generation: m.generation,
  field: m.field,
  materials: m.materials.map(readFieldMaterial),
  ...(m.fixtures.length > 0 && { fixtures: m.fixtures.map(readFieldFixture) }),
  ...(m.tables.length > 0 && { tables: m.tables.map(readFieldDepthTable) }),
});

export const writeUseField = (value: UseField): pb.UseField =>
  create(pb.UseFieldSchema, {
    device: value.device,
    channel: value.channel,
    generation: value.generation,
    field: value.field.subarray(0, 32),
    materials: value.materials.slice(0, 8).map(writeFieldMaterial),
    fixtures: (value.fixtures ?? []).slice(0, 4).map(writeFieldFixture),
    tables: (value.tables ?? []).slice(0, 3).map(writeFieldDepthTable),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedDropField(m: pb.DropField): string | undefined {
  if (m.field.length !== 32) return "field";
  return undefined;
}

export const readDropField = (m: pb.DropField): DropField => ({ field: m.field });

export const writeDropField = (value: DropField): pb.DropField =>
  create(pb.DropFieldSchema, { field: value.field.subarray(0, 32) });

/** Returns the name of the first field that is out of bounds. */
export function refusedFieldMaterial(m: pb.FieldMaterial): string | undefined {
  if (!(m.stiffnessNpm > 0 && m.stiffnessNpm <= 1e12)) return "stiffness_npm";
  if (!isWithin(m.branchStiffnessNpm, 0, 1e12)) return "branch_stiffness_npm";
  if (m.relaxationS !== 0 && !isWithin(m.relaxationS, 0.01, 10)) return "relaxation_s";
  if (!isWithin(m.friction, 0, 2)) return "friction";
  return undefined;
}

export const readFieldMaterial = (m: pb.FieldMaterial): FieldMaterial => ({
  stiffness: m.stiffnessNpm,
  ...(m.branchStiffnessNpm !== 0 && { branchStiffness: m.branchStiffnessNpm }),
  ...(m.relaxationS !== 0 && { relaxation: m.relaxationS }),
  ...(m.friction !== 0 && { friction: m.friction }),
});

export const writeFieldMaterial = (value: FieldMaterial): pb.FieldMaterial =>
  create(pb.FieldMaterialSchema, {
    stiffnessNpm: value.stiffness,
    branchStiffnessNpm: value.branchStiffness ?? 0,
    relaxationS: value.relaxation ?? 0,
    friction: value.friction ?? 0,
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedFieldDepthTable(m: pb.FieldDepthTable): string | undefined {
  if (!isWhole(m.material, 0, 7)) return "material";
  if (!isWithin(m.stepM, 0.0001, 0.1)) return "step_m";
  if (!areNumbers(m.forceN, 1, 16, -1e12, 1e12)) return "force_n";
  return undefined;
}

export const readFieldDepthTable = (m: pb.FieldDepthTable): FieldDepthTable => ({
  material: m.material,
  step: m.stepM,
  force: m.forceN,
});

export const writeFieldDepthTable = (value: FieldDepthTable): pb.FieldDepthTable =>
  create(pb.FieldDepthTableSchema, { material: value.material, stepM: value.step, forceN: [...value.force] });

/** Returns the name of the first field that is out of bounds. */
export function refusedFieldFixture(m: pb.FieldFixture): string | undefined {
  if (!isEnum(m.kind, pb.FieldFixtureKindSchema)) return "kind";
  if (m.atM && !isVec3(m.atM)) return "at_m";
  if (!isNormal(m.normal)) return "normal";
  if (!(m.stiffnessNpm > 0 && m.stiffnessNpm <= 1e12)) return "stiffness_npm";
  if (m.mostForceN !== undefined && !(m.mostForceN > 0 && m.mostForceN <= 1e12)) return "most_force_n";
  return undefined;
}

export const readFieldFixture = (m: pb.FieldFixture): FieldFixture => ({
  kind: m.kind,
  at: readVec3(m.atM),
  normal: readVec3(m.normal),
  stiffness: m.stiffnessNpm,
  ...(m.mostForceN !== undefined && { mostForce: m.mostForceN }),
});

export const writeFieldFixture = (value: FieldFixture): pb.FieldFixture =>
  create(pb.FieldFixtureSchema, {
    kind: value.kind,
    atM: writeVec3(value.at),
    normal: writeVec3(value.normal),
    stiffnessNpm: value.stiffness,
    ...(value.mostForce !== undefined && { mostForceN: value.mostForce }),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedFieldBrick(m: pb.FieldBrick): string | undefined {
  if (m.hash.length !== 16) return "hash";
  if (m.weights.length !== 1024) return "weights";
  return undefined;
}

export const readFieldBrick = (m: pb.FieldBrick): FieldBrick => ({ hash: m.hash, weights: m.weights });

export const writeFieldBrick = (value: FieldBrick): pb.FieldBrick =>
  create(pb.FieldBrickSchema, { hash: value.hash.subarray(0, 16), weights: value.weights.subarray(0, 1024) });

/** Returns the name of the first field that is out of bounds. */
export function refusedFieldStatus(m: pb.FieldStatus): string | undefined {
  if (m.field.length !== 32) return "field";
  if (m.missing.length > 128) return "missing";
  return undefined;
}

export const readFieldStatus = (m: pb.FieldStatus): FieldStatus => ({ field: m.field, missing: m.missing });

export const writeFieldStatus = (value: FieldStatus): pb.FieldStatus =>
  create(pb.FieldStatusSchema, { field: value.field.subarray(0, 32), missing: value.missing.subarray(0, 128) });

/** Returns the name of the first field that is out of bounds. */
export function refusedFieldPose(m: pb.FieldPose): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (m.sequence < 1n) return "sequence";
  if (m.timeNs < -kMaxTime || m.timeNs > kMaxTime) return "time_ns";
  if (m.positionM && !isVec3(m.positionM)) return "position_m";
  if (!m.orientation || !isRotation(m.orientation)) return "orientation";
  if (m.velocityMps && !isVec3(m.velocityMps)) return "velocity_mps";
  if (m.angularVelocityRadps && !isVec3(m.angularVelocityRadps)) return "angular_velocity_radps";
  return undefined;
}

export const readFieldPose = (m: pb.FieldPose): FieldPose => ({
  device: m.device,
  channel: m.channel,
  sequence: m.sequence,
  timeNs: m.timeNs,
  position: readVec3(m.positionM),
  orientation: readQuat(m.orientation),
  velocity: readVec3(m.velocityMps),
  angularVelocity: readVec3(m.angularVelocityRadps),
});

export const writeFieldPose = (value: FieldPose): pb.FieldPose =>
  create(pb.FieldPoseSchema, {
    device: value.device,
    channel: value.channel,
    sequence: value.sequence,
    timeNs: value.timeNs,
    positionM: writeVec3(value.position),
    orientation: writeQuat(value.orientation),
    velocityMps: writeVec3(value.velocity),
    angularVelocityRadps: writeVec3(value.angularVelocity),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedSetStateRate(m: pb.SetStateRate): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  return undefined;
}

export const readSetStateRate = (m: pb.SetStateRate): SetStateRate => ({ hz: m.hz, device: m.device });

export const writeSetStateRate = (value: SetStateRate): pb.SetStateRate =>
  create(pb.SetStateRateSchema, { hz: value.hz, device: value.device });

/** Returns the name of the first field that is out of bounds. */
export function refusedSetStateDeadband(m: pb.SetStateDeadband): string | undefined {
  if (!isWithin(m.share, -1e12, 1e12)) return "share";
  if (!isWithin(m.floorMps, -1e12, 1e12)) return "floor_mps";
  return undefined;
}

export const readSetStateDeadband = (m: pb.SetStateDeadband): StateDeadband => ({
  share: m.share,
  floor: m.floorMps,
  maxSilenceUs: m.maxSilenceUs,
});

export const writeSetStateDeadband = (value: StateDeadband): pb.SetStateDeadband =>
  create(pb.SetStateDeadbandSchema, { share: value.share, floorMps: value.floor, maxSilenceUs: value.maxSilenceUs });

/** Returns the name of the first field that is out of bounds. */
export function refusedRearm(m: pb.Rearm): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  return undefined;
}

export const readRearm = (m: pb.Rearm): Rearm => ({ device: m.device });

export const writeRearm = (value: Rearm): pb.Rearm =>
  create(pb.RearmSchema, { device: value.device });

/** Returns the name of the first field that is out of bounds. */
export function refusedDisarm(m: pb.Disarm): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  return undefined;
}

export const readDisarm = (m: pb.Disarm): Disarm => ({ device: m.device });

export const writeDisarm = (value: Disarm): pb.Disarm =>
  create(pb.DisarmSchema, { device: value.device });

/** Returns the name of the first field that is out of bounds. */
export function refusedCouple(m: pb.Couple): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (!isEnum(m.role, pb.PortRoleSchema)) return "role";
  if (!isEnum(m.method, pb.CouplingMethodSchema)) return "method";
  if (!isWithin(m.positionScale, 0.01, 100)) return "position_scale";
  if (!isWithin(m.forceScale, 0.01, 100)) return "force_scale";
  if (!m.rotation || !isRotation(m.rotation)) return "rotation";
  if (!isWhole(m.axes, 1, 7)) return "axes";
  if (!isWithin(m.stiffnessNpm, 0, 1e12)) return "stiffness_npm";
  if (!isWithin(m.mutualDampingNspm, 0, 1e12)) return "mutual_damping_nspm";
  if (!isWithin(m.dampingNspm, 0, 1e12)) return "damping_nspm";
  if (!isWhole(m.periodUs, 1, 10_000_000)) return "period_us";
  if (!isWithin(m.turnStiffnessNmprad, 0, 1e12)) return "turn_stiffness_nmprad";
  if (!isWithin(m.turnDampingNmsprad, 0, 1e12)) return "turn_damping_nmsprad";
  if (!isWithin(m.gripStiffnessNpm, 0, 1e12)) return "grip_stiffness_npm";
  if (!isWithin(m.gripDampingNspm, 0, 1e12)) return "grip_damping_nspm";
  if (!isWithin(m.driftRatePerS, 0, 1e12)) return "drift_rate_per_s";
  const rate = m.rate && refusedRateControl(m.rate);
  if (rate !== undefined) return `rate.${rate}`;
  return undefined;
}

export const readCouple = (m: pb.Couple): Couple => ({
  device: m.device,
  channel: m.channel,
  role: m.role,
  method: m.method,
  positionScale: m.positionScale,
  forceScale: m.forceScale,
  rotation: readQuat(m.rotation),
  axes: m.axes,
  stiffness: m.stiffnessNpm,
  mutualDamping: m.mutualDampingNspm,
  damping: m.dampingNspm,
  adaptToDelay: m.adaptToDelay,
  purse: m.purse,
  periodUs: m.periodUs,
  ...(m.absolute && { absolute: m.absolute }),
  ...(m.turnStiffnessNmprad !== 0 && { turnStiffness: m.turnStiffnessNmprad }),
  ...(m.turnDampingNmsprad !== 0 && { turnDamping: m.turnDampingNmsprad }),
  ...(m.gripStiffnessNpm !== 0 && { gripStiffness: m.gripStiffnessNpm }),
  ...(m.gripDampingNspm !== 0 && { gripDamping: m.gripDampingNspm }),
  ...(m.driftRatePerS !== 0 && { driftRate: m.driftRatePerS }),
  ...(m.rate && { rate: readRateControl(m.rate) }),
});

export const writeCouple = (value: Couple): pb.Couple =>
  create(pb.CoupleSchema, {
    device: value.device,
    channel: value.channel,
    role: value.role,
    method: value.method,
    positionScale: value.positionScale,
    forceScale: value.forceScale,
    rotation: writeQuat(value.rotation),
    axes: value.axes,
    stiffnessNpm: value.stiffness,
    mutualDampingNspm: value.mutualDamping,
    dampingNspm: value.damping,
    adaptToDelay: value.adaptToDelay,
    purse: value.purse,
    periodUs: value.periodUs,
    absolute: value.absolute ?? false,
    turnStiffnessNmprad: value.turnStiffness ?? 0,
    turnDampingNmsprad: value.turnDamping ?? 0,
    gripStiffnessNpm: value.gripStiffness ?? 0,
    gripDampingNspm: value.gripDamping ?? 0,
    driftRatePerS: value.driftRate ?? 0,
    ...(value.rate && { rate: writeRateControl(value.rate) }),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedRateControl(m: pb.RateControl): string | undefined {
  if (!isWithin(m.deadZoneM, 0, 1e12)) return "dead_zone_m";
  if (!(m.gainPerS > 0 && m.gainPerS <= 1e12)) return "gain_per_s";
  if (!(m.maxSpeedMps > 0 && m.maxSpeedMps <= 1e12)) return "max_speed_mps";
  return undefined;
}

export const readRateControl = (m: pb.RateControl): RateControl => ({
  deadZone: m.deadZoneM,
  gain: m.gainPerS,
  maxSpeed: m.maxSpeedMps,
});

export const writeRateControl = (value: RateControl): pb.RateControl =>
  create(pb.RateControlSchema, { deadZoneM: value.deadZone, gainPerS: value.gain, maxSpeedMps: value.maxSpeed });

/** Returns the name of the first field that is out of bounds. */
export function refusedEngage(m: pb.Engage): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  return undefined;
}

export const readEngage = (m: pb.Engage): Engage => ({ device: m.device });

export const writeEngage = (value: Engage): pb.Engage =>
  create(pb.EngageSchema, { device: value.device });

/** Returns the name of the first field that is out of bounds. */
export function refusedDisengage(m: pb.Disengage): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  return undefined;
}

export const readDisengage = (m: pb.Disengage): Disengage => ({ device: m.device });

export const writeDisengage = (value: Disengage): pb.Disengage =>
  create(pb.DisengageSchema, { device: value.device });

/** Returns the name of the first field that is out of bounds. */
export function refusedSetScale(m: pb.SetScale): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWithin(m.positionScale, 0.01, 100)) return "position_scale";
  if (!isWithin(m.forceScale, 0.01, 100)) return "force_scale";
  return undefined;
}

export const readSetScale = (m: pb.SetScale): SetScale => ({
  device: m.device,
  positionScale: m.positionScale,
  forceScale: m.forceScale,
});

export const writeSetScale = (value: SetScale): pb.SetScale =>
  create(pb.SetScaleSchema, { device: value.device, positionScale: value.positionScale, forceScale: value.forceScale });

/** Returns the name of the first field that is out of bounds. */
export function refusedSetShare(m: pb.SetShare): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (!isWithin(m.share, 0, 1)) return "share";
  return undefined;
}

export const readSetShare = (m: pb.SetShare): SetShare => ({ device: m.device, channel: m.channel, share: m.share });

export const writeSetShare = (value: SetShare): pb.SetShare =>
  create(pb.SetShareSchema, { device: value.device, channel: value.channel, share: value.share });

/** Returns the name of the first field that is out of bounds. */
export function refusedSetOutput(m: pb.SetOutput): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (m.setting.case === undefined) return "setting";
  if (!isWhole(m.output, 0, 7)) return "output";
  if (m.setting.case === "rgb" && !isWhole(m.setting.value, 0, 16_777_215)) return "rgb";
  const vibration = m.setting.case === "vibration" ? refusedVibration(m.setting.value) : undefined;
  if (vibration !== undefined) return `vibration.${vibration}`;
  return undefined;
}

export const readSetOutput = (m: pb.SetOutput): SetOutput => ({
  device: m.device,
  output: m.output,
  setting: m.setting.case === "vibration" ? readVibration(m.setting.value) : { rgb: m.setting.value ?? 0 },
});

export const writeSetOutput = (value: SetOutput): pb.SetOutput =>
  create(pb.SetOutputSchema, {
    device: value.device,
    output: value.output,
    setting: "rgb" in value.setting ? {
      case: "rgb",
      value: value.setting.rgb,
    } : { case: "vibration", value: writeVibration(value.setting) },
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedVibration(m: pb.Vibration): string | undefined {
  if (!isWithin(m.amplitude, 0, 1)) return "amplitude";
  if (!isWithin(m.frequencyHz, 0, 1000)) return "frequency_hz";
  if (!(m.frequencyHz === 0 || m.frequencyHz >= 20)) return "frequency_hz";
  if (!isWhole(m.durationMs, 0, 10_000)) return "duration_ms";
  return undefined;
}

export const readVibration = (m: pb.Vibration): Vibration => ({
  amplitude: m.amplitude,
  frequency: m.frequencyHz,
  durationMs: m.durationMs,
});

export const writeVibration = (value: Vibration): pb.Vibration =>
  create(pb.VibrationSchema, {
    amplitude: value.amplitude,
    frequencyHz: value.frequency,
    durationMs: value.durationMs,
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedDescribe(m: pb.Describe): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  return undefined;
}

export const readDescribe = (m: pb.Describe): Describe => ({ device: m.device, ...(m.handle && { handle: m.handle }) });

export const writeDescribe = (value: Describe): pb.Describe =>
  create(pb.DescribeSchema, { device: value.device, handle: value.handle ?? false });

/** Returns the name of the first field that is out of bounds. */
export function refusedTakeLease(m: pb.TakeLease): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  return undefined;
}

export const readTakeLease = (m: pb.TakeLease): TakeLease => ({ device: m.device, channel: m.channel });

export const writeTakeLease = (value: TakeLease): pb.TakeLease =>
  create(pb.TakeLeaseSchema, { device: value.device, channel: value.channel });

/** Returns the name of the first field that is out of bounds. */
export function refusedGiveLease(m: pb.GiveLease): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  return undefined;
}

export const readGiveLease = (m: pb.GiveLease): GiveLease => ({ device: m.device, channel: m.channel });

export const writeGiveLease = (value: GiveLease): pb.GiveLease =>
  create(pb.GiveLeaseSchema, { device: value.device, channel: value.channel });

/** Returns the name of the first field that is out of bounds. */
export function refusedLeaseLost(m: pb.LeaseLost): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (!isText(m.to, 64)) return "to";
  return undefined;
}

export const readLeaseLost = (m: pb.LeaseLost): LeaseLost => ({ device: m.device, channel: m.channel, to: m.to });

export const writeLeaseLost = (value: LeaseLost): pb.LeaseLost =>
  create(pb.LeaseLostSchema, { device: value.device, channel: value.channel, to: clip(value.to, 64) });

/** Returns the name of the first field that is out of bounds. */
export function refusedControlAck(m: pb.ControlAck): string | undefined {
  if (m.id < 1) return "id";
  if (!isEnum(m.code, pb.CodeSchema)) return "code";
  if (!isText(m.detail, 128)) return "detail";
  if (!isWhole(m.waitMs, 0, 3_600_000)) return "wait_ms";
  const device = m.device && refusedDeviceDescription(m.device);
  if (device !== undefined) return `device.${device}`;
  const handle = m.handle && refusedHandleDescription(m.handle);
  if (handle !== undefined) return `handle.${handle}`;
  return undefined;
}

export const readControlAck = (m: pb.ControlAck): ControlAck => ({
  id: m.id,
  code: m.code,
  detail: m.detail,
  ...(m.waitMs !== 0 && { waitMs: m.waitMs }),
  ...(m.device && { device: readDeviceDescription(m.device) }),
  ...(m.handle && { handle: readHandleDescription(m.handle) }),
});

export const writeControlAck = (value: ControlAck): pb.ControlAck =>
  create(pb.ControlAckSchema, {
    id: value.id,
    code: value.code,
    detail: clip(value.detail, 128),
    waitMs: value.waitMs ?? 0,
    ...(value.device && { device: writeDeviceDescription(value.device) }),
    ...(value.handle && { handle: writeHandleDescription(value.handle) }),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedDeviceDescription(m: pb.DeviceDescription): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isText(m.name, 24)) return "name";
  if (!isText(m.model, 64)) return "model";
  if (!isWhole(m.positionDof, 1, 6)) return "position_dof";
  if (!isWhole(m.forceDof, 1, 6)) return "force_dof";
  if (m.workspaceMinM && !isVec3(m.workspaceMinM)) return "workspace_min_m";
  if (m.workspaceMaxM && !isVec3(m.workspaceMaxM)) return "workspace_max_m";
  if (!isWithin(m.maxForceN, 0, 1e12)) return "max_force_n";
  if (!isWithin(m.continuousForceN, 0, 1e12)) return "continuous_force_n";
  if (!isWithin(m.maxStiffnessNpm, 0, 1e12)) return "max_stiffness_npm";
  if (!isWithin(m.positionResolutionM, 0, 1e12)) return "position_resolution_m";
  if (!isWhole(m.loopHz, 1, 1_000_000)) return "loop_hz";
  if (!areMessages(m.channels, 1, 8, refusedChannelDescription)) return "channels";
  if (!isBox(m.workspaceMinM, m.workspaceMaxM)) return "workspace_min_m";
  return undefined;
}

export const readDeviceDescription = (m: pb.DeviceDescription): DeviceDescription => ({
  device: m.device,
  name: m.name,
  model: m.model,
  positionDof: m.positionDof,
  forceDof: m.forceDof,
  workspace: m.workspaceMinM && m.workspaceMaxM && { min: readVec3(m.workspaceMinM), max: readVec3(m.workspaceMaxM) },
  maxForce: m.maxForceN,
  continuousForce: m.continuousForceN,
  maxStiffness: m.maxStiffnessNpm,
  positionResolution: m.positionResolutionM,
  loopHz: m.loopHz,
  channels: m.channels.map(readChannelDescription),
});

export const writeDeviceDescription = (value: DeviceDescription): pb.DeviceDescription =>
  create(pb.DeviceDescriptionSchema, {
    device: value.device,
    name: clip(value.name, 24),
    model: clip(value.model, 64),
    positionDof: value.positionDof,
    forceDof: value.forceDof,
    ...(value.workspace && {
      workspaceMinM: writeVec3(value.workspace.min),
      workspaceMaxM: writeVec3(value.workspace.max),
    }),
    maxForceN: value.maxForce,
    continuousForceN: value.continuousForce,
    maxStiffnessNpm: value.maxStiffness,
    positionResolutionM: value.positionResolution,
    loopHz: value.loopHz,
    channels: value.channels.slice(0, 8).map(writeChannelDescription),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedHandleDescription(m: pb.HandleDescription): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (m.operatorFromDevice && !isRotation(m.operatorFromDevice)) return "operator_from_device";
  if (!areTexts(m.buttons, 0, 16, 24)) return "buttons";
  if (!isWithin(m.maxTorqueNm, 0, 1e12)) return "max_torque_nm";
  if (m.gripperOpenRad !== undefined && !isWithin(m.gripperOpenRad, 0, 1e12)) return "gripper_open_rad";
  if (!isWithin(m.maxGripperForceN, 0, 1e12)) return "max_gripper_force_n";
  if (!isText(m.group, 24)) return "group";
  if (m.hand !== 0 && !isEnum(m.hand, pb.HandSchema)) return "hand";
  if (!areTexts(m.joints, 0, 8, 24)) return "joints";
  if (!areMessages(m.outputs, 0, 8, refusedOutputDescription)) return "outputs";
  return undefined;
}

export const readHandleDescription = (m: pb.HandleDescription): HandleDescription => ({
  device: m.device,
  buttons: m.buttons,
  orientationMeasured: m.orientationMeasured,
  maxTorque: m.maxTorqueNm,
  maxGripperForce: m.maxGripperForceN,
  group: m.group,
  hand: m.hand,
  ...(m.operatorFromDevice && { operatorFromDevice: readQuat(m.operatorFromDevice) }),
  ...(m.gripperOpenRad !== undefined && { gripperOpen: m.gripperOpenRad }),
  ...(m.joints.length > 0 && { joints: m.joints }),
  ...(m.outputs.length > 0 && { outputs: m.outputs.map(readOutputDescription) }),
});

export const writeHandleDescription = (value: HandleDescription): pb.HandleDescription =>
  create(pb.HandleDescriptionSchema, {
    device: value.device,
    ...(value.operatorFromDevice && { operatorFromDevice: writeQuat(value.operatorFromDevice) }),
    buttons: clipAll(value.buttons, 16, 24),
    orientationMeasured: value.orientationMeasured,
    maxTorqueNm: value.maxTorque,
    ...(value.gripperOpen !== undefined && { gripperOpenRad: value.gripperOpen }),
    maxGripperForceN: value.maxGripperForce,
    group: clip(value.group, 24),
    hand: value.hand,
    joints: clipAll(value.joints ?? [], 8, 24),
    outputs: (value.outputs ?? []).slice(0, 8).map(writeOutputDescription),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedOutputDescription(m: pb.OutputDescription): string | undefined {
  if (!isText(m.name, 24)) return "name";
  if (!isEnum(m.kind, pb.OutputKindSchema)) return "kind";
  return undefined;
}

export const readOutputDescription = (m: pb.OutputDescription): OutputDescription => ({
  name: m.name,
  kind: m.kind as number,
});

export const writeOutputDescription = (value: OutputDescription): pb.OutputDescription =>
  create(pb.OutputDescriptionSchema, { name: clip(value.name, 24), kind: value.kind as number });

/** Returns the name of the first field that is out of bounds. */
export function refusedChannelDescription(m: pb.ChannelDescription): string | undefined {
  if (!isText(m.name, 24)) return "name";
  if (!isEnum(m.rule, pb.ChannelRuleSchema)) return "rule";
  if (!isWhole(m.leaseMs, 0, 3_600_000)) return "lease_ms";
  if (!isText(m.holder, 24)) return "holder";
  return undefined;
}

export const readChannelDescription = (m: pb.ChannelDescription): ChannelDescription => ({
  name: m.name,
  rule: m.rule,
  leaseMs: m.leaseMs,
  holder: m.holder,
});

export const writeChannelDescription = (value: ChannelDescription): pb.ChannelDescription =>
  create(pb.ChannelDescriptionSchema, {
    name: clip(value.name, 24),
    rule: value.rule,
    leaseMs: value.leaseMs,
    holder: clip(value.holder, 24),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedBye(m: pb.Bye): string | undefined {
  if (!isEnum(m.code, pb.CodeSchema)) return "code";
  if (!isText(m.reason, 128)) return "reason";
  return undefined;
}

export const readBye = (m: pb.Bye): Bye => ({ code: m.code, reason: m.reason });

export const writeBye = (value: Bye): pb.Bye =>
  create(pb.ByeSchema, { code: value.code, reason: clip(value.reason, 128) });

/** Returns the name of the first field that is out of bounds. */
export function refusedLinkReport(m: pb.LinkReport): string | undefined {
  if (m.number < 1n) return "number";
  if (m.untilNs < -kMaxTime || m.untilNs > kMaxTime) return "until_ns";
  if (m.spanNs > kMaxTime) return "span_ns";
  if (m.worstLateNs > kMaxTime) return "worst_late_ns";
  if (m.longestGapNs > kMaxTime) return "longest_gap_ns";
  const roundTrip = m.roundTrip && refusedDelays(m.roundTrip);
  if (roundTrip !== undefined) return `round_trip.${roundTrip}`;
  const toServer = m.toServer && refusedDelays(m.toServer);
  if (toServer !== undefined) return `to_server.${toServer}`;
  const toClient = m.toClient && refusedDelays(m.toClient);
  if (toClient !== undefined) return `to_client.${toClient}`;
  if (m.clockOffsetNs < -kMaxTime || m.clockOffsetNs > kMaxTime) return "clock_offset_ns";
  if (!isWithin(m.clockDriftPpm, -1e12, 1e12)) return "clock_drift_ppm";
  if (m.clockErrorNs > kMaxTime) return "clock_error_ns";
  if (!isText(m.words, 128)) return "words";
  return undefined;
}

export const readLinkReport = (m: pb.LinkReport): LinkReport => ({
  number: m.number,
  untilNs: m.untilNs,
  spanNs: m.spanNs,
  forces: m.forces,
  lateServer: m.lateServer,
  lateNetwork: m.lateNetwork,
  lateEngine: m.lateEngine,
  worstLateNs: m.worstLateNs,
  longestGapNs: m.longestGapNs,
  roundTrip: m.roundTrip && readDelays(m.roundTrip),
  toServer: m.toServer && readDelays(m.toServer),
  toClient: m.toClient && readDelays(m.toClient),
  clockOffsetNs: m.clockOffsetNs,
  clockDriftPpm: m.clockDriftPpm,
  clockErrorNs: m.clockErrorNs,
  received: m.received,
  lost: m.lost,
  reordered: m.reordered,
  duplicated: m.duplicated,
  words: m.words,
  lateUnknown: m.lateUnknown,
  refusedNotFinite: m.refusedNotFinite,
  refusedOutOfBounds: m.refusedOutOfBounds,
  refusedUnknownTick: m.refusedUnknownTick,
  refusedOldSequence: m.refusedOldSequence,
});

export const writeLinkReport = (value: LinkReport): pb.LinkReport =>
  create(pb.LinkReportSchema, {
    number: value.number,
    untilNs: value.untilNs,
    spanNs: value.spanNs,
    forces: value.forces,
    lateServer: value.lateServer,
    lateNetwork: value.lateNetwork,
    lateEngine: value.lateEngine,
    worstLateNs: value.worstLateNs,
    longestGapNs: value.longestGapNs,
    ...(value.roundTrip && { roundTrip: writeDelays(value.roundTrip) }),
    ...(value.toServer && { toServer: writeDelays(value.toServer) }),
    ...(value.toClient && { toClient: writeDelays(value.toClient) }),
    clockOffsetNs: value.clockOffsetNs,
    clockDriftPpm: value.clockDriftPpm,
    clockErrorNs: value.clockErrorNs,
    received: value.received,
    lost: value.lost,
    reordered: value.reordered,
    duplicated: value.duplicated,
    words: clip(value.words, 128),
    lateUnknown: value.lateUnknown,
    refusedNotFinite: value.refusedNotFinite,
    refusedOutOfBounds: value.refusedOutOfBounds,
    refusedUnknownTick: value.refusedUnknownTick,
    refusedOldSequence: value.refusedOldSequence,
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedDelays(m: pb.Delays): string | undefined {
  if (m.medianNs < -kMaxTime || m.medianNs > kMaxTime) return "median_ns";
  if (m.p99Ns < -kMaxTime || m.p99Ns > kMaxTime) return "p99_ns";
  return undefined;
}

export const readDelays = (m: pb.Delays): Delays => ({ medianNs: m.medianNs, p99Ns: m.p99Ns });

export const writeDelays = (value: Delays): pb.Delays =>
  create(pb.DelaysSchema, { medianNs: value.medianNs, p99Ns: value.p99Ns });

/** Returns the name of the first field that is out of bounds. */
export function refusedPortState(m: pb.PortState): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (m.epoch < 1n) return "epoch";
  if (m.sequence < 1n) return "sequence";
  if (m.timeNs < -kMaxTime || m.timeNs > kMaxTime) return "time_ns";
  if (m.roundTripNs > 10_000_000_000n) return "round_trip_ns";
  if (!isEnum(m.phase, pb.PortPhaseSchema)) return "phase";
  if (m.positionM && !isVec3(m.positionM)) return "position_m";
  if (m.velocityMps && !isVec3(m.velocityMps)) return "velocity_mps";
  if (m.forceN && !isVec3(m.forceN)) return "force_n";
  if (m.contactForceN && !isVec3(m.contactForceN)) return "contact_force_n";
  if (!isWithin(m.accountJ, -1e3, 1e3)) return "account_j";
  if (!isWithin(m.needJ, 0, 1e3)) return "need_j";
  if (!isWithin(m.givenJ, 0, 1e6)) return "given_j";
  if (!isWithin(m.takenJ, 0, 1e6)) return "taken_j";
  if (m.waveIntegral && !isVec3(m.waveIntegral)) return "wave_integral";
  if (!isWithin(m.waveEnergyJ, 0, 1e6)) return "wave_energy_j";
  const surface = m.surface && refusedPortSurface(m.surface);
  if (surface !== undefined) return `surface.${surface}`;
  const turn = m.turn && refusedPortTurn(m.turn);
  if (turn !== undefined) return `turn.${turn}`;
  const grip = m.grip && refusedPortGrip(m.grip);
  if (grip !== undefined) return `grip.${grip}`;
  if (!isWithin(m.energyInJ, 0, 1e6)) return "energy_in_j";
  if (m.share !== undefined && !isWithin(m.share, 0, 1)) return "share";
  if (m.positionScale !== 0 && !isWithin(m.positionScale, 0.01, 100)) return "position_scale";
  if (m.forceScale !== 0 && !isWithin(m.forceScale, 0.01, 100)) return "force_scale";
  return undefined;
}

export const readPortState = (m: pb.PortState): PortState => ({
  device: m.device,
  channel: m.channel,
  epoch: m.epoch,
  sequence: m.sequence,
  answersEpoch: m.answersEpoch,
  answers: m.answers,
  timeNs: m.timeNs,
  roundTripNs: m.roundTripNs,
  phase: m.phase,
  engagement: m.engagement,
  buttons: m.buttons,
  position: readVec3(m.positionM),
  velocity: readVec3(m.velocityMps),
  force: readVec3(m.forceN),
  account: m.accountJ,
  need: m.needJ,
  given: m.givenJ,
  taken: m.takenJ,
  ...(m.contactForceN && { contactForce: readVec3(m.contactForceN) }),
  ...(m.waveIntegral && { waveIntegral: readVec3(m.waveIntegral) }),
  ...(m.waveEnergyJ !== 0 && { waveEnergy: m.waveEnergyJ }),
  ...(m.surface && { surface: readPortSurface(m.surface) }),
  ...(m.turn && { turn: readPortTurn(m.turn) }),
  ...(m.grip && { grip: readPortGrip(m.grip) }),
  ...(m.energyInJ !== 0 && { energyIn: m.energyInJ }),
  ...(m.share !== undefined && { share: m.share }),
  ...(m.positionScale !== 0 && { positionScale: m.positionScale }),
  ...(m.forceScale !== 0 && { forceScale: m.forceScale }),
  ...(m.ofPeer && { ofPeer: m.ofPeer }),
});

export const writePortState = (value: PortState): pb.PortState =>
  create(pb.PortStateSchema, {
    device: value.device,
    channel: value.channel,
    epoch: value.epoch,
    sequence: value.sequence,
    answersEpoch: value.answersEpoch,
    answers: value.answers,
    timeNs: value.timeNs,
    roundTripNs: value.roundTripNs,
    phase: value.phase,
    engagement: value.engagement,
    buttons: value.buttons,
    positionM: writeVec3(value.position),
    velocityMps: writeVec3(value.velocity),
    forceN: writeVec3(value.force),
    ...(value.contactForce && { contactForceN: writeVec3(value.contactForce) }),
    accountJ: value.account,
    needJ: value.need,
    givenJ: value.given,
    takenJ: value.taken,
    ...(value.waveIntegral && { waveIntegral: writeVec3(value.waveIntegral) }),
    waveEnergyJ: value.waveEnergy ?? 0,
    ...(value.surface && { surface: writePortSurface(value.surface) }),
    ...(value.turn && { turn: writePortTurn(value.turn) }),
    ...(value.grip && { grip: writePortGrip(value.grip) }),
    energyInJ: value.energyIn ?? 0,
    ...(value.share !== undefined && { share: value.share }),
    positionScale: value.positionScale ?? 0,
    forceScale: value.forceScale ?? 0,
    ofPeer: value.ofPeer ?? false,
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedPortTurn(m: pb.PortTurn): string | undefined {
  if (!m.turn || !isRotation(m.turn)) return "turn";
  if (m.angularVelocityRadps && !isVec3(m.angularVelocityRadps)) return "angular_velocity_radps";
  if (m.torqueNm && !isVec3(m.torqueNm)) return "torque_nm";
  return undefined;
}

export const readPortTurn = (m: pb.PortTurn): PortTurn => ({
  turn: readQuat(m.turn),
  angularVelocity: readVec3(m.angularVelocityRadps),
  torque: readVec3(m.torqueNm),
});

export const writePortTurn = (value: PortTurn): pb.PortTurn =>
  create(pb.PortTurnSchema, {
    turn: writeQuat(value.turn),
    angularVelocityRadps: writeVec3(value.angularVelocity),
    torqueNm: writeVec3(value.torque),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedPortGrip(m: pb.PortGrip): string | undefined {
  if (!isWithin(m.openingM, -1e12, 1e12)) return "opening_m";
  if (!isWithin(m.velocityMps, -1e12, 1e12)) return "velocity_mps";
  if (!isWithin(m.forceN, -1e12, 1e12)) return "force_n";
  if (!isWithin(m.accountJ, -1e3, 1e3)) return "account_j";
  if (!isWithin(m.needJ, 0, 1e3)) return "need_j";
  if (!isWithin(m.givenJ, 0, 1e6)) return "given_j";
  if (!isWithin(m.takenJ, 0, 1e6)) return "taken_j";
  return undefined;
}

export const readPortGrip = (m: pb.PortGrip): PortGrip => ({
  opening: m.openingM,
  velocity: m.velocityMps,
  force: m.forceN,
  account: m.accountJ,
  need: m.needJ,
  given: m.givenJ,
  taken: m.takenJ,
});

export const writePortGrip = (value: PortGrip): pb.PortGrip =>
  create(pb.PortGripSchema, {
    openingM: value.opening,
    velocityMps: value.velocity,
    forceN: value.force,
    accountJ: value.account,
    needJ: value.need,
    givenJ: value.given,
    takenJ: value.taken,
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedPortSurface(m: pb.PortSurface): string | undefined {
  if (!isNormal(m.normal)) return "normal";
  if (!isWithin(m.offsetM, -1e12, 1e12)) return "offset_m";
  if (!isWithin(m.stiffnessNpm, 0, 1e12)) return "stiffness_npm";
  return undefined;
}

export const readPortSurface = (m: pb.PortSurface): PortSurface => ({
  normal: readVec3(m.normal),
  offset: m.offsetM,
  stiffness: m.stiffnessNpm,
});

export const writePortSurface = (value: PortSurface): pb.PortSurface =>
  create(pb.PortSurfaceSchema, {
    normal: writeVec3(value.normal),
    offsetM: value.offset,
    stiffnessNpm: value.stiffness,
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedDeviceReport(m: pb.DeviceReport): string | undefined {
  if (m.number < 1n) return "number";
  if (m.untilNs < -kMaxTime || m.untilNs > kMaxTime) return "until_ns";
  if (m.spanNs > kMaxTime) return "span_ns";
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!(m.overruns <= m.steps)) return "overruns";
  if (!(m.unseen <= m.steps)) return "unseen";
  if (!areCounts(m.latenessUsLog2, 0, 24)) return "lateness_us_log2";
  if (!(sum(m.latenessUsLog2) <= m.steps)) return "lateness_us_log2";
  if (!isEnum(m.safety, pb.SafetySchema)) return "safety";
  if (!isText(m.fault, 128)) return "fault";
  if (!isText(m.degraded, 128)) return "degraded";
  return undefined;
}

export const readDeviceReport = (m: pb.DeviceReport): DeviceReport => ({
  number: m.number,
  untilNs: m.untilNs,
  spanNs: m.spanNs,
  device: m.device,
  steps: m.steps,
  missed: m.missed,
  overruns: m.overruns,
  unseen: m.unseen,
  lateness: m.latenessUsLog2,
  safety: m.safety,
  fault: m.fault,
  degraded: m.degraded,
});

export const writeDeviceReport = (value: DeviceReport): pb.DeviceReport =>
  create(pb.DeviceReportSchema, {
    number: value.number,
    untilNs: value.untilNs,
    spanNs: value.spanNs,
    device: value.device,
    steps: value.steps,
    missed: value.missed,
    overruns: value.overruns,
    unseen: value.unseen,
    latenessUsLog2: [...value.lateness],
    safety: value.safety,
    fault: clip(value.fault, 128),
    degraded: clip(value.degraded, 128),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedPeerReport(m: pb.PeerReport): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (!isText(m.name, 64)) return "name";
  if (!isWhole(m.stateOneIn, 1, 1000)) return "state_one_in";
  if (!m.link) return "link";
  const link = refusedLinkReport(m.link);
  if (link !== undefined) return `link.${link}`;
  if (m.errorN !== undefined && !isWithin(m.errorN, 0, 1e12)) return "error_n";
  if (!isText(m.way, 24)) return "way";
  return undefined;
}

export const readPeerReport = (m: pb.PeerReport): PeerReport => ({
  device: m.device,
  channel: m.channel,
  name: m.name,
  stateOneIn: m.stateOneIn,
  forcesRefused: m.forcesRefused,
  link: readLinkReport(m.link!),
  ...(m.errorN !== undefined && { error: m.errorN }),
  ...(m.way !== "" && { way: m.way }),
});

export const writePeerReport = (value: PeerReport): pb.PeerReport =>
  create(pb.PeerReportSchema, {
    device: value.device,
    channel: value.channel,
    name: clip(value.name, 64),
    stateOneIn: value.stateOneIn,
    forcesRefused: value.forcesRefused,
    link: writeLinkReport(value.link),
    ...(value.error !== undefined && { errorN: value.error }),
    way: clip(value.way ?? "", 24),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedHello(m: pb.Hello): string | undefined {
  if (m.versionMin < 1) return "version_min";
  if (!(m.versionMin <= m.versionMax)) return "version_min";
  if (!isEnum(m.role, pb.RoleSchema)) return "role";
  if (!isText(m.name, 64)) return "name";
  if (!areTexts(m.features, 0, 16, 32)) return "features";
  if (!areMessages(m.claims, 0, 16, refusedClaim)) return "claims";
  if (!areTexts(m.ways, 0, 8, 24)) return "ways";
  return undefined;
}

export const readHello = (m: pb.Hello): Hello => ({
  versionMin: m.versionMin,
  versionMax: m.versionMax,
  role: m.role,
  name: m.name,
  features: m.features,
  ...(m.claims.length > 0 && { claims: m.claims.map(readClaim) }),
  ...(m.ways.length > 0 && { ways: m.ways }),
});

export const writeHello = (value: Hello): pb.Hello =>
  create(pb.HelloSchema, {
    versionMin: value.versionMin,
    versionMax: value.versionMax,
    role: value.role,
    name: clip(value.name, 64),
    features: clipAll(value.features, 16, 32),
    claims: (value.claims ?? []).slice(0, 16).map(writeClaim),
    ways: clipAll(value.ways ?? [], 8, 24),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedClaim(m: pb.Claim): string | undefined {
  if (!isText(m.device, 24)) return "device";
  if (!isText(m.channel, 24)) return "channel";
  if (!isEnum(m.role, pb.RoleSchema)) return "role";
  return undefined;
}

export const readClaim = (m: pb.Claim): Claim => ({ device: m.device, channel: m.channel, role: m.role });

export const writeClaim = (value: Claim): pb.Claim =>
  create(pb.ClaimSchema, { device: clip(value.device, 24), channel: clip(value.channel, 24), role: value.role });

/** Returns the name of the first field that is out of bounds. */
export function refusedWelcome(m: pb.Welcome): string | undefined {
  if (m.version < 1) return "version";
  if (!areTexts(m.features, 0, 16, 32)) return "features";
  if (!isEnum(m.role, pb.RoleSchema)) return "role";
  if (!isText(m.deviceName, 64)) return "device_name";
  if (!isWithin(m.maxForceN, 0, 1e12)) return "max_force_n";
  if (!isWithin(m.positionResolutionM, 0, 1e12)) return "position_resolution_m";
  if (!isWhole(m.loopHz, 1, 1_000_000)) return "loop_hz";
  if (!isWhole(m.timeoutMs, 1, 3_600_000)) return "timeout_ms";
  if (!isText(m.server, 64)) return "server";
  if (!areMessages(m.grants, 0, 16, refusedGrant)) return "grants";
  return undefined;
}

export const readWelcome = (m: pb.Welcome): Welcome => ({
  version: m.version,
  features: m.features,
  role: m.role,
  deviceName: m.deviceName,
  maxForce: m.maxForceN,
  positionResolution: m.positionResolutionM,
  loopHz: m.loopHz,
  timeoutMs: m.timeoutMs,
  server: m.server,
  ...(m.grants.length > 0 && { grants: m.grants.map(readGrant) }),
});

export const writeWelcome = (value: Welcome): pb.Welcome =>
  create(pb.WelcomeSchema, {
    version: value.version,
    features: clipAll(value.features, 16, 32),
    role: value.role,
    deviceName: clip(value.deviceName, 64),
    maxForceN: value.maxForce,
    positionResolutionM: value.positionResolution,
    loopHz: value.loopHz,
    timeoutMs: value.timeoutMs,
    server: clip(value.server, 64),
    grants: (value.grants ?? []).slice(0, 16).map(writeGrant),
  });

/** Returns the name of the first field that is out of bounds. */
export function refusedGrant(m: pb.Grant): string | undefined {
  if (!isWhole(m.device, 0, 15)) return "device";
  if (!isWhole(m.channel, 0, 7)) return "channel";
  if (!isEnum(m.role, pb.RoleSchema)) return "role";
  return undefined;
}

export const readGrant = (m: pb.Grant): Grant => ({ device: m.device, channel: m.channel, role: m.role });

export const writeGrant = (value: Grant): pb.Grant =>
  create(pb.GrantSchema, { device: value.device, channel: value.channel, role: value.role });

/** Returns the name of the first field that is out of bounds. */
export function refusedRefused(m: pb.Refused): string | undefined {
  if (!isEnum(m.code, pb.CodeSchema)) return "code";
  if (!isText(m.detail, 128)) return "detail";
  return undefined;
}

export const readRefused = (m: pb.Refused): Refused => ({
  code: m.code,
  detail: m.detail,
  versionMin: m.versionMin,
  versionMax: m.versionMax,
});

export const writeRefused = (value: Refused): pb.Refused =>
  create(pb.RefusedSchema, {
    code: value.code,
    detail: clip(value.detail, 128),
    versionMin: value.versionMin,
    versionMax: value.versionMax,
  });

/** Returns undefined for another frame, or if a field is out of bounds. */
export function readFrame(body: pb.Frame["body"]): PlainFrame | undefined {
  switch (body.case) {
    case "state":
      if (refusedDeviceState(body.value) !== undefined) return undefined;
      return { kind: "state", value: readDeviceState(body.value) };
    case "force":
      if (refusedForceCommand(body.value) !== undefined) return undefined;
      return { kind: "force", value: readForceCommand(body.value) };
    case "controlAck":
      if (refusedControlAck(body.value) !== undefined) return undefined;
      return { kind: "controlAck", value: readControlAck(body.value) };
    case "bye":
      if (refusedBye(body.value) !== undefined) return undefined;
      return { kind: "bye", value: readBye(body.value) };
    case "report":
      if (refusedLinkReport(body.value) !== undefined) return undefined;
      return { kind: "report", value: readLinkReport(body.value) };
    case "deviceReport":
      if (refusedDeviceReport(body.value) !== undefined) return undefined;
      return { kind: "deviceReport", value: readDeviceReport(body.value) };
    case "peerReport":
      if (refusedPeerReport(body.value) !== undefined) return undefined;
      return { kind: "peerReport", value: readPeerReport(body.value) };
    case "portState":
      if (refusedPortState(body.value) !== undefined) return undefined;
      return { kind: "port", value: readPortState(body.value) };
    case "fieldBrick":
      if (refusedFieldBrick(body.value) !== undefined) return undefined;
      return { kind: "fieldBrick", value: readFieldBrick(body.value) };
    case "fieldStatus":
      if (refusedFieldStatus(body.value) !== undefined) return undefined;
      return { kind: "fieldStatus", value: readFieldStatus(body.value) };
    case "fieldPose":
      if (refusedFieldPose(body.value) !== undefined) return undefined;
      return { kind: "fieldPose", value: readFieldPose(body.value) };
    default:
      return undefined;
  }
}

export function writeFrame(frame: PlainFrame): pb.Frame["body"] {
  switch (frame.kind) {
    case "state":
      return { case: "state", value: writeDeviceState(frame.value) };
    case "force":
      return { case: "force", value: writeForceCommand(frame.value) };
    case "controlAck":
      return { case: "controlAck", value: writeControlAck(frame.value) };
    case "bye":
      return { case: "bye", value: writeBye(frame.value) };
    case "report":
      return { case: "report", value: writeLinkReport(frame.value) };
    case "deviceReport":
      return { case: "deviceReport", value: writeDeviceReport(frame.value) };
    case "peerReport":
      return { case: "peerReport", value: writePeerReport(frame.value) };
    case "port":
      return { case: "portState", value: writePortState(frame.value) };
    case "fieldBrick":
      return { case: "fieldBrick", value: writeFieldBrick(frame.value) };
    case "fieldStatus":
      return { case: "fieldStatus", value: writeFieldStatus(frame.value) };
    case "fieldPose":
      return { case: "fieldPose", value: writeFieldPose(frame.value) };
  }
}

/** Returns the name of the first field that is out of bounds; undefined: the request is not known. */
export function readRequest(op: pb.Control["op"]): Request | string | undefined {
  switch (op.case) {
    case "setStateRate":
      return refusedSetStateRate(op.value) ?? { kind: op.case, ...readSetStateRate(op.value) };
    case "rearm":
      return refusedRearm(op.value) ?? { kind: op.case, ...readRearm(op.value) };
    case "describe":
      return refusedDescribe(op.value) ?? { kind: op.case, ...readDescribe(op.value) };
    case "takeLease":
      return refusedTakeLease(op.value) ?? { kind: op.case, ...readTakeLease(op.value) };
    case "giveLease":
      return refusedGiveLease(op.value) ?? { kind: op.case, ...readGiveLease(op.value) };
    case "leaseLost":
      return refusedLeaseLost(op.value) ?? { kind: op.case, ...readLeaseLost(op.value) };
    case "setStateDeadband":
      return refusedSetStateDeadband(op.value) ?? { kind: op.case, ...readSetStateDeadband(op.value) };
    case "disarm":
      return refusedDisarm(op.value) ?? { kind: op.case, ...readDisarm(op.value) };
    case "setOutput":
      return refusedSetOutput(op.value) ?? { kind: op.case, ...readSetOutput(op.value) };
    case "couple":
      return refusedCouple(op.value) ?? { kind: op.case, ...readCouple(op.value) };
    case "engage":
      return refusedEngage(op.value) ?? { kind: op.case, ...readEngage(op.value) };
    case "disengage":
      return refusedDisengage(op.value) ?? { kind: op.case, ...readDisengage(op.value) };
    case "setScale":
      return refusedSetScale(op.value) ?? { kind: op.case, ...readSetScale(op.value) };
    case "setShare":
      return refusedSetShare(op.value) ?? { kind: op.case, ...readSetShare(op.value) };
    case "offerField":
      return refusedOfferField(op.value) ?? { kind: op.case, ...readOfferField(op.value) };
    case "useField":
      return refusedUseField(op.value) ?? { kind: op.case, ...readUseField(op.value) };
    case "dropField":
      return refusedDropField(op.value) ?? { kind: op.case, ...readDropField(op.value) };
    default:
      return undefined;
  }
}

export function writeRequest(request: Request): pb.Control["op"] {
  switch (request.kind) {
    case "setStateRate":
      return { case: request.kind, value: writeSetStateRate(request) };
    case "rearm":
      return { case: request.kind, value: writeRearm(request) };
    case "describe":
      return { case: request.kind, value: writeDescribe(request) };
    case "takeLease":
      return { case: request.kind, value: writeTakeLease(request) };
    case "giveLease":
      return { case: request.kind, value: writeGiveLease(request) };
    case "leaseLost":
      return { case: request.kind, value: writeLeaseLost(request) };
    case "setStateDeadband":
      return { case: request.kind, value: writeSetStateDeadband(request) };
    case "disarm":
      return { case: request.kind, value: writeDisarm(request) };
    case "setOutput":
      return { case: request.kind, value: writeSetOutput(request) };
    case "couple":
      return { case: request.kind, value: writeCouple(request) };
    case "engage":
      return { case: request.kind, value: writeEngage(request) };
    case "disengage":
      return { case: request.kind, value: writeDisengage(request) };
    case "setScale":
      return { case: request.kind, value: writeSetScale(request) };
    case "setShare":
      return { case: request.kind, value: writeSetShare(request) };
    case "offerField":
      return { case: request.kind, value: writeOfferField(request) };
    case "useField":
      return { case: request.kind, value: writeUseField(request) };
    case "dropField":
      return { case: request.kind, value: writeDropField(request) };
  }
}

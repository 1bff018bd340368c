// SPDX-License-Identifier: Apache-2.0
// The frames of a coupling to protobuf and back, for the codec only.
import { create } from "@bufbuild/protobuf";
import { isChannel, isDevice, isMagnitude, isRotation, isTime, isVec3 } from "./bounds.js";
import { isEnum, readQuat, readVec3, writeQuat, writeVec3 } from "./fields.js";
import * as pb from "./gen/tendon_pb.js";
import * as limits from "./limits.js";
import type { Couple, PortGrip, PortState, PortSurface, PortTurn, RateControl, SetScale, SetShare } from "./messages.js";

const isWithin = (value: number, least: number, most: number): boolean => value >= least && value <= most; // false for NaN

const readSurface = ({ normal, offsetM, stiffnessNpm }: pb.PortSurface): PortSurface =>
  ({ normal: readVec3(normal), offset: offsetM, stiffness: stiffnessNpm });

const isSurface = ({ normal, offset, stiffness }: PortSurface): boolean =>
  Math.abs(Math.hypot(normal.x, normal.y, normal.z) - 1) <= limits.kUnitTolerance &&
  isWithin(offset, -limits.kMaxValue, limits.kMaxValue) && isMagnitude(stiffness);

/** No rotation is none of length 1. */
const readTurn = ({ turn, angularVelocityRadps, torqueNm }: pb.PortTurn): PortTurn => ({
  turn: turn ? readQuat(turn) : { w: 0, x: 0, y: 0, z: 0 },
  angularVelocity: readVec3(angularVelocityRadps),
  torque: readVec3(torqueNm),
});

const isTurn = ({ turn, angularVelocity, torque }: PortTurn): boolean =>
  isRotation(turn) && isVec3(angularVelocity) && isVec3(torque);

const writeTurn = ({ turn, angularVelocity, torque }: PortTurn): pb.PortTurn =>
  create(pb.PortTurnSchema, {
    turn: writeQuat(turn), angularVelocityRadps: writeVec3(angularVelocity), torqueNm: writeVec3(torque),
  });

const readGrip = ({ openingM, velocityMps, forceN, accountJ, needJ, givenJ, takenJ }: pb.PortGrip): PortGrip => ({
  opening: openingM, velocity: velocityMps, force: forceN, account: accountJ, need: needJ, given: givenJ, taken: takenJ,
});

const isGrip = ({ opening, velocity, force, ...purse }: PortGrip): boolean =>
  [opening, velocity, force].every((value) => isWithin(value, -limits.kMaxValue, limits.kMaxValue)) && isPurse(purse);

const writeGrip = ({ opening, velocity, force, account, need, given, taken }: PortGrip): pb.PortGrip =>
  create(pb.PortGripSchema, {
    openingM: opening, velocityMps: velocity, forceN: force, accountJ: account, needJ: need, givenJ: given, takenJ: taken,
  });

type Purse = Pick<PortState, "account" | "need" | "given" | "taken">;
const isPurse = ({ account, need, given, taken }: Purse): boolean =>
  isWithin(account, -limits.kMaxAccount, limits.kMaxAccount) && isWithin(need, 0, limits.kMaxAccount) &&
  isWithin(given, 0, limits.kMaxTotal) && isWithin(taken, 0, limits.kMaxTotal);

const isScale = (scale: number): boolean => isWithin(scale, limits.kMinScale, limits.kMaxScale);

export function readPort(from: pb.PortState): PortState | undefined {
  const { device, channel, epoch, sequence, answersEpoch, answers, timeNs, roundTripNs, phase, engagement, buttons } = from;
  const port: PortState = {
    device, channel, epoch, sequence, answersEpoch, answers, timeNs, roundTripNs, phase, engagement, buttons,
    position: readVec3(from.positionM),
    velocity: readVec3(from.velocityMps),
    force: readVec3(from.forceN),
    ...(from.contactForceN && { contactForce: readVec3(from.contactForceN) }),
    account: from.accountJ,
    need: from.needJ,
    given: from.givenJ,
    taken: from.takenJ,
    ...(from.waveIntegral && { waveIntegral: readVec3(from.waveIntegral) }),
    ...(from.waveEnergyJ !== 0 && { waveEnergy: from.waveEnergyJ }),
    ...(from.surface && { surface: readSurface(from.surface) }),
    ...(from.turn && { turn: readTurn(from.turn) }),
    ...(from.grip && { grip: readGrip(from.grip) }),
    ...(from.energyInJ !== 0 && { energyIn: from.energyInJ }),
    ...(from.share !== undefined && { share: from.share }),
    ...(from.positionScale !== 0 && { positionScale: from.positionScale }),
    ...(from.forceScale !== 0 && { forceScale: from.forceScale }),
    ...(from.ofPeer && { ofPeer: true }),
  };
  const good = isDevice(device) && isChannel(channel) && epoch > 0n && sequence > 0n && isTime(timeNs) &&
    roundTripNs <= limits.kMaxRoundTripNs && isEnum(phase, pb.PortPhaseSchema) && isVec3(port.position) &&
    isVec3(port.velocity) && isVec3(port.force) && (!port.contactForce || isVec3(port.contactForce)) &&
    isPurse(port) &&
    (!port.waveIntegral || isVec3(port.waveIntegral)) && isWithin(port.waveEnergy ?? 0, 0, limits.kMaxTotal) &&
    (!port.surface || isSurface(port.surface)) && (!port.turn || isTurn(port.turn)) && (!port.grip || isGrip(port.grip)) &&
    isWithin(port.energyIn ?? 0, 0, limits.kMaxTotal) && isWithin(port.share ?? 0, 0, 1) &&
    isScale(port.positionScale ?? 1) && isScale(port.forceScale ?? 1);
  return good ? port : undefined;
}

export function writePort(port: PortState): pb.PortState {
  const { position, velocity, force, contactForce, account, need, given, taken, waveIntegral, waveEnergy, surface, turn, grip,
    energyIn, share, positionScale, forceScale, ofPeer, ...rest } = port;
  return create(pb.PortStateSchema, {
    ...rest,
    positionM: writeVec3(position),
    velocityMps: writeVec3(velocity),
    forceN: writeVec3(force),
    ...(contactForce && { contactForceN: writeVec3(contactForce) }),
    accountJ: account,
    needJ: need,
    givenJ: given,
    takenJ: taken,
    ...(waveIntegral && { waveIntegral: writeVec3(waveIntegral) }),
    waveEnergyJ: waveEnergy ?? 0,
    ...(surface && {
      surface: { normal: writeVec3(surface.normal), offsetM: surface.offset, stiffnessNpm: surface.stiffness },
    }),
    ...(turn && { turn: writeTurn(turn) }),
    ...(grip && { grip: writeGrip(grip) }),
    energyInJ: energyIn ?? 0,
    ...(share !== undefined && { share }),
    positionScale: positionScale ?? 0,
    forceScale: forceScale ?? 0,
    ofPeer: ofPeer ?? false,
  });
}

const isRate = ({ deadZone, gain, maxSpeed }: RateControl): boolean =>
  [deadZone, gain, maxSpeed].every(isMagnitude) && gain > 0 && maxSpeed > 0;

/** Undefined without a rotation, as this is how all else out of bounds ends, too. */
export function readCouple(from: pb.Couple): Couple | undefined {
  const { device, channel, role, method, positionScale, forceScale, axes, adaptToDelay, purse, periodUs } = from;
  const rotation = from.rotation && readQuat(from.rotation);
  const sizes = [from.stiffnessNpm, from.mutualDampingNspm, from.dampingNspm] as const;
  const { turnStiffnessNmprad, turnDampingNmsprad, gripStiffnessNpm, gripDampingNspm, driftRatePerS } = from;
  const more = [turnStiffnessNmprad, turnDampingNmsprad, gripStiffnessNpm, gripDampingNspm, driftRatePerS] as const;
  const rate = from.rate && { deadZone: from.rate.deadZoneM, gain: from.rate.gainPerS, maxSpeed: from.rate.maxSpeedMps };
  const good = isDevice(device) && isChannel(channel) && isEnum(role, pb.PortRoleSchema) &&
    isEnum(method, pb.CouplingMethodSchema) && isScale(positionScale) && isScale(forceScale) && axes >= 1 && axes <= 7 &&
    [...sizes, ...more].every(isMagnitude) && (!rate || isRate(rate)) && periodUs >= 1 &&
    periodUs <= limits.kMaxValidForMs * 1000;
  if (!good || !rotation || !isRotation(rotation)) return undefined;
  const [stiffness, mutualDamping, damping] = sizes;
  return {
    device, channel, role, method, positionScale, forceScale, rotation, axes, stiffness, mutualDamping, damping, adaptToDelay,
    purse, periodUs,
    ...(from.absolute && { absolute: true }),
    ...(turnStiffnessNmprad !== 0 && { turnStiffness: turnStiffnessNmprad }),
    ...(turnDampingNmsprad !== 0 && { turnDamping: turnDampingNmsprad }),
    ...(gripStiffnessNpm !== 0 && { gripStiffness: gripStiffnessNpm }),
    ...(gripDampingNspm !== 0 && { gripDamping: gripDampingNspm }),
    ...(driftRatePerS !== 0 && { driftRate: driftRatePerS }),
    ...(rate && { rate }),
  };
}

export function writeCouple(couple: Couple): pb.Couple {
  const { rotation, stiffness, mutualDamping, damping, absolute, turnStiffness, turnDamping, gripStiffness, gripDamping, driftRate,
    rate, ...rest } = couple;
  return create(pb.CoupleSchema, {
    ...rest, rotation: writeQuat(rotation), stiffnessNpm: stiffness, mutualDampingNspm: mutualDamping, dampingNspm: damping,
    absolute: absolute ?? false,
    turnStiffnessNmprad: turnStiffness ?? 0,
    turnDampingNmsprad: turnDamping ?? 0,
    gripStiffnessNpm: gripStiffness ?? 0,
    gripDampingNspm: gripDamping ?? 0,
    driftRatePerS: driftRate ?? 0,
    ...(rate && { rate: { deadZoneM: rate.deadZone, gainPerS: rate.gain, maxSpeedMps: rate.maxSpeed } }),
  });
}

/** Whether a receiver accepts it. */
export const isSetScale = ({ positionScale, forceScale }: Omit<SetScale, "device">): boolean =>
  isScale(positionScale) && isScale(forceScale);

/** Whether a receiver accepts it. */
export const isSetShare = ({ channel, share }: Omit<SetShare, "device">): boolean =>
  Number.isInteger(channel) && channel >= 0 && isChannel(channel) && isWithin(share, 0, 1);

// SPDX-License-Identifier: Apache-2.0
// The frames of a coupling to protobuf and back, for the codec only.
import { create } from "@bufbuild/protobuf";
import { isChannel, isDevice, isMagnitude, isRotation, isTime, isVec3 } from "./bounds.js";
import { isEnum, readQuat, readVec3, writeQuat, writeVec3 } from "./fields.js";
import * as pb from "./gen/tendon_pb.js";
import * as limits from "./limits.js";
import type { Couple, PortState } from "./messages.js";

const isWithin = (value: number, least: number, most: number): boolean => value >= least && value <= most;
const isScale = (value: number): boolean => isWithin(value, limits.kMinScale, limits.kMaxScale);

export function readPort(from: pb.PortState): PortState | undefined {
  const { device, channel, epoch, sequence, answersEpoch, answers, timeNs, roundTripNs, phase, engagement, buttons } = from;
  const port: PortState = {
    device, channel, epoch, sequence, answersEpoch, answers, timeNs, roundTripNs, phase, engagement, buttons,
    position: readVec3(from.positionM), velocity: readVec3(from.velocityMps), force: readVec3(from.forceN),
    ...(from.contactForceN && { contactForce: readVec3(from.contactForceN) }),
    account: from.accountJ, need: from.needJ, given: from.givenJ, taken: from.takenJ,
  };
  const good = isDevice(device) && isChannel(channel) && epoch > 0n && sequence > 0n && isTime(timeNs) &&
    roundTripNs <= limits.kMaxRoundTripNs && isEnum(phase, pb.PortPhaseSchema) && isVec3(port.position) &&
    isVec3(port.velocity) && isVec3(port.force) && (!port.contactForce || isVec3(port.contactForce)) &&
    isWithin(port.account, -limits.kMaxAccount, limits.kMaxAccount) && isWithin(port.need, 0, limits.kMaxAccount) &&
    isWithin(port.given, 0, limits.kMaxTotal) && isWithin(port.taken, 0, limits.kMaxTotal);
  return good ? port : undefined;
}

export function writePort(from: PortState): pb.PortState {
  const { position, velocity, force, contactForce, account, need, given, taken, ...rest } = from;
  return create(pb.PortStateSchema, {
    ...rest, positionM: writeVec3(position), velocityMps: writeVec3(velocity), forceN: writeVec3(force),
    ...(contactForce && { contactForceN: writeVec3(contactForce) }),
    accountJ: account, needJ: need, givenJ: given, takenJ: taken,
  });
}

export function readCouple(from: pb.Couple): Couple {
  const { role, method, positionScale, forceScale, axes, adaptToDelay, purse, periodUs, device, channel } = from;
  return {
    role, method, positionScale, forceScale, rotation: readQuat(from.rotation), axes, stiffness: from.stiffnessNpm,
    mutualDamping: from.mutualDampingNspm, damping: from.dampingNspm, adaptToDelay, purse, periodUs, device, channel,
  };
}

export const isCouple = (couple: Couple): boolean =>
  isEnum(couple.role, pb.PortRoleSchema) && isEnum(couple.method, pb.CouplingMethodSchema) &&
  isScale(couple.positionScale) && isScale(couple.forceScale) && isRotation(couple.rotation) && couple.axes >= 1 &&
  couple.axes <= 7 && [couple.stiffness, couple.mutualDamping, couple.damping].every(isMagnitude) &&
  couple.periodUs >= 1 && couple.periodUs <= limits.kMaxValidForMs * 1000 && isDevice(couple.device) && isChannel(couple.channel);

export const writeCouple = ({ rotation, stiffness, mutualDamping, damping, ...rest }: Couple): pb.Couple =>
  create(pb.CoupleSchema, {
    ...rest, rotation: writeQuat(rotation), stiffnessNpm: stiffness, mutualDampingNspm: mutualDamping, dampingNspm: damping,
  });

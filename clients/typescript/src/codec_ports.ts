// SPDX-License-Identifier: Apache-2.0
// The frames of a coupling to protobuf and back, for the codec only.
import { create } from "@bufbuild/protobuf";
import { isChannel, isDevice, isMagnitude, isRotation, isTime, isVec3 } from "./bounds.js";
import { isEnum, readQuat, readVec3, writeQuat, writeVec3 } from "./fields.js";
import * as pb from "./gen/tendon_pb.js";
import * as limits from "./limits.js";
import type { Couple, PortState, PortSurface } from "./messages.js";

const isWithin = (value: number, least: number, most: number): boolean => value >= least && value <= most; // false for NaN

const readSurface = ({ normal, offsetM, stiffnessNpm }: pb.PortSurface): PortSurface =>
  ({ normal: readVec3(normal), offset: offsetM, stiffness: stiffnessNpm });

const isSurface = ({ normal, offset, stiffness }: PortSurface): boolean =>
  Math.abs(Math.hypot(normal.x, normal.y, normal.z) - 1) <= limits.kUnitTolerance &&
  isWithin(offset, -limits.kMaxValue, limits.kMaxValue) && isMagnitude(stiffness);

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
  };
  const good = isDevice(device) && isChannel(channel) && epoch > 0n && sequence > 0n && isTime(timeNs) &&
    roundTripNs <= limits.kMaxRoundTripNs && isEnum(phase, pb.PortPhaseSchema) && isVec3(port.position) &&
    isVec3(port.velocity) && isVec3(port.force) && (!port.contactForce || isVec3(port.contactForce)) &&
    isWithin(port.account, -limits.kMaxAccount, limits.kMaxAccount) && isWithin(port.need, 0, limits.kMaxAccount) &&
    isWithin(port.given, 0, limits.kMaxTotal) && isWithin(port.taken, 0, limits.kMaxTotal) &&
    (!port.waveIntegral || isVec3(port.waveIntegral)) && isWithin(port.waveEnergy ?? 0, 0, limits.kMaxTotal) &&
    (!port.surface || isSurface(port.surface));
  return good ? port : undefined;
}

export function writePort(port: PortState): pb.PortState {
  const { position, velocity, force, contactForce, account, need, given, taken, waveIntegral, waveEnergy, surface, ...rest } = port;
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
  });
}

/** Undefined without a rotation, as this is how all else out of bounds ends, too. */
export function readCouple(from: pb.Couple): Couple | undefined {
  const { device, channel, role, method, positionScale, forceScale, axes, adaptToDelay, purse, periodUs } = from;
  const rotation = from.rotation && readQuat(from.rotation);
  const sizes = [from.stiffnessNpm, from.mutualDampingNspm, from.dampingNspm] as const;
  const good = isDevice(device) && isChannel(channel) && isEnum(role, pb.PortRoleSchema) &&
    isEnum(method, pb.CouplingMethodSchema) && isWithin(positionScale, limits.kMinScale, limits.kMaxScale) &&
    isWithin(forceScale, limits.kMinScale, limits.kMaxScale) && axes >= 1 && axes <= 7 && sizes.every(isMagnitude) &&
    periodUs >= 1 && periodUs <= limits.kMaxValidForMs * 1000;
  if (!good || !rotation || !isRotation(rotation)) return undefined;
  const [stiffness, mutualDamping, damping] = sizes;
  return {
    device, channel, role, method, positionScale, forceScale, rotation, axes, stiffness, mutualDamping, damping, adaptToDelay,
    purse, periodUs,
  };
}

export function writeCouple({ rotation, stiffness, mutualDamping, damping, ...rest }: Couple): pb.Couple {
  return create(pb.CoupleSchema, {
    ...rest, rotation: writeQuat(rotation), stiffnessNpm: stiffness, mutualDampingNspm: mutualDamping, dampingNspm: damping,
  });
}

// SPDX-License-Identifier: Apache-2.0
// The reports of a server to protobuf and back, for the codec only.
import { create } from "@bufbuild/protobuf";
import { isBounded, isChannel, isDevice, isError, isLength, isTime } from "./bounds.js";
import { clip, isEnum, isText } from "./fields.js";
import * as pb from "./gen/tendon_pb.js";
import * as limits from "./limits.js";
import type { Delays, DeviceReport, LinkReport, PeerReport } from "./messages.js";

const readDelays = (from: pb.Delays | undefined): Delays | undefined =>
  from && { medianNs: from.medianNs, p99Ns: from.p99Ns };
const areDelays = (delays: Delays | undefined): boolean => !delays || (isTime(delays.medianNs) && isTime(delays.p99Ns));

export function readReport(from: pb.LinkReport): LinkReport | undefined {
  const { $typeName: _name, $unknown: _unknown, roundTrip, toServer, toClient, ...rest } = from;
  const report: LinkReport = {
    ...rest,
    roundTrip: readDelays(roundTrip),
    toServer: readDelays(toServer),
    toClient: readDelays(toClient),
  };
  const good = report.number > 0n && isTime(report.untilNs) && isLength(report.spanNs) && isLength(report.worstLateNs) &&
    isLength(report.longestGapNs) && areDelays(report.roundTrip) && areDelays(report.toServer) &&
    areDelays(report.toClient) && isTime(report.clockOffsetNs) && isBounded(report.clockDriftPpm) &&
    isLength(report.clockErrorNs) && isText(report.words, limits.kMaxDetail);
  return good ? report : undefined;
}

export function writeReport({ roundTrip, toServer, toClient, words, ...rest }: LinkReport): pb.LinkReport {
  return create(pb.LinkReportSchema, {
    ...rest,
    ...(roundTrip && { roundTrip: create(pb.DelaysSchema, roundTrip) }),
    ...(toServer && { toServer: create(pb.DelaysSchema, toServer) }),
    ...(toClient && { toClient: create(pb.DelaysSchema, toClient) }),
    words: clip(words, limits.kMaxDetail),
  });
}

export function readDeviceReport(from: pb.DeviceReport): DeviceReport | undefined {
  const { $typeName: _name, $unknown: _unknown, latenessUsLog2: lateness, ...rest } = from;
  const { number, untilNs, spanNs, device, steps, overruns, unseen, safety, fault, degraded } = rest;
  const good = number > 0n && isTime(untilNs) && isLength(spanNs) && isDevice(device) && overruns <= steps && unseen <= steps &&
    lateness.length <= limits.kLatenessBuckets && lateness.reduce((sum, count) => sum + count, 0n) <= steps &&
    isEnum(safety, pb.SafetySchema) && isText(fault, limits.kMaxDetail) && isText(degraded, limits.kMaxDetail);
  return good ? { ...rest, lateness } : undefined;
}

export function writeDeviceReport({ lateness, fault, degraded, ...rest }: DeviceReport): pb.DeviceReport {
  return create(pb.DeviceReportSchema, {
    ...rest, latenessUsLog2: [...lateness], fault: clip(fault, limits.kMaxDetail), degraded: clip(degraded, limits.kMaxDetail),
  });
}

export function readPeerReport(from: pb.PeerReport): PeerReport | undefined {
  const { device, channel, name, stateOneIn, forcesRefused, errorN: error, way } = from;
  const link = from.link && readReport(from.link);
  const good = isDevice(device) && isChannel(channel) && isText(name, limits.kMaxName) && stateOneIn >= 1 &&
    stateOneIn <= limits.kMaxOneIn && isError(error) && isText(way, limits.kMaxLabel);
  if (!good || !link) return undefined;
  return {
    device, channel, name, stateOneIn, forcesRefused, link, ...(error !== undefined && { error }), ...(way && { way }),
  };
}

export function writePeerReport({ link, name, error, way, ...rest }: PeerReport): pb.PeerReport {
  return create(pb.PeerReportSchema, {
    ...rest, name: clip(name, limits.kMaxName), link: writeReport(link), ...(error !== undefined && { errorN: error }),
    way: clip(way ?? "", limits.kMaxLabel),
  });
}

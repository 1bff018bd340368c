// SPDX-License-Identifier: Apache-2.0
import {
  decodeData, encodeFrame, encodeHead, type ControlAck, type DataContent, type Echo, type Frame,
} from "./codec.js";
import { CipherSuite, DatagramType, decodeHeader, kHeaderSize, concat } from "./datagram.js";
import { kByes, kMaxDatagram, kMaxForged, kMaxPacketNumber } from "./limits.js";
import {
  Code, type DeviceReport, type DeviceState, type FieldBrick, type FieldPose, type FieldStatus, type ForceCommand, type LinkReport,
  type PeerReport, type PortState, type Request,
} from "./messages.js";
import { ReplayWindow } from "./replay_window.js";
import { IncomingRequests, OutgoingRequests } from "./requests.js";
import { RoundTrip } from "./round_trip.js";
import { PlainSeal, type Seal } from "./seal.js";
import { earliest, kMillisecond, kNever, kSecond, toMilliseconds, type Nanoseconds } from "./time.js";

/**
 * Counters of one session. Each received datagram increments exactly one of `received`, `duplicated`, `malformed`,
 * `forged` and `oldKey`.
 */
export interface LinkStats {
  sent: number;
  /** Accepted. */
  received: number;
  /** The number of packets of the peer that have never been received (so far). */
  lost: number;
  /** The number of packets that were not received by the peer according to its ack vectors. */
  lostOutgoing: number;
  /** The number of datagrams that were accepted but are older than a previous one. */
  reordered: number;
  /** The number of dropped datagrams that were received before, are too old, or belong to the handshake. */
  duplicated: number;
  /** The number of datagrams that were dropped because they do not belong to this session. */
  malformed: number;
  /** The number of datagrams that were dropped because the authentication failed (suites 1 and 2). */
  forged: number;
  /** The number of datagrams that were dropped because their key has expired or is too far ahead (suites 1 and 2). */
  oldKey: number;
  /** The number of frames that were dropped because a value is out of bounds (NaN, Infinity …). */
  invalid: number;
  /** The number of frames that were dropped because they are not newer than the newest state, force or report. */
  stale: number;
  /** The newest sample of the round trip, ms. It is undefined before the first one. */
  roundTripMs: number | undefined;
  /** ms, SRTT of RFC 6298. */
  smoothedRoundTripMs: number;
  /** ms, RTTVAR of RFC 6298. */
  roundTripVariationMs: number;
}

/** These are sent to observers that request diagnostics. */
export type Diagnosis =
  | { readonly kind: "deviceReport"; readonly value: DeviceReport }
  | { readonly kind: "peerReport"; readonly value: PeerReport };

/** The key of the streams in which only the newest report is kept. */
function streamOf({ kind, value }: Diagnosis): string {
  return kind === "deviceReport" ? `${value.device}` : `${value.device}/${value.channel}`;
}
function numberOf({ kind, value }: Diagnosis): bigint {
  return kind === "deviceReport" ? value.number : value.link.number;
}
const endOf = ({ device, channel, ofPeer }: PortState): string => `${device}/${channel}/${ofPeer ? "peer" : "own"}`;
/** Removes and returns the oldest entry. */
function takeFirst<Value>(from: Map<string, Value>): Value | undefined {
  for (const [key, value] of from) {
    from.delete(key);
    return value;
  }
  return undefined;
}

export type SessionEvent =
  | { readonly kind: "state"; readonly state: DeviceState }
  | { readonly kind: "force"; readonly command: ForceCommand }
  | { readonly kind: "report"; readonly report: LinkReport }
  | Diagnosis
  | { readonly kind: "port"; readonly port: PortState }
  | { readonly kind: "fieldStatus"; readonly status: FieldStatus }
  | { readonly kind: "request"; readonly id: number; readonly request: Request }
  | ({ readonly kind: "answered" } & ControlAck)
  /**
   * The last event of a session, which was closed by a Bye of the peer, because the peer was silent (Code.TIMED_OUT), or
   * because the maximum age was reached (Code.EXPIRED).
   */
  | { readonly kind: "closed"; readonly code: Code; readonly reason: string };

export interface SessionConfig {
  readonly connectionId: number;
  readonly seal?: Seal;
  /** There must not be a longer time between two datagrams. */
  readonly keepAlive?: Nanoseconds;
  /** The session is closed if the peer is silent for this time. */
  readonly timeout?: Nanoseconds;
  /** A request is repeated after max(this, SRTT + 4 RTTVAR). */
  readonly minResend?: Nanoseconds;
  /** Maximum age of an encrypted session (Code.EXPIRED), so that no key is older than a day. */
  readonly life?: Nanoseconds;
}

/**
 * A session that can be used by clients and servers, without I/O. Its inputs are bytes and times, and its outputs are
 * bytes and events. The protocol is described in protocol/SESSION.md.
 *
 * In states, forces and reports, an older value is replaced by the newest one. Requests are reliable and ordered. Each
 * datagram contains an echo, which yields a round trip and an ack vector. All queues are bounded.
 *
 * Call `receive` for each datagram and `tick` when `nextTick()` is due, then call `nextEvent` and `nextDatagram`
 * until they are empty.
 */
export class Session {
  readonly stats: LinkStats = {
    sent: 0, received: 0, lost: 0, lostOutgoing: 0, reordered: 0, duplicated: 0, malformed: 0, forged: 0, oldKey: 0,
    invalid: 0, stale: 0, roundTripMs: undefined, smoothedRoundTripMs: 0, roundTripVariationMs: 0,
  };
  readonly #config: Required<SessionConfig>;
  readonly #opened: Nanoseconds;
  #latest: Nanoseconds;
  #open = true;

  // Out.
  #nextPacket = 0n;
  #lastSent: Nanoseconds | undefined;
  #stateToSend: DeviceState | undefined;
  #forceToSend: ForceCommand | undefined;
  #reportToSend: LinkReport | undefined;
  readonly #diagnosesToSend = new Map<string, Diagnosis>();
  /** The key is the device, the channel and the end, as for received port states. */
  readonly #portsToSend = new Map<string, PortState>();
  /** By device and channel. */
  readonly #posesToSend = new Map<string, FieldPose>();
  #brickToSend: FieldBrick | undefined;
  readonly #asked = new OutgoingRequests();
  #bye: Frame | undefined;
  #byesLeft = 0;

  // In.
  #lastHeard: Nanoseconds;
  readonly #seen = new ReplayWindow();
  #echo: Omit<Echo, "receivedMask"> | undefined;
  /** By device, and by device and channel. */
  readonly #newestTick = new Map<number, bigint>();
  readonly #newestSequence = new Map<string, bigint>();
  #newestReport = 0n;
  readonly #newestDiagnosis = new Map<string, bigint>();
  readonly #newestPort = new Map<string, PortState>();
  /** The newest packet that was sent and has been echoed by the peer. */
  #newestEchoed = -1n;
  readonly #answering = new IncomingRequests();
  readonly #roundTrip = new RoundTrip();

  #stateArrived: DeviceState | undefined;
  #forceArrived: ForceCommand | undefined;
  #reportArrived: LinkReport | undefined;
  readonly #diagnosesArrived = new Map<string, Diagnosis>();
  readonly #portsArrived = new Map<string, PortState>();
  /** The newest of each field. */
  readonly #statusesArrived = new Map<string, FieldStatus>();
  #closed: SessionEvent | undefined;

  /** `opened` is the time of the end of the handshake. The first datagram is due immediately. */
  constructor(config: SessionConfig, opened: Nanoseconds) {
    this.#config = {
      seal: new PlainSeal(), keepAlive: 50n * kMillisecond, timeout: 2n * kSecond, minResend: 20n * kMillisecond,
      life: 86_400n * kSecond, ...config,
    };
    this.#opened = this.#latest = this.#lastHeard = opened;
  }

  get open(): boolean {
    return this.#open;
  }

  // ---- In

  /** Handles a datagram. Datagrams are counted and dropped if they are malformed or belong to another session. */
  receive(now: Nanoseconds, datagram: Uint8Array): void {
    this.#latest = now;
    if (!this.#open) return;
    const header = decodeHeader(datagram);
    if (header && header.type !== DatagramType.Data) {
      ++this.stats.duplicated; // a late duplicate of the handshake
      return;
    }
    const { connectionId, seal } = this.#config;
    const ours = header?.suite === seal.suite && header.connectionId === connectionId &&
      header.packetNumber < kMaxPacketNumber;
    if (!header || !ours) {
      ++this.stats.malformed;
      return;
    }
    if (this.#seen.contains(header.packetNumber)) {
      ++this.stats.duplicated;
      return;
    }
    const body = seal.open(now, header, datagram);
    if (typeof body === "string") {
      ++this.stats[body];
      return;
    }
    const content = decodeData(body);
    if (!content) {
      ++this.stats.malformed;
      // The number is consumed only if the datagram is authentic. In suite 0, a damaged copy must not block the
      // original.
      if (seal.suite !== CipherSuite.Plain) this.#seen.insert(header.packetNumber);
      return;
    }
    this.#accept(now, header.packetNumber, content);
  }

  sendState(state: DeviceState): void {
    this.#stateToSend = state;
  }
  sendForce(command: ForceCommand): void {
    this.#forceToSend = command;
  }
  sendReport(report: LinkReport): void {
    this.#reportToSend = report;
  }
  sendDiagnosis(diagnosis: Diagnosis): void {
    this.#diagnosesToSend.set(streamOf(diagnosis), diagnosis);
  }
  sendPort(port: PortState): void {
    this.#portsToSend.set(endOf(port), port);
  }
  sendPose(pose: FieldPose): void {
    this.#posesToSend.set(`${pose.device}/${pose.channel}`, pose);
  }
  sendBrick(brick: FieldBrick): void {
    this.#brickToSend = brick;
  }
  /**
   * Returns the time of the peer's clock at `now`. Returns undefined if no datagram has been received. If the delays of
   * the two directions are different, the error is half of the difference.
   */
  peerTime(now: Nanoseconds): Nanoseconds | undefined {
    return this.#echo && this.#echo.sent + (now - this.#echo.received) + this.#roundTrip.smoothed / 2n;
  }
  /** Queues a reliable request and returns its id, or undefined if 16 are pending. */
  request(request: Request): number | undefined {
    return this.#asked.add(request);
  }
  get suite(): CipherSuite {
    return this.#config.seal.suite;
  }
  /** Answers a request. Ids without a pending request are ignored. */
  answer(answer: ControlAck): void {
    this.#answering.answer(answer);
  }
  /** Sends a Bye and closes. Unsent frames are dropped, and no event follows. */
  close(code: Code, reason: string): void {
    if (!this.#open) return;
    this.#open = false;
    this.#bye = { kind: "bye", value: { code, reason } };
    this.#byesLeft = kByes;
  }
  /** Checks the timeout of the peer and the age of the session. */
  tick(now: Nanoseconds): void {
    this.#latest = now;
    const { timeout, life, seal } = this.#config;
    if (!this.#open) return;
    if (now - this.#lastHeard >= timeout) {
      this.#open = false;
      this.#closed = { kind: "closed", code: Code.TIMED_OUT, reason: `nothing received for ${toMilliseconds(timeout)} ms` };
    } else if (
      seal.suite !== CipherSuite.Plain &&
      (now - this.#opened >= life || this.#nextPacket >= kMaxPacketNumber || this.stats.forged >= kMaxForged)
    ) {
      const reason = "the session has reached its maximum age";
      this.close(Code.EXPIRED, reason);
      this.#closed = { kind: "closed", code: Code.EXPIRED, reason };
    }
  }

  // ---- Out

  /** Returns the next datagram to send, or undefined. */
  nextDatagram(now: Nanoseconds): Uint8Array | undefined {
    this.#latest = now;
    if (this.#byesLeft > 0) {
      --this.#byesLeft;
      return this.#write(now);
    }
    return this.#open && this.#somethingToSay(now) ? this.#write(now) : undefined;
  }

  nextEvent(): SessionEvent | undefined {
    const request = this.#answering.next();
    if (request) return { kind: "request", ...request };
    const answer = this.#asked.nextAnswer();
    if (answer) return { kind: "answered", ...answer };
    const command = this.#forceArrived;
    this.#forceArrived = undefined;
    if (command) return { kind: "force", command };
    const port = takeFirst(this.#portsArrived);
    if (port) return { kind: "port", port };
    const report = this.#reportArrived;
    this.#reportArrived = undefined;
    if (report) return { kind: "report", report };
    const diagnosis = takeFirst(this.#diagnosesArrived);
    if (diagnosis) return diagnosis;
    const state = this.#stateArrived;
    this.#stateArrived = undefined;
    if (state) return { kind: "state", state };
    const status = takeFirst(this.#statusesArrived);
    if (status) return { kind: "fieldStatus", status };
    const closed = this.#closed;
    this.#closed = undefined;
    return closed;
  }

  /** Returns when `tick` and `nextDatagram` are due. The time is not in the future if there is something to send. */
  nextTick(): Nanoseconds {
    if (!this.#open) return this.#byesLeft > 0 ? this.#latest : kNever;
    if (this.#lastSent === undefined || this.#somethingToSay(this.#latest)) return this.#latest;
    const silence = earliest(this.#lastHeard + this.#config.timeout, this.#lastSent + this.#config.keepAlive);
    return earliest(silence, this.#asked.nextDueTime());
  }

  // ---- Inside

  #accept(now: Nanoseconds, number: bigint, content: DataContent): void {
    ++this.stats.received;
    this.stats.invalid += content.invalid;
    this.#lastHeard = now;
    const newest = number > this.#seen.highest;
    if (newest) {
      this.#echo = { sent: content.sent, received: now, packetNumber: number };
    } else {
      ++this.stats.reordered;
    }
    this.#seen.insert(number);
    this.stats.lost = Number(this.#seen.missing);
    if (content.echo) this.#observe(now, content.sent, content.echo);
    for (const frame of content.frames) this.#take(frame, newest);
  }

  #observe(now: Nanoseconds, sent: Nanoseconds, told: Echo): void {
    const possible = told.packetNumber < this.#nextPacket && told.sent >= this.#opened && told.sent <= now &&
      sent >= told.received;
    if (!possible) {
      ++this.stats.invalid;
      return;
    }
    this.#countLostOutgoing(told);
    const sample = now - told.sent - (sent - told.received);
    if (sample < 0n) return; // possible if the clock rates differ and the peer held the echo for long
    this.#roundTrip.observe(sample);
    this.stats.roundTripMs = toMilliseconds(sample);
    this.stats.smoothedRoundTripMs = toMilliseconds(this.#roundTrip.smoothed);
    this.stats.roundTripVariationMs = toMilliseconds(this.#roundTrip.variation);
  }

  /** The ack vector covers the echoed packet and at most 32 before it. */
  #countLostOutgoing(told: Echo): void {
    if (told.packetNumber <= this.#newestEchoed) return;
    const between = told.packetNumber - this.#newestEchoed - 1n;
    const reached = between < 32n ? Number(between) : 32;
    for (let i = 0; i < reached; ++i) this.stats.lostOutgoing += (told.receivedMask >>> i) & 1 ? 0 : 1;
    this.#newestEchoed = told.packetNumber;
  }

  #take(frame: Frame, newest: boolean): void {
    switch (frame.kind) {
      case "state":
        if (frame.value.tick > (this.#newestTick.get(frame.value.device) ?? -1n)) {
          this.#newestTick.set(frame.value.device, frame.value.tick);
          this.#stateArrived = frame.value;
        } else {
          ++this.stats.stale;
        }
        return;
      case "force": {
        const channel = `${frame.value.device}/${frame.value.channel}`;
        if (frame.value.sequence > (this.#newestSequence.get(channel) ?? -1n)) {
          this.#newestSequence.set(channel, frame.value.sequence);
          this.#forceArrived = frame.value;
        } else {
          ++this.stats.stale;
        }
        return;
      }
      case "report":
        if (frame.value.number > this.#newestReport) {
          this.#newestReport = frame.value.number;
          this.#reportArrived = frame.value;
        } else {
          ++this.stats.stale;
        }
        return;
      case "deviceReport":
      case "peerReport": {
        const stream = streamOf(frame);
        if (numberOf(frame) > (this.#newestDiagnosis.get(stream) ?? 0n)) {
          this.#newestDiagnosis.set(stream, numberOf(frame));
          this.#diagnosesArrived.set(stream, frame);
        } else {
          ++this.stats.stale;
        }
        return;
      }
      case "port": {
        const { epoch, sequence } = frame.value;
        const newest = this.#newestPort.get(endOf(frame.value));
        if (!newest || epoch > newest.epoch || (epoch === newest.epoch && sequence > newest.sequence)) {
          this.#newestPort.set(endOf(frame.value), frame.value);
          this.#portsArrived.set(endOf(frame.value), frame.value);
        } else {
          ++this.stats.stale;
        }
        return;
      }
      case "fieldStatus":
        if (newest) this.#statusesArrived.set(frame.value.field.join(), frame.value);
        else ++this.stats.stale;
        return;
      case "control":
        this.stats.invalid += this.#answering.take(frame.value) ? 0 : 1;
        return;
      case "controlAck":
        this.stats.invalid += this.#asked.acknowledge(frame.value) ? 0 : 1;
        return;
      case "bye":
        this.#open = false;
        this.#closed = { kind: "closed", ...frame.value };
        return;
    }
  }

  #somethingToSay(now: Nanoseconds): boolean {
    const silentTooLong = this.#lastSent === undefined || now - this.#lastSent >= this.#config.keepAlive;
    return silentTooLong || this.#stateToSend !== undefined || this.#forceToSend !== undefined ||
      this.#reportToSend !== undefined || this.#diagnosesToSend.size > 0 || this.#portsToSend.size > 0 ||
      this.#posesToSend.size > 0 || this.#brickToSend !== undefined || this.#answering.nextDue() !== undefined || this.#asked.nextDue(now) !== undefined;
  }

  /**
   * Writes as many frames as possible, the most time-critical ones first. The next datagram contains the others. There
   * is always enough space for a state and a force.
   */
  #write(now: Nanoseconds): Uint8Array {
    const { connectionId, seal, minResend } = this.#config;
    const echo = this.#echo && { ...this.#echo, receivedMask: this.#seen.maskBefore(this.#echo.packetNumber) };
    let body = encodeHead(now, echo);
    const add = (frame: Frame): boolean => {
      const piece = encodeFrame(frame);
      if (kHeaderSize + body.length + piece.length + seal.overhead > kMaxDatagram) return false;
      body = concat(body, piece);
      return true;
    };
    if (this.#bye) {
      add(this.#bye);
    } else {
      if (this.#stateToSend && add({ kind: "state", value: this.#stateToSend })) this.#stateToSend = undefined;
      for (const [place, port] of this.#portsToSend) {
        if (!add({ kind: "port", value: port })) break;
        this.#portsToSend.delete(place);
      }
      if (this.#forceToSend && add({ kind: "force", value: this.#forceToSend })) this.#forceToSend = undefined;
      for (const [place, pose] of this.#posesToSend) {
        if (!add({ kind: "fieldPose", value: pose })) break;
        this.#posesToSend.delete(place);
      }
      for (let ack; (ack = this.#answering.nextDue()) && add({ kind: "controlAck", value: ack }); ) {
        this.#answering.sent(ack.id);
      }
      const timeout = this.#roundTrip.timeout(minResend);
      for (let due; (due = this.#asked.nextDue(now)) && add({ kind: "control", value: due }); ) {
        this.#asked.sent(due.id, now, timeout);
      }
      if (this.#reportToSend && add({ kind: "report", value: this.#reportToSend })) this.#reportToSend = undefined;
      for (const [stream, diagnosis] of this.#diagnosesToSend) {
        if (!add(diagnosis)) break;
        this.#diagnosesToSend.delete(stream);
      }
      if (this.#brickToSend && add({ kind: "fieldBrick", value: this.#brickToSend })) this.#brickToSend = undefined;
    }
    const datagram = seal.close(now, connectionId, this.#nextPacket, body);
    ++this.#nextPacket;
    ++this.stats.sent;
    this.#lastSent = now;
    return datagram;
  }
}

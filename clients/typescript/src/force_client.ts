// SPDX-License-Identifier: Apache-2.0
import { objection, usable, type Touch } from "./answer.js";
import { isRequest, type ControlAck } from "./codec.js";
import { checked, type ClientConfig, type ClientStats, type Phase } from "./config.js";
import { Deadband, foretell } from "./deadband.js";
import { expect } from "./expect.js";
import { ClientHandshake } from "./handshake.js";
import { kMaxValidForMs } from "./limits.js";
import {
  Code, kFeatureChannels, kFeatureDiagnostics, kFeatureHandle, kFeatureJoints, kFeatureLocalModel, kFeatureOutputs, kFeatureWays,
  kProtocolVersion, Role,
  type DeviceDescription, type DeviceReport, type DeviceState, type Grant, type HandleDescription, type Hello, type LampColour,
  type LinkReport, type PeerReport, type Request, type Vec3, type Vibration, type Welcome,
} from "./messages.js";
import { Session, type LinkStats } from "./session.js";
import { earliest, fromMilliseconds, kNever, latest, type Nanoseconds } from "./time.js";

/** The physics engine, seen from here. While it computes, newer states replace older ones. null: it knows no force, and none is sent. */
export type Physics = (hand: DeviceState) => Vec3 | Touch | null;

/** An onlooker: device state and the state of the link in, nothing out. */
export type Watch = (hand: DeviceState, link: Readonly<LinkStats>) => void;

const kValidPeriods = 3;
const kMinValidForMs = 20;
/** A gap is not a period; an engine slower than 10 Hz says so by rateHz. */
const kMaxObservedPeriodMs = 100;
/** A lease is asked for again when it may be over, but no more often than this: the holder renews it all the time. */
const kAskLeaseAgain = fromMilliseconds(50);

/** The numbers of a client that names no device and no channel. */
const kFirstPlace: Omit<Grant, "role"> = { device: 0, channel: 0 };

/**
 * A guest at a Tendon server, without socket, clock or timer: it says Hello, keeps the session alive, hands the newest
 * device state to one callback, sends the force that comes back, and begins again when the server is gone.
 *
 *     client.receive(now, datagram) for each that has come in; then client.turn(now), again when it says so.
 *
 * - Newest wins. Of the states that came in before a turn, the callback sees the newest one, once.
 * - Rate. With rateHz = r the callback is called at multiples of 1/r, or as soon after as there is a state it has not
 *   seen; after a delay of a whole period the grid starts anew. With 0 it is called once for every new state.
 * - Force. It leaves in the turn after the one that computed it, which is due at once: the datagram's time stamp must not
 *   be older than the physics' work. One that is not finite or beyond 10¹² is counted and not sent.
 * - Reconnection. However an attempt or a session ends, the next attempt waits retryMinMs, then twice as long each time,
 *   at most retryMaxMs. The first state of a new session resets that.
 */
export class ForceClient {
  readonly #config: Required<ClientConfig>;
  readonly #role: Role;
  readonly #physics: Physics | undefined;
  readonly #watch: Watch | undefined;
  readonly #send: (datagram: Uint8Array) => void;
  /** Period of the callback; 0 = none. */
  readonly #period: Nanoseconds;

  #handshake: ClientHandshake | undefined;
  #session: Session | undefined;
  #welcome: Welcome | undefined;
  #description: DeviceDescription | undefined;
  #handle: HandleDescription | undefined;
  /** The numbers of our device and channel. */
  #place = kFirstPlace;
  #holds = false;
  /** The request for the lease that waits for its answer. */
  #askedLease: number | undefined;
  /** When to ask for the lease (again). */
  #askLease = kNever;
  /** End of the present attempt's patience. */
  #giveUp = 0n;
  /** When the next attempt begins. */
  #retry = 0n;
  /** Wait before the attempt after that. */
  #backOff: Nanoseconds;

  /** Newest state that the callback has not seen. */
  #unseen: DeviceState | undefined;
  /** Buttons held in any of the states since the one that it has seen. */
  #pressed = 0;
  /** Newest state, seen or not. */
  #newest: DeviceState | undefined;
  #newestArrived: Nanoseconds;
  /** Newest tick that the callback has seen. */
  #seenTick = 0n;
  /** The request for the deadband of states that waits for its answer. */
  #deadbandRequest: number | undefined;
  /** The server leaves states out. */
  #foretells = false;
  #deadband: Deadband | undefined;
  #report: LinkReport | undefined;
  #deviceReport: DeviceReport | undefined;
  #peerReports: ReadonlyMap<number, PeerReport> = new Map();
  #nextCall: Nanoseconds;
  /** Sequence number of the newest force. */
  #sequence = 0n;
  /** The tick that it answers. */
  #answeredTick = 0n;
  readonly #stats: ClientStats = {
    phase: "greeting", code: Code.OK, reason: "", link: undefined, attempts: 0, sessions: 0, states: 0, statesForetold: 0,
    statesSkipped: 0, forces: 0, forcesUnusable: 0, unusable: "", leftOut: "", forcesAlike: 0, leaseLostTo: "",
  };

  /**
   * `send` takes one datagram, or loses it; it is called from within receive(), turn() and stop(). The first Hello leaves with
   * the first turn. Throws RangeError naming the field when `config` is impossible.
   */
  constructor(
    config: ClientConfig,
    callback: { readonly physics: Physics } | { readonly watch: Watch },
    send: (datagram: Uint8Array) => void,
    now: Nanoseconds,
  ) {
    this.#config = checked(config);
    this.#physics = "physics" in callback ? callback.physics : undefined;
    expect(!(this.#physics && this.#config.diagnostics), "diagnostics", true, "false: they are for observers only");
    this.#watch = "watch" in callback ? callback.watch : undefined;
    this.#role = this.#physics ? Role.CONTROLLER : Role.OBSERVER;
    this.#send = send;
    this.#period = this.#config.rateHz > 0 ? fromMilliseconds(1000 / this.#config.rateHz) : 0n;
    this.#backOff = fromMilliseconds(this.#config.retryMinMs);
    this.#nextCall = this.#newestArrived = now;
    this.#greet(now);
  }

  /** Takes any bytes from the server. */
  receive(now: Nanoseconds, datagram: Uint8Array): void {
    if (this.#handshake) {
      this.#handshake.receive(now, datagram);
      this.#settle(now);
    } else if (this.#session) {
      this.#session.receive(now, datagram);
      this.#takeEvents(now);
    }
  }

  /**
   * Does everything that is due at `now` and returns the latest instant of the next call; call it earlier when a datagram
   * comes. An exception of the callback passes through, after a Bye to the server.
   */
  turn(now: Nanoseconds): Nanoseconds {
    if (this.phase === "stopped") return kNever;
    this.#tick(now);
    this.#flush(now);
    return this.#call(now) ? now : this.#nextTurn();
  }

  /**
   * Asks the server to clear a latched fault of its device, and to take a disarm back. Controllers only: an observer is
   * refused. False when there is no session to ask in, or too many requests are open.
   */
  rearm(): boolean {
    return this.#session?.request({ kind: "rearm", device: this.#place.device }) !== undefined;
  }
  /** Asks the server for no force, from the device's next step on, until somebody rearms. False as for rearm(). */
  disarm(): boolean {
    return this.#session?.request({ kind: "disarm", device: this.#place.device }) !== undefined;
  }

  /** The operator's act of a coupling, at the leader's server ([teleoperation]). False as for rearm(). */
  engage(): boolean {
    return this.#session?.request({ kind: "engage", device: this.#place.device }) !== undefined;
  }
  /** The end of that, at either end's server. False as for rearm(). */
  disengage(): boolean {
    return this.#session?.request({ kind: "disengage", device: this.#place.device }) !== undefined;
  }
  /**
   * The scales of the coupling from now on, at the leader's server, while it is not engaged or its clutch is held: each
   * 0.01 … 100, or a RangeError. False as for rearm().
   */
  setScale(positionScale: number, forceScale: number): boolean {
    const wanted: Request = { kind: "setScale", device: this.#place.device, positionScale, forceScale };
    if (!isRequest(wanted)) {
      throw new RangeError(`setScale(${positionScale}, ${forceScale}): expected two scales, each 0.01 … 100`);
    }
    return this.#session?.request(wanted) !== undefined;
  }
  /**
   * How much the leader of that channel of our device counts among several, at the follower's server: 0 … 1, or a
   * RangeError. False as for rearm().
   */
  setShare(channel: number, share: number): boolean {
    const wanted: Request = { kind: "setShare", device: this.#place.device, channel, share };
    if (!isRequest(wanted)) {
      throw new RangeError(`setShare(${channel}, ${share}): expected a channel 0 … 7 and a share 0 … 1`);
    }
    return this.#session?.request(wanted) !== undefined;
  }

  /**
   * Sets a lamp of the device, or starts a pulse of vibration (HandleDescription.outputs). For whoever `holds`. False as
   * for rearm(), and without `outputs` in the config; a RangeError when the setting is out of its bounds.
   */
  setOutput(output: number, setting: LampColour | Vibration): boolean {
    const wanted: Request = { kind: "setOutput", device: this.#place.device, output, setting };
    if (!isRequest(wanted)) {
      throw new RangeError(`setOutput(${output}, ${JSON.stringify(setting)}): expected output 0 … 7, rgb 0 … 0xffffff, ` +
        "amplitude 0 … 1, frequency 0 or 20 … 1000 Hz, durationMs 0 … 10000");
    }
    return this.welcome?.features.includes(kFeatureOutputs) === true && this.#session?.request(wanted) !== undefined;
  }

  /** The channel takes our forces; while it does not, the physics is not called. */
  get holds(): boolean {
    return this.#holds;
  }
  /** Asks for the channel's lease, once more when it is lost before the answer. False as for rearm(). */
  takeLease(): boolean {
    const { device, channel } = this.#place;
    const asked = this.#session?.request({ kind: "takeLease", device, channel });
    this.#askedLease = asked ?? this.#askedLease;
    return asked !== undefined;
  }
  /** Gives the lease up, and asks for it no more. False as for rearm(). */
  giveLease(): boolean {
    const { device, channel } = this.#place;
    this.#askLease = kNever;
    if (this.#session?.request({ kind: "giveLease", device, channel }) === undefined) return false;
    this.#askedLease = undefined; // any answer is older than this release
    this.#holds = false;
    return true;
  }

  /** Says Bye, so that the server need not wait for a timeout, and ends. Any further turn does nothing. */
  stop(now: Nanoseconds): void {
    if (this.phase === "stopped") return;
    this.#session?.close(Code.OK, `${this.#config.name} stops`);
    this.#flush(now);
    this.#end(now, "stopped", Code.OK, "stopped");
  }

  /** A copy that does not change any more. */
  stats(): ClientStats {
    const link = this.#session?.stats ?? this.#stats.link;
    return { ...this.#stats, link: link && { ...link } };
  }
  get phase(): Phase {
    return this.#stats.phase;
  }
  /** The server's description of itself and its device at the opening of the newest session. */
  get welcome(): Welcome | undefined {
    return this.#welcome;
  }
  /** Description of the device, once we have named a device or a channel and the server has answered. */
  get description(): DeviceDescription | undefined {
    return this.#description;
  }

  /** How the device lies before the operator, and its buttons' names. Absent for good when the server does not know that. */
  get handle(): HandleDescription | undefined {
    return this.#handle;
  }

  /** The server's newest report on our forces in the present session; one comes each second while forces come. */
  get report(): LinkReport | undefined {
    return this.#report;
  }

  /** With `diagnostics`, the newest report on the device's loop in the present session, once a second. */
  get deviceReport(): DeviceReport | undefined {
    return this.#deviceReport;
  }
  /** With `diagnostics`, a copy of the newest report on the engine of each channel, even one that has gone. */
  get peerReports(): ReadonlyMap<number, PeerReport> {
    return this.#peerReports;
  }

  get #claims(): boolean {
    return this.#config.device !== "" || this.#config.channel !== "";
  }

  #greet(now: Nanoseconds): void {
    const { name, device, channel, diagnostics, joints, outputs, ways } = this.#config;
    const hello: Hello = {
      versionMin: kProtocolVersion,
      versionMax: kProtocolVersion,
      role: this.#role,
      name,
      features: [
        kFeatureLocalModel, kFeatureChannels, kFeatureHandle, ...(joints ? [kFeatureJoints] : []),
        ...(outputs ? [kFeatureOutputs] : []),
        ...(diagnostics ? [kFeatureDiagnostics] : []),
        ...(ways.length > 0 ? [kFeatureWays] : []),
      ],
      ways,
      claims: this.#claims ? [{ device, channel, role: this.#role }] : [],
    };
    const { key, random, suites } = this.#config;
    this.#handshake = new ClientHandshake(hello, key, random, now, suites);
    this.#giveUp = now + fromMilliseconds(this.#config.patienceMs);
    this.#stats.phase = "greeting";
    ++this.#stats.attempts;
  }

  /** Acts on the server's answer once it has come. */
  #settle(now: Nanoseconds): void {
    const outcome = this.#handshake?.outcome;
    if (!outcome) return;
    if (outcome.kind === "refused") {
      this.#end(now, "refused", outcome.refused.code, outcome.refused.detail);
      return;
    }
    const { connectionId, welcome, seal } = outcome;
    if (this.#claims && welcome.grants?.length !== 1) {
      this.#end(now, "refused", Code.UNSUPPORTED, "that server has one device, with one channel: name none");
      return;
    }
    this.#handshake = undefined;
    this.#welcome = welcome;
    const grant = welcome.grants?.[0];
    this.#place = grant ?? kFirstPlace;
    this.#holds = (grant ?? welcome).role === Role.CONTROLLER;
    this.#askedLease = undefined;
    this.#askLease = this.#config.takeLease && this.#role === Role.CONTROLLER && !this.#holds ? now : kNever;
    this.#stats.leaseLostTo = this.#stats.leftOut = "";
    this.#description = undefined;
    this.#handle = undefined;
    this.#session = new Session({ connectionId, seal }, now);
    const { device } = this.#place;
    if (this.#claims) this.#session.request({ kind: "describe", device });
    if (welcome.features.includes(kFeatureHandle)) this.#session.request({ kind: "describe", device, handle: true });
    if (this.#config.stateHz > 0) this.#session.request({ kind: "setStateRate", hz: this.#config.stateHz, device });
    const { deadband, stateDeadband } = this.#config;
    this.#deadbandRequest = stateDeadband && this.#session.request({ kind: "setStateDeadband", ...stateDeadband });
    this.#foretells = false;
    this.#seenTick = 0n;
    this.#report = this.#deviceReport = undefined;
    this.#peerReports = new Map();
    this.#deadband = deadband && new Deadband(deadband); // this session was not sent what another was
    this.#sequence = 0n;
    this.#stats.phase = "open";
    ++this.#stats.sessions;
  }

  #end(now: Nanoseconds, phase: Phase, code: Code, reason: string): void {
    Object.assign(this.#stats, { phase, code, reason, link: this.#session?.stats ?? this.#stats.link });
    this.#handshake = undefined;
    this.#session = undefined;
    this.#holds = false;
    this.#unseen = this.#newest = undefined;
    this.#pressed = 0;
    this.#retry = now + this.#backOff;
    this.#backOff = earliest(2n * this.#backOff, fromMilliseconds(this.#config.retryMaxMs));
  }

  /** Does everything that is due by time. */
  #tick(now: Nanoseconds): void {
    if (this.#session) {
      this.#session.tick(now);
      this.#takeEvents(now);
      if (this.#session && this.#askedLease === undefined && now >= this.#askLease && !this.takeLease()) {
        this.#askLease = now + kAskLeaseAgain;
      }
    } else if (this.#handshake) {
      if (now >= this.#giveUp) this.#end(now, "unanswered", Code.TIMED_OUT, "no answer");
      else this.#handshake.tick(now);
    } else if (now >= this.#retry) {
      this.#greet(now);
      this.#handshake!.tick(now);
    }
  }

  #takeEvents(now: Nanoseconds): void {
    for (let event; (event = this.#session?.nextEvent()); ) {
      if (event.kind === "state") {
        ++this.#stats.states;
        if (this.#unseen) ++this.#stats.statesSkipped;
        this.#unseen = this.#newest = event.state;
        if (this.#physics && !this.#holds) this.#pressed = 0; // a press of that time was another engine's
        this.#pressed |= event.state.buttons;
        this.#newestArrived = now;
        this.#backOff = fromMilliseconds(this.#config.retryMinMs);
      } else if (event.kind === "report") {
        this.#report = event.report;
      } else if (event.kind === "deviceReport") {
        this.#deviceReport = event.value;
      } else if (event.kind === "peerReport") {
        this.#peerReports = new Map(this.#peerReports).set(event.value.channel, event.value);
      } else if (event.kind === "answered") {
        this.#takeAnswer(now, event);
      } else if (event.kind === "request") {
        this.#takeRequest(now, event.id, event.request);
      } else if (event.kind === "closed") {
        this.#flush(now); // our own Bye, when the session ends by its age
        // Two programs with one key would otherwise take the place from each other for ever.
        this.#end(now, event.code === Code.REPLACED ? "stopped" : "lost", event.code, event.reason);
      }
    }
  }

  #takeAnswer(now: Nanoseconds, { id, code, device, handle, waitMs = 0 }: ControlAck): void {
    if (device) this.#description = device;
    if (handle) this.#handle = handle;
    if (id === this.#deadbandRequest) this.#foretells = code === Code.OK && this.#period > 0n && this.#silence() > 0n;
    if (id !== this.#askedLease) return;
    this.#askedLease = undefined;
    this.#askLease = kNever;
    if (code !== Code.UNSUPPORTED) this.#holds = code === Code.OK; // otherwise the server knows no leases
    if (this.#holds) {
      this.#stats.leaseLostTo = "";
    } else if (this.#config.takeLease && code === Code.BUSY) {
      this.#askLease = now + latest(fromMilliseconds(waitMs), kAskLeaseAgain);
    }
  }

  #takeRequest(now: Nanoseconds, id: number, request: Request): void {
    if (request.kind !== "leaseLost") {
      this.#session?.answer({ id, code: Code.UNSUPPORTED, detail: "that is a client's to ask" });
      return;
    }
    this.#session?.answer({ id, code: Code.OK, detail: "" });
    if (request.device !== this.#place.device || request.channel !== this.#place.channel) return;
    this.#holds = false;
    this.#stats.leaseLostTo = request.to;
    // A request still in flight may cross this message. One sent now is answered after it.
    if (this.#askedLease !== undefined && this.takeLease()) return;
    if (this.#config.takeLease) this.#askLease = now + kAskLeaseAgain;
  }

  #flush(now: Nanoseconds): void {
    for (let datagram; (datagram = (this.#session ?? this.#handshake)?.nextDatagram(now)); ) this.#send(datagram);
  }

  /** True when a force now waits to be sent. */
  #call(now: Nanoseconds): boolean {
    if (now < this.#nextCall || (this.#physics && !this.#holds)) return false;
    const newest = this.#foretells ? this.#foretold(now) : this.#unseen;
    if (!newest) return false;
    const buttons = (newest.buttons | this.#pressed) >>> 0;
    const hand = buttons === newest.buttons ? newest : { ...newest, buttons };
    this.#unseen = undefined;
    this.#pressed = 0;
    this.#seenTick = hand.tick;
    this.#nextCall += this.#period;
    if (this.#nextCall <= now) this.#nextCall = now + this.#period;
    try {
      this.#watch?.(hand, this.#session!.stats);
      if (!this.#physics) return false;
      const touch = this.#physics(hand);
      if (touch === null) return false;
      if (!touch) throw new TypeError(`physics: expected {x, y, z} or {force: {x, y, z}}, got ${touch}`);
      this.#answer(now, "force" in touch ? touch : { force: touch }, hand);
      return true;
    } catch (error) {
      this.stop(now);
      throw error;
    }
  }

  /** The state predicted for now; undefined when nothing is new, or nothing has come for too long. */
  #foretold(now: Nanoseconds): DeviceState | undefined {
    const age = now - this.#newestArrived;
    if (!this.#newest || age > this.#silence()) return undefined;
    const state = foretell(this.#newest, age, this.#hapticPeriod());
    if (state.tick <= this.#seenTick) return undefined; // the state before it spent less time on its way
    if (state.tick > this.#newest.tick) ++this.#stats.statesForetold;
    return state;
  }

  #silence(): Nanoseconds {
    return BigInt(this.#config.stateDeadband?.maxSilenceUs ?? 0) * 1000n;
  }
  #hapticPeriod(): Nanoseconds {
    return fromMilliseconds(1000 / this.#welcome!.loopHz);
  }

  #answer(now: Nanoseconds, touch: Touch, hand: DeviceState): void {
    if (!this.#session || !this.#welcome) return; // the callback has called stop()
    const objects = objection(touch);
    if (objects) {
      ++this.#stats.forcesUnusable;
      this.#stats.unusable = objects;
      return;
    }
    const { topologyChanged, error } = touch;
    const { answer, leftOut } = usable(touch, hand, this.#welcome.features);
    if (leftOut) this.#stats.leftOut = leftOut;
    if (this.#deadband && !this.#deadband.passes(now, answer) && !topologyChanged) {
      ++this.#stats.forcesAlike;
      return;
    }
    this.#session.sendForce({
      validForUs: Math.ceil(1000 * this.#validForMs(hand.tick, this.#welcome.loopHz)),
      sequence: ++this.#sequence,
      basedOnTick: hand.tick,
      ...answer,
      device: this.#place.device,
      channel: this.#place.channel,
      topologyChanged,
      error,
      way: this.#way(touch),
    });
    this.#answeredTick = hand.tick;
    ++this.#stats.forces;
  }

  #way({ way = 0 }: Touch): number | undefined {
    if (Number.isInteger(way) && way >= 0 && way <= this.#config.ways.length) {
      return way > 0 && this.#welcome!.features.includes(kFeatureWays) ? way : undefined;
    }
    this.#stats.leftOut = "the way of answering: the config's ways have none of its number";
    return undefined;
  }

  #validForMs(tick: bigint, loopHz: number): number {
    if (this.#config.validForMs > 0) return this.#config.validForMs;
    const asked = this.#config.rateHz > 0 ? 1000 / this.#config.rateHz : 0;
    const seen = this.#sequence > 0n ? (1000 * Number(tick - this.#answeredTick)) / loopHz : 0;
    const silence = this.#config.deadband?.longestSilenceMs ?? 0;
    const period = Math.max(asked, Math.min(seen, kMaxObservedPeriodMs), silence);
    return Math.min(Math.max(kValidPeriods * period, kMinValidForMs), kMaxValidForMs);
  }

  /** When the callback is due next; kNever while there is nothing that it has not seen. */
  #nextDue(): Nanoseconds {
    if (!this.#foretells) return this.#unseen ? this.#nextCall : kNever;
    if (!this.#newest) return kNever;
    const ahead = latest(this.#seenTick + 1n - this.#newest.tick, 0n); // the first tick that it has not seen
    const due = latest(this.#nextCall, this.#newestArrived + ahead * this.#hapticPeriod());
    return due - this.#newestArrived <= this.#silence() ? due : kNever;
  }

  #nextTurn(): Nanoseconds {
    if (this.#session) {
      const call = this.#physics && !this.#holds ? kNever : this.#nextDue();
      const ask = this.#askedLease === undefined ? this.#askLease : kNever;
      return earliest(this.#session.nextTick(), earliest(call, ask));
    }
    if (this.#handshake) return earliest(this.#giveUp, this.#handshake.nextTick());
    return this.phase === "stopped" ? kNever : this.#retry;
  }
}

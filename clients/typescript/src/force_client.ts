// SPDX-License-Identifier: Apache-2.0
import { objection, usable, type Touch } from "./answer.js";
import { isRequest, type ControlAck } from "./codec.js";
import { checked, type ClientConfig, type ClientStats, type Phase } from "./config.js";
import { Deadband, predict } from "./deadband.js";
import { expect } from "./expect.js";
import { ClientHandshake } from "./handshake.js";
import { kMaxValidForMs } from "./limits.js";
import {
  Code, kFeatureChannels, kFeatureDiagnostics, kFeatureFields, kFeatureHandle, kFeatureJoints, kFeatureLocalModel, kFeatureOutputs,
  kFeatureWays, kProtocolVersion, Role,
  type DeviceDescription, type DeviceReport, type DeviceState, type ForceCommand, type Grant, type HandleDescription, type Hello, type LampColour,
  type LinkReport, type PeerReport, type Request, type Vec3, type Vibration, type Welcome,
} from "./messages.js";
import { Session, type LinkStats } from "./session.js";
import { earliest, fromMilliseconds, kNever, latest, type Nanoseconds } from "./time.js";
import { FieldUser } from "./upload.js";

/** The physics engine. During a computation, newer states replace older ones. Null: no force is sent. */
export type Physics = (hand: DeviceState) => Vec3 | Touch | null;

/** Callback of an observer. */
export type Watch = (hand: DeviceState, link: Readonly<LinkStats>) => void;

const kValidPeriods = 3;
const kMinValidForMs = 20;
/** If the gap is longer, it is not used as a period. If an engine is slower than 10 Hz, it must set rateHz. */
const kMaxObservedPeriodMs = 100;
/** The minimum time between two requests for a lease, which the holder renews continuously. */
const kAskLeaseAgain = fromMilliseconds(50);

/** Indices used if neither device nor channel is named. */
const kFirstPlace: Omit<Grant, "role"> = { device: 0, channel: 0 };

/**
 * A client of a Tendon server that does not use a socket, a clock or a timer. It opens a session and keeps it alive,
 * passes the newest device state to one callback, sends the returned force, and reconnects after the session ends.
 *
 *     client.receive(now, datagram) for each received datagram; then client.turn(now), again at the returned time.
 *
 * - Newest wins. In each turn, the callback receives only the newest state.
 * - Rate. If rateHz = r > 0, the callback runs at multiples of 1/r, or as soon as an unseen state is available.
 *   After a delay of a full period, the schedule restarts. If rateHz = 0, it runs once for each new state.
 * - Force. It is sent in the turn after the callback, which is due immediately, so that the time stamp does not include
 *   the computation. Forces that are not finite or beyond 10¹² are counted and not sent.
 * - Reconnection. After an attempt or a session ends, the client waits for retryMinMs before the next attempt. The
 *   wait is doubled with each attempt up to retryMaxMs. It is reset by the first state of a new session.
 */
export class ForceClient {
  /** The field of this client. Requires `fields` in the config. */
  readonly fields = new FieldUser();
  readonly #config: Required<ClientConfig>;
  readonly #role: Role;
  readonly #physics: Physics | undefined;
  readonly #watch: Watch | undefined;
  readonly #send: (datagram: Uint8Array) => void;
  /** The period of the callback. If it is 0, there is none. */
  readonly #period: Nanoseconds;

  #handshake: ClientHandshake | undefined;
  #session: Session | undefined;
  #welcome: Welcome | undefined;
  #description: DeviceDescription | undefined;
  #handle: HandleDescription | undefined;
  /** Indices of the device and channel. */
  #place = kFirstPlace;
  #holds = false;
  /** Id of the pending lease request. */
  #askedLease: number | undefined;
  /** Time of the next lease request. */
  #askLease = kNever;
  /** Timeout of the current attempt. */
  #giveUp = 0n;
  /** Start of the next attempt. */
  #retry = 0n;
  /** The time to wait after the next attempt, if it fails. */
  #backOff: Nanoseconds;

  /** The newest state that has not been passed to the callback. */
  #unseen: DeviceState | undefined;
  /** The buttons that were pressed in any state since the last callback. */
  #pressed = 0;
  #newest: DeviceState | undefined;
  #newestArrived: Nanoseconds;
  /** The newest tick that was passed to the callback. */
  #seenTick = 0n;
  /** Id of the pending request for the state deadband. */
  #deadbandRequest: number | undefined;
  /** The server omits predictable states. */
  #predicts = false;
  #deadband: Deadband | undefined;
  #report: LinkReport | undefined;
  #deviceReport: DeviceReport | undefined;
  #peerReports: ReadonlyMap<number, PeerReport> = new Map();
  #nextCall: Nanoseconds;
  #sequence = 0n;
  /** The tick of the state that is answered by the newest force. */
  #answeredTick = 0n;
  readonly #stats: ClientStats = {
    phase: "greeting", code: Code.OK, reason: "", link: undefined, attempts: 0, sessions: 0, states: 0, statesPredicted: 0,
    statesSkipped: 0, forces: 0, forcesUnusable: 0, unusable: "", leftOut: "", forcesAlike: 0, leaseLostTo: "",
  };

  /**
   * `send` sends or drops a datagram. It is called from receive(), turn() and stop(). The first Hello is sent by the
   * first turn. Throws a RangeError with the name of the field if `config` is invalid.
   */
  constructor(
    config: ClientConfig,
    callback: { readonly physics: Physics } | { readonly watch: Watch },
    send: (datagram: Uint8Array) => void,
    now: Nanoseconds,
  ) {
    this.#config = checked(config);
    this.#physics = "physics" in callback ? callback.physics : undefined;
    expect(!(this.#physics && this.#config.diagnostics), "diagnostics", true, "false: only observers can use diagnostics");
    this.#watch = "watch" in callback ? callback.watch : undefined;
    this.#role = this.#physics ? Role.CONTROLLER : Role.OBSERVER;
    this.#send = send;
    this.#period = this.#config.rateHz > 0 ? fromMilliseconds(1000 / this.#config.rateHz) : 0n;
    this.#backOff = fromMilliseconds(this.#config.retryMinMs);
    this.#nextCall = this.#newestArrived = now;
    this.#greet(now);
  }

  /** Handles a datagram from the server, which may contain arbitrary bytes. */
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
   * Performs all work due at `now` and returns the time of the next call. Call it earlier if a datagram arrives. An
   * exception of the callback propagates after a Bye is sent to the server.
   */
  turn(now: Nanoseconds): Nanoseconds {
    if (this.phase === "stopped") return kNever;
    this.#tick(now);
    this.#flush(now);
    return this.#call(now) ? now : this.#nextTurn();
  }

  /**
   * Asks the server to clear a latched fault of the device and to undo a disarm. Only for controllers. Returns false
   * if there is no session or if too many requests are pending.
   */
  rearm(): boolean {
    return this.#session?.request({ kind: "rearm", device: this.#place.device }) !== undefined;
  }
  /** Asks the server to disable all forces until a client rearms. Returns false as rearm() does. */
  disarm(): boolean {
    return this.#session?.request({ kind: "disarm", device: this.#place.device }) !== undefined;
  }

  /** Engages a coupling ([teleoperation]), at the server of the leader. Returns false as rearm() does. */
  engage(): boolean {
    return this.#session?.request({ kind: "engage", device: this.#place.device }) !== undefined;
  }
  /** Disengages a coupling, at either server. Returns false as rearm() does. */
  disengage(): boolean {
    return this.#session?.request({ kind: "disengage", device: this.#place.device }) !== undefined;
  }
  /**
   * Sets the scales of the coupling at the server of the leader. The coupling must not be engaged unless its clutch
   * is held. Throws a RangeError outside of 0.01 … 100. Returns false as rearm() does.
   */
  setScale(positionScale: number, forceScale: number): boolean {
    const wanted: Request = { kind: "setScale", device: this.#place.device, positionScale, forceScale };
    if (!isRequest(wanted)) {
      throw new RangeError(`setScale(${positionScale}, ${forceScale}): expected two scales, each 0.01 … 100`);
    }
    return this.#session?.request(wanted) !== undefined;
  }
  /**
   * Sets the weight of the leader on that channel if several leaders share one follower, at the follower's server.
   * Throws a RangeError outside of 0 … 1. Returns false as rearm() does.
   */
  setShare(channel: number, share: number): boolean {
    const wanted: Request = { kind: "setShare", device: this.#place.device, channel, share };
    if (!isRequest(wanted)) {
      throw new RangeError(`setShare(${channel}, ${share}): expected a channel 0 … 7 and a share 0 … 1`);
    }
    return this.#session?.request(wanted) !== undefined;
  }

  /**
   * Sets an indicator lamp or starts a vibration pulse (HandleDescription.outputs). Requires the channel (`holds`).
   * Returns false in the same cases as rearm(), and if `outputs` is not set in the config. Throws a RangeError if
   * `setting` is out of bounds.
   */
  setOutput(output: number, setting: LampColour | Vibration): boolean {
    const wanted: Request = { kind: "setOutput", device: this.#place.device, output, setting };
    if (!isRequest(wanted)) {
      throw new RangeError(`setOutput(${output}, ${JSON.stringify(setting)}): expected output 0 … 7, rgb 0 … 0xffffff, ` +
        "amplitude 0 … 1, frequency 0 or 20 … 1000 Hz, durationMs 0 … 10000");
    }
    return this.welcome?.features.includes(kFeatureOutputs) === true && this.#session?.request(wanted) !== undefined;
  }

  /** Whether this client holds the channel. Otherwise the physics callback is not called. */
  get holds(): boolean {
    return this.#holds;
  }
  /** Requests the lease, again if it is lost before the answer. Returns false as rearm() does. */
  takeLease(): boolean {
    const { device, channel } = this.#place;
    const asked = this.#session?.request({ kind: "takeLease", device, channel });
    this.#askedLease = asked ?? this.#askedLease;
    return asked !== undefined;
  }
  /** Releases the lease and stops requesting it. Returns false as rearm() does. */
  giveLease(): boolean {
    const { device, channel } = this.#place;
    this.#askLease = kNever;
    if (this.#session?.request({ kind: "giveLease", device, channel }) === undefined) return false;
    this.#askedLease = undefined; // a later answer would be outdated
    this.#holds = false;
    this.fields.lostLease();
    return true;
  }

  /**
   * Sends the true force for a state, which the server uses to correct the field. Returns false if the state does not
   * contain a field, if the force is unusable, or if this client does not hold the channel.
   */
  truth(hand: DeviceState, force: Vec3): boolean {
    if (!this.#session || !this.#holds || !hand.field) return false;
    const objects = objection({ force });
    if (objects) {
      ++this.#stats.forcesUnusable;
      this.#stats.unusable = objects;
      return false;
    }
    this.#session.sendForce({ ...this.#command(hand), force, field: hand.field.generation });
    return true;
  }

  /** Sends a Bye, so that the server does not have to wait for a timeout, and stops. Further turns do nothing. */
  stop(now: Nanoseconds): void {
    if (this.phase === "stopped") return;
    this.#session?.close(Code.OK, `${this.#config.name} stops`);
    this.#flush(now);
    this.#end(now, "stopped", Code.OK, "stopped");
  }

  /** Returns a copy. */
  stats(): ClientStats {
    const link = this.#session?.stats ?? this.#stats.link;
    return { ...this.#stats, link: link && { ...link } };
  }
  get phase(): Phase {
    return this.#stats.phase;
  }
  /** Description of the server in the newest session. */
  get welcome(): Welcome | undefined {
    return this.#welcome;
  }
  /** Description of the device. Undefined until it arrives; it is only requested if a device or channel is named. */
  get description(): DeviceDescription | undefined {
    return this.#description;
  }

  /** Orientation of the device relative to the operator, and names of the buttons, if the server supports it. */
  get handle(): HandleDescription | undefined {
    return this.#handle;
  }

  /** The newest report on the received forces in this session. It is sent once per second if there are any. */
  get report(): LinkReport | undefined {
    return this.#report;
  }

  /** Newest report on the loop of the device in this session, once per second. Requires `diagnostics`. */
  get deviceReport(): DeviceReport | undefined {
    return this.#deviceReport;
  }
  /** The newest report on the engine of each channel, also after it has left. Requires `diagnostics`. */
  get peerReports(): ReadonlyMap<number, PeerReport> {
    return this.#peerReports;
  }

  get #claims(): boolean {
    return this.#config.device !== "" || this.#config.channel !== "";
  }

  #greet(now: Nanoseconds): void {
    const { name, device, channel, diagnostics, fields, joints, outputs, ways } = this.#config;
    const hello: Hello = {
      versionMin: kProtocolVersion,
      versionMax: kProtocolVersion,
      role: this.#role,
      name,
      features: [
        kFeatureLocalModel, kFeatureChannels, kFeatureHandle, ...(joints ? [kFeatureJoints] : []),
        ...(outputs ? [kFeatureOutputs] : []),
        ...(diagnostics ? [kFeatureDiagnostics] : []),
        ...(fields ? [kFeatureFields] : []),
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

  /** Handles the answer of the server, if it has arrived. */
  #settle(now: Nanoseconds): void {
    const outcome = this.#handshake?.outcome;
    if (!outcome) return;
    if (outcome.kind === "refused") {
      this.#end(now, "refused", outcome.refused.code, outcome.refused.detail);
      return;
    }
    const { connectionId, welcome, seal } = outcome;
    if (this.#claims && welcome.grants?.length !== 1) {
      this.#end(now, "refused", Code.UNSUPPORTED, "this server has one device with one channel: omit their names");
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
    if (welcome.features.includes(kFeatureFields)) this.fields.opened(this.#session, this.#place);
    else if (this.#config.fields) this.fields.closed("the server does not support fields");
    const { deadband, stateDeadband } = this.#config;
    this.#deadbandRequest = stateDeadband && this.#session.request({ kind: "setStateDeadband", ...stateDeadband });
    this.#predicts = false;
    this.#seenTick = 0n;
    this.#report = this.#deviceReport = undefined;
    this.#peerReports = new Map();
    this.#deadband = deadband && new Deadband(deadband); // the new session has not sent any force yet
    this.#sequence = 0n;
    this.#stats.phase = "open";
    ++this.#stats.sessions;
  }

  #end(now: Nanoseconds, phase: Phase, code: Code, reason: string): void {
    Object.assign(this.#stats, { phase, code, reason, link: this.#session?.stats ?? this.#stats.link });
    this.#handshake = undefined;
    this.#session = undefined;
    this.fields.closed();
    this.#holds = false;
    this.#unseen = this.#newest = undefined;
    this.#pressed = 0;
    this.#retry = now + this.#backOff;
    this.#backOff = earliest(2n * this.#backOff, fromMilliseconds(this.#config.retryMaxMs));
  }

  #tick(now: Nanoseconds): void {
    if (this.#session) {
      this.#session.tick(now);
      this.#takeEvents(now);
      if (this.#session && this.#askedLease === undefined && now >= this.#askLease && !this.takeLease()) {
        this.#askLease = now + kAskLeaseAgain;
      }
      this.fields.tick(now, this.#holds);
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
        if (this.#physics && !this.#holds) this.#pressed = 0; // pressed for another engine
        this.#pressed |= event.state.buttons;
        this.#newestArrived = now;
        this.#backOff = fromMilliseconds(this.#config.retryMinMs);
      } else if (event.kind === "report") {
        this.#report = event.report;
      } else if (event.kind === "deviceReport") {
        this.#deviceReport = event.value;
      } else if (event.kind === "peerReport") {
        this.#peerReports = new Map(this.#peerReports).set(event.value.channel, event.value);
      } else if (event.kind === "fieldStatus") {
        this.fields.takeStatus(now, event.status);
      } else if (event.kind === "answered") {
        this.#takeAnswer(now, event);
      } else if (event.kind === "request") {
        this.#takeRequest(now, event.id, event.request);
      } else if (event.kind === "closed") {
        this.#flush(now); // sends the Bye if a session has reached its maximum age
        // Reconnecting would start a cycle in which both programs replace each other.
        this.#end(now, event.code === Code.REPLACED ? "stopped" : "lost", event.code, event.reason);
      }
    }
  }

  #takeAnswer(now: Nanoseconds, answer: ControlAck): void {
    const { id, code, device, handle, waitMs = 0 } = answer;
    this.fields.takeAnswer(now, answer);
    if (device) this.#description = device;
    if (handle) this.#handle = handle;
    if (id === this.#deadbandRequest) this.#predicts = code === Code.OK && this.#period > 0n && this.#silence() > 0n;
    if (id !== this.#askedLease) return;
    this.#askedLease = undefined;
    this.#askLease = kNever;
    if (code !== Code.UNSUPPORTED) this.#holds = code === Code.OK; // otherwise the server does not support leases
    if (this.#holds) {
      this.#stats.leaseLostTo = "";
    } else if (this.#config.takeLease && code === Code.BUSY) {
      this.#askLease = now + latest(fromMilliseconds(waitMs), kAskLeaseAgain);
    }
  }

  #takeRequest(now: Nanoseconds, id: number, request: Request): void {
    if (request.kind !== "leaseLost") {
      this.#session?.answer({ id, code: Code.UNSUPPORTED, detail: "only a client can send this request" });
      return;
    }
    this.#session?.answer({ id, code: Code.OK, detail: "" });
    if (request.device !== this.#place.device || request.channel !== this.#place.channel) return;
    this.#holds = false;
    this.fields.lostLease();
    this.#stats.leaseLostTo = request.to;
    // A pending request may be older than this message, so send a new one.
    if (this.#askedLease !== undefined && this.takeLease()) return;
    if (this.#config.takeLease) this.#askLease = now + kAskLeaseAgain;
  }

  #flush(now: Nanoseconds): void {
    do {
      for (let datagram; (datagram = (this.#session ?? this.#handshake)?.nextDatagram(now)); ) this.#send(datagram);
    } while (this.fields.hasBrick(now));
  }

  /** Returns whether a force is waiting to be sent. */
  #call(now: Nanoseconds): boolean {
    if (now < this.#nextCall || (this.#physics && !this.#holds)) return false;
    const newest = this.#predicts ? this.#predicted(now) : this.#unseen;
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

  /** Returns the state that is predicted for `now`, unless there is nothing new or the last state is too old. */
  #predicted(now: Nanoseconds): DeviceState | undefined {
    const age = now - this.#newestArrived;
    if (!this.#newest || age > this.#silence()) return undefined;
    const state = predict(this.#newest, age, this.#hapticPeriod());
    if (state.tick <= this.#seenTick) return undefined; // the network delay of the previous state was shorter
    if (state.tick > this.#newest.tick) ++this.#stats.statesPredicted;
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
    this.#session.sendForce({ ...this.#command(hand), ...answer, topologyChanged, error, way: this.#way(touch) });
  }

  /** Returns the members of the next force command, except for the force. */
  #command({ tick }: DeviceState): Omit<ForceCommand, "force"> {
    const validForUs = Math.ceil(1000 * this.#validForMs(tick, this.#welcome!.loopHz));
    this.#answeredTick = tick;
    ++this.#stats.forces;
    return { validForUs, sequence: ++this.#sequence, basedOnTick: tick, ...this.#place };
  }

  #way({ way = 0 }: Touch): number | undefined {
    if (Number.isInteger(way) && way >= 0 && way <= this.#config.ways.length) {
      return way > 0 && this.#welcome!.features.includes(kFeatureWays) ? way : undefined;
    }
    this.#stats.leftOut = "the solver path: its number is not in the ways of the config";
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

  /** Returns the time of the next callback. This is kNever if there is no new state. */
  #nextDue(): Nanoseconds {
    if (!this.#predicts) return this.#unseen ? this.#nextCall : kNever;
    if (!this.#newest) return kNever;
    const ahead = latest(this.#seenTick + 1n - this.#newest.tick, 0n); // the first tick that was not passed on
    const due = latest(this.#nextCall, this.#newestArrived + ahead * this.#hapticPeriod());
    return due - this.#newestArrived <= this.#silence() ? due : kNever;
  }

  #nextTurn(): Nanoseconds {
    if (this.#session) {
      const call = this.#physics && !this.#holds ? kNever : this.#nextDue();
      const ask = this.#askedLease === undefined ? this.#askLease : kNever;
      return earliest(earliest(this.#session.nextTick(), this.fields.due()), earliest(call, ask));
    }
    if (this.#handshake) return earliest(this.#giveUp, this.#handshake.nextTick());
    return this.phase === "stopped" ? kNever : this.#retry;
  }
}

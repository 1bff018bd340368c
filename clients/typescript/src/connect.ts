// SPDX-License-Identifier: Apache-2.0
import type { ClientConfig, ClientStats, Phase } from "./config.js";
import { expect } from "./expect.js";
import type { Field } from "./field.js";
import { ForceClient, type Physics, type Watch } from "./force_client.js";
import type {
  DeviceDescription, DeviceReport, DeviceState, HandleDescription, LampColour, LinkReport, PeerReport, Vec3, Vibration, Welcome,
} from "./messages.js";
import { fromMilliseconds, kNever, toMilliseconds, type Nanoseconds } from "./time.js";
import type { Motion } from "./upload.js";

export interface Transport {
  /** Sends a datagram. If this is not possible, the datagram is dropped. */
  send(datagram: Uint8Array): void;
  /** Called after an attempt or a session, when the server's address may have changed. `another`: it did not answer. */
  again?(another: boolean): void;
  close(): void;
}
/**
 * Opens a transport to one server: udp() of "tendon-client/node", webSocket(), or your own. It must not call back
 * synchronously. Use `fail` to report a permanent error, which ends the client.
 */
export type OpenTransport = (receive: (datagram: Uint8Array) => void, fail: (error: Error) => void) => Transport;

export interface ConnectConfig extends ClientConfig {
  readonly onPhase?: (guest: Guest) => void;
  readonly onReport?: (report: LinkReport) => void;
  /** This is called when there is a new reason for not sending a force, or a part of it (`leftOut`). */
  readonly onUnusable?: (why: string) => void;
}

/** A client in real time. */
export interface Guest {
  readonly phase: Phase;
  readonly welcome: Welcome | undefined;
  /** Description of the device. Absent until it arrives; it is only requested if `device` or `channel` is named. */
  readonly description: DeviceDescription | undefined;
  /** The orientation of the device and the names of the buttons, if the server supports this. */
  readonly handle: HandleDescription | undefined;
  /** Whether this client holds the channel. Otherwise the physics callback is not called. */
  readonly holds: boolean;
  /** The newest report on the received forces. It is sent once per second if there are any. */
  readonly report: LinkReport | undefined;
  /** The newest report on the loop of the device, which is sent once per second. Requires `diagnostics`. */
  readonly deviceReport: DeviceReport | undefined;
  /** The newest report on the engine of each channel, also after it has left. Requires `diagnostics`. */
  readonly peerReports: ReadonlyMap<number, PeerReport>;
  stats(): ClientStats;
  rearm(): boolean;
  disarm(): boolean;
  /** Engages or disengages a coupling, at the server of the leader (disengage: either server). */
  engage(): boolean;
  disengage(): boolean;
  /** Sets the scales of a coupling at the server of the leader, unless it is engaged and its clutch is not held. */
  setScale(positionScale: number, forceScale: number): boolean;
  /** Sets the weight of the leader on that channel if several leaders share one follower, at the follower's server. */
  setShare(channel: number, share: number): boolean;
  /** Sets an indicator lamp or starts a vibration pulse (requires `outputs` in the config). */
  setOutput(output: number, setting: LampColour | Vibration): boolean;
  /** Requests or releases the lease of the channel. */
  takeLease(): boolean;
  giveLease(): boolean;
  /**
   * Asks the server to render a field in the channel, and uploads the missing bricks. If the client reconnects, this is
   * repeated. If only the materials have changed, no bricks are sent. If the argument is undefined, the server stops
   * rendering the current field. Requires `fields` in the config.
   */
  use(field: Field | undefined): void;
  /** The reason why the server has refused the field. Empty if it was not refused. */
  readonly fieldRefused: string;
  /**
   * Sends the predicted pose of the object at `aheadMs` from now. The server extrapolates it for at most 50 ms. Returns
   * false if there is no session, or if the server does not support fields. Throws a RangeError if a value is larger than
   * 10 m, 10 m/s or 100 rad/s.
   */
  pose(motion: Motion, aheadMs?: number): boolean;
  /**
   * Sends the true force for a state. It is not rendered, but the server uses it to correct the field. Returns false if
   * the state does not contain a field.
   */
  truth(hand: DeviceState, force: Vec3): boolean;
  stop(): void;
  /** Resolves at the end. Rejects with the exception of a callback, or if the host is unknown. */
  readonly ended: Promise<void>;
}

/**
 * Connects to a server. With `physics`, each device state is answered with a force. Reconnects if the server starts
 * later or is restarted.
 *
 *     connect(udp("127.0.0.1:47100"), { name: "spring" }, { physics: ({ position: p }) => ({ x: -500 * p.x, … }) });
 */
export function connect(
  open: OpenTransport,
  config: ConnectConfig,
  callback: { readonly physics: Physics } | { readonly watch: Watch },
): Guest {
  return new RealTimeGuest(open, config, callback);
}

/** The maximum number of event-loop rounds that a backlog of datagrams may delay the callback. */
const kMaxRounds = 16;
/** In some runtimes there is an overflow if the timer is longer. An early timer is harmless. */
const kLongestTimerMs = 1000;

const readClock = (): Nanoseconds => fromMilliseconds(performance.now());

class RealTimeGuest implements Guest {
  readonly ended: Promise<void>;
  readonly #client: ForceClient;
  readonly #transport: Transport;
  readonly #onPhase: ((guest: Guest) => void) | undefined;
  readonly #onReport: ((report: LinkReport) => void) | undefined;
  readonly #onUnusable: ((why: string) => void) | undefined;
  readonly #fields: boolean;
  #unusable = "";
  #leftOut = "";
  #told: LinkReport | undefined;
  readonly #defer: (task: () => void) => void;
  #resolve!: () => void;
  #reject!: (error: unknown) => void;
  #phase: Phase = "greeting";

  #timer: ReturnType<typeof setTimeout> | undefined;
  #timerDue: Nanoseconds = kNever;
  #deferred = false;
  #ended = false;
  /** The datagrams since the last round of the event loop, and for how many rounds they delayed the turn. */
  #arrived = 0;
  #rounds = 0;

  constructor(open: OpenTransport, config: ConnectConfig, callback: ConstructorParameters<typeof ForceClient>[1]) {
    this.ended = new Promise((resolve, reject) => {
      this.#resolve = resolve;
      this.#reject = reject;
    });
    this.#onPhase = config.onPhase;
    this.#onReport = config.onReport;
    this.#onUnusable = config.onUnusable;
    this.#fields = config.fields === true;
    this.#defer = makeDefer();
    this.#client = new ForceClient(config, callback, (datagram) => this.#transport.send(datagram), readClock());
    this.#transport = open((datagram) => this.#receive(datagram), (error) => this.#fail(error));
    this.#wake();
  }

  get phase(): Phase {
    return this.#client.phase;
  }
  get welcome(): Welcome | undefined {
    return this.#client.welcome;
  }
  get description(): DeviceDescription | undefined {
    return this.#client.description;
  }
  get handle(): HandleDescription | undefined {
    return this.#client.handle;
  }
  get holds(): boolean {
    return this.#client.holds;
  }
  get report(): LinkReport | undefined {
    return this.#client.report;
  }
  get deviceReport(): DeviceReport | undefined {
    return this.#client.deviceReport;
  }
  get peerReports(): ReadonlyMap<number, PeerReport> {
    return this.#client.peerReports;
  }
  stats(): ClientStats {
    return this.#client.stats();
  }
  rearm(): boolean {
    return this.#ask(() => this.#client.rearm());
  }
  disarm(): boolean {
    return this.#ask(() => this.#client.disarm());
  }
  engage(): boolean {
    return this.#ask(() => this.#client.engage());
  }
  disengage(): boolean {
    return this.#ask(() => this.#client.disengage());
  }
  setScale(positionScale: number, forceScale: number): boolean {
    return this.#ask(() => this.#client.setScale(positionScale, forceScale));
  }
  setShare(channel: number, share: number): boolean {
    return this.#ask(() => this.#client.setShare(channel, share));
  }
  setOutput(output: number, setting: LampColour | Vibration): boolean {
    return this.#ask(() => this.#client.setOutput(output, setting));
  }
  takeLease(): boolean {
    return this.#ask(() => this.#client.takeLease());
  }
  giveLease(): boolean {
    return this.#ask(() => this.#client.giveLease());
  }
  use(field: Field | undefined): void {
    expect(this.#fields, "fields", false, "true in the config");
    this.#client.fields.use(field?.describe());
    this.#wake();
  }
  get fieldRefused(): string {
    return this.#client.fields.refused;
  }
  pose(motion: Motion, aheadMs = 0): boolean {
    return this.#ask(() => this.#client.fields.move(readClock(), motion, fromMilliseconds(aheadMs)));
  }
  truth(hand: DeviceState, force: Vec3): boolean {
    return this.#ask(() => this.#client.truth(hand, force));
  }
  stop(): void {
    this.#client.stop(readClock());
    this.#end();
  }

  #ask(request: () => boolean): boolean {
    const asked = request();
    this.#wake();
    return asked;
  }

  #receive(datagram: Uint8Array): void {
    this.#client.receive(readClock(), datagram);
    ++this.#arrived;
    this.#wake();
  }

  #wake(): void {
    if (this.#deferred || this.#ended) return;
    this.#deferred = true;
    this.#defer(() => this.#round());
  }

  /**
   * Runs after the datagrams of this event-loop round. If there were several, more may be waiting in the socket, and
   * the callback must receive the newest state.
   */
  #round(): void {
    this.#deferred = false;
    const backlog = this.#arrived > 1 && this.#rounds < kMaxRounds;
    this.#arrived = 0;
    this.#rounds = backlog ? this.#rounds + 1 : 0;
    if (backlog) this.#wake();
    else this.#turn();
  }

  #turn(): void {
    try {
      let now: Nanoseconds;
      let next: Nanoseconds;
      do {
        now = readClock();
        next = this.#client.turn(now);
      } while (next <= now);
      if (this.phase === "stopped") {
        this.#end();
        return;
      }
      this.#arm(now, next);
      this.#tellPhase();
      this.#tellReport();
      this.#tellUnusable();
    } catch (error) {
      this.#fail(error);
    }
  }

  #fail(error: unknown): void {
    this.#reject(error);
    this.#end();
  }

  #tellPhase(): void {
    if (this.#phase === this.phase) return;
    this.#phase = this.phase;
    if (this.phase === "unanswered" || this.phase === "refused" || this.phase === "lost") {
      this.#transport.again?.(this.phase === "unanswered");
    }
    this.#onPhase?.(this);
  }

  #tellUnusable(): void {
    const { unusable, leftOut } = this.#client.stats();
    if (unusable && unusable !== this.#unusable) this.#onUnusable?.((this.#unusable = unusable));
    if (leftOut && leftOut !== this.#leftOut) this.#onUnusable?.((this.#leftOut = leftOut));
  }

  #tellReport(): void {
    const { report } = this.#client;
    if (!report || report === this.#told) return;
    this.#told = report;
    this.#onReport?.(report);
  }

  /** An early timer is cheaper than resetting it for each datagram. */
  #arm(now: Nanoseconds, next: Nanoseconds): void {
    if (this.#timer !== undefined && this.#timerDue <= next) return;
    clearTimeout(this.#timer);
    this.#timerDue = next;
    const wait = Math.min(Math.ceil(toMilliseconds(next - now)), kLongestTimerMs);
    this.#timer = setTimeout(() => {
      this.#timer = undefined;
      this.#wake();
    }, wait);
  }

  #end(): void {
    if (this.#ended) return;
    this.#ended = true;
    clearTimeout(this.#timer);
    this.#transport.close();
    this.#tellPhase();
    this.#resolve();
  }
}

/** Schedules a task after pending input. */
function makeDefer(): (task: () => void) => void {
  if (typeof setImmediate === "function") return (task) => void setImmediate(task);
  const channel = new MessageChannel(); // setTimeout(0) would wait for up to 4 ms
  let next: () => void = () => {};
  channel.port1.onmessage = () => next();
  return (task) => {
    next = task;
    channel.port2.postMessage(undefined);
  };
}

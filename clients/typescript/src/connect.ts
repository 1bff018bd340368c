// SPDX-License-Identifier: Apache-2.0
import type { ClientConfig, ClientStats, Phase } from "./config.js";
import { ForceClient, type Physics, type Watch } from "./force_client.js";
import type {
  DeviceDescription, DeviceReport, HandleDescription, LampColour, LinkReport, PeerReport, Vibration, Welcome,
} from "./messages.js";
import { fromMilliseconds, kNever, toMilliseconds, type Nanoseconds } from "./time.js";

/** The way of datagrams to one server. */
export interface Transport {
  /** Sends one datagram, or loses it. */
  send(datagram: Uint8Array): void;
  /** An attempt or a session is over: the server may have another address by now. `another`: nobody answered at this one. */
  again?(another: boolean): void;
  close(): void;
}
/**
 * Opens a way to one server: udp() of "tendon-client/node", webSocket(), or your own. Never calls back at once. `fail` ends the
 * guest: there is no way there and there will be none.
 */
export type OpenTransport = (receive: (datagram: Uint8Array) => void, fail: (error: Error) => void) => Transport;

export interface ConnectConfig extends ClientConfig {
  /** Told whenever the connection's phase has changed. */
  readonly onPhase?: (guest: Guest) => void;
  /** Told of each report of the server. */
  readonly onReport?: (report: LinkReport) => void;
  /** Told, once for each new reason, why a force of the callback, or a part of it (`leftOut`), was not sent. */
  readonly onUnusable?: (why: string) => void;
}

/** A guest in real time. */
export interface Guest {
  readonly phase: Phase;
  readonly welcome: Welcome | undefined;
  /** Description of the device, once `device` or `channel` was named and the server has answered. */
  readonly description: DeviceDescription | undefined;
  /** How the device lies before the operator, and its buttons' names. Absent for good when the server does not know that. */
  readonly handle: HandleDescription | undefined;
  /** The channel takes our forces; while it does not, the physics is not called. */
  readonly holds: boolean;
  /** The server's newest report on our forces, once a second while they come. */
  readonly report: LinkReport | undefined;
  /** With `diagnostics`, the newest report on the device's loop, once a second. */
  readonly deviceReport: DeviceReport | undefined;
  /** With `diagnostics`, the newest report on the engine of each channel; the last one stays when it has gone. */
  readonly peerReports: ReadonlyMap<number, PeerReport>;
  stats(): ClientStats;
  rearm(): boolean;
  disarm(): boolean;
  /** The operator's act of a coupling, at the leader's server, and its end. */
  engage(): boolean;
  disengage(): boolean;
  /** The scales of a coupling from now on, at the leader's server, while it is not engaged or its clutch is held. */
  setScale(positionScale: number, forceScale: number): boolean;
  /** How much the leader of that channel counts among several, at the follower's server. */
  setShare(channel: number, share: number): boolean;
  /** Sets a lamp of the device, or starts a pulse of vibration (`outputs` in the config). */
  setOutput(output: number, setting: LampColour | Vibration): boolean;
  /** Asks for the channel's lease, once more when it is lost before the answer; or gives it up. */
  takeLease(): boolean;
  giveLease(): boolean;
  /** Sends Bye and ends. */
  stop(): void;
  /** Resolves at the end; rejects with what a callback threw, or when there is no such host. */
  readonly ended: Promise<void>;
}

/**
 * Becomes a guest of a server: sees the hand, and with `physics` answers each state with a force. It waits for the server
 * when it is not there yet, and finds it again when it was restarted.
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

/** Rounds of the event loop that wait for a backlog to be read, before the callback must have its turn. */
const kMaxRounds = 16;
/** Longer timers overflow in some runtimes; this one only makes us look again. */
const kLongestTimerMs = 1000;

const readClock = (): Nanoseconds => fromMilliseconds(performance.now());

class RealTimeGuest implements Guest {
  readonly ended: Promise<void>;
  readonly #client: ForceClient;
  readonly #transport: Transport;
  readonly #onPhase: ((guest: Guest) => void) | undefined;
  readonly #onReport: ((report: LinkReport) => void) | undefined;
  readonly #onUnusable: ((why: string) => void) | undefined;
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
  /** Datagrams since the last round of the event loop, and how many rounds they have put the turn off. */
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
  stop(): void {
    this.#client.stop(readClock());
    this.#end();
  }

  /** A request leaves in the next turn. */
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
   * Comes after the datagrams that this round of the event loop has read. When they were several, more may wait in the
   * socket: the physics must see the newest state, not work through a queue of old ones.
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

  /** A timer that fires too early costs less than resetting it for every datagram. */
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

/** Puts a task behind the input that is already there. */
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

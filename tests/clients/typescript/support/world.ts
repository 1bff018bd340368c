// SPDX-License-Identifier: Apache-2.0
// A client (A) and a server (Z) in virtual time, and a network between them. A is the ForceClient that is tested, and Z
// is built from parts of the protocol. The network loses, delays, reorders and duplicates datagrams according to a
// seed.
import { decodeHelloMessage, encodeAnswerMessage, type ControlAck } from "../../../../clients/typescript/src/codec.js";
import {
  CipherSuite, concat, decodeHello, encodeAnswer, encodeRetry, equal, helloHeader, type HelloDatagram,
} from "../../../../clients/typescript/src/datagram.js";
import type { ClientConfig } from "../../../../clients/typescript/src/config.js";
import { ForceClient } from "../../../../clients/typescript/src/force_client.js";
import {
  Code, Mode, type DeviceState, type ForceCommand, type Grant, type Hello, type Refused, type Request, type Welcome,
} from "../../../../clients/typescript/src/messages.js";
import { keyId, keyOfSuite2 } from "../../../../clients/typescript/src/noise.js";
import { NoiseSeal, PlainSeal } from "../../../../clients/typescript/src/seal.js";
import { Session } from "../../../../clients/typescript/src/session.js";
import { kFeatureAesGcm } from "../../../../clients/typescript/src/suites.js";
import { fromMilliseconds, kNever, kSecond, type Nanoseconds } from "../../../../clients/typescript/src/time.js";
import { ascii } from "./bytes.js";
import { Random } from "./random.js";
import { readMessage1, type Answered } from "./responder.js";

export interface Weather {
  readonly loss: number;
  /** Must be above zero. */
  readonly delayMs: number;
  /** Uniform in [0, jitterMs), added to the delay. */
  readonly jitterMs: number;
  readonly duplicates: number;
}
export const kFair: Weather = { loss: 0, delayMs: 5, jitterMs: 0, duplicates: 0 };
export const kFoul: Weather = { loss: 0.3, delayMs: 5, jitterMs: 20, duplicates: 0.1 };

class Way {
  #flying: { readonly at: Nanoseconds; readonly datagram: Uint8Array }[] = [];
  constructor(readonly world: World) {}

  send(datagram: Uint8Array): void {
    const { weather, random, now } = this.world;
    const copies = random.uniform() < weather.duplicates ? 2 : 1;
    for (let i = 0; i < copies; ++i) {
      const lost = random.uniform() < weather.loss;
      const at = now + fromMilliseconds(weather.delayMs + weather.jitterMs * random.uniform());
      if (!lost) this.#flying.push({ at, datagram: datagram.slice() });
    }
    this.#flying.sort((a, b) => (a.at < b.at ? -1 : a.at > b.at ? 1 : 0));
  }
  *arrivals(now: Nanoseconds): Iterable<Uint8Array> {
    while (this.#flying[0] && this.#flying[0].at <= now) yield this.#flying.shift()!.datagram;
  }
  next(): Nanoseconds {
    return this.#flying[0]?.at ?? kNever;
  }
}

export interface ServerConduct {
  up: boolean;
  refuse: Refused | undefined;
  features: string[];
  grants: readonly Grant[];
  /** The key of the session. Undefined means suite 0. */
  key: Uint8Array | undefined;
  /** Use suite 2 if the client offers it. */
  aes: boolean;
  /** The number of datagrams and the time after which the server renews its key. */
  renewAfter: { datagrams: bigint; time: Nanoseconds };
  state: (tick: bigint) => DeviceState;
  /** One state is sent for this number of ticks. */
  every: bigint;
  answer: (request: Request) => Omit<ControlAck, "id">;
}

export const kWelcome: Omit<Welcome, "role" | "features"> = {
  version: 1, deviceName: "simulated", maxForce: 8, positionResolution: 0, loopHz: 1000, timeoutMs: 2000, server: "Z",
};

const kCookie = ascii("sixteen byte jar");

/** A server at 1 kHz. Its clock has an offset and runs 200 ppm fast. */
export class Server {
  readonly conduct: ServerConduct = {
    up: true,
    refuse: undefined,
    features: ["local-model"],
    grants: [],
    key: undefined,
    aes: false,
    renewAfter: NoiseSeal.kRenewAfter,
    every: 1n,
    answer: () => ({ code: Code.OK, detail: "done" }),
    state: (tick) => ({
      tick, sampledNs: tick * 1_000_000n, position: { x: Number(tick) / 1e6, y: 0, z: 0 },
      velocity: { x: 0, y: 0, z: 0 }, forceApplied: { x: 0, y: 0, z: 0 }, energy: 0, permittedForce: Infinity, reasons: 0,
      forceSequence: 0n, forceAgeNs: 0n, mode: Mode.ACTIVE, device: 0, channel: 0, buttons: 0,
    }),
  };
  readonly hellos: { readonly datagram: HelloDatagram; readonly hello: Hello }[] = [];
  readonly forces: { readonly at: Nanoseconds; readonly command: ForceCommand }[] = [];
  readonly requests: Request[] = [];
  /** The answers to the requests that are sent by the server. */
  readonly answers: { readonly code: Code; readonly detail: string }[] = [];
  session: Session | undefined;
  #nextId = 1;
  /** The answer to the attempt with this client random, sent again if the Hello is repeated. */
  #answered: { readonly random: Uint8Array; readonly datagram: Uint8Array } | undefined;
  #tick = 1n;

  constructor(private readonly random: Random) {}

  clock(now: Nanoseconds): Nanoseconds {
    return now + 12_345n * kSecond + now / 5000n;
  }
  restart(): void {
    this.session = undefined;
    this.#answered = undefined;
  }

  receive(now: Nanoseconds, datagram: Uint8Array, send: (datagram: Uint8Array) => void): void {
    const hello = decodeHello(datagram);
    if (!this.conduct.up) return;
    if (!hello) this.session?.receive(this.clock(now), datagram);
    else if (!equal(hello.cookie, kCookie)) send(encodeRetry({ suite: hello.suite, random: hello.random, cookie: kCookie }));
    else this.#meet(now, hello, send);
  }

  /** Called once per millisecond. */
  step(now: Nanoseconds, send: (datagram: Uint8Array) => void): void {
    const { session, conduct } = this;
    const halfOpen = conduct.key !== undefined && session?.stats.received === 0;
    if (!session || !conduct.up || halfOpen) return;
    const time = this.clock(now);
    session.tick(time);
    const tick = this.#tick++;
    if (tick % conduct.every === 0n) session.sendState(conduct.state(tick));
    for (let event; (event = session.nextEvent()); ) {
      if (event.kind === "force") this.forces.push({ at: now, command: event.command });
      if (event.kind === "request") {
        this.requests.push(event.request);
        session.answer({ id: event.id, ...conduct.answer(event.request) });
      }
      if (event.kind === "answered") this.answers.push({ code: event.code, detail: event.detail });
    }
    for (let datagram; (datagram = session.nextDatagram(time)); ) send(datagram);
  }

  #meet(now: Nanoseconds, datagram: HelloDatagram, send: (datagram: Uint8Array) => void): void {
    if (this.#answered && equal(this.#answered.random, datagram.random)) return send(this.#answered.datagram);
    const { key, refuse, features, grants, renewAfter } = this.conduct;
    const id = key ? keyId(key) : new Uint8Array(0);
    if (datagram.suite !== (key ? CipherSuite.Noise : CipherSuite.Plain)) return;
    if (!equal(datagram.content.subarray(0, id.length), id)) return;
    const message = datagram.content.slice(id.length);
    const prologue = concat(ascii("tendon-1"), helloHeader(datagram.suite), id, datagram.random);
    const noise = key && readMessage1(key, prologue, message);
    if (key && !noise) return;
    const hello = decodeHelloMessage(noise?.payload ?? message);
    if (!hello) return;
    this.hellos.push({ datagram, hello });

    const aes = this.conduct.aes && hello.features.includes(kFeatureAesGcm);
    const agreed = aes ? [kFeatureAesGcm, ...features] : features;
    const answer = refuse ?? { ...kWelcome, features: agreed, role: hello.role, grants };
    const finished = noise?.answer(this.random.bytes(32), encodeAnswerMessage(answer));
    const connectionId = refuse ? 0 : this.#nextId++;
    const content = finished?.message2 ?? encodeAnswerMessage(answer);
    this.#answered = {
      random: datagram.random,
      datagram: encodeAnswer({ suite: datagram.suite, connectionId, random: datagram.random, content }),
    };
    if (!refuse) {
      const seal = finished ? sealOf(finished, aes, this.clock(now), renewAfter) : new PlainSeal();
      this.session = new Session({ connectionId, seal }, this.clock(now));
    }
    send(this.#answered.datagram);
  }
}

function sealOf(
  { sendKey, receiveKey, hash }: Answered, aes: boolean, now: Nanoseconds, renewAfter: ServerConduct["renewAfter"],
): NoiseSeal {
  const keys = aes
    ? { sendKey: keyOfSuite2(sendKey, hash), receiveKey: keyOfSuite2(receiveKey, hash) }
    : { sendKey, receiveKey };
  return new NoiseSeal(keys, now, renewAfter, aes ? CipherSuite.AesGcm : CipherSuite.Noise);
}

export class World {
  now: Nanoseconds = kSecond;
  weather: Weather;
  readonly random: Random;
  readonly server: Server;
  readonly client: ForceClient;
  readonly toServer = new Way(this);
  readonly toClient = new Way(this);
  #nextTurn: Nanoseconds;
  #nextStep: Nanoseconds;

  constructor(
    seed: number,
    weather: Weather,
    config: ClientConfig,
    callback: ConstructorParameters<typeof ForceClient>[1],
    conduct: Partial<ServerConduct> = {},
  ) {
    this.random = new Random(seed);
    this.weather = weather;
    this.server = new Server(this.random);
    Object.assign(this.server.conduct, conduct);
    const random = (size: number): Uint8Array => this.random.bytes(size);
    this.client = new ForceClient({ random, ...config }, callback, (d) => this.toServer.send(d), this.now);
    this.#nextTurn = this.#nextStep = this.now;
  }

  runMs(ms: number): void {
    this.runUntil(() => false, ms);
  }

  /** Runs until done() is true. Returns false after `ms`. */
  runUntil(done: () => boolean, ms: number): boolean {
    const end = this.now + fromMilliseconds(ms);
    const toClient = (datagram: Uint8Array): void => this.toClient.send(datagram);
    while (!done()) {
      const next = [this.#nextTurn, this.#nextStep, this.toServer.next(), this.toClient.next()]
        .reduce((a, b) => (a < b ? a : b));
      if (next > end) {
        this.now = end;
        return false;
      }
      this.now = next > this.now ? next : this.now;
      for (const datagram of this.toServer.arrivals(this.now)) this.server.receive(this.now, datagram, toClient);
      if (this.now >= this.#nextStep) {
        this.server.step(this.now, toClient);
        this.#nextStep = this.now + 1_000_000n;
      }
      for (const datagram of this.toClient.arrivals(this.now)) {
        this.client.receive(this.now, datagram);
        this.#nextTurn = this.now;
      }
      if (this.now >= this.#nextTurn) this.#nextTurn = this.client.turn(this.now);
    }
    return true;
  }
}

export const kPush = { x: -1, y: 0, z: 0 };

export function controller(seed: number, weather: Weather, config: ClientConfig = {}, conduct: Partial<ServerConduct> = {}) {
  const seen: DeviceState[] = [];
  const physics = (hand: DeviceState) => {
    seen.push(hand);
    return kPush;
  };
  return { seen, world: new World(seed, weather, config, { physics }, conduct) };
}

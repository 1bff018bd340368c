// SPDX-License-Identifier: Apache-2.0
import { createServer, type IncomingMessage, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import type { Duplex } from "node:stream";
import { WebSocketServer, type WebSocket } from "ws";
import { CipherSuite, decodeHeader } from "./datagram.js";
import { kMaxDatagram } from "./limits.js";
import { addressText, isLoopback, lookUp, parseAddress, parseServer, udp } from "./udp.js";

export interface BridgeConfig {
  /** The address for WebSockets, HOST:PORT. If the port is 0, it is chosen by the system. */
  readonly listen: string;
  /** The address of tendond, HOST:PORT. HOST can be a name or an address. */
  readonly to: string;
  /** Other origins of pages that may connect, for example "https://lab.example". */
  readonly origins: readonly string[];
  readonly maxPeers: number;
  /** The maximum number of datagrams per second that are accepted from a page. Other datagrams are dropped. */
  readonly maxRateHz: number;
}

export const kBridgeDefaults: BridgeConfig = {
  listen: "127.0.0.1:47180", to: "127.0.0.1:47100", origins: [], maxPeers: 32, maxRateHz: 4000,
};

export interface BridgeCounts {
  peers: number;
  opened: number;
  /** The number of WebSockets that were refused because of a wrong origin, or because there were too many. */
  refusedOrigin: number;
  refusedFull: number;
  toServer: number;
  toPage: number;
  /** The number of messages that were dropped because they are not datagrams of Tendon. */
  malformed: number;
  /** The number of messages that were dropped because they are unencrypted and from another machine. */
  plain: number;
  /** Dropped: above maxRateHz. */
  tooFast: number;
  /** The number of datagrams that were dropped for newer ones because the page is too slow. */
  tooSlow: number;
}

/** The maximum number of bytes that wait in a WebSocket, which is about 60 ms of states at 1 kHz. */
const kMaxWaitingBytes = 16 * 1024;
/** If a page is silent for this time, it is disconnected. A session sends every 50 ms. */
const kIdleMs = 30_000;

/**
 * Connects browsers, which have no UDP, to tendond. Each binary WebSocket message contains one datagram, and each
 * WebSocket has its own UDP socket. The bridge has no key and reads only the unencrypted header.
 *
 * For tendond, all datagrams come from the machine of the bridge, from which it accepts unencrypted datagrams.
 * Therefore the bridge accepts only pages of this machine and of the configured origins, because any page open in a
 * browser could otherwise move the hand. Unencrypted datagrams are forwarded only from WebSockets of this machine
 * without a proxy.
 */
export class Bridge {
  readonly counts: BridgeCounts = {
    peers: 0, opened: 0, refusedOrigin: 0, refusedFull: 0, toServer: 0, toPage: 0, malformed: 0, plain: 0, tooFast: 0,
    tooSlow: 0,
  };
  readonly #config: BridgeConfig;
  readonly #http: Server;
  readonly #webSockets = new WebSocketServer({ noServer: true, maxPayload: kMaxDatagram, perMessageDeflate: false });

  private constructor(config: BridgeConfig) {
    this.#config = config;
    this.#http = createServer((_, response) => {
      response.writeHead(426, { "Content-Type": "text/plain" }).end("This is tendon-bridge: it speaks WebSocket only.\n");
    });
    this.#http.on("upgrade", (request: IncomingMessage, socket: Duplex, head: Buffer) => this.#meet(request, socket, head));
  }

  /** Throws an Error if an address is invalid or cannot be used. */
  static async open(config: Partial<BridgeConfig> = {}): Promise<Bridge> {
    const bridge = new Bridge({ ...kBridgeDefaults, ...config });
    await lookUp(parseServer(bridge.#config.to).host);
    const { host, port } = parseAddress(bridge.#config.listen);
    await new Promise<void>((resolve, reject) => {
      const refused = ({ code }: NodeJS.ErrnoException): void => {
        const why = code === "EADDRINUSE" ? "address already in use" : code;
        reject(new Error(`cannot listen on ${bridge.#config.listen}: ${why}`));
      };
      bridge.#http.once("error", refused).listen({ host, port }, resolve);
    });
    return bridge;
  }

  /** The address at which the bridge listens, HOST:PORT. */
  get address(): string {
    const { address, port } = this.#http.address() as AddressInfo;
    return addressText({ host: address, port });
  }

  async close(): Promise<void> {
    for (const page of this.#webSockets.clients) page.terminate();
    await new Promise<void>((resolve) => {
      this.#http.close(() => resolve());
      this.#http.closeAllConnections();
    });
  }

  #meet(request: IncomingMessage, socket: Duplex, head: Buffer): void {
    const refuse = (status: string): void => {
      socket.once("finish", () => socket.destroy()); // even if the client does not close
      socket.end(`HTTP/1.1 ${status}\r\nConnection: close\r\n\r\n`);
    };
    socket.on("error", () => {}); // "close" follows
    if (!this.#isWelcome(request.headers.origin)) {
      ++this.counts.refusedOrigin;
      refuse("403 Forbidden");
    } else if (this.counts.peers >= this.#config.maxPeers) {
      ++this.counts.refusedFull;
      refuse("503 Service Unavailable");
    } else {
      this.#webSockets.handleUpgrade(request, socket, head, (page) => this.#serve(page, isLocal(request)));
    }
  }

  /** Programs other than browsers send no origin. They could use UDP as well. */
  #isWelcome(origin: string | undefined): boolean {
    if (origin === undefined || this.#config.origins.includes(origin)) return true;
    return URL.canParse(origin) && isLoopbackName(new URL(origin).hostname);
  }

  #serve(page: WebSocket, local: boolean): void {
    const { counts } = this;
    ++counts.peers;
    ++counts.opened;
    const way = udp(this.#config.to)((datagram) => {
      if (page.bufferedAmount > kMaxWaitingBytes) {
        ++counts.tooSlow;
      } else {
        ++counts.toPage;
        page.send(datagram, { binary: true });
      }
    }, () => page.terminate());
    const rate = new RateLimit(this.#config.maxRateHz);
    const idle = setTimeout(() => page.terminate(), kIdleMs);
    page.on("message", (data, isBinary) => {
      idle.refresh();
      const datagram = data as Buffer;
      const header = isBinary ? decodeHeader(datagram) : undefined;
      if (!header) ++counts.malformed;
      else if (header.suite === CipherSuite.Plain && !local) ++counts.plain;
      else if (!rate.take(performance.now())) ++counts.tooFast;
      else {
        ++counts.toServer;
        way.send(datagram);
      }
    });
    page.on("error", () => {}); // "close" follows
    page.on("close", () => {
      clearTimeout(idle);
      way.close();
      --counts.peers;
    });
  }
}

/** A token bucket for a rate per second with a burst of a tenth of that. */
class RateLimit {
  #left: number;
  #then = 0;
  constructor(readonly rateHz: number) {
    this.#left = this.#most;
  }
  take(nowMs: number): boolean {
    this.#left = Math.min(this.#left + ((nowMs - this.#then) / 1000) * this.rateHz, this.#most);
    this.#then = nowMs;
    if (this.#left < 1) return false;
    --this.#left;
    return true;
  }
  get #most(): number {
    return Math.max(this.rateHz / 10, 1);
  }
}

const isLoopbackName = (name: string): boolean =>
  name === "localhost" || name.endsWith(".localhost") || isLoopback(name.replace(/^\[|\]$/g, ""));

/** Whether the request comes from this machine without a proxy. */
function isLocal(request: IncomingMessage): boolean {
  const { headers, socket } = request;
  const proxied = ["forwarded", "x-forwarded-for", "x-real-ip", "via"].some((name) => headers[name] !== undefined);
  return !proxied && isLoopback(socket.remoteAddress ?? "");
}

// SPDX-License-Identifier: Apache-2.0
import { createSocket } from "node:dgram";
import { isIPv4, isIPv6 } from "node:net";
import type { OpenTransport } from "./connect.js";

export interface Address {
  readonly host: string;
  readonly port: number;
}

/**
 * "127.0.0.1:47100" or "[::1]:47100". HOST is a numeric address or `localhost` (127.0.0.1); there is no name lookup, so
 * nothing here waits. Anything else throws a RangeError.
 */
export function parseAddress(text: string): Address {
  const [, bracketed, plain, digits] = /^(?:\[([^\]]*)\]|([^:]*)):(\d{1,5})$/.exec(text) ?? [];
  const host = plain === "localhost" ? "127.0.0.1" : (plain ?? bracketed ?? "");
  const port = Number(digits);
  if ((plain === undefined ? !isIPv6(host) : !isIPv4(host)) || !(port <= 0xffff)) {
    throw new RangeError(`expected HOST:PORT like 127.0.0.1:47100, got "${text}"`);
  }
  return { host, port };
}

export const addressText = ({ host, port }: Address): string => `${isIPv6(host) ? `[${host}]` : host}:${port}`;

/** 127.0.0.0/8 and ::1: datagrams to it never leave this machine. False for what is no numeric address. */
export function isLoopback(host: string): boolean {
  const ip = host.replace(/^::ffff:/i, "");
  return isIPv4(ip) ? ip.startsWith("127.") : ip === "::1";
}

/**
 * A UDP socket that talks to one server, from a port that the system chooses. It is connected, so that the kernel drops
 * what others send to it. What the system does not take is lost.
 */
export function udp(server: string): OpenTransport {
  const { host, port } = parseAddress(server);
  return (receive) => {
    const socket = createSocket(isIPv6(host) ? "udp6" : "udp4");
    /** Until the socket is connected, which takes a round of the event loop. */
    let waiting: Uint8Array[] | undefined = [];
    socket.on("message", receive);
    socket.on("error", () => {}); // nobody listens there (yet)
    socket.connect(port, host, () => {
      const early = waiting ?? [];
      waiting = undefined;
      for (const datagram of early) socket.send(datagram, () => {});
    });
    return {
      send(datagram) {
        if (waiting) waiting.push(datagram);
        else socket.send(datagram, () => {});
      },
      close() {
        socket.close();
      },
    };
  };
}

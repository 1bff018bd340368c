// SPDX-License-Identifier: Apache-2.0
import { createSocket, type Socket } from "node:dgram";
import { lookup } from "node:dns/promises";
import { isIP, isIPv4, isIPv6 } from "node:net";
import type { OpenTransport } from "./connect.js";

export interface Address {
  readonly host: string;
  readonly port: number;
}

/**
 * Parses "127.0.0.1:47100" or "[::1]:47100". HOST is a numeric address or `localhost` (127.0.0.1); names are not
 * resolved, so this never blocks. Throws a RangeError for other texts.
 */
export function parseAddress(text: string): Address {
  const [, bracketed, plain, digits] = /^(?:\[([^\]]*)\]|([^:]*)):(\d{1,5})$/.exec(text) ?? [];
  const host = plain === "localhost" ? "127.0.0.1" : (plain ?? bracketed ?? "");
  const port = Number(digits);
  if ((plain === undefined ? !isIPv6(host) : !isIPv4(host)) || !(port <= 0xffff)) {
    throw new RangeError(`expected HOST:PORT like 127.0.0.1:47100 or [::1]:47100, got "${text}"`);
  }
  return { host, port };
}

export const addressText = ({ host, port }: Address): string => `${isIPv6(host) ? `[${host}]` : host}:${port}`;

/** Returns true if the address is in 127.0.0.0/8 or ::1. Returns false for names. */
export function isLoopback(host: string): boolean {
  const ip = host.replace(/^::ffff:/i, "");
  return isIPv4(ip) ? ip.startsWith("127.") : ip === "::1";
}

/** Like parseAddress(), but HOST may also be a name: "haptics.lab:47100". Does not resolve it. */
export function parseServer(text: string): Address {
  const [, host = "", digits] = /^([A-Za-z0-9_][A-Za-z0-9_.-]{0,252}):(\d{1,5})$/.exec(text) ?? [];
  if (host === "" || host === "localhost" || isIPv4(host) || Number(digits) > 0xffff) return parseAddress(text);
  return { host, port: Number(digits) };
}

/** The host name is unknown. The message contains the name. */
export class NoSuchHost extends Error {}

/** Returns the addresses of a host in order of preference. Rejects with NoSuchHost. */
export async function lookUp(host: string): Promise<readonly string[]> {
  if (isIP(host)) return [host];
  try {
    return (await lookup(host, { all: true, verbatim: true })).map(({ address }) => address);
  } catch (error) {
    const { code, message } = error as NodeJS.ErrnoException;
    throw new NoSuchHost(`cannot find ${host}: ${code === "ENOTFOUND" ? "no such host" : message}`);
  }
}

/** The maximum number of datagrams that wait for the socket. If there are more, the oldest ones are dropped. */
const kMostWaiting = 16;

/**
 * A UDP socket connected to one server from an ephemeral port, so that the kernel drops datagrams from other senders.
 * Datagrams that the system rejects are dropped. The host name is resolved at the start and again before each further
 * attempt. If it is unknown at the start, the client ends with NoSuchHost.
 */
export function udp(server: string): OpenTransport {
  const { host, port } = parseServer(server);
  return (receive, fail) => {
    let socket: Socket | undefined;
    let present = "";
    let closed = false;
    /** This is used until a socket is connected, which takes some rounds of the event loop. */
    const waiting: Uint8Array[] = [];
    const send = (datagram: Uint8Array): void => {
      if (socket) socket.send(datagram, () => {});
      else if (waiting.push(datagram) > kMostWaiting) waiting.shift();
    };
    /** The result is true if the address is reachable. */
    const moveTo = (ip: string): Promise<boolean> =>
      new Promise((resolve) => {
        const next = createSocket(isIPv6(ip) ? "udp6" : "udp4");
        next.on("message", receive);
        next.on("error", () => {}); // the server is not listening (yet)
        // Node passes an error to the callback, contrary to its type declarations.
        next.connect(port, ip, (...results: unknown[]) => {
          if (closed || results[0]) {
            next.close();
            return resolve(closed);
          }
          socket?.close();
          [socket, present] = [next, ip];
          waiting.splice(0).forEach(send);
          resolve(true);
        });
      });
    const find = async (another: boolean): Promise<void> => {
      const ips = await lookUp(host);
      const at = ips.indexOf(present);
      if (at >= 0 && (!another || ips.length === 1)) return;
      for (let i = 0; i < ips.length; ++i) {
        const ip = ips[(at + 1 + i) % ips.length]!;
        if (closed || ip === present || (await moveTo(ip))) return;
      }
    };
    find(false).catch(fail);
    return {
      send,
      again: (another) => void find(another).catch(() => {}), // keep the current address
      close() {
        closed = true;
        socket?.close();
      },
    };
  };
}

// SPDX-License-Identifier: Apache-2.0
// The header and the three datagrams of the handshake. Decoding never throws and returns undefined for invalid input.
import { kMaxDatagram } from "./limits.js";
import { kProtocolVersion } from "./messages.js";

export const DatagramType = { Hello: 1, Retry: 2, Data: 3, Answer: 4 } as const;
export type DatagramType = (typeof DatagramType)[keyof typeof DatagramType];

/**
 * 0: unencrypted, loopback only. 1: Noise_NNpsk0_25519_ChaChaPoly_SHA256. 2: handshake of suite 1, then AES-256-GCM;
 * Data only.
 */
export const CipherSuite = { Plain: 0, Noise: 1, AesGcm: 2 } as const;
export type CipherSuite = (typeof CipherSuite)[keyof typeof CipherSuite];

const kMagic = 0x54; // 'T'
export const kHeaderSize = 16;
const kRandomAt = 16;
const kCookieAt = 32;
const kRetrySize = 48;
const kContentLengthAt = 48;
const kContentAt = 50;
const kAnswerAt = 32;

/** The unencrypted 16-byte header of each datagram. It is the associated data of the encryption. */
export interface Header {
  readonly type: DatagramType;
  readonly epoch: number;
  readonly suite: CipherSuite;
  /** This is assigned by the server. It is 0 before that. */
  readonly connectionId: number;
  /** 0, 1, 2 … for each direction in Data, otherwise 0. */
  readonly packetNumber: bigint;
}

export function encodeHeader(header: Header): Uint8Array {
  const bytes = new Uint8Array(kHeaderSize);
  const view = new DataView(bytes.buffer);
  bytes[0] = kMagic;
  bytes[1] = (kProtocolVersion << 4) | header.type;
  bytes[2] = header.epoch;
  bytes[3] = header.suite;
  view.setUint32(4, header.connectionId, true);
  view.setBigUint64(8, header.packetNumber, true);
  return bytes;
}

export function decodeHeader(datagram: Uint8Array): Header | undefined {
  if (datagram.length < kHeaderSize || datagram.length > kMaxDatagram) return undefined;
  const view = viewOf(datagram);
  const second = view.getUint8(1);
  const type = second & 0x0f;
  const epoch = view.getUint8(2);
  const suite = view.getUint8(3);
  if (view.getUint8(0) !== kMagic || second >> 4 !== kProtocolVersion) return undefined;
  if (type < DatagramType.Hello || type > DatagramType.Answer || suite > CipherSuite.AesGcm) return undefined;
  if (type !== DatagramType.Data && (epoch !== 0 || suite === CipherSuite.AesGcm)) return undefined;
  if (epoch !== 0 && suite === CipherSuite.Plain) return undefined;
  return {
    type: type as DatagramType,
    epoch,
    suite: suite as CipherSuite,
    connectionId: view.getUint32(4, true),
    packetNumber: view.getBigUint64(8, true),
  };
}

export interface HelloDatagram {
  readonly suite: CipherSuite;
  /** 16 bytes chosen by the client, which identify the attempt in Retry and Answer. */
  readonly random: Uint8Array;
  /** 16 bytes that are chosen by the server. They are zero in the first Hello. */
  readonly cookie: Uint8Array;
  /** Suite 0: message Hello. Suite 1: key id, then Noise message 1. */
  readonly content: Uint8Array;
}
export interface RetryDatagram {
  readonly suite: CipherSuite;
  readonly random: Uint8Array;
  readonly cookie: Uint8Array;
}
export interface AnswerDatagram {
  readonly suite: CipherSuite;
  /** 0 with Refused. */
  readonly connectionId: number;
  readonly random: Uint8Array;
  /** Suite 0: message Answer. Suite 1: Noise message 2. */
  readonly content: Uint8Array;
}

const handshakeHeader = (type: DatagramType, suite: CipherSuite, connectionId = 0): Uint8Array =>
  encodeHeader({ type, epoch: 0, suite, connectionId, packetNumber: 0n });

export const helloHeader = (suite: CipherSuite): Uint8Array => handshakeHeader(DatagramType.Hello, suite);

/** Always returns 1200 bytes, so that replies are never larger (no amplification). */
export function encodeHello(hello: HelloDatagram): Uint8Array {
  const bytes = new Uint8Array(kMaxDatagram);
  bytes.set(helloHeader(hello.suite));
  bytes.set(hello.random, kRandomAt);
  bytes.set(hello.cookie, kCookieAt);
  viewOf(bytes).setUint16(kContentLengthAt, hello.content.length, true);
  bytes.set(hello.content, kContentAt);
  return bytes;
}

export const encodeRetry = (retry: RetryDatagram): Uint8Array =>
  concat(handshakeHeader(DatagramType.Retry, retry.suite), retry.random, retry.cookie);

export const encodeAnswer = (answer: AnswerDatagram): Uint8Array =>
  concat(handshakeHeader(DatagramType.Answer, answer.suite, answer.connectionId), answer.random, answer.content);

export function decodeHello(datagram: Uint8Array): HelloDatagram | undefined {
  const header = decodeHandshake(datagram, DatagramType.Hello);
  if (!header || datagram.length !== kMaxDatagram) return undefined;
  const end = kContentAt + viewOf(datagram).getUint16(kContentLengthAt, true);
  if (end > kMaxDatagram || datagram.subarray(end).some((byte) => byte !== 0)) return undefined;
  return {
    suite: header.suite,
    random: datagram.slice(kRandomAt, kCookieAt),
    cookie: datagram.slice(kCookieAt, kContentLengthAt),
    content: datagram.slice(kContentAt, end),
  };
}

export function decodeRetry(datagram: Uint8Array): RetryDatagram | undefined {
  const header = decodeHandshake(datagram, DatagramType.Retry);
  if (!header || datagram.length !== kRetrySize) return undefined;
  return { suite: header.suite, random: datagram.slice(kRandomAt, kCookieAt), cookie: datagram.slice(kCookieAt) };
}

export function decodeAnswer(datagram: Uint8Array): AnswerDatagram | undefined {
  const header = decodeHandshake(datagram, DatagramType.Answer);
  if (!header || datagram.length < kAnswerAt) return undefined;
  return {
    suite: header.suite,
    connectionId: header.connectionId,
    random: datagram.slice(kRandomAt, kAnswerAt),
    content: datagram.slice(kAnswerAt),
  };
}

function decodeHandshake(datagram: Uint8Array, type: DatagramType): Header | undefined {
  const header = decodeHeader(datagram);
  if (header?.type !== type || header.packetNumber !== 0n) return undefined;
  return type === DatagramType.Answer || header.connectionId === 0 ? header : undefined;
}

export function concat(...pieces: readonly Uint8Array[]): Uint8Array {
  const whole = new Uint8Array(pieces.reduce((size, piece) => size + piece.length, 0));
  let at = 0;
  for (const piece of pieces) {
    whole.set(piece, at);
    at += piece.length;
  }
  return whole;
}

export const equal = (a: Uint8Array, b: Uint8Array): boolean =>
  a.length === b.length && a.every((byte, i) => byte === b[i]);

const viewOf = (bytes: Uint8Array): DataView => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

// SPDX-License-Identifier: Apache-2.0
// Bounds of the wire that are used outside gen/codec.ts. Both ends have the same (protocol/WIRE.md, SESSION.md).

/** Bytes; no datagram is larger: below every common path MTU, so it is never fragmented. */
export const kMaxDatagram = 1200;
/** Largest magnitude of any quantity, per component, in SI units. */
export const kMaxValue = 1e12;
/** ns; largest distance of any clock reading from its zero. */
export const kMaxTime = 1n << 60n;
/** Tolerance of the length of a unit normal or quaternion. */
export const kUnitTolerance = 1e-3;
/** ms; longest validity of a force. */
export const kMaxValidForMs = 10_000;
/** Packet numbers are below this: a nonce never comes near the one that renews a key. */
export const kMaxPacketNumber = 1n << 60n;
export const kMaxFrames = 64;
/** Requests sent and not yet answered. */
export const kRequestWindow = 16;
/** Bytes of UTF-8 in a name. */
export const kMaxName = 64;
/** Bytes of UTF-8 in the name of a device or a channel. */
export const kMaxLabel = 24;
/** Ways of answering that an engine names. */
export const kMaxWays = 8;
export const kMaxLoopHz = 1_000_000;
/** How many times a Bye is sent. */
export const kByes = 3;
/** A sealed session ends after so many datagrams that did not open, so that nobody can go on guessing tags. */
export const kMaxForged = 2 ** 36;

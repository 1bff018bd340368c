// SPDX-License-Identifier: Apache-2.0
// Bounds of the protocol that are used outside of gen/codec.ts (protocol/WIRE.md, SESSION.md).

/** Size limit of a datagram in bytes. Below all common path MTUs, so that datagrams are never fragmented. */
export const kMaxDatagram = 1200;
/** Largest magnitude of each component of a quantity in SI units. */
export const kMaxValue = 1e12;
/** ns, largest magnitude of a clock reading. */
export const kMaxTime = 1n << 60n;
/** Tolerance of the norm of a unit vector or quaternion. */
export const kUnitTolerance = 1e-3;
/** ms, maximum validity of a force. */
export const kMaxValidForMs = 10_000;
/** Exclusive upper bound of packet numbers, so that a nonce never reaches that of REKEY. */
export const kMaxPacketNumber = 1n << 60n;
export const kMaxFrames = 64;
/** The maximum number of pending requests. */
export const kRequestWindow = 16;
/** Bytes of UTF-8 in a name. */
export const kMaxName = 64;
/** Bytes of UTF-8 in the name of a device or a channel. */
export const kMaxLabel = 24;
export const kMaxWays = 8;
export const kMaxLoopHz = 1_000_000;
/** How many times a Bye is sent. */
export const kByes = 3;
/** An encrypted session ends after this number of forged datagrams, which limits how often a tag can be guessed. */
export const kMaxForged = 2 ** 36;

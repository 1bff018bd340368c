// SPDX-License-Identifier: Apache-2.0
// Every bound of the wire; both ends have the same (protocol/WIRE.md, protocol/SESSION.md).

/** Bytes; no datagram is larger: below every common path MTU, so it is never fragmented. */
export const kMaxDatagram = 1200;
/** Largest magnitude of any quantity, per component, in SI units. */
export const kMaxValue = 1e12;
/** ns; largest distance of any clock reading from its zero. */
export const kMaxTime = 1n << 60n;
/** Tolerance of the length of a unit normal or quaternion. */
export const kUnitTolerance = 1e-3;
/** Entries of a table of forces. */
export const kMinTable = 2;
export const kMaxTable = 16;
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
/** Named buttons of a device. */
export const kMaxButtons = 16;
export const kMaxJoints = 8;
export const kMaxOutputs = 8;
/** The longest pulse of a vibration, ms: nobody feels a longer one, and it cannot be left on. */
export const kMaxVibrationMs = 10_000;
/** Hz. */
export const kMinVibrationHz = 20;
export const kMaxVibrationHz = 1000;
export const kMaxDevices = 16;
export const kMaxChannels = 8;
export const kMaxClaims = 16;
/** Ways of answering that an engine names. */
export const kMaxWays = 8;
/** Axes of a device. */
export const kMaxDof = 6;
export const kMaxFeatures = 16;
/** Bytes of UTF-8 in one feature. */
export const kMaxFeature = 32;
/** Bytes of UTF-8 in one sentence: the reason of a refusal, an answer or a Bye. */
export const kMaxDetail = 128;
/** Longest round trip that an end of a coupling tells. */
export const kMaxRoundTripNs = 10_000_000_000n;
/** J in the account of an end of a coupling, and in the totals that it pays and is paid. */
export const kMaxAccount = 1e3;
export const kMaxTotal = 1e6;
/** Of positions and forces, from one end of a coupling to the other. */
export const kMinScale = 0.01;
export const kMaxScale = 100;
export const kMaxLoopHz = 1_000_000;
/** Buckets in the histogram of a loop's lateness. */
export const kLatenessBuckets = 24;
/** A server sends an engine at least one state in this many. */
export const kMaxOneIn = 1000;
export const kMaxTimeoutMs = 3_600_000;
/** How many times a Bye is sent. */
export const kByes = 3;
/** A sealed session ends after so many datagrams that did not open, so that nobody can go on guessing tags. */
export const kMaxForged = 2 ** 36;

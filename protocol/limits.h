// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/output.h"
#include "core/base/time.h"

// The bounds of the wire, with their reasons. They are part of the protocol and not configurable (WIRE.md lists them),
// because both peers must agree on them. A receiver refuses and counts a value that is out of bounds; a sender
// truncates texts and lists. The comments in tendon.proto contain the same bounds, and protocol/vectors/bounds.json
// tests them.

namespace tendon::limits {

/// Largest magnitude of any physical quantity in SI units, per component. This is not a physical limit, which the
/// server sets. Its cube is finite in single precision (1e36 < 3.4e38), and a unit error of 1e9 or more is detected.
inline constexpr double kMaxValue = 1e12;

/// Largest distance of a clock reading from its zero: 36 years. A round trip is the sum of four such times and cannot
/// overflow 64 bits.
inline constexpr Duration kMaxTime{std::int64_t{1} << 60};

/// Longest validity of a force. A longer one would outlast every timeout and so act on behalf of a dead peer.
inline constexpr Duration kMaxValidFor = std::chrono::seconds(10);

/// Frames in one datagram. A correct peer needs at most 48: both request windows and sixteen states or forces. Without
/// this bound, a datagram of 1200 bytes could hold 590 empty frames.
inline constexpr int kMaxFrames = 64;

/// Requests that may be sent without an answer. Both peers keep this many slots, so that answers survive loss (see
/// requests.h). Requests come from people; 16 allow for a burst of clicks.
inline constexpr std::uint32_t kRequestWindow = 16;

/// Widest deadband of states that a server grants. Half the speed is far above the thresholds of touch (7 … 15 %). A
/// hand at 1 m/s moves 20 mm in the longest silence. A silence below 1 ms, one haptic step, would omit nothing.
inline constexpr double kMaxDeadbandShare = 0.5;
inline constexpr double kMaxDeadbandFloor = 0.1;  ///< m/s
inline constexpr Duration kMinStateSilence = std::chrono::milliseconds(1);
inline constexpr Duration kMaxStateSilence = std::chrono::milliseconds(20);

/// Devices of one session, numbered from 0: ten fingers of two hands, and six more for tools.
inline constexpr std::uint32_t kMaxDevices = 16;
/// Channels of one device, numbered from 0. Each one adds a reconstruction to every haptic step.
inline constexpr std::uint32_t kMaxChannels = 8;
inline constexpr int kMaxClaims = 16;
/// Bytes in the name of a device or a channel.
inline constexpr std::size_t kMaxLabel = 24;
inline constexpr std::size_t kMaxButtons = 16;
inline constexpr std::size_t kMaxJoints = 8;
inline constexpr std::size_t kMaxOutputs = kMostOutputs;
/// Solver paths that an engine names. Engines have five at most, and a Hello has no room for sixteen (see below).
inline constexpr std::size_t kMaxWays = 8;

/// Longest pulse of a vibration. It is longer than anyone needs, and it prevents a vibration that never stops.
inline constexpr Duration kMaxVibration = std::chrono::seconds(10);
/// Hz. Slower pulses are felt as motion; faster ones are not felt at all.
inline constexpr double kMinVibrationHz = 20;
inline constexpr double kMaxVibrationHz = 1000;

/// Sizes of texts in bytes of UTF-8. With these, the largest Hello without claims (882 bytes before padding, 208 of
/// them ways) and the largest Welcome (874) fit into the 944 bytes that a datagram has for them. Sixteen claims with
/// the longest names (896) and sixteen of the longest features (544) do not fit together; ClientHandshake refuses such
/// a Hello.
inline constexpr std::size_t kMaxName = 64;
inline constexpr std::size_t kMaxFeature = 32;
inline constexpr int kMaxFeatures = 16;
/// One sentence: the reason in a refusal, an answer or a Bye.
inline constexpr std::size_t kMaxDetail = 128;

/// Buckets of a loop's lateness histogram, in powers of two of 1 µs. The last but one ends at 4.2 s, later than every
/// safe stop.
inline constexpr std::size_t kLatenessBuckets = 24;
/// Largest divisor of the state rate. It is fifty times larger than any that RateAdaptation chooses.
inline constexpr std::uint32_t kMaxOneIn = 1000;

/// Haptic steps per second: ten times the fastest loop known to us (100 kHz, on FPGAs).
inline constexpr std::uint32_t kMaxLoopHz = 1'000'000;

/// Longest silence that a server may grant. An hour is more than anyone needs, and it keeps sums of times small.
inline constexpr Duration kMaxTimeout = std::chrono::hours(1);

/// Packet numbers are below this, far from 2⁶⁴ − 1, the nonce that renews a key. At 1 MHz they last for 36 000 years.
inline constexpr std::uint64_t kMaxPacketNumber = std::uint64_t{1} << 60;

/// Datagrams that may be sealed with one key. The confidentiality of AES-GCM decreases with the number of blocks
/// sealed; RFC 9001, 6.6 allows 2²³ packets of any size. Rekey is far below.
inline constexpr std::uint64_t kMaxDatagramsOfKey = std::uint64_t{1} << 23;
/// Datagrams that fail authentication before a session is ended. Each one is a guess at a tag; RFC 9001, 6.6 allows 2³⁶
/// per connection for ChaCha20-Poly1305 and 2⁵² for AES-GCM. At 1 MHz this takes 19 h.
inline constexpr std::uint64_t kMaxForged = std::uint64_t{1} << 36;

/// Number of times that a Bye is sent. At 10 % loss, one conversation in a thousand loses all three and ends by
/// timeout.
inline constexpr int kByes = 3;

}  // namespace tendon::limits

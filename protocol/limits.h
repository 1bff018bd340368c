// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/output.h"
#include "core/base/time.h"

// Every bound of the wire, each with its reason. Both ends must agree on them: they are part of the protocol (WIRE.md
// lists them), not settings. A receiver refuses a value beyond its bound, and counts it; a sender cuts texts and lists
// to size. The comments in tendon.proto hold the same bounds, and protocol/vectors/bounds.json tests them.

namespace tendon::limits {

/// Largest magnitude of any physical quantity in SI units, per component. It is no physical limit (those are the
/// server's): its cube stays finite in single precision (1e36 < 3.4e38), and a unit that is wrong by 1e9 or more is
/// noticed.
inline constexpr double kMaxValue = 1e12;

/// Largest distance of any clock reading from its zero: 36 years. A round trip is the sum of four such times; it cannot
/// overflow 64 bits.
inline constexpr Duration kMaxTime{std::int64_t{1} << 60};

/// The longest validity of a force. A longer one would outlast every peer timeout, and so speak for a dead peer.
inline constexpr Duration kMaxValidFor = std::chrono::seconds(10);

/// Frames in one datagram. A correct peer needs 48 at most: both request windows and sixteen states or forces. Without
/// this bound a datagram of 1200 bytes could hold 590 empty frames.
inline constexpr int kMaxFrames = 64;

/// Requests sent and not yet answered. Both ends keep this many slots, so that answers survive loss (see requests.h).
/// People make requests; 16 are a burst of clicks.
inline constexpr std::uint32_t kRequestWindow = 16;

/// The widest deadband of states that a server grants. Half the speed is far beyond the thresholds of touch (7 … 15 %).
/// A hand at 1 m/s moves 20 mm in the longest silence. A silence below 1 ms, one haptic step, would leave nothing out.
inline constexpr double kMaxDeadbandShare = 0.5;
inline constexpr double kMaxDeadbandFloor = 0.1;  ///< m/s
inline constexpr Duration kMinStateSilence = std::chrono::milliseconds(1);
inline constexpr Duration kMaxStateSilence = std::chrono::milliseconds(20);

/// Devices of one session, numbered from 0: ten fingers of two hands, and six more for tools.
inline constexpr std::uint32_t kMaxDevices = 16;
/// Channels of one device, numbered from 0. Each adds a reconstruction to every haptic step.
inline constexpr std::uint32_t kMaxChannels = 8;
/// Claims in one Hello.
inline constexpr int kMaxClaims = 16;
/// Bytes of the name of a device or a channel.
inline constexpr std::size_t kMaxLabel = 24;
/// Named buttons of a device.
inline constexpr std::size_t kMaxButtons = 16;
inline constexpr std::size_t kMaxJoints = 8;
inline constexpr std::size_t kMaxOutputs = kMostOutputs;
/// Ways of answering that an engine names: its rungs are five, and a Hello has no room for sixteen (below).
inline constexpr std::size_t kMaxWays = 8;

/// The longest pulse of a vibration: nobody feels a longer one, and it cannot be left on.
inline constexpr Duration kMaxVibration = std::chrono::seconds(10);
/// Hz: below, a pulse is a motion; above, no skin feels it.
inline constexpr double kMinVibrationHz = 20;
inline constexpr double kMaxVibrationHz = 1000;

/// Bytes of UTF-8. With these the largest Hello without claims (882 bytes before padding, 208 of them ways) and the
/// largest Welcome (874) stay below the 944 bytes that a datagram has for them. Sixteen claims with the longest names
/// (896) and sixteen of the longest features (544) do not fit together: ClientHandshake refuses such a Hello.
inline constexpr std::size_t kMaxName = 64;
inline constexpr std::size_t kMaxFeature = 32;
inline constexpr int kMaxFeatures = 16;
/// One sentence: the reason of a refusal, an answer or a Bye.
inline constexpr std::size_t kMaxDetail = 128;

/// Buckets of the histogram of a loop's lateness, by powers of two of 1 µs. The last but one ends at 4.2 s, beyond
/// every safe stop.
inline constexpr std::size_t kLatenessBuckets = 24;
/// At the rarest a guest is sent one state in this many: fifty times rarer than RateAdaptation makes them.
inline constexpr std::uint32_t kMaxOneIn = 1000;

/// Haptic steps per second: ten times the fastest loop known to us (100 kHz, on FPGAs).
inline constexpr std::uint32_t kMaxLoopHz = 1'000'000;

/// The longest silence that a server may grant. An hour is longer than anybody needs, and keeps sums of times small.
inline constexpr Duration kMaxTimeout = std::chrono::hours(1);

/// Packet numbers are below this, far from 2⁶⁴ − 1, the nonce that renews a key. At 1 MHz it takes 36 000 years.
inline constexpr std::uint64_t kMaxPacketNumber = std::uint64_t{1} << 60;

/// Datagrams that one key may seal. AES-GCM's secrecy wears off with the blocks that a key has sealed: RFC 9001, 6.6
/// allows 2²³ packets of any size. Rekey is far below.
inline constexpr std::uint64_t kMaxDatagramsOfKey = std::uint64_t{1} << 23;
/// Datagrams of one session that do not open, before it ends. Each is a guess at a tag; of ChaCha20-Poly1305 RFC 9001,
/// 6.6 allows 2³⁶ in a connection, of AES-GCM 2⁵². At 1 MHz it takes 19 h.
inline constexpr std::uint64_t kMaxForged = std::uint64_t{1} << 36;

/// How often a Bye is sent: at 10 % loss, one conversation in a thousand loses all three and ends by timeout.
inline constexpr int kByes = 3;

}  // namespace tendon::limits

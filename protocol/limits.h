// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/output.h"
#include "core/base/time.h"

// The bounds of the wire. They are part of the protocol (WIRE.md) and cannot be configured, because both peers must use
// the same values. A receiver refuses and counts values that are out of bounds, and a sender truncates texts and lists.
// tendon.proto contains the same bounds, which are tested with protocol/vectors/bounds.json.

namespace tendon {
inline constexpr std::uint32_t kProtocolVersion = 1;
}

namespace tendon::limits {

/// For all physical quantities in SI units, per component. The server sets the physical limits. The cube of this value
/// is finite in single precision (1e36 < 3.4e38), and unit errors of 1e9 or more are detected.
inline constexpr double kMaxValue = 1e12;

/// 36 years, for all clock readings. A round trip is the sum of four such times and cannot overflow 64 bits.
inline constexpr Duration kMaxTime{std::int64_t{1} << 60};

/// A longer validity would exceed all timeouts, and the force of a dead peer would still be rendered.
inline constexpr Duration kMaxValidFor = std::chrono::seconds(10);

/// A correct peer uses at most 48: both request windows and 16 states or forces. 590 empty ones fit into 1200 bytes.
inline constexpr int kMaxFrames = 64;

/// Pending requests. Both peers keep this many slots, so that answers survive loss. 16 allow for a burst of clicks.
inline constexpr std::uint32_t kRequestWindow = 16;

/// The widest deadband of states. Half the speed is far above the thresholds of touch (7 … 15 %). A hand at 1 m/s moves
/// 20 mm during the maximum silence. The minimum silence is one haptic step.
inline constexpr double kMaxDeadbandShare = 0.5;
inline constexpr double kMaxDeadbandFloor = 0.1;  ///< m/s
inline constexpr Duration kMinStateSilence = std::chrono::milliseconds(1);
inline constexpr Duration kMaxStateSilence = std::chrono::milliseconds(20);

inline constexpr std::uint32_t kMaxDevices = 16;  ///< ten fingers of two hands, and six more for tools
inline constexpr std::uint32_t kMaxChannels = 8;  ///< each one adds a reconstruction to every haptic step
inline constexpr int kMaxClaims = 16;
inline constexpr std::size_t kMaxLabel = 24;  ///< bytes, for devices and channels
inline constexpr std::size_t kMaxButtons = 16;
inline constexpr std::size_t kMaxJoints = 8;
inline constexpr std::size_t kMaxOutputs = kMostOutputs;
inline constexpr std::size_t kMaxWays = 8;  ///< engines use at most five; a Hello has no room for sixteen

inline constexpr Duration kMaxVibration = std::chrono::seconds(10);  ///< of a pulse; vibrations must always stop
/// Hz. The hand feels slower pulses as motion, and does not feel faster ones.
inline constexpr double kMinVibrationHz = 20;
inline constexpr double kMaxVibrationHz = 1000;

/// Sizes of texts in bytes of UTF-8. The largest Hello without claims (882 bytes before padding, including 208 for
/// ways) and the largest Welcome (874) fit into the 944 bytes available in a datagram. Sixteen claims with the longest
/// names (896) and sixteen of the longest features (544) do not fit together, and ClientHandshake refuses them.
inline constexpr std::size_t kMaxName = 64;
inline constexpr std::size_t kMaxFeature = 32;
inline constexpr int kMaxFeatures = 16;
inline constexpr std::size_t kMaxDetail = 128;  ///< for the reason of a refusal, an answer or a Bye

/// Powers of two of 1 µs. The second to last one ends at 4.2 s, after every safe stop.
inline constexpr std::size_t kLatenessBuckets = 24;
inline constexpr std::uint32_t kMaxOneIn = 1000;  ///< divides the state rate; 50 times that of RateAdaptation

inline constexpr std::uint32_t kMaxLoopHz = 1'000'000;  ///< ten times the fastest known loop (100 kHz, on FPGAs)

/// The maximum silence that a server may grant. Sums of such times are still small.
inline constexpr Duration kMaxTimeout = std::chrono::hours(1);

/// Far below 2⁶⁴ − 1, the nonce used for renewing a key. At 1 MHz this takes 36 000 years.
inline constexpr std::uint64_t kMaxPacketNumber = std::uint64_t{1} << 60;

/// The confidentiality of AES-GCM decreases with each block. RFC 9001, 6.6 allows 2²³ packets. Rekey is far below.
inline constexpr std::uint64_t kMaxDatagramsOfKey = std::uint64_t{1} << 23;
/// Datagrams that may fail authentication in a session, since each one is a guess at a tag. RFC 9001, 6.6 allows 2³⁶
/// per connection for ChaCha20-Poly1305 and 2⁵² for AES-GCM. At 1 MHz this takes 19 h.
inline constexpr std::uint64_t kMaxForged = std::uint64_t{1} << 36;

/// Copies of a Bye. With 10 % loss, all three are lost in one of a thousand conversations, which then time out.
inline constexpr int kByes = 3;

}  // namespace tendon::limits

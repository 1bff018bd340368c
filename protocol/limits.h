// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

// Every bound of the wire, each with its reason. Both ends must agree on them: they are part of the protocol (WIRE.md
// lists them), not settings. A receiver refuses a value beyond its bound, and counts it; a sender cuts texts and lists
// to size. The comments in tendon.proto hold the same bounds, and protocol/vectors/bounds.json tests them.

namespace tendon::limits {

/// Largest magnitude of any physical quantity in SI units, per component. It is not physics (what a
/// device can do is the server's business): its square times itself stays finite even in single
/// precision (1e36 < 3.4e38), and a unit mistaken by 1e9 or more is noticed.
inline constexpr double kMaxValue = 1e12;

/// Largest distance of any clock reading from its zero: 36 years. The sum of four such times, which a
/// round trip is, cannot overflow 64 bits.
inline constexpr Duration kMaxTime{std::int64_t{1} << 60};

/// A force cannot be promised for longer: beyond every peer timeout, the promise is about a dead peer.
inline constexpr Duration kMaxValidFor = std::chrono::seconds(10);

/// Frames in one datagram. The two request windows and sixteen states or forces are 48; a 1200-byte datagram
/// could otherwise hold 590 empty ones.
inline constexpr int kMaxFrames = 64;

/// Requests sent and not yet answered. Both ends keep this many slots, which is what makes the answers
/// survive loss (see requests.h). A request is a human act; 16 are a burst of clicks.
inline constexpr std::uint32_t kRequestWindow = 16;

/// The widest deadband of states that a server grants. Half the speed is beyond every threshold of touch (7 … 15 %).
/// In 20 ms of silence a hand at 1 m/s moves 20 mm as predicted. A shorter silence than 1 ms would leave nothing out.
inline constexpr double kMaxDeadbandShare = 0.5;
inline constexpr double kMaxDeadbandFloor = 0.1;  ///< m/s
inline constexpr Duration kMinStateSilence = std::chrono::milliseconds(1);
inline constexpr Duration kMaxStateSilence = std::chrono::milliseconds(20);

/// Devices of one server, numbered from 0: two hands of five fingers, and as much again for tools. Each has a thread.
inline constexpr std::uint32_t kMaxDevices = 16;
/// Channels of one device, numbered from 0. Each costs its haptic step a reconstruction.
inline constexpr std::uint32_t kMaxChannels = 8;
/// Claims in one Hello.
inline constexpr int kMaxClaims = 16;
/// Bytes of the name of a device or a channel.
inline constexpr std::size_t kMaxLabel = 24;

/// Bytes of UTF-8. With these the largest Hello without claims (674 bytes before padding) and the largest Welcome
/// (874) stay below the 1200 bytes of a datagram, with room to grow. Sixteen claims with the longest names (896) do not
/// go with sixteen of the longest features (544): ClientHandshake refuses what is too long.
inline constexpr std::size_t kMaxName = 64;
inline constexpr std::size_t kMaxFeature = 32;
inline constexpr int kMaxFeatures = 16;
/// One sentence: the reason of a refusal, an answer or a Bye.
inline constexpr std::size_t kMaxDetail = 128;

/// Buckets of the histogram of a loop's lateness, by powers of two of a microsecond: the last but one ends at 4.2 s,
/// beyond every safe stop.
inline constexpr std::size_t kLatenessBuckets = 24;
/// The rarest that a state is sent to a guest, one in so many: fifty times beyond what RateAdaptation does.
inline constexpr std::uint32_t kMaxOneIn = 1000;

/// Haptic steps per second: ten times beyond the fastest loop known to us (100 kHz, on FPGAs).
inline constexpr std::uint32_t kMaxLoopHz = 1'000'000;

/// The longest silence that a server may grant. An hour is far beyond any use; it keeps sums of times small.
inline constexpr Duration kMaxTimeout = std::chrono::hours(1);

/// Packet numbers are below this: the nonces of one key never come near the one that renews it, 2⁶⁴ − 1.
/// At 1 MHz, 36 000 years.
inline constexpr std::uint64_t kMaxPacketNumber = std::uint64_t{1} << 60;

/// How often a Bye is said: at 10 % loss one conversation in a thousand ends by timeout instead.
inline constexpr int kByes = 3;

}  // namespace tendon::limits

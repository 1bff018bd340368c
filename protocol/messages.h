// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <tuple>

#include "core/base/reason.h"
#include "core/base/time.h"
#include "core/teleoperation/port_state.h"
#include "protocol/limits.h"
#include "protocol/wire/generated/messages.h"

// The messages of the protocol as plain values. Their structs are generated from tendon.proto. See WIRE.md for their
// encoding. SI units are used, forces act on the hand, and vectors are in the base frame of the device.

namespace tendon {

/// The number of steps for each wake-up delay: [0] at most 1 µs, [i] above 2^(i−1) µs and at most 2^i µs, and all
/// others in the last one.
using LatenessHistogram = decltype(DeviceReport::lateness);
static_assert(std::tuple_size_v<LatenessHistogram> == limits::kLatenessBuckets);

constexpr std::size_t lateness_bucket(Duration late) noexcept {
  // Rounds down, but 2 µs, for example, belongs to the lower bucket.
  const std::int64_t us = late.count() <= 0 ? 0 : (late.count() - 1) / 1000;
  const auto bucket = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(us)));
  return std::min(bucket, limits::kLatenessBuckets - 1);
}

/// Both directions, unreliable: one end of a coupling, sent to the other end and to observers. For each device, channel
/// and end, the highest sequence of the highest epoch wins. Requires kFeatureTeleoperation.
struct PortFrame : PortState {
  std::uint32_t device = 0;  ///< always of the session's server
  std::uint32_t channel = 0;
  bool of_peer = false;  ///< for observers: the remote end
};

// Features are only used if both peers name them.

/// Forces can include a local model, which the server evaluates at the position of the hand.
inline constexpr std::string_view kFeatureLocalModel = "local-model";
/// Claims use the names of devices and channels, and the client is notified if it loses a lease.
inline constexpr std::string_view kFeatureChannels = "channels";

inline constexpr std::string_view kFeatureHandle = "handle";  ///< orientation, button names and button states

inline constexpr std::string_view kFeatureJoints = "joints";  ///< joint angles and their names

inline constexpr std::string_view kFeatureOutputs = "outputs";  ///< lamps and vibration, which can be set by the client

/// The client can be the remote end of a coupling (Couple, PortState). Observers are sent the PortStates of both ends.
inline constexpr std::string_view kFeatureTeleoperation = "teleoperation";

/// States of several devices at the same step are sent in columns if this halves the size, using single precision
/// except for positions. For clients with more than seven devices, whose complete states do not fit into a datagram.
inline constexpr std::string_view kFeatureStateColumns = "state-columns";

/// An engine names its solver paths, and each force indicates which one was used.
inline constexpr std::string_view kFeatureWays = "ways";

/// The client can upload fields (OfferField), which the server renders at its own rate (UseField).
inline constexpr std::string_view kFeatureFields = "fields";

/// For observers only: requested forces and statistics of loops and engines (DeviceReport, PeerReport).
inline constexpr std::string_view kFeatureDiagnostics = "diagnostics";

}  // namespace tendon

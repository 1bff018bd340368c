// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "core/base/time.h"

namespace tendon::replay {

/// Rigorous bounds on the offset between the clocks of two machines, from the messages between them. θ(t) = second
/// clock − first clock at the time t of the first. A message sent at s and received by r took at least zero time:
///
///     first → second:      θ ≤ r − s
///     second → first:      θ ≥ s − r
///
/// The clocks drift by at most ρ = `most_drift` against each other, so each message bounds θ at every other time:
///
///     U(t) = min_i (u_i + ρ |t − t_i|),   L(t) = max_i (l_i − ρ |t − t_i|)
///     θ = (U + L)/2 ± (U − L)/2
///
/// The error bound is at most half of the minimum round-trip time. It cannot be less than the error due to asymmetric
/// delays, which no message can detect.
struct ClockBound {
  LocalTime at{};     ///< of the first clock
  Duration offset{};  ///< θ
  Duration error{};   ///< θ lies within offset ± error; negative: inconsistent, because one of the clocks was stepped
};

/// One message. `at` is its event on the first clock, sending or reception.
struct Crossing {
  LocalTime at{};
  Duration bound{};  ///< second clock − first clock of its two events: r − s there, s − r back
};

/// Two quartz crystals with an error of 100 ppm each.
inline constexpr double kMostDrift = 200e-6;

/// One for each interval `every` from the first crossing to the last. Both lists must be sorted by time. Empty if one
/// of them is.
std::vector<ClockBound> clock_bounds(const std::vector<Crossing>& there, const std::vector<Crossing>& back,
                                     Duration every, double most_drift = kMostDrift);

/// Mean rate of θ in s/s over all messages, and the bound of its error.
struct ClockDrift {
  double rate = 0;
  double error = 0;
};

/// From the first and the last of `bounds`, whose `most_drift` should be well above the expected drift.
ClockDrift drift_over(const std::vector<ClockBound>& bounds);

bool is_possible(const std::vector<ClockBound>& bounds);

/// Interpolates between `bounds` (at least one) and holds the first and last value outside.
Duration offset_at(const std::vector<ClockBound>& bounds, LocalTime at);

}  // namespace tendon::replay

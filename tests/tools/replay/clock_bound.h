// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "core/base/time.h"

namespace tendon::replay {

/// How far apart the clocks of two machines were, proved by the messages that went between them.
///
/// θ(t) = the second clock minus the first one, at the time t of the first. A message that leaves at s and has come by r
/// was under way for no less than nothing, whatever the network did:
///
///     first → second, sent at s, there by r:      θ ≤ r − s
///     second → first, sent at s, there by r:      θ ≥ s − r
///
/// and clocks drift against each other by at most `most_drift`, so that each message bounds θ at every other time too:
///
///     U(t) = min_i (u_i + ρ |t − t_i|),   L(t) = max_i (l_i − ρ |t − t_i|),   ρ = most_drift
///     θ = (U + L)/2 ± (U − L)/2
///
/// So the error is never more than half of the least round trip, and no less than what the two ways differ by can make
/// of it: no message can tell a slow way there from a slow way back.
struct ClockBound {
  LocalTime at{};     ///< of the first clock
  Duration offset{};  ///< θ
  Duration error{};   ///< θ lies within offset ± this; below 0: no such clocks exist, one of them stepped
};

/// One message. `at`: of the first clock, when it was sent or had come there.
struct Crossing {
  LocalTime at{};
  Duration bound{};  ///< second clock − first clock of its two events: r − s there, s − r back
};

/// Two quartz crystals, each wrong by 100 ppm.
inline constexpr double kMostDrift = 200e-6;

/// The bound once in each `every`, from the first crossing to the last. Both lists in the order of time; empty when one
/// of them is.
std::vector<ClockBound> clock_bounds(const std::vector<Crossing>& there, const std::vector<Crossing>& back,
                                     Duration every, double most_drift = kMostDrift);

/// The rate of θ in s/s over all of the messages, and the bound of its error.
struct ClockDrift {
  double rate = 0;
  double error = 0;
};

/// Estimates the drift from the first and the last of `bounds`, which should allow far more than the expected drift.
ClockDrift drift_over(const std::vector<ClockBound>& bounds);

/// Whether an offset exists that satisfies all of `bounds`.
bool is_possible(const std::vector<ClockBound>& bounds);

/// Between two of `bounds` (at least one), and held beyond the ends.
Duration offset_at(const std::vector<ClockBound>& bounds, LocalTime at);

}  // namespace tendon::replay

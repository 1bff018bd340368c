// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "core/teleoperation/methods/coupling_method.h"
#include "tests/support/swept_work.h"

namespace tendon::lab {

struct TeleopOptions {
  int hands = 21;                              ///< per method and round trip, 1 … 1000
  std::uint64_t seed = 1;                      ///< of the first hand
  std::optional<std::filesystem::path> out{};  ///< folder for teleop.csv and the figure
  std::string command{};                       ///< repeats the run
  bool json = false;
  Part part{};  ///< the units are the trials, for each hand at each round trip of each method
};

/// Each value is the median or the worst case over the hands.
struct TeleopRow {
  CouplingMethod method = CouplingMethod::kPositionPosition;
  int round_trip_ms = 0;
  double first = 0;   ///< felt on the first press, relative to the force of a rigid link
  double second = 0;  ///< the same value for the second press
  double buzz = 0;    ///< m/s rms above 20 Hz in free motion, the worst hand
  double pair = 0;    ///< J, the minimum work of both ports for the worst hand
};

/// Two devices of 75 g (b 0.26 N·s/m, f_c 0.02 N, 1 kHz, AOL+ with a shared account) and tendond's coupling in virtual
/// time. A hand of 150 … 600 N/m presses 30 mm at a wall of 500 N/m at 10 mm for 4 s, leaves and repeats. The network
/// adds up to max(5 ms, 20 % of the one-way delay), reorders, and loses 10 %; it is ideal at round trip 0.
std::vector<TeleopRow> teleop_rows(int hands, std::uint64_t seed, std::span<const int> round_trips_ms);

/// Felt force of each method over the round trip.
void teleop(const TeleopOptions& options, std::ostream& out);

}  // namespace tendon::lab

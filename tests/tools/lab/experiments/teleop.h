// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <span>
#include <vector>

#include "core/teleoperation/port_state.h"
#include "tests/support/swept_work.h"

namespace tendon::lab {

struct TeleopOptions {
  int hands = 21;                              ///< drawn for each method and round trip, 1 … 1000
  std::uint64_t seed = 1;                      ///< of the first one
  std::optional<std::filesystem::path> out{};  ///< folder for the figure
  bool json = false;
  Part part{};  ///< its units are trials: each hand at each round trip of each method, in that order
};

/// A method at a round trip: medians over the hands, and the worst of what must not be.
struct TeleopRow {
  CouplingMethod method = CouplingMethod::kPositionPosition;
  int round_trip_ms = 0;
  double first = 0;   ///< of a rigid link's force, felt on the first press
  double second = 0;  ///< … and on the second
  double buzz = 0;    ///< m/s rms above 20 Hz in free motion, the worst hand
  double pair = 0;    ///< J, least work of both ports together, the worst hand
};

/// Two devices of 75 g (b 0.26 N·s/m, f_c 0.02 N, 1 kHz, AOL+ with a shared account) and the coupling that tendond runs,
/// in virtual time. A hand of 150 … 600 N/m presses 30 mm at a wall of 500 N/m at 10 mm for 4 s, leaves, and comes again.
/// The network delays each message by up to max(5 ms, 20 % of a way) more, reorders, and loses 10 %; at round trip 0 it
/// does nothing.
std::vector<TeleopRow> teleop_rows(int hands, std::uint64_t seed, std::span<const int> round_trips_ms);

/// `tendon-lab teleop`: which method is felt how, over the round trip.
void teleop(const TeleopOptions& options, std::ostream& out);

}  // namespace tendon::lab

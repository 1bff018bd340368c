// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/control/preset.h"
#include "tests/tools/lab/experiments/experiment.h"

namespace tendon::lab {

// What one grid hides. The grid of compare.h has one size of count, one motion, one period and linear springs; a law
// that is tuned on it alone learns the grid. Here a situation is drawn from its seed: the network, the device and the
// hand as in the grid, and one thing that the grid does not vary.

/// A kind of situation.
struct SituationKind {
  std::string_view name;
  std::string_view what;  ///< one line
};
/// Every kind, in the order in which tables list them.
std::span<const SituationKind> situation_kinds() noexcept;

/// Laws are tuned on seeds below this; the seeds from here on are held out, and nobody tunes a law on them.
inline constexpr std::uint64_t kHeldOutSeeds = 1'000'000;

/// A situation without a law: the same for every law that is tried in it.
struct Trial {
  Experiment experiment{};  ///< its limiter has the friction of the device, and no law
  double encoder_step = 0;  ///< m
  double stiffness = 0;     ///< N/m, of the object where it is pressed
  std::string drawn{};      ///< what was drawn, for people and for the CSV
};

/// The situation of this kind that `seed` draws; empty for the recorded hands when TENDON_DATA is not set. The same seed
/// gives the same situation on every machine. Throws std::invalid_argument for a kind that is none of the list.
std::optional<Trial> draw_situation(std::string_view kind, std::uint64_t seed);

/// What is compared: a law of the catalogue with the parts that a scene would list, or a preset.
struct Contender {
  std::string_view name;
  Law law = Law::kAolPlus;
  std::optional<Preset> preset{};
  bool promises = false;  ///< to be passive
};
/// Every law, then every preset.
std::vector<Contender> contenders();

/// What a contender makes of a situation.
Outcome outcome_of(const Contender& contender, const Trial& trial);

}  // namespace tendon::lab

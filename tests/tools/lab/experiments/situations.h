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

// Laws could overfit to the grid of compare.h, with its one encoder resolution, motion and period and its linear
// springs. Here, network, device and hand are drawn as in the grid, with one variation by kind.

struct SituationKind {
  std::string_view name;
  std::string_view what;
};
std::span<const SituationKind> situation_kinds() noexcept;

/// Laws must only be tuned on smaller seeds; larger ones are only for the evaluation.
inline constexpr std::uint64_t kHeldOutSeeds = 1'000'000;

struct Trial {
  Experiment experiment{};  ///< the limiter has the friction of the device, but no law
  double encoder_step = 0;  ///< m
  double stiffness = 0;     ///< N/m, of the object where it is pressed
  std::string drawn{};      ///< drawn parameters, as text
};

/// Deterministic on all machines. nullopt for recorded hands if TENDON_DATA is not set. Throws std::invalid_argument if
/// there is no such kind.
std::optional<Trial> draw_situation(std::string_view kind, std::uint64_t seed);

struct Contender {
  std::string_view name;
  Law law = Law::kAolPlus;
  std::optional<Preset> preset{};
  bool promises = false;  ///< guarantees passivity
};
std::vector<Contender> contenders();

Outcome outcome_of(const Contender& contender, const Trial& trial);

}  // namespace tendon::lab

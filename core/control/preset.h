// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/control/catalogue.h"
#include "core/ledger/friction.h"
#include "core/remote/learned_model.h"

namespace tendon {

/// Sets of parts that were measured together (tests/tools/bench/RESULTS.md). A scene can use one instead of parts.
enum class Preset : std::uint8_t {
  kFeel,
  kFeelUnconditional,
};

struct PresetInfo {
  Preset preset;
  std::string_view name;  ///< in scenes and tables
  std::string_view what;  ///< one line: the device it is for
};

/// The first preset is the recommended default.
std::span<const PresetInfo> presets() noexcept;
const PresetInfo& info(Preset preset) noexcept;

struct PresetDevice {
  Friction friction{};      ///< lower bounds
  Duration longest_hold{};  ///< T_max
  double encoder_step = 0;  ///< Δ in m; 0 if exact, without a robust ledger
};

/// Only values that follow from the device depend on T.
struct PresetParts {
  AolPlus<1, 3>::Parts parts{};
  std::optional<LearnedModel::Config> learned_model{};
};
PresetParts preset_parts(Preset preset, const PresetDevice& device) noexcept;

/// Returns a phrase such as "passive whatever the hand does".
std::string promise_of(const LimiterConfig& limiter);

}  // namespace tendon

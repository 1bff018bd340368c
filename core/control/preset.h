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

/// Parts that were chosen together by measuring them (tests/tools/lab/README.md): what a newcomer lists instead of each
/// part with its numbers.
enum class Preset : std::uint8_t {
  kFeel,
  kFeelUnconditional,
};

struct PresetInfo {
  Preset preset;
  std::string_view name;  ///< in scenes and tables
  std::string_view what;  ///< one line: for which device
};

/// Every preset, the one for a newcomer first.
std::span<const PresetInfo> presets() noexcept;
const PresetInfo& info(Preset preset) noexcept;

/// The device that a preset is for.
struct PresetDevice {
  Friction friction{};      ///< lower bounds
  Duration longest_hold{};  ///< T_max
  double encoder_step = 0;  ///< Δ, m; 0: exact, and there is no robust ledger
};

/// What a preset lists. Values that are lengths, forces and stiffnesses do not depend on T; only what follows from the
/// device does.
struct PresetParts {
  AolPlus<1, 3>::Parts parts{};
  std::optional<LearnedModel::Config> learned_model{};
};
PresetParts preset_parts(Preset preset, const PresetDevice& device) noexcept;

/// What a limiter promises, in a sentence without a full stop: "passive while the handle accelerates by less than 300
/// m/s², …", "passive whatever the hand does", or that it promises nothing.
std::string promise_of(const LimiterConfig& limiter);

}  // namespace tendon

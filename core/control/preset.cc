// SPDX-License-Identifier: Apache-2.0
#include "core/control/preset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr std::array kPresets = {
    PresetInfo{Preset::kFeel, "feel", "low vibration and accurate rendering on every device"},
    PresetInfo{Preset::kFeelUnconditional, "feel-unconditional",
               "the same without assumptions about the hand, for devices with at least 0.1 N·s/m of friction"},
};

constexpr double kStiffness = 1500;    // N/m
constexpr double kUsualCount = 30e-6;  // m: count of the default smoothing of the damper

}  // namespace

std::span<const PresetInfo> presets() noexcept { return kPresets; }

const PresetInfo& info(Preset preset) noexcept { return kPresets[static_cast<std::size_t>(preset)]; }

PresetParts preset_parts(Preset preset, const PresetDevice& device) noexcept {
  PresetParts chosen;
  AolPlus<1, 3>::Parts& parts = chosen.parts;
  parts.energy_cap.emplace();
  parts.fading_contact.emplace();
  if (device.encoder_step > 0) parts.robust_ledger.emplace().encoder_step = {device.encoder_step};
  parts.knee.emplace().start = 0.7;
  if (preset == Preset::kFeel) parts.bounded_acceleration.emplace();
  // Not softer than the limit that friction allows.
  const double by_friction = 2 * device.friction.viscous / seconds(device.longest_hold);
  parts.shaping.emplace().stiffness = {std::max(kStiffness, by_friction)};
  parts.thrift.emplace();
  auto& damper = parts.damper.emplace();
  damper.smoothing =
      from_seconds(seconds(damper.smoothing) * std::clamp(std::sqrt(device.encoder_step / kUsualCount), 0.6, 2.0));
  chosen.learned_model.emplace();
  return chosen;
}

std::string promise_of(const LimiterConfig& limiter) {
  if (!info(limiter.law).passive) return "not passive for every object: " + std::string(info(limiter.law).what);
  const auto& bounded = limiter.parts.bounded_acceleration;
  if (limiter.law != Law::kAolPlus || !bounded) return "passive for every motion of the hand";
  return "passive while the handle accelerates by less than " + shortest(bounded->most[0]) +
         " m/s²; a step with a higher acceleration only relies on friction";
}

}  // namespace tendon

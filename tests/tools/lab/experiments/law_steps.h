// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>

#include "core/control/limiter.h"

namespace tendon::lab {

/// Steps whose cost is measured: 15 mm at 0.25 Hz, as in the paper, against a spring of 2000 N/m. A period has a
/// thousand samples 4 ms apart; each step moves a quarter of the distance between samples, as in 1 ms.
class LawSteps {
 public:
  static constexpr std::size_t kPeriod = 1000;  ///< steps
  static constexpr double kStiffness = 2000;    ///< N/m
  static constexpr Friction kFriction{.coulomb = 0.02, .viscous = 0.26};
  static constexpr Duration kEnvironmentDelay = std::chrono::milliseconds(40);  ///< for laws that model the environment

  explicit LawSteps(const LimiterConfig& config);

  /// Step `i` of a period; i < kPeriod. Returns the held force, N.
  const Vec3& step(std::size_t i) noexcept {
    const Vec3 dx = (places_[i] - places_[i == 0 ? kPeriod - 1 : i - 1]) / 4;
    law_.observe({.applied = applied_, .dx = dx, .held = std::chrono::milliseconds(1)});
    applied_ = law_.limit({.force = -kStiffness * places_[i], .stiffness = kStiffness * Mat3::Identity()}).force;
    return applied_;
  }

 private:
  std::array<Vec3, kPeriod> places_;
  Limiter law_;
  Vec3 applied_ = Vec3::Zero();
};

/// With LawSteps' friction and, for a law with a model of the environment, its stiffness and delay. AOL+ has no parts.
LimiterConfig measured_limiter(Law law);

}  // namespace tendon::lab

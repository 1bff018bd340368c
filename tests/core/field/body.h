// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "core/base/motion.h"
#include "core/ledger/friction.h"

namespace tendon::field {

/// A handle of 150 g in a hand that pulls it to a target with a spring, integrated in steps of 50 µs.
struct Body {
  static constexpr double kHandle = 0.15;  ///< kg
  static constexpr double kStep = 5e-5;    ///< s
  static constexpr int kSteps = 20;        ///< in 1 ms

  Friction friction{.coulomb = 0.02, .viscous = 0.26};
  Vec3 x = Vec3::Zero();
  Vec3 v = Vec3::Zero();
  double stiffness = 300;  ///< N/m, of the hand
  double damping = 3;      ///< N·s/m, of the hand
  double mass = 0.05;      ///< kg, of the hand

  /// Simulates 1 ms with a constant force (N, on the hand).
  void go(const Vec3& force, const Vec3& target, const Vec3& target_speed) {
    for (int i = 0; i < kSteps; ++i) step(force, target + (i * kStep) * target_speed, target_speed);
  }

  /// Simulates kStep.
  void step(const Vec3& force, const Vec3& aim, const Vec3& aim_speed) {
    const double all = kHandle + mass;
    const Vec3 impulse = all * v + 0.5 * kStep * (force + stiffness * (aim - x) + damping * aim_speed);
    const double size = impulse.norm();
    const double kept = size > 0 ? std::max(0.0, 1 - kStep * friction.coulomb / (2 * size)) : 0.0;
    const Vec3 mean = impulse * (kept / (all + 0.5 * kStep * (friction.viscous + damping + 0.5 * kStep * stiffness)));
    x += kStep * mean;
    v = kept > 0 ? Vec3(2 * mean - v) : Vec3(Vec3::Zero());
  }
};

}  // namespace tendon::field

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "core/base/motion.h"
#include "core/ledger/friction.h"

namespace tendon::field {

/// A handle of 150 g in a hand that pulls it to `target` with a spring, integrated in steps of 50 µs.
struct Body {
  static constexpr double kMass = 0.15 + 0.05;  ///< kg, handle and hand
  static constexpr double kHand = 300;          ///< N/m
  static constexpr double kHandDamping = 3;     ///< N·s/m
  static constexpr double kStep = 5e-5;         ///< s

  Friction friction{.coulomb = 0.02, .viscous = 0.26};
  Vec3 x = Vec3::Zero();
  Vec3 v = Vec3::Zero();

  /// Simulates 1 ms with a constant force (N, on the hand).
  void go(const Vec3& force, const Vec3& target, const Vec3& target_speed) {
    for (int i = 0; i < 20; ++i) {
      const Vec3 aim = target + (i * kStep) * target_speed;
      const Vec3 impulse = kMass * v + 0.5 * kStep * (force + kHand * (aim - x) + kHandDamping * target_speed);
      const double size = impulse.norm();
      const double kept = size > 0 ? std::max(0.0, 1 - kStep * friction.coulomb / (2 * size)) : 0.0;
      const Vec3 mean =
          impulse * (kept / (kMass + 0.5 * kStep * (friction.viscous + kHandDamping + 0.5 * kStep * kHand)));
      x += kStep * mean;
      v = kept > 0 ? Vec3(2 * mean - v) : Vec3(Vec3::Zero());
    }
  }
};

}  // namespace tendon::field

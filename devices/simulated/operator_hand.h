// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"
#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// A hand on the handle: a mass moving with the handle, which is connected to a target s(t) by a spring and a damper.
///
///     F_hand = k (s − x) + c (ṡ − v) − m_hand dv/dt        (N, on the handle)
///
/// OperatorProfile has the parameters of a fingertip, a hand with a stylus, and an arm. Source: Hajian and Howe (J.
/// Biomech. Eng. 119:109, 1997); Kuchenbecker, Park and Niemeyer (IMECE 2003).
/// Thread-safe: yes, immutable. Realtime-safe: all except the constructor.
class OperatorHand {
 public:
  struct Config {
    double stiffness = 0;  ///< k, N/m, > 0
    double damping = 0;    ///< c, N·s/m, ≥ 0
    double mass = 0;       ///< kg, ≥ 0
    ScriptedMotion motion{ScriptedMotion::Sine{}};
  };

  /// Throws std::invalid_argument if a value is out of range, naming the field.
  explicit OperatorHand(Config config);

  /// Returns k (s(t) − x) + c ṡ(t). The caller integrates the rest, which depends on the handle's motion, implicitly.
  Vec3 drive(double t, const Vec3& x) const noexcept;

  /// `t` in s, since the start.
  ScriptedMotion::Point target(double t) const noexcept { return config_.motion.at(t); }

  double stiffness() const noexcept { return config_.stiffness; }
  double damping() const noexcept { return config_.damping; }
  double mass() const noexcept { return config_.mass; }

 private:
  Config config_;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"
#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// The operator's hand on the handle: a mass that moves with the handle, connected by a spring and a damper to the
/// point s(t) at which the operator aims:
///
///     F_hand = k (s − x) + c (ṡ − v) − m_hand dv/dt        (N, on the handle)
///
/// This is the second-order model with a moving equilibrium point of Hajian and Howe (J. Biomech. Eng. 119:109, 1997)
/// and Kuchenbecker, Park and Niemeyer (IMECE 2003). OperatorProfile contains the parameters of a fingertip, of a hand
/// with a stylus and of an arm.
///
/// Thread-safe: yes, immutable. Realtime-safe: all except the constructor.
class OperatorHand {
 public:
  struct Config {
    double stiffness = 0;  ///< k, N/m, > 0
    double damping = 0;    ///< c, N·s/m, ≥ 0
    double mass = 0;       ///< kg, ≥ 0
    ScriptedMotion motion{ScriptedMotion::Sine{}};
  };

  /// Throws std::invalid_argument, naming the field, its value and the expected range.
  explicit OperatorHand(Config config);

  /// Returns k (s(t) − x) + c ṡ(t), the part of the force that is independent of the velocity and acceleration of the
  /// handle. The caller integrates the other two parts implicitly.
  Vec3 drive(double t, const Vec3& x) const noexcept;

  /// The target point `t` seconds after the start.
  ScriptedMotion::Point target(double t) const noexcept { return config_.motion.at(t); }

  double stiffness() const noexcept { return config_.stiffness; }
  double damping() const noexcept { return config_.damping; }
  double mass() const noexcept { return config_.mass; }

 private:
  Config config_;
};

}  // namespace tendon

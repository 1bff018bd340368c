// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include "core/base/motion.h"

namespace tendon {

/// The three joints that a handle hangs on, as far as friction in them goes: how fast each turns when the handle moves,
///
///     dq/dt = J(x) dx/dt,      J in rad/m, x in m in the device base frame, from the middle of the workspace
///
/// The workspace is a ball in which J is finite and smooth. Beyond it J is that of the nearest point of the ball: a
/// simulated hand may pull a handle further than its legs are long.
///
/// Thread-safe: yes, it never changes. Realtime-safe: all but the constructor.
class Mechanism {
 public:
  /// A Novint Falcon: the three thighs of a delta robot (devices/falcon/kinematics.h), around falcon::kCentre.
  struct Falcon {};

  /// A Phantom, and the Touch after it: a turntable q₁ that bears an upper arm q₂ and a forearm q₃; all motors are in
  /// the base (a parallelogram drives the forearm), so that q₂ and q₃ are each counted from the base:
  ///
  ///     x = r sin q₁,  y = l_f − l_f cos q₃ + l_u sin q₂,  z = r cos q₁ − l_u,      r = l_u cos q₂ + l_f sin q₃
  ///
  /// x to the right, y up, z towards the user; at q = 0 the upper arm lies level and the forearm hangs. After
  /// Çavuşoğlu, Feygin and Tendick, Presence 11(6), 2002. The workspace is four fifths of the way to the nearest place
  /// where the arm is stretched, folded, or over its turntable.
  struct Arm {
    double upper_arm = 0;  ///< l_u, m, > 0
    double forearm = 0;    ///< l_f, m, > 0
  };

  using Kind = std::variant<Falcon, Arm>;

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit Mechanism(const Kind& kind);

  /// J at `position`.
  Mat3 jacobian(const Vec3& position) const noexcept;

  /// m, radius of the workspace.
  double reach() const noexcept { return reach_; }

  /// m/rad, of each joint: by itself it moves the handle no further than this, ‖J⁻¹ eᵢ‖, anywhere in the workspace.
  const Vec3& levers() const noexcept { return levers_; }

 private:
  Kind kind_;
  double reach_;
  Vec3 levers_;
};

}  // namespace tendon

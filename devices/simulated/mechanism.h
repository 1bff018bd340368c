// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>
#include <variant>

#include "core/base/motion.h"

namespace tendon {

/// The three joints of a device: their angles q and their velocities when the handle moves,
///
///     dq/dt = J(x) dx/dt,      J in rad/m, x in m in the device base frame, from the middle of the workspace
///
/// The workspace is a ball in which J is finite and smooth. Outside it, J is that of the nearest point of the ball,
/// because a simulated hand may pull the handle further than the mechanism reaches.
///
/// Thread-safe: yes, immutable. Realtime-safe: all except the constructor.
class Mechanism {
 public:
  /// Novint Falcon: the three thighs of a delta robot (devices/falcon/kinematics.h), around falcon::kCentre.
  struct Falcon {};

  /// Phantom and its successor Touch: a turntable q₁ carries an upper arm q₂ and a forearm q₃. All motors are in the
  /// base (a parallelogram drives the forearm), so q₂ and q₃ are both measured relative to the base:
  ///
  ///     x = r sin q₁,  y = l_f − l_f cos q₃ + l_u sin q₂,  z = r cos q₁ − l_u,      r = l_u cos q₂ + l_f sin q₃
  ///
  /// x to the right, y up, z towards the user. At q = 0 the upper arm is horizontal and the forearm hangs down. From
  /// Çavuşoğlu, Feygin and Tendick, Presence 11(6), 2002. The radius of the workspace is four fifths of the distance to
  /// the nearest position at which the arm is stretched, folded, or above its turntable.
  struct Arm {
    double upper_arm = 0;  ///< l_u, m, > 0
    double forearm = 0;    ///< l_f, m, > 0
  };

  using Kind = std::variant<Falcon, Arm>;

  /// Throws std::invalid_argument, naming the field, its value and the expected range.
  explicit Mechanism(const Kind& kind);

  Mat3 jacobian(const Vec3& position) const noexcept;

  /// Returns q (rad) at `position`, or at the nearest point of the workspace.
  Vec3 angles(const Vec3& position) const noexcept;

  /// Names of q₁, q₂ and q₃.
  std::array<std::string_view, 3> joints() const noexcept;

  /// m, radius of the workspace.
  double reach() const noexcept { return reach_; }

  /// m/rad, for each joint an upper bound of ‖J⁻¹ eᵢ‖ in the workspace: the displacement of the handle if only this
  /// joint rotates.
  const Vec3& levers() const noexcept { return levers_; }

 private:
  Vec3 within_reach(const Vec3& position) const noexcept;

  Kind kind_;
  double reach_;
  Vec3 levers_;
};

}  // namespace tendon

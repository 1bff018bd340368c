// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>
#include <variant>

#include "core/base/motion.h"

namespace tendon {

/// The three joints of a device, with angles q:
///
///     dq/dt = J(x) dx/dt,      J in rad/m, x in m in the device base frame, from the middle of the workspace
///
/// In the workspace, which is a ball, J is finite and smooth. Outside it, the nearest point of the ball is used,
/// because simulated hands may move too far. Thread-safe: yes, immutable. Realtime-safe: all except the constructor.
class Mechanism {
 public:
  /// The thighs of a Novint Falcon around falcon::kCentre (devices/falcon/kinematics.h).
  struct Falcon {};

  /// Phantom and Touch: a turntable q₁ with an upper arm q₂ and a forearm q₃, which are both measured from the base,
  /// because all motors are in the base (a parallelogram drives the forearm).
  ///
  ///     x = r sin q₁,  y = l_f − l_f cos q₃ + l_u sin q₂,  z = r cos q₁ − l_u,      r = l_u cos q₂ + l_f sin q₃
  ///
  /// x is to the right, y up, z towards the user. At q = 0, the upper arm is horizontal and the forearm vertical.
  /// Source: Çavuşoğlu, Feygin and Tendick, Presence 11(6), 2002. The radius of the workspace is four fifths of the
  /// distance to the nearest position where the arm is stretched, folded, or above its turntable.
  struct Arm {
    double upper_arm = 0;  ///< l_u, m, > 0
    double forearm = 0;    ///< l_f, m, > 0
  };

  using Kind = std::variant<Falcon, Arm>;

  /// Throws std::invalid_argument if a value is out of range, naming the field.
  explicit Mechanism(const Kind& kind);

  Mat3 jacobian(const Vec3& position) const noexcept;

  Vec3 angles(const Vec3& position) const noexcept;  ///< rad

  std::array<std::string_view, 3> joints() const noexcept;

  double reach() const noexcept { return reach_; }  ///< radius of the workspace, m

  /// Upper bounds of ‖J⁻¹ eᵢ‖ in the workspace, in m/rad: the motion of the handle if only joint i moves.
  const Vec3& levers() const noexcept { return levers_; }

 private:
  Vec3 within_reach(const Vec3& position) const noexcept;

  Kind kind_;
  double reach_;
  Vec3 levers_;
};

}  // namespace tendon

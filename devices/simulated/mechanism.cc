// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/mechanism.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/expect.h"
#include "devices/falcon/kinematics.h"

namespace tendon {
namespace {

/// The ball around falcon::kCentre, and the maximum motion of the grip when only one leg moves. For three million
/// positions, the maximum was 0.091685 m/rad, and the minimum 0.0314; the centre has 0.0672.
constexpr double kFalconReach = 0.05;    // m
constexpr double kFalconLever = 0.0917;  // m/rad

/// Relative to the distance of the nearest position without a finite Jacobian, where friction is unbounded.
constexpr double kShareOfArmsReach = 0.8;

double reach_of(const Mechanism::Arm& arm) {
  const double from_shoulder = std::hypot(arm.upper_arm, arm.forearm);
  const double stretched = arm.upper_arm + arm.forearm - from_shoulder;
  const double folded = from_shoulder - std::abs(arm.upper_arm - arm.forearm);
  return kShareOfArmsReach * std::min({stretched, folded, arm.upper_arm});
}

struct Elbow {
  double r;          ///< m, from the axis of the turntable
  double cos_gamma;  ///< for γ = q₃ − q₂ in (−90°, 90°)
  double q2;
  double q3;
};

Elbow elbow_of(const Mechanism::Arm& arm, const Vec3& x) noexcept {
  const double r = std::hypot(x.x(), x.z() + arm.upper_arm);
  const double up = x.y() - arm.forearm;
  const double sin_gamma =
      (r * r + up * up - arm.upper_arm * arm.upper_arm - arm.forearm * arm.forearm) / (2 * arm.upper_arm * arm.forearm);
  const double gamma = std::asin(sin_gamma);
  const double cos_gamma = std::cos(gamma);
  const double q2 = std::atan2(up, r) - std::atan2(-arm.forearm * cos_gamma, arm.upper_arm + arm.forearm * sin_gamma);
  return {.r = r, .cos_gamma = cos_gamma, .q2 = q2, .q3 = q2 + gamma};
}

Vec3 angles_of(const Mechanism::Arm& arm, const Vec3& x) noexcept {
  const Elbow elbow = elbow_of(arm, x);
  return {std::atan2(x.x(), x.z() + arm.upper_arm), elbow.q2, elbow.q3};
}

Mat3 jacobian_of(const Mechanism::Arm& arm, const Vec3& x) noexcept {
  const auto [r, cos_gamma, q2, q3] = elbow_of(arm, x);
  const Vec3 out(x.x() / r, 0, (x.z() + arm.upper_arm) / r);  // from the turntable's axis to the handle
  const Vec3 aside(out.z(), 0, -out.x());
  Mat3 jacobian;
  jacobian.row(0) = aside / r;
  jacobian.row(1) = (std::cos(q3) * Vec3::UnitY() - std::sin(q3) * out) / (arm.upper_arm * cos_gamma);
  jacobian.row(2) = (std::cos(q2) * out + std::sin(q2) * Vec3::UnitY()) / (arm.forearm * cos_gamma);
  return jacobian;
}

}  // namespace

Mechanism::Mechanism(const Kind& kind) : kind_(kind), reach_(kFalconReach), levers_(Vec3::Constant(kFalconLever)) {
  const auto* arm = std::get_if<Arm>(&kind);
  if (arm == nullptr) return;
  // Includes all haptic devices. The squares of these lengths can be represented accurately.
  const auto sound = [](double length) { return length >= 0.01 && length <= 10; };
  expect(sound(arm->upper_arm), "upper_arm", arm->upper_arm, "0.01 to 10 m");
  expect(sound(arm->forearm), "forearm", arm->forearm, "0.01 to 10 m");
  reach_ = reach_of(*arm);
  // q₁ moves the handle by r per radian, which is l_u in the middle; q₂ and q₃ by the lengths of their arms.
  levers_ = Vec3(arm->upper_arm + reach_, arm->upper_arm, arm->forearm);
}

Vec3 Mechanism::within_reach(const Vec3& position) const noexcept {
  const double distance = position.norm();
  return distance > reach_ ? Vec3(position * (reach_ / distance)) : position;
}

Vec3 Mechanism::angles(const Vec3& position) const noexcept {
  const Vec3 within = within_reach(position);
  if (const auto* arm = std::get_if<Arm>(&kind_)) return angles_of(*arm, within);
  const std::optional<falcon::Pose> pose = falcon::pose_at(falcon::kCentre + within);
  return pose ? pose->angles : Vec3(Vec3::Zero());  // always set within kFalconReach
}

std::array<std::string_view, 3> Mechanism::joints() const noexcept {
  if (std::holds_alternative<Arm>(kind_)) return {"turntable", "upper arm", "forearm"};
  return {"thigh 1", "thigh 2", "thigh 3"};
}

Mat3 Mechanism::jacobian(const Vec3& position) const noexcept {
  const Vec3 within = within_reach(position);
  if (const auto* arm = std::get_if<Arm>(&kind_)) return jacobian_of(*arm, within);
  const std::optional<falcon::Pose> pose = falcon::pose_at(falcon::kCentre + within);
  return pose ? pose->jacobian : Mat3(Mat3::Zero());  // always set within kFalconReach
}

}  // namespace tendon

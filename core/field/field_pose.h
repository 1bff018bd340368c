// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"

namespace tendon::field {

/// From the frame of an object to the device base frame: x = turn · local + position.
struct Pose {
  Vec3 position = Vec3::Zero();
  Quat turn{};

  Vec3 to_base(const Vec3& local) const noexcept;
  Vec3 to_object(const Vec3& x) const noexcept;
};

/// A pose that the engine expects for the time `at`. For a delay of RTT/2 it should be RTT/2 ahead of the engine.
struct TimedPose {
  static constexpr double kMostPosition = 10;  ///< m
  static constexpr double kMostSpeed = 10;     ///< m/s
  static constexpr double kMostRate = 100;     ///< rad/s

  LocalTime at{};
  Pose pose{};
  Vec3 velocity = Vec3::Zero();          ///< m/s
  Vec3 angular_velocity = Vec3::Zero();  ///< rad/s, base frame axes
};

/// Computes the current pose of the object from the newest one, extrapolated by dt = now − at, limited to ± 50 ms:
///     position + v dt,   q(ω dt) · turn   with q(θ) = (1, θ/2)/‖(1, θ/2)‖, which turns by 2 atan(‖θ‖/2)
/// Longer extrapolation overshoots if an object stops. The difference between two poses fades with a time constant of
/// 15 ms, so that the object does not jump. Until the first pose, the object is at the origin of the base frame.
/// Realtime-safe: yes.
class FieldPose {
 public:
  static constexpr Duration kMostLead = std::chrono::milliseconds(50);
  static constexpr double kFade = 0.015;  ///< s

  /// Takes a newer pose. Returns false and does nothing if a value is not finite or out of range.
  bool observe(const TimedPose& pose) noexcept;

  /// Returns the pose at `now`. Must be called once per haptic step of `period` s.
  Pose at(LocalTime now, double period) noexcept;

  bool known() const noexcept { return newest_.has_value(); }

 private:
  Pose expected(LocalTime now) const noexcept;

  std::optional<TimedPose> newest_;
  bool fresh_ = false;   ///< not used yet
  bool placed_ = false;  ///< `used_` is a pose of the engine
  Pose used_{};
  Vec3 rest_ = Vec3::Zero();  ///< m, remaining difference from the previous pose
  Quat turn_rest_{};
};

}  // namespace tendon::field

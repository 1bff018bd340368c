// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>

#include "core/base/motion.h"
#include "core/base/time.h"

namespace tendon {

/// Moves the handle of a leader with an absolute map to the position of the follower with a spring. The end of the
/// spring moves to that position with the speed kSpeed, and the force is at most kForce. The alignment is done if the
/// distance was small for the time kHeld, and fails after the time kMost. Thread-safe: no. Realtime-safe: yes.
class Alignment {
 public:
  static constexpr Duration kHeld = std::chrono::milliseconds(200);
  static constexpr Duration kMost = std::chrono::seconds(5);
  static constexpr double kSpeed = 0.05;  ///< m/s
  static constexpr double kForce = 1;     ///< N

  void begin(LocalTime now) noexcept {
    since_ = apart_at_ = now;
    guide_.reset();
  }

  /// Must be called once per period with the distance in m, which is small if it is at most `within`. NaN is not small.
  void observe(double apart, double within, LocalTime now) noexcept {
    if (!(apart <= within)) apart_at_ = now;
  }
  bool is_done(LocalTime now) const noexcept { return now - apart_at_ >= kHeld; }
  bool is_overdue(LocalTime now) const noexcept { return now - since_ > kMost; }

  struct Spring {
    double stiffness = 0;  ///< N/m
    double damping = 0;    ///< N·s/m
    double max_force = 0;  ///< N
  };
  /// Returns the force on the handle in N. `there` is the position of the follower in m.
  Vec3 force(const Vec3& there, const Vec3& position, const Vec3& velocity, const Spring& spring,
             Duration elapsed) noexcept {
    if (!guide_) guide_ = position;
    const Vec3 left = there - *guide_;
    const double way = kSpeed * seconds(elapsed);
    *guide_ = left.norm() > way ? Vec3(*guide_ + left * (way / left.norm())) : there;
    Vec3 force = spring.stiffness * (*guide_ - position) - spring.damping * velocity;
    const double most = std::min(kForce, spring.max_force);
    if (force.stableNorm() > most) force *= most / force.stableNorm();
    return force;
  }

 private:
  LocalTime since_{};
  LocalTime apart_at_{};       ///< last time at which the distance was not small
  std::optional<Vec3> guide_;  ///< m, end of the spring
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include "core/base/motion.h"

namespace tendon {

// These parts of the safety layer are used to reduce a force. Each part returns a factor s, 0 ≤ s ≤ 1, for all
// components, so that the force cannot be increased or rotated. This also ensures that the bounds of the energy limiter
// are not exceeded, both for the norm and for each axis. Torques have a separate limit and growth limit in N·m, and a
// grip force is used as a vector with one component. `field` is used in error messages.
// Thread-safe: no. Realtime-safe: all except the constructors, which throw std::invalid_argument naming the field.

/// Limits the norm of a force: s = max / ‖F‖. Clipping each component would rotate the force, and integer overflow
/// would reverse it (libnifalcon: 30 N·m requested, 16 bits sent). Source: OpenHaptics' HD_EXCEEDED_MAX_FORCE.
class ForceLimit {
 public:
  struct Config {
    double max = 0;  ///< N, or N·m; > 0
  };
  explicit ForceLimit(const Config& config, const char* field = "force_limit");
  double share(const Vec3& asked) const noexcept;
  double max() const noexcept { return config_.max; }

 private:
  Config config_;
};

/// Limits the rate at which a force can be increased in its own direction:
///
///     ‖s F‖ ≤ (F_before · F/‖F‖)₊ + rate · T
///
/// Forces may decrease at once, and reversed forces start at zero. If all changes were limited, the force would be
/// applied even if it is no longer requested. Source: HD_EXCEEDED_MAX_FORCE_IMPULSE (0x0202) of OpenHaptics.
class GrowthLimit {
 public:
  struct Config {
    double rate = 0;  ///< N/s, or N·m/s; > 0
  };
  explicit GrowthLimit(const Config& config, const char* field = "growth_limit");
  /// `before` was actually rendered during the last `elapsed`.
  double share(const Vec3& asked, const Vec3& before, Duration elapsed) const noexcept;

 private:
  Config config_;
};

/// A ramp from zero after arming: s = t / time. Source: HD_FORCE_RAMPING_RATE of OpenHaptics.
class RampIn {
 public:
  struct Config {
    Duration time{};  ///< > 0
  };
  explicit RampIn(const Config& config);
  double share(Duration since_armed) const noexcept;

 private:
  Config config_;
};

/// A ramp to zero, used for watchdogs: s = 1 − (t − since) / time.
struct RampOut {
  LocalTime since{};
  Duration time{};
  double share(LocalTime now) const noexcept;
};

/// Protects the motors from overheating. A first-order thermal model is driven by the force that was actually held,
///
///     τ dθ/dt = (‖F‖ / continuous)² − θ                         θ = 1: the steady state at `continuous`
///
/// and ‖F‖ is bounded. The bound starts at `peak`, falls to `continuous` with a time constant of 1 s while θ > 0.7, and
/// rises again with the same time constant while θ < 0.5. For θ ≥ 1 it is `continuous` immediately, so θ never exceeds
/// 1 + (T/τ)(peak/continuous)².
///
/// A single temperature is computed for all motors, using the force at the handle. It is correct if the motors share
/// the force evenly, and too low for a motor that carries more. The device must limit the torque of each joint itself.
/// Source: PreventWarmMotors of OpenHaptics (0.7, 0.5, × 0.999 each ms). Touch: peak 3.3 N, continuous 0.88 N.
class HeatLimit {
 public:
  struct Config {
    double peak = 0;           ///< N, ≥ continuous
    double continuous = 0;     ///< N, > 0
    Duration time_constant{};  ///< τ of the motors, > 0
  };
  explicit HeatLimit(const Config& config);
  /// Updates the temperature. `held` (N, norm) was applied for `elapsed`.
  void observe(double held, Duration elapsed) noexcept;
  double share(const Vec3& asked) const noexcept;
  double heat() const noexcept { return heat_; }    ///< θ
  double bound() const noexcept { return bound_; }  ///< N

 private:
  Config config_;
  double heat_ = 0;
  double bound_;
};

/// Fades out outward forces outside a sphere or box; at the distance `margin` from it they are zero. With the outward
/// direction n, and the weight w that falls linearly from 1 at the surface to 0 at `margin`,
///
///     s = 1 − (1 − w) (F·n/‖F‖)₊
///
/// so that forces are not reduced if they pull the hand back. Far out, devices are close to their stops and
/// singularities, where a small position error causes a large force error.
///
/// The workspace does not apply a force and does not add damping. The force of a wall here would not be visible to the
/// energy limiter, and the wall would only be passive if b > K T/2 + |B| (Colgate and Schenkel, J. Robotic Systems
/// 14(1), 1997). With b = 1 N·s/m at 1 kHz, that allows a wall of 2 N/mm without damping or a damper of 1 N·s/m without
/// a spring, and the limiter could no longer rely on that b. An engine can render such a wall through the limiter.
class Workspace {
 public:
  struct Sphere {
    double radius;  ///< m, > 0
  };
  struct Box {
    Vec3 half;  ///< m, half of each edge, > 0; edges are parallel to the axes of the device's base frame
  };
  struct Config {
    Vec3 centre = Vec3::Zero();  ///< m
    std::variant<Sphere, Box> shape;
    double margin = 0;  ///< m, > 0
  };
  explicit Workspace(const Config& config);
  double share(const Vec3& asked, const Vec3& position) const noexcept;
  /// Returns the vector from the nearest point inside to `position`, m; zero inside.
  Vec3 outside(const Vec3& position) const noexcept;

 private:
  Config config_;
};

}  // namespace tendon

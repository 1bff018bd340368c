// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include "core/base/motion.h"

namespace tendon {

// The parts of the safety layer that reduce a force. Each gives a share s of it, 0 ≤ s ≤ 1, the same for all
// components. So none makes a force longer, turns it or raises a component, and the force still keeps every bound that
// it kept before: the energy limiter's on the norm or on each axis. A SafeDevice has those that its Config lists.
//
// A torque has a limit and a growth limit of its own, in N·m, and a grip, as a vector of one component.
//
// Thread-safe: no. Realtime-safe: all but the constructors, which throw std::invalid_argument naming the field.

/// No force is longer than `max`: s = max / ‖F‖. Clipping each component by itself would turn the force; wrapping
/// (Novint Falcon with libnifalcon: 30 N·m asked for, 16 bits sent) would reverse it. Source: HD_EXCEEDED_MAX_FORCE of
/// OpenHaptics.
class ForceLimit {
 public:
  struct Config {
    double max = 0;  ///< N, of a torque N·m; > 0
  };
  /// `field`: its name in errors.
  explicit ForceLimit(const Config& config, const char* field = "force_limit");
  double share(const Vec3& asked) const noexcept;
  double max() const noexcept { return config_.max; }

 private:
  Config config_;
};

/// No force grows along its own direction faster than `rate`:
///
///     ‖s F‖ ≤ (F_before · F/‖F‖)₊ + rate · T
///
/// A force falls at once; one that reverses begins at zero. A limit on every change would keep up a force that nobody
/// asks for any more, which a safety layer must not do. Source: HD_EXCEEDED_MAX_FORCE_IMPULSE (0x0202) of OpenHaptics.
class GrowthLimit {
 public:
  struct Config {
    double rate = 0;  ///< N/s, of a torque N·m/s; > 0
  };
  /// `field`: its name in errors.
  explicit GrowthLimit(const Config& config, const char* field = "growth_limit");
  /// `before`: the force really held for the last `elapsed`.
  double share(const Vec3& asked, const Vec3& before, Duration elapsed) const noexcept;

 private:
  Config config_;
};

/// From zero to the whole force in `time` after arming: s = t / time. Source: HD_FORCE_RAMPING_RATE of OpenHaptics.
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

/// From the whole force to zero: s = 1 − (t − since) / time. A watchdog that has tripped ends a force this way.
struct RampOut {
  LocalTime since{};
  Duration time{};
  double share(LocalTime now) const noexcept;
};

/// Keeps motors from burning: a first-order model of their heat under the force that was really held,
///
///     τ dθ/dt = (‖F‖ / continuous)² − θ                         θ = 1: as warm as `continuous` for ever makes them
///
/// and a bound on ‖F‖ that starts at `peak`, falls towards `continuous` with a time constant of 1 s while θ > 0.7, and
/// rises again with the same one when θ < 0.5. At θ ≥ 1 it is `continuous` at once; so θ never exceeds
/// 1 + (T/τ)(peak/continuous)².
///
/// There is one heat for all motors, from the force at the handle. It is right where the motors share the force evenly,
/// and too low for a motor that bears more. Only the device knows the torque of each joint, and has to bound it itself.
///
/// Source: PreventWarmMotors of OpenHaptics (0.7, 0.5, × 0.999 each ms). Touch: peak 3.3 N, continuous 0.88 N.
class HeatLimit {
 public:
  struct Config {
    double peak = 0;           ///< N, ≥ continuous
    double continuous = 0;     ///< N, > 0
    Duration time_constant{};  ///< τ, of the motors' heat, > 0
  };
  explicit HeatLimit(const Config& config);
  /// `held` (N, norm) was on for `elapsed`.
  void observe(double held, Duration elapsed) noexcept;
  double share(const Vec3& asked) const noexcept;
  double heat() const noexcept { return heat_; }    ///< θ
  double bound() const noexcept { return bound_; }  ///< N

 private:
  Config config_;
  double heat_ = 0;
  double bound_;
};

/// Forces may push outwards inside a sphere or box, less and less outside it, and no more at the distance `margin` from
/// it. With the outward direction n, and w = 1 inside, 0 from that distance on and linear between,
///
///     s = 1 − (1 − w) (F·n/‖F‖)₊
///
/// so a force that pulls the hand back stays whole. Far out, devices come near their stops and singularities, where a
/// small error of position makes a large error of force.
///
/// It neither pushes nor brakes by itself. The energy limiter would not see the force of such a wall, which is passive
/// only while b > K T/2 + |B| (Colgate and Schenkel, J. Robotic Systems 14(1), 1997): with b = 1 N·s/m at 1 kHz, a wall
/// of 2 N/mm without a brake, or a brake of 1 N·s/m without a spring; and the limiter could not count on that b any
/// more. An engine can render such a wall through the limiter.
class Workspace {
 public:
  struct Sphere {
    double radius;  ///< m, > 0
  };
  struct Box {
    Vec3 half;  ///< m, half its edges, each > 0; parallel to the axes of the device's frame
  };
  struct Config {
    Vec3 centre = Vec3::Zero();  ///< m
    std::variant<Sphere, Box> shape;
    double margin = 0;  ///< m, > 0
  };
  explicit Workspace(const Config& config);
  double share(const Vec3& asked, const Vec3& position) const noexcept;
  /// The vector from the nearest point inside to `position`, m; zero inside.
  Vec3 outside(const Vec3& position) const noexcept;

 private:
  Config config_;
};

}  // namespace tendon

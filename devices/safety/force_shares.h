// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include "core/base/motion.h"

namespace tendon {

// What a safety layer may do to a force: give a share s of it, 0 ≤ s ≤ 1, the same for all its components. So no part
// here makes a force longer, turns it or raises one of its components, and a bound that the force kept before (the
// energy limiter's, joint or of each axis) it keeps after any of them. Each is a small value of its own; a SafeDevice
// has those that its Config lists.
//
// Thread-safe: no. Realtime-safe: all but the constructors, which throw std::invalid_argument naming the field.

/// No force longer than `max`: s = max / ‖F‖. Clipping each component by itself would turn the force, and wrapping it
/// (Novint Falcon with libnifalcon: 30 N·m asked for, 16 bits sent) would turn it round.
/// Source: HD_EXCEEDED_MAX_FORCE of OpenHaptics.
class ForceLimit {
 public:
  struct Config {
    double max = 0;  ///< N, > 0
  };
  explicit ForceLimit(const Config& config);
  double share(const Vec3& asked) const noexcept;
  double max() const noexcept { return config_.max; }

 private:
  Config config_;
};

/// No force grows along itself by more than `rate`:
///
///     ‖s F‖ ≤ (F_before · F/‖F‖)₊ + rate · T
///
/// It falls at once, and one that turns back begins at zero. A limit on any change would hold on to a force after
/// nobody asks for it any more, which safety must not. Source: HD_EXCEEDED_MAX_FORCE_IMPULSE (0x0202) of OpenHaptics.
class GrowthLimit {
 public:
  struct Config {
    double rate = 0;  ///< N/s, > 0
  };
  explicit GrowthLimit(const Config& config);
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

/// From the whole force to none: s = 1 − (t − since) / time. How a watchdog that has tripped ends a force.
struct RampOut {
  LocalTime since{};
  Duration time{};
  double share(LocalTime now) const noexcept;
};

/// Keeps motors from burning: first-order heat of the force that was really held,
///
///     τ dθ/dt = (‖F‖ / continuous)² − θ                         θ = 1: as warm as `continuous` for ever makes them
///
/// and a bound on ‖F‖ that starts at `peak`, falls towards `continuous` with a time constant of 1 s while θ > 0.7, and
/// rises again with the same one when θ < 0.5. At θ ≥ 1 it is `continuous` at once; so θ never exceeds
/// 1 + (T/τ)(peak/continuous)².
///
/// One heat for all motors, from the force at the handle: right where the motors share it evenly, and too low for one
/// that bears more than its share. Torques by joint are known only to the device, which has to bound them itself.
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

/// Where forces may push outwards: nowhere beyond `margin` outside a sphere or box, and less and less on the way there.
/// With n outward and w = 1 inside, 0 from the depth `margin` on, linear between,
///
///     s = 1 − (1 − w) (F·n/‖F‖)₊
///
/// so a force that pulls the hand back stays whole. Out there devices come near their stops and singularities, where a
/// small error of position is a large one of force.
///
/// It does not push or brake by itself. A wall that pushes is a force that no energy limiter has seen, and passive only
/// up to b > K T/2 + |B| (Colgate and Schenkel, J. Robotic Systems 14(1), 1997): a device with b = 1 N·s/m at 1 kHz
/// bears 2 N/mm and no brake, or a brake of 1 N·s/m and no spring, and then the limiter may not count on that b any
/// more. Who wants such a wall has the engine render it, through the limiter.
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

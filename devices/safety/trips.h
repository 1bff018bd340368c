// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "core/estimation/velocity_estimator.h"

namespace tendon {

// Conditions that must end all forces. SafeDevice uses those that its Config lists, and latches them.
//
// Thread-safe: no. Realtime-safe: all except the constructors, which throw std::invalid_argument, naming the field.

/// Trips if the handle is faster than any hand that holds it, because it was released or thrown. Source: Force
/// Dimension's SDK: above the velocity threshold "forces are automatically disabled and brakes engaged";
/// HD_EXCEEDED_MAX_VELOCITY of OpenHaptics.
class SpeedTrip {
 public:
  struct Config {
    double max = 0;  ///< m/s, > 0
  };
  /// `resolution` is one encoder count (m, ≥ 0), for the VelocityEstimator.
  SpeedTrip(const Config& config, double resolution);
  /// Adds a position that was sampled at `at`.
  bool tripped(LocalTime at, const Vec3& position) noexcept;
  /// Discards all positions, as after construction.
  void forget() noexcept;

 private:
  Config config_;
  double resolution_;
  VelocityEstimator estimator_;
};

/// Trips if the handle rotates faster than any hand. It sums the small rotations between samples and estimates the rate
/// of that sum as SpeedTrip does.
class TurnTrip {
 public:
  struct Config {
    double max = 0;  ///< rad/s, > 0
  };
  /// `resolution` is one encoder count (rad, ≥ 0), for the VelocityEstimator.
  TurnTrip(const Config& config, double resolution);
  /// Adds an orientation that was sampled at `at`. It must be a rotation.
  bool tripped(LocalTime at, const Quat& orientation) noexcept;
  /// Discards all orientations, as after construction.
  void forget() noexcept;

 private:
  Config config_;
  double resolution_;
  VelocityEstimator estimator_;
  std::optional<Quat> before_;
  Vec3 turned_ = Vec3::Zero();  ///< rad, sum of all rotations
};

/// Trips if a position is further from the previous one than `max_speed` and one count on each axis allow, because the
/// encoders have wrapped or lost counts, or because the packet was corrupted. The Falcon's packets have neither
/// checksum nor sequence number, so a corrupted one cannot be recognized otherwise.
class StepBound {
 public:
  struct Config {
    double max_speed = 0;  ///< m/s, > 0: faster than any hand
  };
  /// `resolution` is one encoder count, m, ≥ 0.
  StepBound(const Config& config, double resolution);
  /// `elapsed` is the time since the previous position.
  bool tripped(const Vec3& before, const Vec3& position, Duration elapsed) const noexcept;

 private:
  Config config_;
  double resolution_;
};

/// Trips if nothing arrives for longer than `timeout`. The force then falls to zero within `ramp`. Source: watchdogs of
/// Force Dimension (firmware ≥ 3.0) and Haptikfabriken Polhem (0.5 s); none is documented for the Falcon.
class Watchdog {
 public:
  struct Config {
    Duration timeout{};                             ///< > 0
    Duration ramp = std::chrono::milliseconds(20);  ///< ≥ 0; 0: immediately
  };
  /// `field` is the name in error messages.
  Watchdog(const Config& config, const char* field);
  bool tripped(Duration silent) const noexcept { return silent > config_.timeout; }
  Duration ramp() const noexcept { return config_.ramp; }

 private:
  Config config_;
};

/// A button that must be held, as on the teach pendant of a robot (ISO 10218-1: enabling device). It is released when
/// the user lets go of the handle.
class DeadManSwitch {
 public:
  struct Config {
    std::uint32_t button = 0;  ///< bit in PositionSample::buttons, below 32
  };
  explicit DeadManSwitch(const Config& config);
  bool held(std::uint32_t buttons) const noexcept { return ((buttons >> config_.button) & 1U) != 0; }

 private:
  Config config_;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "core/estimation/velocity_estimator.h"

namespace tendon {

// Conditions for ending all forces, which are latched by SafeDevice. `field` is used in error messages.
// Thread-safe: no. Realtime-safe: all except the constructors, which throw std::invalid_argument naming the field.

/// Trips if the handle moves faster than a hand that is holding it, because it was released or thrown. Source: Force
/// Dimension's SDK ("forces are automatically disabled and brakes engaged"), OpenHaptics' HD_EXCEEDED_MAX_VELOCITY.
class SpeedTrip {
 public:
  struct Config {
    double max = 0;  ///< m/s, > 0
  };
  /// `resolution` is an encoder count in m, ≥ 0.
  SpeedTrip(const Config& config, double resolution);
  bool tripped(LocalTime at, const Vec3& position) noexcept;
  void forget() noexcept;

 private:
  Config config_;
  double resolution_;
  VelocityEstimator estimator_;
};

/// Trips if the handle rotates faster than a hand that is holding it, using the sum of small rotations between samples.
class TurnTrip {
 public:
  struct Config {
    double max = 0;  ///< rad/s, > 0
  };
  /// `resolution` is an encoder count in rad, ≥ 0.
  TurnTrip(const Config& config, double resolution);
  /// `orientation` must be a valid rotation.
  bool tripped(LocalTime at, const Quat& orientation) noexcept;
  void forget() noexcept;

 private:
  Config config_;
  double resolution_;
  VelocityEstimator estimator_;
  std::optional<Quat> before_;
  Vec3 turned_ = Vec3::Zero();  ///< rad, sum of all rotations
};

/// Trips if the distance between two positions exceeds `max_speed`, plus one count per axis: the encoders have wrapped
/// or lost counts, or the packet was corrupted. The Falcon's packets do not contain a checksum or a sequence number.
class StepBound {
 public:
  struct Config {
    double max_speed = 0;  ///< m/s, > 0
  };
  /// `resolution` is an encoder count in m, ≥ 0.
  StepBound(const Config& config, double resolution);
  bool tripped(const Vec3& before, const Vec3& position, Duration elapsed) const noexcept;

 private:
  Config config_;
  double resolution_;
};

/// Trips after a timeout, and ramps the force down to zero. Source: watchdogs of Force Dimension (firmware ≥ 3.0) and
/// Haptikfabriken Polhem (0.5 s). The Falcon's documentation does not mention a watchdog.
class Watchdog {
 public:
  struct Config {
    Duration timeout{};                             ///< > 0
    Duration ramp = std::chrono::milliseconds(20);  ///< ≥ 0
  };
  Watchdog(const Config& config, const char* field);
  bool tripped(Duration silent) const noexcept { return silent > config_.timeout; }
  Duration ramp() const noexcept { return config_.ramp; }

 private:
  Config config_;
};

/// A button that must be held, as on a teach pendant (ISO 10218-1: enabling device). It is released with the handle.
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

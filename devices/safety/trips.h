// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "core/estimation/velocity_estimator.h"

namespace tendon {

// Each of these says when all force has to end. A SafeDevice has those that its Config lists, and latches a trip.
//
// Thread-safe: no. Realtime-safe: all but the constructors, which throw std::invalid_argument naming the field.

/// Trips when the handle is faster than any hand that holds it: it has been let go, or is being thrown.
/// Source: Force Dimension's SDK: above the velocity threshold "forces are automatically disabled and brakes engaged";
/// HD_EXCEEDED_MAX_VELOCITY of OpenHaptics.
class SpeedTrip {
 public:
  struct Config {
    double max = 0;  ///< m/s, > 0
  };
  /// `resolution`: one encoder count, m, ≥ 0, for the VelocityEstimator.
  SpeedTrip(const Config& config, double resolution);
  /// The next position, sampled at `at`.
  bool tripped(LocalTime at, const Vec3& position) noexcept;
  /// Forgets all positions so far: the next one is the first.
  void forget() noexcept;

 private:
  Config config_;
  double resolution_;
  VelocityEstimator estimator_;
};

/// Trips when the handle turns faster than any hand turns it. It adds up the small turns from sample to sample, and
/// estimates the speed of that sum as SpeedTrip does.
class TurnTrip {
 public:
  struct Config {
    double max = 0;  ///< rad/s, > 0
  };
  /// `resolution`: one encoder count, rad, ≥ 0, for the VelocityEstimator.
  TurnTrip(const Config& config, double resolution);
  /// The next orientation, sampled at `at`. It has to be a rotation.
  bool tripped(LocalTime at, const Quat& orientation) noexcept;
  /// Forgets all orientations so far: the next one is the first.
  void forget() noexcept;

 private:
  Config config_;
  double resolution_;
  VelocityEstimator estimator_;
  std::optional<Quat> before_;
  Vec3 turned_ = Vec3::Zero();  ///< rad, the sum
};

/// Trips when a position is further from the one before than `max_speed` and one count on each axis allow: the encoders
/// have wrapped or lost count, or the packet was garbled. The Falcon's packets have neither checksum nor number, so a
/// garbled one looks like any other.
class StepBound {
 public:
  struct Config {
    double max_speed = 0;  ///< m/s, > 0: more than any hand
  };
  /// `resolution`: one encoder count, m, ≥ 0.
  StepBound(const Config& config, double resolution);
  /// `elapsed` since the position before.
  bool tripped(const Vec3& before, const Vec3& position, Duration elapsed) const noexcept;

 private:
  Config config_;
  double resolution_;
};

/// Trips when nothing has come for longer than `timeout`. The force then falls to zero over the time `ramp`.
/// Source: watchdogs of Force Dimension (firmware ≥ 3.0), Haptikfabriken Polhem (0.5 s); the Falcon documents none.
class Watchdog {
 public:
  struct Config {
    Duration timeout{};                             ///< > 0
    Duration ramp = std::chrono::milliseconds(20);  ///< ≥ 0; 0: zero at once
  };
  /// `field`: its name in errors.
  Watchdog(const Config& config, const char* field);
  bool tripped(Duration silent) const noexcept { return silent > config_.timeout; }
  Duration ramp() const noexcept { return config_.ramp; }

 private:
  Config config_;
};

/// A button that has to be held, as on every robot's teach pendant (ISO 10218-1 calls it an enabling device). Whoever
/// lets go of the handle releases it.
class DeadManSwitch {
 public:
  struct Config {
    std::uint32_t button = 0;  ///< its bit in PositionSample::buttons, below 32
  };
  explicit DeadManSwitch(const Config& config);
  bool held(std::uint32_t buttons) const noexcept { return ((buttons >> config_.button) & 1U) != 0; }

 private:
  Config config_;
};

}  // namespace tendon

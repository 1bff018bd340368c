// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "core/base/motion.h"
#include "protocol/messages.h"

namespace tendon {

/// Omits changes that cannot be felt (Weber's law): sends a vector if it differs from the last one sent by more than a
/// share of its norm, or after a maximum silence, so that lost vectors are replaced.
///
///     ‖v − v_sent‖ > max(share · ‖v_sent‖, floor)   or   now − sent ≥ longest_silence
///
/// The result can contain more energy than the input, so the receiver must use a limiter, as Tendon does.
/// Source: Hinterseer, Hirche, Chaudhuri, Steinbach, Buss, "Perception-based data reduction and transmission of haptic
/// data in telepresence and teleaction systems", IEEE TSP 56(2), 2008.
/// Thread-safe: no. Realtime-safe: yes.
class Deadband {
 public:
  struct Config {
    double share = 0.10;  ///< 0 … 1; just noticeable: 7 to 15 % of a force
    double floor = 0.05;  ///< in the unit of the vector, ≥ 0
    Duration longest_silence = std::chrono::milliseconds(20);
  };
  static constexpr Config force() noexcept { return {}; }
  static constexpr Config velocity() noexcept { return {.floor = 1e-3}; }

  /// Throws std::invalid_argument naming the field if a value of `config` is out of bounds.
  explicit Deadband(const Config& config);

  /// Returns true if `value` should be sent, and records it as sent.
  bool passes(LocalTime now, const Vec3& value) noexcept;
  bool differs(LocalTime now, const Vec3& value) const noexcept;
  /// Must be called if `value` was sent for another reason.
  void sent(LocalTime now, const Vec3& value) noexcept { sent_ = {now, value}; }

 private:
  struct Sent {
    LocalTime at;
    Vec3 value;
  };
  Config config_;
  std::optional<Sent> sent_;
};

/// m, from the middle of a handle to its end. Used to convert N to N·m, and m/s to rad/s.
inline constexpr double kHandleLever = 0.05;  // m

/// A deadband for a vector, its rotational equivalent, and a gripper. If one is sent, or comes or goes, all are sent.
/// Thread-safe: no. Realtime-safe: yes.
class HandleDeadband {
 public:
  struct Value {
    Vec3 vector = Vec3::Zero();
    std::optional<Vec3> turning{};
    std::optional<double> grip{};
  };

  /// The floor is `floor` · kHandleLever (N·m) for torques and `floor` (N) for grip forces.
  static HandleDeadband of_forces(const Deadband::Config& config) {
    return {config, config.floor * kHandleLever, config.floor};
  }
  /// The floor is `floor` / kHandleLever (rad/s) for the angular velocity and the gripper.
  static HandleDeadband of_velocities(const Deadband::Config& config) {
    return {config, config.floor / kHandleLever, config.floor / kHandleLever};
  }

  bool passes(LocalTime now, const Value& value) noexcept;
  void sent(LocalTime now, const Value& value) noexcept;

 private:
  HandleDeadband(const Deadband::Config& vector, double turning_floor, double grip_floor);

  Deadband vector_;
  Deadband turning_;
  Deadband grip_;
  bool turns_ = false;
  bool grips_ = false;
};

/// Predicts the state after `later`, assuming constant velocity. Both peers use this function, so the sender knows the
/// prediction of the receiver. The result is at a multiple of the haptic period T:
///
///     n = ⌊later / haptic_period⌋      tick + n      sampled + n T      position + velocity · n T
///     orientation turned by the rotation vector angular velocity · n T      opening + its velocity · n T
///
/// Copies all other fields. A negative `later` is treated as zero. Realtime-safe: yes.
DeviceState predict(const DeviceState& sent, Duration later, Duration haptic_period) noexcept;

/// Omits states that the receiver can predict(), by a deadband on all velocities. New modes or buttons are always sent.
/// Thread-safe: no. Realtime-safe: yes.
class StateDeadband {
 public:
  /// Returns the reason for refusing a request, or an empty string. Turning the deadband off is always granted.
  static std::string objection(const SetStateDeadband& asked);

  /// `asked` must be valid and must not turn the deadband off.
  explicit StateDeadband(const SetStateDeadband& asked);

  bool passes(const DeviceState& state) noexcept;

 private:
  HandleDeadband velocity_;
  std::optional<Mode> mode_;
  std::uint32_t buttons_ = 0;
};

}  // namespace tendon

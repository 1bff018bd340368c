// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "core/base/motion.h"
#include "protocol/messages.h"

namespace tendon {

/// Omits changes that a person cannot feel (Weber's law). A vector is sent if it differs from the last one sent by more
/// than a share of that one's length, and also after a maximum silence, so that a lost vector is replaced.
///
///     ‖v − v_sent‖ > max(share · ‖v_sent‖, floor)   or   now − sent ≥ longest_silence
///
/// The reconstructed signal can contain more energy than the original, so the receiver must use a limiter. Tendon's
/// server does.
///
/// Source: Hinterseer, Hirche, Chaudhuri, Steinbach, Buss, "Perception-based data reduction and transmission of haptic
/// data in telepresence and teleaction systems", IEEE TSP 56(2), 2008.
///
/// Thread-safe: no. Realtime-safe: yes.
class Deadband {
 public:
  struct Config {
    double share = 0.10;  ///< 0 … 1; the just noticeable difference of a force is 7 to 15 %
    double floor = 0.05;  ///< in the unit of the vector, ≥ 0; smaller changes are omitted
    Duration longest_silence = std::chrono::milliseconds(20);
  };
  static constexpr Config force() noexcept { return {}; }
  static constexpr Config velocity() noexcept { return {.floor = 1e-3}; }

  /// Throws std::invalid_argument, naming the field, if a value of `config` is out of bounds.
  explicit Deadband(const Config& config);

  /// Returns true if `value` should be sent at `now`, and records it as sent.
  bool passes(LocalTime now, const Vec3& value) noexcept;
  /// Returns true if `value` should be sent at `now`.
  bool differs(LocalTime now, const Vec3& value) const noexcept;
  /// Records that `value` was sent for another reason.
  void sent(LocalTime now, const Vec3& value) noexcept { sent_ = {now, value}; }

 private:
  struct Sent {
    LocalTime at;
    Vec3 value;
  };
  Config config_;
  std::optional<Sent> sent_;
};

/// The length in m that converts between rotation and translation: from the middle of a handle to its end. It converts
/// a floor in N to one in N·m, and a floor in m/s to one in rad/s.
inline constexpr double kHandleLever = 0.05;  // m

/// A deadband for a handle that may also rotate and have a gripper. The vector, its rotational counterpart and the
/// value of the gripper are sent together as soon as one of them should be sent, or when one of them appears or
/// disappears.
///
/// Thread-safe: no. Realtime-safe: yes.
class HandleDeadband {
 public:
  struct Value {
    Vec3 vector = Vec3::Zero();
    std::optional<Vec3> turning{};
    std::optional<double> grip{};
  };

  /// For forces. The floor is `floor` · kHandleLever (N·m) for a torque and `floor` (N) for a grip force.
  static HandleDeadband of_forces(const Deadband::Config& config) {
    return {config, config.floor * kHandleLever, config.floor};
  }
  /// For velocities. The floor is `floor` / kHandleLever (rad/s) for angular velocity and for the velocity of the
  /// gripper.
  static HandleDeadband of_velocities(const Deadband::Config& config) {
    return {config, config.floor / kHandleLever, config.floor / kHandleLever};
  }

  /// Returns true if `value` should be sent at `now`, and records it as sent.
  bool passes(LocalTime now, const Value& value) noexcept;
  /// Records that `value` was sent for another reason.
  void sent(LocalTime now, const Value& value) noexcept;

 private:
  HandleDeadband(const Deadband::Config& vector, double turning_floor, double grip_floor);

  Deadband vector_;
  Deadband turning_;
  Deadband grip_;
  bool turns_ = false;  ///< the last value sent had `turning`
  bool grips_ = false;  ///< the last value sent had `grip`
};

/// Predicts the state `later` after `sent` under the assumption of constant velocity. Both peers use this function, so
/// the sender knows what the receiver predicts. With the haptic period T, the prediction is for a whole tick:
///
///     n = ⌊later / haptic_period⌋      tick + n      sampled + n T      position + velocity · n T
///     orientation turned by the rotation vector angular velocity · n T      opening + its velocity · n T
///
/// All other fields are copied from `sent`. A negative `later` counts as zero. Realtime-safe: yes.
DeviceState foretell(const DeviceState& sent, Duration later, Duration haptic_period) noexcept;

/// Omits device states that the receiver can predict with foretell(), by a deadband on the velocity, the angular
/// velocity and the velocity of the gripper. A state whose mode or buttons differ from the last one sent is never
/// omitted.
///
/// Thread-safe: no. Realtime-safe: yes.
class StateDeadband {
 public:
  /// Returns the reason why a client's request cannot be granted, or an empty string if it can. A request to turn the
  /// deadband off is always granted.
  static std::string objection(const SetStateDeadband& asked);

  /// `asked` must be grantable and must not turn the deadband off.
  explicit StateDeadband(const SetStateDeadband& asked);

  /// Returns true if the receiver needs this state, and records it as sent.
  bool passes(const DeviceState& state) noexcept;

 private:
  HandleDeadband velocity_;
  std::optional<Mode> mode_;   ///< mode of the last state sent
  std::uint32_t buttons_ = 0;  ///< buttons of the last state sent
};

}  // namespace tendon

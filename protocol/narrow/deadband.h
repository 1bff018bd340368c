// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "core/base/motion.h"
#include "protocol/messages.h"

namespace tendon {

/// Leaves out changes that a hand cannot feel (Weber's law): a vector is sent when it differs from the last one sent by
/// more than a share of it, and in any case after a silence, so that a lost vector does not stay wrong.
///
///     ‖v − v_sent‖ > max(share · ‖v_sent‖, floor)   or   now − sent ≥ longest_silence
///
/// The receiver's reconstruction can contain more energy than the vectors left out, so a limiter has to follow it;
/// Tendon's does.
///
/// Source: Hinterseer, Hirche, Chaudhuri, Steinbach, Buss, "Perception-based data reduction and transmission of haptic
/// data in telepresence and teleaction systems", IEEE TSP 56(2), 2008.
///
/// Thread-safe: no. Realtime-safe: yes.
class Deadband {
 public:
  struct Config {
    double share = 0.10;  ///< 0 … 1; the just noticeable difference of force is 7 to 15 %
    double floor = 0.05;  ///< in the unit of the vector, ≥ 0: smaller changes are left out
    Duration longest_silence = std::chrono::milliseconds(20);
  };
  static constexpr Config force() noexcept { return {}; }
  static constexpr Config velocity() noexcept { return {.floor = 1e-3}; }

  /// Throws std::invalid_argument that names the field when a value of `config` is out of bounds.
  explicit Deadband(const Config& config);

  /// True when `value` should be sent at `now`; it then counts as sent.
  bool passes(LocalTime now, const Vec3& value) noexcept;
  /// Whether `value` should be sent at `now`.
  bool differs(LocalTime now, const Vec3& value) const noexcept;
  /// Says that `value` has been sent for another reason.
  void sent(LocalTime now, const Vec3& value) noexcept { sent_ = {now, value}; }

 private:
  struct Sent {
    LocalTime at;
    Vec3 value;
  };
  Config config_;
  std::optional<Sent> sent_;
};

/// The length by which what turns is compared with what moves: 50 mm, from the middle of a handle to its end. It makes
/// a floor in N one in N·m, and a floor in m/s one in rad/s.
inline constexpr double kHandleLever = 0.05;  // m

/// A deadband for what a handle can do more than move: a vector, its like for rotation, and its like for the gripper.
/// All three are sent as soon as one of them should be, and when one appears or vanishes.
///
/// Thread-safe: no. Realtime-safe: yes.
class HandleDeadband {
 public:
  struct Value {
    Vec3 vector = Vec3::Zero();
    std::optional<Vec3> turning{};
    std::optional<double> grip{};
  };

  /// Of forces: a torque has the floor `floor` · kHandleLever (N·m), a grip force `floor` (N).
  static HandleDeadband of_forces(const Deadband::Config& config) {
    return {config, config.floor * kHandleLever, config.floor};
  }
  /// Of velocities: an angular velocity, and that of the gripper, have the floor `floor` / kHandleLever (rad/s).
  static HandleDeadband of_velocities(const Deadband::Config& config) {
    return {config, config.floor / kHandleLever, config.floor / kHandleLever};
  }

  /// True when `value` should be sent at `now`; it then counts as sent.
  bool passes(LocalTime now, const Value& value) noexcept;
  /// Says that `value` has been sent for another reason.
  void sent(LocalTime now, const Value& value) noexcept;

 private:
  HandleDeadband(const Deadband::Config& vector, double turning_floor, double grip_floor);

  Deadband vector_;
  Deadband turning_;
  Deadband grip_;
  bool turns_ = false;  ///< the value last sent had one
  bool grips_ = false;  ///< likewise
};

/// The state `later` after `sent`, if the device keeps its velocity. Both ends use this function, so the sender knows
/// what the receiver believes. It counts whole haptic periods T, so that the result belongs to a tick:
///
///     n = ⌊later / haptic_period⌋      tick + n      sampled + n T      position + velocity · n T
///     orientation turned by the rotation vector angular velocity · n T      opening + its velocity · n T
///
/// All other fields are those of `sent`. A `later` below zero counts as zero. Realtime-safe: yes.
DeviceState foretell(const DeviceState& sent, Duration later, Duration haptic_period) noexcept;

/// Leaves out the device states that their receiver can foretell(): a deadband on velocity, on angular velocity and on
/// that of the gripper. A state whose mode or buttons differ from those of the last one sent always passes.
///
/// Thread-safe: no. Realtime-safe: yes.
class StateDeadband {
 public:
  /// Why a client's request cannot be granted; empty when it can be. A request to turn the deadband off can.
  static std::string objection(const SetStateDeadband& asked);

  /// `asked` must be grantable, and not off.
  explicit StateDeadband(const SetStateDeadband& asked);

  /// True when the receiver needs this state; it then counts as sent.
  bool passes(const DeviceState& state) noexcept;

 private:
  HandleDeadband velocity_;
  std::optional<Mode> mode_;   ///< of the last state sent
  std::uint32_t buttons_ = 0;  ///< likewise
};

}  // namespace tendon

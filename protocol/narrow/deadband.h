// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "core/base/motion.h"
#include "protocol/messages.h"

namespace tendon {

/// Leaves out what a hand cannot feel: a vector is worth sending when it differs from the last one sent by more than
/// Weber's share of it, and in any case after a silence, so that a lost one does not stay wrong.
///
///     ‖v − v_sent‖ > max(share · ‖v_sent‖, floor)   or   now − sent ≥ longest_silence
///
/// What the receiver rebuilds can hold more energy than what was left out, so a limiter has to stand behind it:
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
    double floor = 0.05;  ///< in the unit of the vector, ≥ 0: below it everything counts as nothing
    Duration longest_silence = std::chrono::milliseconds(20);
  };
  static constexpr Config force() noexcept { return {}; }
  static constexpr Config velocity() noexcept { return {.floor = 1e-3}; }

  /// Throws std::invalid_argument naming the field when `config` is impossible.
  explicit Deadband(const Config& config);

  /// Whether `value` is worth sending at `now`; if so it counts as sent.
  bool passes(LocalTime now, const Vec3& value) noexcept;
  /// It has been sent for another reason.
  void sent(LocalTime now, const Vec3& value) noexcept { sent_ = {now, value}; }

 private:
  struct Sent {
    LocalTime at;
    Vec3 value;
  };
  Config config_;
  std::optional<Sent> sent_;
};

/// Where the device is `later` than in `sent`, as far as the line goes that it was on. Both ends reckon with this, so
/// that the sender knows what the receiver believes. In whole haptic periods, so that the result is at a tick:
///
///     n = ⌊later / haptic_period⌋      tick + n      sampled + n T      position + velocity · n T
///
/// Everything else is as it was. A `later` below zero is none. Realtime-safe: yes.
DeviceState foretell(const DeviceState& sent, Duration later, Duration haptic_period) noexcept;

/// Leaves out the device states that their receiver can foretell: a deadband on velocity, which is the slope of the
/// line that it goes on along. A state of another mode passes always.
///
/// Thread-safe: no. Realtime-safe: yes.
class StateDeadband {
 public:
  /// What is wrong with what a client asks for; empty when it can be granted. Off is granted.
  static std::string objection(const SetStateDeadband& asked);

  /// `asked` is one that can be granted, and not off.
  explicit StateDeadband(const SetStateDeadband& asked);

  /// Whether the receiver needs this state; if so it counts as sent.
  bool passes(const DeviceState& state) noexcept;

 private:
  Deadband velocity_;
  std::optional<Mode> mode_;  ///< as sent
};

}  // namespace tendon

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

/// The state `later` after `sent`, if the device keeps its velocity. Both ends use this function, so the sender knows
/// what the receiver believes. It counts whole haptic periods T, so that the result belongs to a tick:
///
///     n = ⌊later / haptic_period⌋      tick + n      sampled + n T      position + velocity · n T
///
/// All other fields are those of `sent`. A `later` below zero counts as zero. Realtime-safe: yes.
DeviceState foretell(const DeviceState& sent, Duration later, Duration haptic_period) noexcept;

/// Leaves out the device states that their receiver can foretell(): a deadband on velocity. A state whose mode or
/// buttons differ from those of the last one sent always passes.
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
  Deadband velocity_;
  std::optional<Mode> mode_;   ///< of the last state sent
  std::uint32_t buttons_ = 0;  ///< likewise
};

}  // namespace tendon

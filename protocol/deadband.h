// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/motion.h"

namespace tendon {

/// Leaves out what a hand cannot feel: a vector is worth sending when it differs from the last one sent by more than
/// Weber's share of it, and in any case after a silence, so that a lost one does not stay wrong.
///
///     ‖v − v_sent‖ > max(share · ‖v_sent‖, floor)   or   now − sent ≥ longest_silence
///
/// With 10 % on force (floor 0.05 N) 6.6 % of 1 kHz samples remained on recorded touch; on velocity (floor 1 mm/s, the
/// receiver goes on along the line) 17.5 %, at 0.05 mm rms. What the receiver rebuilds can hold more energy than what
/// was left out, so a limiter has to stand behind it: Tendon's does.
///
/// Source: Hinterseer, Hirche, Chaudhuri, Steinbach, Buss, "Perception-based data reduction and transmission of haptic
/// data in telepresence and teleaction systems", IEEE TSP 56(2), 2008; numbers from network.md section 2.
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

 private:
  struct Sent {
    LocalTime at;
    Vec3 value;
  };
  Config config_;
  std::optional<Sent> sent_;
};

}  // namespace tendon

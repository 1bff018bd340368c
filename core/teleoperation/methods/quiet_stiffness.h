// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>

#include "core/base/time.h"

namespace tendon {

/// The stiffness of a spring between two ends with a delay, in N/m or N·m/rad:
///     K → min(most, 2 B/T_loop),    T_loop > 0 and known                 (see PositionPosition)
/// K has the time constant kSettling, but uses the first T_loop at once. Thread-safe: no. Realtime-safe: yes.
class QuietStiffness {
 public:
  static constexpr Duration kSettling = std::chrono::milliseconds(200);

  struct Config {
    double most = 0;     ///< > 0
    double damping = 0;  ///< B; ∞: K is `most`
    Duration period{};   ///< the period of `follow`, > 0
  };
  /// Does not check the values.
  explicit QuietStiffness(const Config& config) noexcept : config_(config), value_(config.most) {}

  /// Must be called once per period. `loop` is 0 if it is not known.
  double follow(Duration loop) noexcept {
    const double late = seconds(loop);
    double quiet = config_.most;
    if (late > 0) quiet = std::min(quiet, 2 * config_.damping / late);
    const double share = known_ ? std::min(1.0, seconds(config_.period) / seconds(kSettling)) : 1.0;
    value_ += share * (quiet - value_);
    known_ = late > 0;
    return value_;
  }
  /// K changes gradually.
  void become(double most, double damping) noexcept {
    config_.most = most;
    config_.damping = damping;
  }
  void forget() noexcept { known_ = false; }  ///< uses the next T_loop immediately
  double value() const noexcept { return value_; }

 private:
  Config config_;
  double value_;
  bool known_ = false;
};

}  // namespace tendon

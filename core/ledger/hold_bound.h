// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon {

/// How long the next force may be held: the T that the bounds of OutputBound count on, following what the machine
/// shows.
///
///     T(0)   = T_max                                        what the scene says
///     T(n+1) = min((1 + margin) · held, most · T_max)       after an interval with held > T(n); never below T(n)
///     T(n+1) = T(n) − max(1 ns, (T(n) − T_max) · held/memory), not below T_max            after any other interval
///
/// Up at once, down slowly, and never below T_max: a machine that is late again within `memory` finds a bound that
/// already allows for it. As long as no interval is longer than T_max, T is T_max to the last bit.
///
/// The promise of the limiter counts on T: E ≥ 0 while every hold is no longer than the T in force when it began. The
/// first longer one, of length T_act with the force F, can take at most
///
///     (T_act − T)(‖F‖ − f_c)₊²/(4b)  ≤  (T_act/T − 1) · E
///
/// more than the ledger has (OutputBound).
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class HoldBound {
 public:
  struct Follow {
    double margin = 0.25;  ///< ≥ 0: how much longer than the longest hold seen the next one may be
    /// > 0. Time constant of the way back: overruns of ordinary kernels come minutes apart.
    Duration memory = std::chrono::seconds(60);
    /// ≥ 1, in T_max. Longer is a machine that stopped, and no measure of its jitter: at 4 the force above f_c is still
    /// half of what it was.
    double most = 4;
  };

  /// Throws std::invalid_argument naming the field when a value is impossible. `longest_hold`: T_max, > 0.
  HoldBound(Duration longest_hold, const Follow& follow);

  /// An interval has ended after `held`. One that is not positive changes nothing.
  void observe(Duration held) noexcept;

  /// T.
  Duration in_force() const noexcept { return longest_hold_ + excess_; }

 private:
  Follow follow_;
  Duration longest_hold_;  ///< T_max
  Duration excess_{};      ///< T − T_max
};

}  // namespace tendon

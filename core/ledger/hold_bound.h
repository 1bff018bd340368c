// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon {

/// Computes an upper bound T for the duration of the next hold from the measured times, for OutputBound.
///     T(0)   = T_max                                        from the scene
///     T(n+1) = min((1 + margin) · held, most · T_max)       if held > T(n); never below T(n)
///     T(n+1) = T(n) − max(1 ns, (T(n) − T_max) · held/memory), not below T_max            otherwise
/// T rises immediately and falls slowly. T is therefore large enough if the machine is late again within `memory`. If
/// no interval was longer than T_max, T is equal to T_max.
///
/// A force F that is held for T_act > T can take E below zero, but by no more than
///     (T_act − T)(‖F‖ − f_c)₊²/(4b)  ≤  (T_act/T − 1) · E
///
/// Source: core/PROOFS.md, "Late holds".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
class HoldBound {
 public:
  struct Follow {
    double margin = 0.25;  ///< ≥ 0: the relative margin of T
    /// > 0. Time constant of the return to T_max. With ordinary kernels, overruns are minutes apart.
    Duration memory = std::chrono::seconds(60);
    /// ≥ 1: the largest T as a multiple of T_max. Longer intervals are not used because they are not caused by jitter
    /// but by a machine that was stopped. If T is 4 T_max, the limiter can still use half of the force above f_c.
    double most = 4;
  };

  /// `longest_hold`: T_max, > 0. Throws std::invalid_argument with the name of the field if a value is out of range.
  HoldBound(Duration longest_hold, const Follow& follow);

  /// Updates T with the length of the last interval. Does nothing if it is not positive.
  void observe(Duration held) noexcept;

  Duration in_force() const noexcept { return longest_hold_ + excess_; }  ///< T

 private:
  Follow follow_;
  Duration longest_hold_;  ///< T_max
  Duration excess_{};      ///< T − T_max
};

}  // namespace tendon

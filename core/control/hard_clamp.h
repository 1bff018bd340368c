// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Limits the norm of a force without changing its direction.
///     F(n) = F_wanted(n) · min(1, F_max / ‖F_wanted(n)‖)
///
/// This is **not** passive: an unstable system has a limit cycle with the amplitude F_max.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class HardClamp {
 public:
  struct Config {
    Friction friction;     ///< only for the ledger
    double max_force = 0;  ///< F_max, N; ≥ 0 and finite
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit HardClamp(const Config& config);

  void observe(const Interval<N>& interval) noexcept { port_.observe(interval.applied, interval.dx, interval.held); }
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
    port_.observe_unseen(applied.norm(), at_most);
  }
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

 private:
  double max_force_;
  EnergyLedger port_;
};

}  // namespace tendon

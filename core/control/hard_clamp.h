// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Bounds the size of a force and nothing else, as a device's own limit does.
///
///     F(n) = F_wanted(n) · min(1, F_max / ‖F_wanted(n)‖)
///
/// Promises that no force is larger than F_max (N); the direction is kept. It is **not** passive: an instability
/// becomes a limit cycle of that amplitude.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class HardClamp {
 public:
  struct Config {
    Friction friction;     ///< for the ledger alone
    double max_force = 0;  ///< F_max, N; ≥ 0 and finite
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit HardClamp(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

 private:
  double max_force_;
  EnergyLedger port_;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Returns all finite forces unchanged, and updates the ledger. Use it only with simulated devices.
template <int N>
class Unlimited {
 public:
  struct Config {
    Friction friction;  ///< for the ledger
  };

  /// Throws std::invalid_argument if a friction bound is negative or not finite.
  explicit Unlimited(const Config& config) : ledger_(config.friction) {}

  void observe(const Interval<N>& interval) noexcept { ledger_.observe(interval.applied, interval.dx, interval.held); }
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
    ledger_.observe_unseen(applied.norm(), at_most);
  }
  LimitedForce<N> limit(const Demand<N>& wanted) noexcept {
    if (!wanted.force.allFinite()) return {Vec<N>::Zero(), kNoBound, Reason::kNotFinite};
    return {wanted.force, kNoBound, {}};
  }
  double energy() const noexcept { return ledger_.energy(); }

 private:
  EnergyLedger ledger_;
};

}  // namespace tendon

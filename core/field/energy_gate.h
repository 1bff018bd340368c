// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>

namespace tendon::field {

/// Limits the stored energy H of a field to the energy that the hand has supplied, for every change of the field:
///     H ≤ H₀ + min(max(E − H₀, 0), P T) + tank
/// E is the account of the limiter after booking the interval, and H₀ the stored energy with the old law, the old place
/// of the proxy and the new hand. The tank is filled to `push_j` with `push_w`. Energy from the tank is credited
/// to the account, so an object can push a hand by at most push_j + push_w t. Several springs can share a gate. H and
/// H₀ are then sums. See core/field/README.md. Realtime-safe: yes.
class EnergyGate {
 public:
  struct Config {
    double push_j = 0;  ///< J, ≥ 0
    double push_w = 0;  ///< W, ≥ 0
  };
  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();

  explicit EnergyGate(const Config& config) noexcept : config_(config), tank_(config.push_j) {}

  /// Starts a step of `period` s with E = `account`, ΣH₀ = `before` (J) and P = `power` (W).
  void open(double account, double before, double power, double period) noexcept {
    budget_ = std::max(0.0, account - before);  // 0 for NaN
    if (power < kNoLimit) budget_ = std::min(budget_, power * period);
    tank_ = std::min(config_.push_j, tank_ + config_.push_w * period);
    drawn_ = 0;
  }

  /// The most that a spring with H₀ = `before` may store.
  double most(double before) const noexcept { return before + budget_ + tank_; }

  /// Books a spring that stores `now`, at most `most(before)`. Energy that is released here is not available to other
  /// springs.
  void settle(double before, double now) noexcept {
    const double rise = std::max(now - before, 0.0);
    const double paid = std::min(rise, budget_);
    const double drawn = std::min(rise - paid, tank_);
    budget_ -= paid;
    tank_ -= drawn;
    drawn_ += drawn;
  }

  double drawn() const noexcept { return drawn_; }  ///< J from the tank in this step, to be credited to the account
  double tank() const noexcept { return tank_; }    ///< J

 private:
  Config config_;
  double tank_;
  double budget_ = 0;
  double drawn_ = 0;
};

}  // namespace tendon::field

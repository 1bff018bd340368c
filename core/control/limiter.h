// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/control/catalogue.h"
#include "core/ledger/hold_bound.h"
#include "core/ledger/output_bound.h"

namespace tendon {

/// The law of a scene for a point in space, chosen from the catalogue at construction.
///
/// It keeps the guarantee of a `passive` law if the loop is late. T is the bound on the hold time (HoldBound). It is
/// T_max until a force has been held longer. Laws with a bound like equation (8) use T (FollowsHolds). For the other
/// passive laws, whose proofs then no longer apply, the limiter adds the bound of equation (8) with T. The result is
/// unchanged, bit for bit, if no force is held longer than T_max.
///
/// Source: core/PROOFS.md, "Late holds".
///
/// Satisfies StabilityController<Limiter, 3>. Thread-safe: no. Realtime-safe: all but the constructor.
class Limiter {
 public:
  /// Throws what the constructor of the law throws, and std::invalid_argument for a `shared_account` with a law that
  /// cannot share its account.
  explicit Limiter(const LimiterConfig& config);

  void observe(const Interval<3>& interval) noexcept;
  void observe_unseen(const Vec<3>& applied, Duration at_most) noexcept;
  LimitedForce<3> limit(const Demand<3>& wanted) noexcept;
  double energy() const noexcept;

  /// SharesAccount, for laws that implement it. Other laws ignore `credit` and `withdraw`; their `payable` is 0 and
  /// their `worst_loss` is +∞.
  void credit(double energy) noexcept;
  void withdraw(double energy) noexcept;
  double payable() const noexcept;
  double worst_loss(const Vec<3>& force) const noexcept;

  /// Forwards to AolPlus::adapt. Other laws ignore it.
  void adapt(const Friction& friction) noexcept;

  /// Returns T, the longest time for which the next force can be held.
  Duration longest_hold() const noexcept { return holds_ ? holds_->in_force() : longest_hold_; }
  /// Forwards to AolPlus::broken_assumptions. Returns 0 for other laws.
  std::uint64_t broken_assumptions() const noexcept;

 private:
  void follow(Duration held) noexcept;

  AnyLaw law_;
  Duration longest_hold_;           ///< T_max
  std::optional<HoldBound> holds_;  ///< empty: T stays T_max
  double viscous_ = 0;              ///< b, N·s/m
  OutputBound bound_;               ///< equation (8) with T
  bool bounded_from_here_ = false;  ///< a force was held too long for the law, so `bound_` is used as well
};

}  // namespace tendon

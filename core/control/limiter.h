// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/control/catalogue.h"
#include "core/ledger/hold_bound.h"
#include "core/ledger/output_bound.h"

namespace tendon {

/// The law of a scene, for a point in space: one of the catalogue, chosen when it is built.
///
/// It keeps the promise of a law that is `passive` through overruns. T is how long a hold may be (HoldBound): T_max, or
/// longer after a hold that was longer. The laws with a bound like equation (8) then bound by T (FollowsHolds). The
/// proofs of the other passive laws end with the first hold beyond T_max; from then on equation (8) with T and the
/// port's ledger bounds their force as well (OutputBound, Theorem 1). As long as no hold is longer than T_max, none of
/// this changes a bit.
///
/// Satisfies StabilityController<Limiter, 3>. Thread-safe: no. Realtime-safe: all but the constructor.
class Limiter {
 public:
  /// Throws what the law's constructor throws, and std::invalid_argument for a `shared_account` on a law that has none
  /// to share.
  explicit Limiter(const LimiterConfig& config);

  void observe(const Interval<3>& interval) noexcept;
  void observe_unseen(const Vec<3>& applied, Duration at_most) noexcept;
  LimitedForce<3> limit(const Demand<3>& wanted) noexcept;
  double energy() const noexcept;

  /// SharesAccount, of a law that does so (`shared_account` refuses the others). Other laws pass over `credit` and
  /// `withdraw`; their `payable` is 0 and their `worst_loss` +∞.
  void credit(double energy) noexcept;
  void withdraw(double energy) noexcept;
  double payable() const noexcept;
  double worst_loss(const Vec<3>& force) const noexcept;

  /// Forwards to AolPlus::adapt. Other laws ignore it.
  void adapt(const Friction& friction) noexcept;

  /// T: the next force may be held for so long.
  Duration longest_hold() const noexcept { return holds_ ? holds_->in_force() : longest_hold_; }
  /// Forwards to AolPlus::broken_assumptions. Other laws have none: 0.
  std::uint64_t broken_assumptions() const noexcept;

 private:
  void follow(Duration held) noexcept;

  AnyLaw law_;
  Duration longest_hold_;           ///< T_max
  std::optional<HoldBound> holds_;  ///< empty: T stays T_max
  double viscous_ = 0;              ///< b, N·s/m
  OutputBound bound_;               ///< equation (8) with T
  bool bounded_from_here_ = false;  ///< the law's own proof has ended: `bound_` applies, too
};

}  // namespace tendon

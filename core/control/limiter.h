// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/control/catalogue.h"
#include "core/ledger/hold_bound.h"
#include "core/ledger/output_bound.h"

namespace tendon {

/// The law of a scene for a point in space, chosen from the catalogue at construction. It keeps the guarantee of a
/// `passive` law if the loop is late. T is the bound on the hold time (HoldBound), and equal to T_max until a force has
/// been held longer. Laws with a bound like equation (8) use T (FollowsHolds). The proofs of the other passive laws
/// then no longer apply, and the limiter adds the bound of equation (8) with T. The result is unchanged, bit for bit,
/// if no force is held longer.
///
/// Source: core/PROOFS.md, "Late holds".
/// Satisfies StabilityController<Limiter, 3>. Thread-safe: no. Realtime-safe: yes, except the constructor.
class Limiter {
 public:
  /// Throws what the law throws, and std::invalid_argument if the law does not support `shared_account`.
  explicit Limiter(const LimiterConfig& config);

  void observe(const Interval<3>& interval) noexcept;
  void observe_unseen(const Vec<3>& applied, Duration at_most) noexcept;
  LimitedForce<3> limit(const Demand<3>& wanted) noexcept;
  double energy() const noexcept;

  /// SharesAccount. For other laws, `credit` and `withdraw` do nothing, `payable` is 0 and `worst_loss` is +∞.
  void credit(double energy) noexcept;
  void withdraw(double energy) noexcept;
  double payable() const noexcept;
  double worst_loss(const Vec<3>& force) const noexcept;

  /// See AolPlus::adapt. Other laws ignore it.
  void adapt(const Friction& friction) noexcept;

  Duration longest_hold() const noexcept { return holds_ ? holds_->in_force() : longest_hold_; }  ///< T
  std::uint64_t broken_assumptions() const noexcept;  ///< see AolPlus; 0 for other laws

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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>

#include "core/ledger/port.h"

namespace tendon {

/// A law that makes the force at a device's port safe to feel: what every law in core/control implements.
///
/// Once in each haptic period, in this order: `observe` the interval that has just ended (not in the first period,
/// which has none), then `limit` the wanted force to the one to hold until the next period. When nobody saw the motion
/// in an interval, call `observe_unseen` instead of `observe`: the force `applied` was held for at most `at_most`, and
/// then vanished.
///
/// N is 1, 3 (forces in N, displacements in m) or 6 (joint torques in N·m and angles in rad, or a wrench and
/// a twist; each law says which it takes).
///
/// `energy` is the law's account of the port, J: the ledger E of Lee & Lee 2009, eq. (5), or a lower bound of it. Laws
/// that do not act on it keep it too, so that every law can be judged by it.
///
/// A demand that is not finite gives zero force with Reason::kNotFinite; an interval that is not finite is
/// not booked.
///
/// Thread-safe: no. Realtime-safe: all of it.
template <class Law, int N>
concept StabilityController = requires(Law law, const Interval<N>& interval, const Vec<N>& applied, Duration at_most,
                                       const Demand<N>& demand) {
  { law.observe(interval) }
  noexcept;
  { law.observe_unseen(applied, at_most) }
  noexcept;
  { law.limit(demand) }
  noexcept->std::same_as<LimitedForce<N>>;
  { law.energy() }
  noexcept->std::convertible_to<double>;
};

/// A law whose account other ports may pay into and draw on (Purse), J:
///
///     credit(J)        the account rises: another port has given up as much. Below zero or not finite: nothing happens
///     withdraw(J)      the account falls. The caller withdraws no more than `payable`; the same for bad values
///     payable()        what bounds the next force; of it max(payable, 0) may be withdrawn
///     worst_loss(F)    ℓ(F) of OutputBound: the account that lets F (N) through whole; +∞ when none does
///
/// `energy` is then the account, the port's own ledger + credited − withdrawn. Both take place between `observe` and
/// `limit` of one period: what is withdrawn after `limit` was already lent to the force.
template <class Law, int N>
concept SharesAccount = requires(Law law, const Law& same, const Vec<N>& force, double energy) {
  { law.credit(energy) }
  noexcept;
  { law.withdraw(energy) }
  noexcept;
  { same.payable() }
  noexcept->std::same_as<double>;
  { same.worst_loss(force) }
  noexcept->std::same_as<double>;
};

/// A law whose bound counts on how long its forces are held, and follows a new bound of that from the next `limit` on
/// (HoldBound).
template <class Law>
concept FollowsHolds = requires(Law law, Duration longest_hold) {
  { law.hold_at_most(longest_hold) }
  noexcept;
};

}  // namespace tendon

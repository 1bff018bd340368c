// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>

#include "core/ledger/port.h"

namespace tendon {

/// The interface of the laws, which make the force at the port of a device safe.
///
/// In each haptic period, first call `observe` with the last interval (not in the first period), and then `limit`,
/// which returns the force to apply until the next period. If the motion in the last interval was not measured, call
/// `observe_unseen` instead. The force `applied` was then held for at most `at_most` and set to zero.
///
/// N is 1, 3 (forces in N, displacements in m) or 6 (joint torques in N·m and angles in rad, or a wrench and a twist).
///
/// `energy` is the account of the port in J: the ledger E of Lee & Lee 2009, eq. (5), or a lower bound of it. Laws that
/// do not use it keep it as well, so that all laws can be compared. If a demand is not finite, the force is zero and
/// Reason::kNotFinite is set. A non-finite interval is not booked.
/// Thread-safe: no. Realtime-safe: yes.
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

/// A law whose account other ports can credit and draw on (EnergyTank). In J:
///     credit(J)        raises the account by energy that another port gave up. Ignores values that are not positive
///     withdraw(J)      lowers the account, by at most `payable`. Ignores values that are not positive
///     payable()        the value that bounds the next force; max(payable, 0) may be withdrawn
///     worst_loss(F)    ℓ(F) of OutputBound: the account at which F (N) passes unchanged; +∞ if there is none
/// `energy` is then the ledger of the port + credited − withdrawn. `credit` and `withdraw` must be called between
/// `observe` and `limit` of a period, because the force of `limit` uses the energy.
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

/// A law that uses the hold time in its bound. `hold_at_most` takes effect with the next `limit` (HoldBound).
template <class Law>
concept FollowsHolds = requires(Law law, Duration longest_hold) {
  { law.hold_at_most(longest_hold) }
  noexcept;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#include "core/control/force_bounding.h"

#include "core/control/law_support.h"

namespace tendon {

template <int N>
ForceBounding<N>::ForceBounding(const Config& config)
    : viscous_(law_support::checked_viscous(config.friction.viscous)),
      viscous_per_hold_(viscous_ / law_support::checked_hold(config.longest_hold)),
      port_(config.friction),
      empty_({.coulomb = 0, .viscous = config.friction.viscous}),
      budget_(empty_) {}

template <int N>
void ForceBounding<N>::observe(const Interval<N>& interval) noexcept {
  port_.observe(interval.applied, interval.dx, interval.held);
  if (budget_.energy() > 0 && interval.applied == Vec<N>::Zero()) budget_ = empty_;
  budget_.observe(interval.applied, interval.dx, interval.held);
}

template <int N>
void ForceBounding<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  port_.observe_unseen(applied.norm(), at_most);
  budget_.observe_unseen(applied.norm(), at_most);
}

template <int N>
LimitedForce<N> ForceBounding<N>::limit(const Demand<N>& demand) noexcept {
  const double bound = budget_.energy() > 0 ? 2 * std::sqrt(viscous_per_hold_ * budget_.energy()) : 0.0;
  if (!law_support::finite(demand)) return law_support::refused<N>(bound);
  return law_support::bounded<N>(demand.force, bound, Reason::kEnergy);
}

template <int N>
MemorylessForceBounding<N>::MemorylessForceBounding(const Config& config)
    : viscous_(law_support::checked_viscous(config.friction.viscous)),
      longest_hold_(law_support::checked_hold(config.longest_hold)),
      port_(config.friction) {}

template <int N>
void MemorylessForceBounding<N>::observe(const Interval<N>& interval) noexcept {
  port_.observe(interval.applied, interval.dx, interval.held);
  permitted_ = 0;
  if (!law_support::finite(interval)) return;
  const double per_hold = viscous_ / longest_hold_;
  const double credited = viscous_ / std::max(seconds(interval.held), longest_hold_);
  const double stored = interval.applied.squaredNorm() / (4 * per_hold) - interval.applied.dot(interval.dx) +
                        credited * interval.dx.squaredNorm();
  if (stored > 0) permitted_ = 2 * std::sqrt(per_hold * stored);
}

template <int N>
void MemorylessForceBounding<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  port_.observe_unseen(applied.norm(), at_most);
  permitted_ = 0;
}

template <int N>
LimitedForce<N> MemorylessForceBounding<N>::limit(const Demand<N>& demand) noexcept {
  if (!law_support::finite(demand)) return law_support::refused<N>(permitted_);
  return law_support::bounded<N>(demand.force, permitted_, Reason::kEnergy);
}

template class ForceBounding<1>;
template class ForceBounding<3>;
template class ForceBounding<6>;
template class MemorylessForceBounding<1>;
template class MemorylessForceBounding<3>;
template class MemorylessForceBounding<6>;

}  // namespace tendon

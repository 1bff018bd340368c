// SPDX-License-Identifier: Apache-2.0
#include "core/control/passive_synthesis.h"

#include "core/control/law_support.h"

namespace tendon {

template <int N>
PassiveSynthesis<N>::PassiveSynthesis(const Config& config)
    : affordable_(law_support::checked_viscous(config.friction.viscous) /
                  (law_support::checked_hold(config.longest_hold) / 2 + seconds(config.delay))),
      steepest_(config.stiffness.value_or(0)),
      port_(config.friction) {
  expect(config.delay >= Duration::zero(), "delay", seconds(config.delay), "0 s or more");
  if (config.stiffness) {
    expect(std::isfinite(steepest_) && steepest_ > 0, "stiffness", steepest_, "a finite number above 0 N/m");
  }
}

template <int N>
LimitedForce<N> PassiveSynthesis<N>::limit(const Demand<N>& demand) noexcept {
  if (!law_support::finite(demand)) return law_support::refused<N>(kNoBound);
  steepest_ = std::max(steepest_, law_support::spectral_norm<N>(demand.stiffness));
  if (demand.force == Vec<N>::Zero()) return {demand.force, kNoBound, {}};
  if (steepest_ == 0) return {Vec<N>::Zero(), kNoBound, Reason::kEnergy};
  if (steepest_ <= affordable_) return {demand.force, kNoBound, {}};
  return {demand.force * (affordable_ / steepest_), kNoBound, Reason::kEnergy};
}

template class PassiveSynthesis<1>;
template class PassiveSynthesis<3>;
template class PassiveSynthesis<6>;

}  // namespace tendon

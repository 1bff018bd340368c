// SPDX-License-Identifier: Apache-2.0
#include "core/control/hard_clamp.h"

#include "core/control/law_support.h"

namespace tendon {

template <int N>
HardClamp<N>::HardClamp(const Config& config) : max_force_(config.max_force), port_(config.friction) {
  expect(std::isfinite(max_force_) && max_force_ >= 0, "max_force", max_force_, "a finite number of 0 N or more");
}

template <int N>
LimitedForce<N> HardClamp<N>::limit(const Demand<N>& demand) noexcept {
  if (!law_support::finite(demand)) return law_support::refused<N>(max_force_);
  return law_support::bounded<N>(demand.force, max_force_, Reason::kMaxForce);
}

template class HardClamp<1>;
template class HardClamp<3>;
template class HardClamp<6>;

}  // namespace tendon

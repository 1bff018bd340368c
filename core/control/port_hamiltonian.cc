// SPDX-License-Identifier: Apache-2.0
#include "core/control/port_hamiltonian.h"

#include "core/control/law_support.h"

namespace tendon {

template <int N>
PortHamiltonian<N>::PortHamiltonian(const Config& config) : stiffness_(config.stiffness), port_(config.friction) {
  expect(std::isfinite(stiffness_) && stiffness_ > 0, "stiffness", stiffness_, "a finite number above 0 N/m");
}

template <int N>
void PortHamiltonian<N>::observe(const Interval<N>& interval) noexcept {
  port_.observe(interval.applied, interval.dx, interval.held);
  dx_.setZero();
  const double income = -interval.applied.dot(interval.dx);
  if (!law_support::finite(interval) || !std::isfinite(income)) return;
  stored_ += income;
  if (stored_ < 0) {  // overdraft (see the header); there is no leap in the same interval
    debt_ -= stored_;
    stored_ = 0;
    return;
  }
  dx_ = interval.dx;
  if (income > 0) repay(income / 2);
}

template <int N>
void PortHamiltonian<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  port_.observe_unseen(applied.norm(), at_most);
  dx_.setZero();
  stored_ = 0;
}

template <int N>
void PortHamiltonian<N>::repay(double energy) noexcept {
  const double paid = std::min(energy, debt_);
  stored_ -= paid;
  debt_ -= paid;
}

template <int N>
LimitedForce<N> PortHamiltonian<N>::limit(const Demand<N>& demand) noexcept {
  if (!law_support::finite(demand)) return law_support::refused<N>(0);
  const double size = demand.force.stableNorm();
  if (size == 0) {
    repay(stored_);
    stored_ = 0;
    return {demand.force, 0, {}};
  }
  const Vec<N> direction = demand.force / size;
  const double along = direction.dot(demand.stiffness * direction);
  const double stiffness = along > 0 ? along : stiffness_;
  const double leap = std::min(std::max(-direction.dot(dx_), 0.0), size / stiffness);
  dx_.setZero();
  const double leaped = stiffness * leap * leap / 2;
  if (leaped > stored_) {
    debt_ += leaped - stored_;
    stored_ = leaped;
  }
  return law_support::bounded<N>(demand.force, std::sqrt(2 * stiffness * stored_), Reason::kEnergy);
}

template class PortHamiltonian<1>;
template class PortHamiltonian<3>;
template class PortHamiltonian<6>;

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#include "core/control/virtual_coupling.h"

#include "core/control/law_support.h"

namespace tendon {

template <int N>
VirtualCoupling<N>::VirtualCoupling(const Config& config)
    : stiffness_(config.stiffness),
      damping_per_hold_(config.damping / law_support::checked_hold(config.longest_hold)),
      port_(config.friction) {
  expect(std::isfinite(stiffness_) && stiffness_ > 0, "stiffness", stiffness_, "a finite number above 0 N/m");
  expect(std::isfinite(config.damping) && config.damping >= 0, "damping", config.damping,
         "a finite number of 0 N·s/m or more");
}

template <int N>
LimitedForce<N> VirtualCoupling<N>::limit(const Demand<N>& demand) noexcept {
  if (!law_support::finite(demand)) {
    stretch_.setZero();
    return law_support::refused<N>(kNoBound);
  }
  const auto principal = law_support::principal_stiffness<N>(demand.stiffness);
  const Vec<N> total = principal.values.cwiseMax(0) + Vec<N>::Constant(stiffness_ + damping_per_hold_);
  const Vec<N> push = damping_per_hold_ * stretch_ - demand.force;
  const Vec<N> along = principal.vectors.transpose() * push;
  const Vec<N> stretch = principal.vectors * along.cwiseQuotient(total);
  const Vec<N> force = -(stiffness_ * stretch + damping_per_hold_ * (stretch - stretch_));
  if (!force.allFinite()) {
    stretch_.setZero();
    return law_support::refused<N>(kNoBound);
  }
  stretch_ = stretch;
  return {force, kNoBound, force == demand.force ? Reasons() : Reasons(Reason::kEnergy)};
}

namespace {

void check_design(double viscous, Duration longest_hold, double damping) {
  expect(std::isfinite(viscous) && viscous >= 0, "viscous", viscous, "a finite number of 0 N·s/m or more");
  expect(std::isfinite(damping), "damping", damping, "a finite number");
  law_support::checked_hold(longest_hold);
}

// 2b(B_c + κ) less the maximum over c of the right-hand side of the condition.
double llewellyn_margin(double viscous, double damping, double kappa) {
  constexpr int kPoints = 2000;
  const double sum = damping + kappa;
  double most = 0;
  for (int i = 0; i <= kPoints; ++i) {
    const double c = static_cast<double>(i) / kPoints;
    most = std::max(most, c * (1 - c) * sum * sum + kappa * kappa * c * c * c / (1 + c));
  }
  return 2 * viscous * sum - most;
}

}  // namespace

double colgate_coupling(double viscous, Duration longest_hold, double damping) {
  check_design(viscous, longest_hold, damping);
  return std::max(2 * (viscous - std::abs(damping)) / seconds(longest_hold), 0.0);
}

double two_port_coupling(double viscous, Duration longest_hold, double damping) {
  check_design(viscous, longest_hold, damping);
  expect(damping >= 0, "damping", damping, "0 N·s/m or more");
  // The margin is concave in κ. For B_c > 8b it is negative and falls at κ = 0; otherwise it changes sign once.
  if (viscous == 0 || damping > 8 * viscous) return 0;
  double low = 0;
  double high = viscous;
  while (llewellyn_margin(viscous, damping, high) > 0) high *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (llewellyn_margin(viscous, damping, middle) >= 0 ? low : high) = middle;
  }
  return 2 * low / seconds(longest_hold);
}

template class VirtualCoupling<1>;
template class VirtualCoupling<3>;
template class VirtualCoupling<6>;

}  // namespace tendon

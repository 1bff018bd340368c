// SPDX-License-Identifier: Apache-2.0
#include "core/control/nonlinear_coupling.h"

#include "core/control/law_support.h"

namespace tendon {

template <int N>
NonlinearCoupling<N>::NonlinearCoupling(const Config& config) : port_(config.friction) {
  const double most =
      2 * law_support::checked_viscous(config.friction.viscous) / law_support::checked_hold(config.longest_hold);
  max_slope_ = config.max_slope.value_or(most);
  expect(max_slope_ > 0 && max_slope_ <= most, "max_slope", max_slope_,
         "a number above 0 and at most 2b/T = " + shortest(most) + " N/m");
}

template <int N>
void NonlinearCoupling<N>::observe(const Interval<N>& interval) noexcept {
  port_.observe(interval.applied, interval.dx, interval.held);
  if (!law_support::finite(interval)) {
    elastic_.setZero();
    return;
  }
  elastic_ = max_slope_ * interval.dx - interval.applied;
  // If the device rounds the force up, it stretches the spring. The account of the proxy pays for this.
  const double beyond = interval.applied.squaredNorm() - returned_.squaredNorm();
  if (beyond > 0) account_ -= beyond / (2 * max_slope_);
}

template <int N>
void NonlinearCoupling<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  port_.observe_unseen(applied.norm(), at_most);
  elastic_.setZero();
}

template <int N>
LimitedForce<N> NonlinearCoupling<N>::limit(const Demand<N>& demand) noexcept {
  const Vec<N> centre = elastic_ / 2;
  const double radius = std::sqrt(std::max(centre.squaredNorm() + max_slope_ * account_, 0.0));
  const double permitted = centre.norm() + radius;
  Vec<N> f = Vec<N>::Zero();
  Reasons reasons = Reason::kNotFinite;
  if (law_support::finite(demand)) {
    const Vec<N> wanted = -demand.force;
    const bool inside = (wanted - centre).stableNorm() <= radius;
    f = inside ? wanted : Vec<N>(centre + law_support::shortened<N>(wanted - centre, radius));
    reasons = inside ? Reasons() : Reasons(Reason::kEnergy);
  }
  account_ += f.dot(elastic_ - f) / max_slope_;
  returned_ = f;
  elastic_.setZero();
  return {-f, permitted, reasons};
}

template class NonlinearCoupling<1>;
template class NonlinearCoupling<3>;
template class NonlinearCoupling<6>;

}  // namespace tendon

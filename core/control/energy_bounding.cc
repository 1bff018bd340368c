// SPDX-License-Identifier: Apache-2.0
#include "core/control/energy_bounding.h"

#include "core/base/portable_math.h"
#include "core/control/law_support.h"

namespace tendon {

template <int N>
EnergyBounding<N>::EnergyBounding(const Config& config) : port_(config.friction) {
  const double most =
      law_support::checked_viscous(config.friction.viscous) / law_support::checked_hold(config.longest_hold);
  c1_ = config.c1.value_or(most);
  expect(c1_ > 0 && c1_ <= most, "c1", c1_, "a number above 0 and at most b/T = " + shortest(most) + " N/m");
  c2_ = config.c2.value_or(c1_);
  expect(c2_ > 0 && c2_ <= c1_, "c2", c2_, "a number above 0 and at most c1 = " + shortest(c1_) + " N/m");
}

template <int N>
void EnergyBounding<N>::observe(const Interval<N>& interval) noexcept {
  port_.observe(interval.applied, interval.dx, interval.held);
  const bool seen = law_support::finite(interval);
  before_ = seen ? Vec<N>(-interval.applied) : Vec<N>::Zero();
  dx_ = seen ? interval.dx : Vec<N>::Zero();
}

template <int N>
void EnergyBounding<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  port_.observe_unseen(applied.norm(), at_most);
  before_.setZero();
  dx_.setZero();
}

template <int N>
LimitedForce<N> EnergyBounding<N>::limit(const Demand<N>& demand) noexcept {
  // (ii) is a ball around c₂Δx, (i) a half-space with a boundary perpendicular to Δx.
  const double travel = dx_.norm();
  const double middle = c2_ * travel;  // of the ball, along Δx
  const double radius = portable::hypot(middle, before_.norm());
  const double permitted = middle + radius;
  if (!law_support::finite(demand)) return law_support::refused<N>(permitted);

  const Vec<N> wanted = -demand.force;
  const Vec<N> centre = c2_ * dx_;
  const auto in_ball = [&](const Vec<N>& f) { return (f - centre).stableNorm() <= radius; };
  const Vec<N> along = travel > 0 ? Vec<N>(dx_ / travel) : Vec<N>::Zero();
  const double ceiling = along.dot(before_) + c1_ * travel;
  if (in_ball(wanted) && along.dot(wanted) <= ceiling) return {demand.force, permitted, {}};

  Vec<N> f = centre + law_support::shortened<N>(wanted - centre, radius);
  if (along.dot(f) > ceiling) {
    // Use the nearest force in the half-space if it is in the ball, or else on the disc where they intersect.
    const double height = along.dot(wanted);
    const Vec<N> across = wanted - height * along;
    f = std::min(height, ceiling) * along + across;
    if (!in_ball(f)) {
      const double above = ceiling - middle;
      const double disc = std::sqrt(std::max(radius * radius - above * above, 0.0));
      f = ceiling * along + law_support::shortened<N>(across, disc);
    }
  }
  return {-f, permitted, Reason::kEnergy};
}

template class EnergyBounding<1>;
template class EnergyBounding<3>;
template class EnergyBounding<6>;

}  // namespace tendon

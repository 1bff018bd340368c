// SPDX-License-Identifier: Apache-2.0
#include "core/control/admittance_loop.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/base/expect.h"

namespace tendon {

namespace {

template <int N>
void check(const Vec<N>& values, const char* name, double above) {
  for (const double value : values) {
    above > 0 ? expect_above_zero(value, name) : expect_not_negative(value, name);
  }
}

}  // namespace

template <int N>
AdmittanceLoop<N>::AdmittanceLoop(const Config& config) : config_(config) {
  check<N>(config.mass, "mass", std::numeric_limits<double>::min());
  check<N>(config.damping, "damping", 0);
  check<N>(config.stiffness, "stiffness", 0);
  check<N>(config.proportional, "proportional", 0);
  check<N>(config.integral, "integral", 0);
}

template <int N>
void AdmittanceLoop<N>::observe(const Interval<N>& interval) noexcept {
  held_ = 0;
  if (interval.held <= Duration::zero() || !interval.applied.allFinite() || !interval.dx.allFinite()) return;
  dx_ = interval.dx;
  held_ = seconds(interval.held);

  const Vec<N> missing = commanded_ - interval.applied;
  const double shortfall = missing.norm();
  if (!(shortfall > 0)) {
    integral_ += step_;
  } else {
    const Vec<N> direction = missing / shortfall;
    integral_ += step_ - std::max(step_.dot(direction), 0.0) * direction;
    const double enough = std::max(interval.applied.dot(direction), 0.0);
    integral_ -= std::max(integral_.dot(direction) - enough, 0.0) * direction;
  }
  step_.setZero();
}

template <int N>
void AdmittanceLoop<N>::observe_unseen() noexcept {
  step_.setZero();
  held_ = 0;
}

template <int N>
Demand<N> AdmittanceLoop<N>::command(const Measured& measured) noexcept {
  const double h = held_;
  const Vec<N> push = measured.hand_force + measured.environment - config_.stiffness.cwiseProduct(displacement_);
  velocity_ = (config_.mass.cwiseProduct(velocity_) + h * push)
                  .cwiseQuotient(config_.mass + h * config_.damping + h * h * config_.stiffness);
  displacement_ += h * velocity_;
  step_ = h > 0 ? Vec<N>(config_.integral.cwiseProduct(h * velocity_ - dx_)) : Vec<N>::Zero();
  commanded_ = config_.proportional.cwiseProduct(velocity_ - measured.velocity) + integral_ + step_;

  const Demand<N> wanted{commanded_};
  if (!wanted.force.allFinite()) {
    velocity_.setZero();
    displacement_.setZero();
    integral_.setZero();
    step_.setZero();
    commanded_.setZero();
  }
  return wanted;
}

template class AdmittanceLoop<1>;
template class AdmittanceLoop<3>;
template class AdmittanceLoop<6>;

}  // namespace tendon

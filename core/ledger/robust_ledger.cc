// SPDX-License-Identifier: Apache-2.0
#include "core/ledger/robust_ledger.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {
namespace {

/// Reduces each component of the travel by `count`, which may have been added by rounding.
template <int N>
Vec<N> beyond(double count, const Vec<N>& travel) noexcept {
  return (travel.array().abs() - count).max(0.0).matrix();
}

}  // namespace

template <int N>
RobustLedger<N>::RobustLedger(const Config& config)
    : config_(config), least_coulomb_(config.friction.coulomb), least_viscous_(config.friction.viscous) {
  expect_not_negative(config.friction.coulomb, "friction.coulomb");
  expect_not_negative(config.friction.viscous, "friction.viscous");
  expect_not_negative(config.encoder_step, "encoder_step");
  expect(config.window >= 1, "window", config.window, "1 or more");
}

template <int N>
double RobustLedger<N>::travel_beyond_count(const Vec<N>& travel) const noexcept {
  return beyond<N>(config_.encoder_step, travel).norm();
}

template <int N>
void RobustLedger<N>::restart() noexcept {
  from_turn_.setZero();
  to_peak_.setZero();
  credited_ = 0;
  least_coulomb_ = config_.friction.coulomb;
  in_window_.setZero();
  window_length_ = {};
  in_window_count_ = 0;
  least_viscous_ = config_.friction.viscous;
}

template <int N>
void RobustLedger<N>::observe(const Interval<N>& interval) noexcept {
  if (!interval.applied.allFinite() || !interval.dx.allFinite()) return;
  const double half_count = config_.encoder_step / 2;
  energy_ -= interval.applied.dot(interval.dx);
  energy_ -= half_count * (interval.applied - last_applied_).template lpNorm<1>();
  margin_ = half_count * interval.applied.template lpNorm<1>();
  last_applied_ = interval.applied;

  from_turn_ += interval.dx;
  const double travel = travel_beyond_count(from_turn_);
  if (travel > credited_) {
    energy_ += least_coulomb_ * (travel - credited_);
    credited_ = travel;
    to_peak_ = from_turn_;
  } else if (const Vec<N> back = from_turn_ - to_peak_; beyond<N>(config_.encoder_step, back).squaredNorm() > 0) {
    // If the hand has moved back by more than one count, a new path is started at the peak.
    from_turn_ = back;
    to_peak_ = back;
    least_coulomb_ = config_.friction.coulomb;
    credited_ = travel_beyond_count(back);
    energy_ += least_coulomb_ * credited_;
  }

  in_window_ += interval.dx;
  window_length_ += std::max(interval.held, Duration::zero());
  if (++in_window_count_ == config_.window) {
    const double distance = travel_beyond_count(in_window_);
    if (window_length_ > Duration::zero()) energy_ += least_viscous_ * distance * distance / seconds(window_length_);
    in_window_.setZero();
    window_length_ = {};
    in_window_count_ = 0;
    least_viscous_ = config_.friction.viscous;
  }
}

template <int N>
void RobustLedger<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  const double excess = std::max(applied.norm() - config_.friction.coulomb, 0.0);
  if (config_.friction.viscous > 0 && std::isfinite(excess)) {
    energy_ -= seconds(at_most) * excess * excess / (4 * config_.friction.viscous);
  }
  // Settle the margin of the force held so far. The next interval starts from zero force.
  energy_ -= margin_;
  margin_ = 0;
  last_applied_.setZero();
  restart();
}

template <int N>
void RobustLedger<N>::transfer(double energy) noexcept {
  if (std::isfinite(energy)) energy_ += energy;
}

template <int N>
void RobustLedger<N>::adapt(const Friction& friction) noexcept {
  const auto possible = [](double value) { return std::isfinite(value) && value >= 0; };
  if (!possible(friction.coulomb) || !possible(friction.viscous)) return;
  config_.friction = friction;
  least_coulomb_ = std::min(least_coulomb_, friction.coulomb);
  least_viscous_ = std::min(least_viscous_, friction.viscous);
}

template class RobustLedger<1>;
template class RobustLedger<3>;
template class RobustLedger<6>;

}  // namespace tendon

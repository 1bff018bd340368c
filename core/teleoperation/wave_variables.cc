// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/wave_variables.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {

template <int N>
WavePort<N>::WavePort(const Config& config) : config_(config), root_(std::sqrt(2 * config.impedance)) {
  expect_above_zero(config.impedance, "impedance");
  expect_not_negative(config.drift_rate, "drift_rate");
  expect_above_zero(seconds(config.period), "period");
}

template <int N>
void WavePort<N>::receive(const WaveMessage<N>& message) noexcept {
  if (message.sequence <= newest_.sequence) return;
  if (!message.wave.allFinite() || !message.integral.allFinite() || !std::isfinite(message.energy)) return;
  newest_ = message;
  fresh_ = true;
}

template <int N>
Demand<N> WavePort<N>::command(const Vec<N>& velocity) noexcept {
  const double period = seconds(config_.period);
  wave_ = fresh_ ? newest_.wave : Vec<N>::Zero();
  fresh_ = false;
  wave_ += config_.drift_rate * (newest_.integral - used_integral_ - period * wave_);

  const double left = std::max(newest_.energy - used_energy_, 0.0);
  const double power = wave_.squaredNorm() / 2;
  if (period * power > left) wave_ *= std::sqrt(left / (period * power));
  return {root_ * wave_ - config_.impedance * velocity};
}

template <int N>
WaveMessage<N> WavePort<N>::observe(const Interval<N>& interval) noexcept {
  const double held = seconds(interval.held);
  ++sent_.sequence;
  sent_.wave.setZero();
  if (!(held > 0) || !interval.applied.allFinite() || !interval.dx.allFinite()) return sent_;

  // A period that was longer than planned can have used no more than there was.
  const double used = std::min(held * wave_.squaredNorm() / 2, std::max(newest_.energy - used_energy_, 0.0));
  used_energy_ += used;
  used_integral_ += held * wave_;
  account_ += used - interval.applied.dot(interval.dx);

  sent_.wave = (config_.impedance / held * interval.dx - interval.applied) / root_;
  const double cost = held * sent_.wave.squaredNorm() / 2;
  const double affordable = std::clamp(account_, 0.0, cost);
  if (affordable < cost) sent_.wave *= std::sqrt(affordable / cost);
  account_ -= affordable;
  sent_.energy += affordable;
  sent_.integral += held * sent_.wave;
  return sent_;
}

template class WavePort<1>;
template class WavePort<3>;
template class WavePort<6>;

}  // namespace tendon

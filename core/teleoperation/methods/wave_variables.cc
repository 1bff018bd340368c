// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/wave_variables.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"
#include "core/base/portable_math.h"

namespace tendon {

template <int N>
WavePort<N>::WavePort(const Config& config)
    : config_(config), root_(std::sqrt(2 * config.impedance)), means_(1), tracking_(0), clock_(config.max_playout) {
  expect_above_zero(config.impedance, "impedance");
  expect_above_zero(seconds(config.period), "period");
  expect_not_negative(seconds(config.max_playout), "max_playout");
  expect(config.max_wave > 0, "max_wave", config.max_wave, "above 0");
  expect_not_negative(config.encoder_step, "encoder_step");
  const double means = seconds(config.smoothing) / seconds(config.period);
  expect(means >= 1 && means <= static_cast<double>(kMost), "smoothing", seconds(config.smoothing),
         "1 to 256 periods of " + shortest(seconds(config.period)) + " s");
  means_ = static_cast<std::size_t>(portable::round(means));
  tracking_ = 1 / std::max(config.impedance / kTracking, seconds(config.smoothing));
  for (Vec<N>& sum : played_) sum.setZero();
  for (Vec<N>& due : due_) due.setZero();
}

template <int N>
void WavePort<N>::join(const WaveMessage<N>& first) noexcept {
  if (!first.integral.allFinite() || !std::isfinite(first.energy)) return;
  clock_ = PlayoutClock(config_.max_playout);
  clock_.heard(sent_.time, first.time, Duration::zero());
  begin_ = 0;
  count_ = 1;
  heard_[0] = first;
  joined_ = true;
  for (Vec<N>& sum : played_) sum = first.integral;
  mean_ = used_integral_ = first.integral;
  played_energy_ = used_energy_ = first.energy;
  wave_.setZero();
}

template <int N>
void WavePort<N>::receive(const WaveMessage<N>& message) noexcept {
  if (!message.integral.allFinite() || !std::isfinite(message.energy)) return;
  // Searches from the back, because messages usually arrive in order.
  std::size_t place = count_;
  while (place > 0 && heard(place - 1).sequence >= message.sequence) --place;
  if (place == 0) return;  // already played out
  if (place < count_ && (heard(place).sequence == message.sequence || heard(place).time <= message.time)) return;
  const WaveMessage<N>& before = heard(place - 1);
  if (message.time <= before.time) return;

  const Duration now = sent_.time;
  if (place == count_) {
    const auto steps = static_cast<double>(message.sequence - before.sequence);
    const double gap = seconds(message.time - before.time) * (1 - 1 / steps);
    clock_.heard(now, message.time, joined_ ? from_seconds(gap) : Duration::zero());
    joined_ = true;
  }
  if (count_ == kMost) {
    begin_ = (begin_ + 1) % kMost;
    --count_;
    --place;
  }
  for (std::size_t k = count_; k > place; --k) heard(k) = heard(k - 1);
  heard(place) = message;
  ++count_;
}

template <int N>
typename WavePort<N>::Sums WavePort<N>::sums_at(Duration time) noexcept {
  while (count_ > 1 && heard(1).time <= time) {
    begin_ = (begin_ + 1) % kMost;
    --count_;
  }
  const WaveMessage<N>& before = heard(0);
  if (count_ == 1 || time <= before.time) return {before.integral, before.energy};
  const WaveMessage<N>& after = heard(1);
  const double share = seconds(time - before.time) / seconds(after.time - before.time);
  return {before.integral + share * (after.integral - before.integral),
          before.energy + share * (after.energy - before.energy)};
}

template <int N>
Demand<N> WavePort<N>::command(const Vec<N>& velocity) noexcept {
  const Sums sums = sums_at(clock_.advance(sent_.time));
  played_energy_ = std::max(played_energy_, sums.energy);
  const Vec<N> step = (sums.integral - played_[next_]) / static_cast<double>(means_);
  played_[next_] = sums.integral;
  next_ = (next_ + 1) % means_;
  wave_ = step / seconds(config_.period) + (mean_ - used_integral_) / seconds(kLate);
  mean_ += step;
  const double length = wave_.stableNorm();
  if (length > config_.max_wave) wave_ *= config_.max_wave / length;

  const double left = std::max(played_energy_ - used_energy_, 0.0) + spare_;
  const double energy = seconds(config_.period) * wave_.squaredNorm() / 2;
  if (energy > left) wave_ *= std::sqrt(left / energy);

  if (!velocity.allFinite()) {
    velocity_.setZero();
    return {root_ * wave_ - config_.impedance * velocity};
  }
  follow(still_ > kStillFor ? Vec<N>(Vec<N>::Zero()) : velocity);
  return {root_ * wave_ - config_.impedance * velocity_};
}

template <int N>
void WavePort<N>::follow(const Vec<N>& velocity) noexcept {
  const Vec<N> most = seconds(config_.period) * velocity;
  const double square = most.squaredNorm();
  const double lags = square > 0 ? std::clamp(ahead_.dot(most) / square, 0.0, 1.0) : 0.0;
  velocity_ = velocity + tracking_ * (ahead_ - lags * most);
}

template <int N>
void WavePort<N>::watch_rest(const Vec<N>& dx, Duration held) noexcept {
  wandered_ += dx;
  still_ += held;
  const double far = wandered_.stableNorm();
  const double still = kStill * config_.encoder_step;
  constexpr double kRounding = 1 + 1e-9;
  if (still == 0 || far > kRounding * still) {
    if (far > 0) wandered_ *= still / far;
    still_ = {};
  }
}

template <int N>
WaveMessage<N> WavePort<N>::observe(const Interval<N>& interval, const SharedAccount& account) noexcept {
  account_ = account.payable + interval.applied.dot(interval.dx);  // undo the work that is already in the account
  return observe(interval, account.wanted - interval.applied, account.reserve);
}

template <int N>
WaveMessage<N> WavePort<N>::observe(const Interval<N>& interval) noexcept {
  return observe(interval, Vec<N>(Vec<N>::Zero()), 0);
}

template <int N>
WaveMessage<N> WavePort<N>::observe(const Interval<N>& interval, const Vec<N>& cut, double reserve) noexcept {
  const double held = seconds(interval.held);
  ++sent_.sequence;
  taken_ = given_ = 0;
  if (!(held > 0)) return sent_;
  sent_.time += interval.held;
  if (!interval.applied.allFinite() || !interval.dx.allFinite() || !cut.allFinite()) return sent_;

  ahead_ += interval.dx - held * velocity_;
  watch_rest(interval.dx, interval.held);

  // A period that is longer than planned cannot use more energy than available.
  taken_ = std::min(held * wave_.squaredNorm() / 2, std::max(played_energy_ - used_energy_, 0.0));
  used_energy_ += taken_;
  used_integral_ += held * wave_;
  account_ += taken_ - interval.applied.dot(interval.dx);

  const Vec<N> due = (config_.impedance * interval.dx - held * interval.applied) / root_;
  unsent_ -= held * cut / root_;
  due_sum_ += due;
  const Vec<N> mean = (due_sum_ - due_[due_next_]) / static_cast<double>(means_);
  due_[due_next_] = due_sum_;
  due_next_ = (due_next_ + 1) % means_;
  send(mean / held, held, reserve);
  spare_ = std::max(account_ - kReserves * reserve, 0.0);
  return sent_;
}

/// Sends `wave` and the missing part together, with the energy of `wave` and the energy beyond 1.5 reserves.
template <int N>
void WavePort<N>::send(const Vec<N>& wave, double held, double reserve) noexcept {
  const double cost = held * wave.squaredNorm() / 2;
  const double affordable = std::clamp(account_, 0.0, account_ < reserve ? kPoorShare * cost : cost);
  const double most = affordable + std::max(account_ - affordable - kReserves * reserve, 0.0);
  Vec<N> whole = wave + unsent_ / seconds(kLate);
  const double wanted = held * whole.squaredNorm() / 2;
  if (wanted > most) whole *= std::sqrt(most / wanted);
  unsent_ += held * (wave - whole);
  given_ = std::min(held * whole.squaredNorm() / 2, std::max(account_, 0.0));
  account_ -= given_;
  sent_.energy += given_;
  sent_.integral += held * whole;
}

template class WavePort<1>;
template class WavePort<3>;
template class WavePort<6>;

}  // namespace tendon

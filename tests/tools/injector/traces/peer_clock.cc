// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/peer_clock.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "tests/tools/injector/models/wide.h"

namespace tendon::injector {
namespace {

constexpr std::int64_t kBillion = 1'000'000'000;

Duration scaled(Duration a, std::int64_t b, std::int64_t c) noexcept {
  const Int128 product = Int128{a.count()} * b;
  const Int128 quotient = product / c;
  return Duration(static_cast<std::int64_t>(product % c < 0 ? quotient - 1 : quotient));
}

}  // namespace

DriftingClock::DriftingClock(Config config, LocalTime start) : config_(std::move(config)), start_(start) {
  const auto beyond = [](Duration change) { return change > kMaxOffset || change < -kMaxOffset; };
  if (beyond(config_.offset)) throw std::invalid_argument("the offset of a clock exceeds 10 years");
  if (config_.drift_ppb > kMaxDriftPpb || config_.drift_ppb < -kMaxDriftPpb) {
    throw std::invalid_argument("the drift of a clock exceeds 100000 ppm");
  }
  if (config_.steps.size() > kMaxSteps) throw std::invalid_argument("a clock has more than 1000 steps");
  Duration sum = config_.offset;
  Duration before = Duration::min();
  for (const Step& step : config_.steps) {
    if (step.at <= before || beyond(step.at)) {
      throw std::invalid_argument("the times of a clock's steps must increase, and not exceed 10 years");
    }
    if (beyond(step.change) || beyond(sum += step.change)) {
      throw std::invalid_argument("the steps of a clock add up to more than 10 years");
    }
    before = step.at;
  }
}

LocalTime DriftingClock::reading(LocalTime truth) const noexcept {
  const Duration elapsed = truth - start_;
  Duration ahead = config_.offset + scaled(elapsed, config_.drift_ppb, kBillion);
  for (const Step& step : config_.steps) {
    if (step.at <= elapsed) ahead += step.change;
  }
  return truth + ahead;
}

LocalTime DriftingClock::truth(LocalTime reading, LocalTime earliest) const noexcept {
  // Between two steps: elapsed + ⌊elapsed · drift⌋ ≥ wanted. As elapsed is an integer, ⌊elapsed · (1 + drift)⌋ ≥
  // wanted, so elapsed ≥ ⌈wanted / (1 + drift)⌉.
  Duration ahead = config_.offset;
  Duration from = earliest == LocalTime::min() ? Duration::min() : earliest - start_;
  for (auto step = config_.steps.begin();; ++step) {
    const Duration wanted = reading - start_ - ahead;
    const Duration elapsed = std::max(-scaled(-wanted, kBillion, kBillion + config_.drift_ppb), from);
    if (step == config_.steps.end() || elapsed < step->at) return start_ + elapsed;
    ahead += step->change;
    from = std::max(from, step->at);
  }
}

}  // namespace tendon::injector

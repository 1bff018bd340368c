// SPDX-License-Identifier: Apache-2.0
#include "protocol/bandwidth/rate_adaptation.h"

#include <algorithm>
#include <string_view>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr Duration kLeastWindow = std::chrono::seconds(10);  ///< lets a queue drain, but follows a new route quickly

constexpr std::uint64_t kLossSample = 20;  ///< a single lost datagram must not exceed 5 %

}  // namespace

RateAdaptation::RateAdaptation(const Config& config, LocalTime now)
    : config_(config),
      least_since_(now),
      short_queue_at_(now),
      trouble_at_(now),
      window_start_(now),
      bearable_at_(now) {
  const auto expect_share = [](double p, std::string_view field) { expect(p >= 0 && p <= 1, field, p, "0 to 1"); };
  expect_above_zero(seconds(config.queueing), "queueing_s");
  expect_above_zero(seconds(config.patience), "patience_s");
  expect_above_zero(seconds(config.clean), "clean_s");
  expect(config.longest_clean >= config.clean, "longest_clean_s", seconds(config.longest_clean), "at least clean_s");
  expect_above_zero(seconds(config.unusable_after), "unusable_after_s");
  expect_share(config.loss, "loss");
  expect_share(config.unusable_loss, "unusable_loss");
  clean_.fill(config.clean);
}

void RateAdaptation::step_down(LocalTime now) noexcept {
  trouble_at_ = now;
  if (step_ + 1 == kOneIn.size()) return;
  ++step_;
  if (just_up_) clean_[step_] = std::min(2 * clean_[step_], config_.longest_clean);
  just_up_ = false;
}

void RateAdaptation::step_up(LocalTime now) noexcept {
  trouble_at_ = now;
  if (just_up_) clean_[step_ + 1] = config_.clean;
  just_up_ = step_ > 0;
  if (step_ > 0) --step_;
}

void RateAdaptation::observe(LocalTime now, Duration round_trip, std::uint64_t seen, std::uint64_t missed) noexcept {
  if (now - least_since_ >= kLeastWindow) {
    least_before_ = least_;
    least_ = Duration::max();
    least_since_ = now;
  }
  least_ = std::min(least_, round_trip);
  const Duration queue = round_trip - std::min(least_, least_before_);
  bool full = false;
  if (queue <= config_.queueing) {
    short_queue_at_ = now;
    longest_queue_ = Duration::zero();
  } else {
    trouble_at_ = now;
    longest_queue_ = std::max(longest_queue_, queue);
    if (now - short_queue_at_ >= config_.patience) {
      // Wait while a queue is shrinking, because it was filled at a higher rate.
      full = queue > longest_queue_ * 9 / 10;
      short_queue_at_ = now;
      longest_queue_ = queue;
    }
  }

  bool lossy = false;
  const std::uint64_t seen_now = seen - window_seen_;
  const std::uint64_t missed_now = missed - window_missed_;
  if (now - window_start_ >= config_.patience && seen_now + missed_now >= kLossSample) {
    const double loss = static_cast<double>(missed_now) / static_cast<double>(seen_now + missed_now);
    lossy = loss > config_.loss;
    if (lossy) trouble_at_ = now;
    if (loss <= config_.unusable_loss || step_ + 1 < kOneIn.size()) bearable_at_ = now;
    window_start_ = now;
    window_seen_ = seen;
    window_missed_ = missed;
  }
  unusable_ = now - bearable_at_ >= config_.unusable_after;

  if (lossy || full) {
    step_down(now);
  } else if (now - trouble_at_ >= clean_[step_]) {
    step_up(now);
  }
}

}  // namespace tendon

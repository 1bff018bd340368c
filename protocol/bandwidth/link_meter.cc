// SPDX-License-Identifier: Apache-2.0
#include "protocol/bandwidth/link_meter.h"

#include <algorithm>
#include <utility>

namespace tendon {

void LinkMeter::heard(LocalTime now) noexcept {
  longest_gap_ = std::max(longest_gap_, now - heard_);
  heard_ = now;
}

void LinkMeter::observe(const ClockExchange& exchange, const ClockOffsetEstimator::Estimate& clock) noexcept {
  const auto& [sent, received, answered, answered_at] = exchange;
  round_trip_.add((answered_at - sent) - (answered - received));
  from_peer_.add(answered_at - clock.to_local(answered));
  if (std::exchange(newest_sent_, sent) != sent) to_peer_.add(clock.to_local(received) - sent);
}

LinkMeter::Report LinkMeter::report(LocalTime now) {
  Report report{.round_trip = round_trip_.take(),
                .to_peer = to_peer_.take(),
                .from_peer = from_peer_.take(),
                .longest_gap = std::max(longest_gap_, now - heard_)};
  longest_gap_ = {};
  return report;
}

void LinkMeter::Samples::add(Duration sample) noexcept {
  if ((seen_++ & (one_in_ - 1)) != 0) return;  // same as % one_in_, but faster
  if (kept_.size() == kMost) {
    for (std::size_t i = 0; i < kMost / 2; ++i) kept_[i] = kept_[2 * i];
    kept_.resize(kMost / 2);
    one_in_ *= 2;
    // This sample is kept, because its index is a multiple of the new one_in_.
  }
  kept_.push_back(sample);
}

std::optional<Delays> LinkMeter::Samples::take() {
  std::optional<Delays> delays;
  if (!kept_.empty()) {
    // The smallest sample that is not exceeded by `percent` of all samples.
    const auto quantile = [&](std::size_t percent) {
      const auto at = kept_.begin() + static_cast<std::ptrdiff_t>((kept_.size() * percent + 99) / 100 - 1);
      std::nth_element(kept_.begin(), at, kept_.end());
      return *at;
    };
    delays = {.median = quantile(50), .p99 = quantile(99)};
  }
  kept_.clear();
  seen_ = 0;
  one_in_ = 1;
  return delays;
}

}  // namespace tendon

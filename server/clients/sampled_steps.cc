// SPDX-License-Identifier: Apache-2.0
#include "server/clients/sampled_steps.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace tendon {

void SampledSteps::remember() {
  if (!at_.empty()) return;
  at_.resize(kRemembered);
  sent_after_ns_.resize(kRemembered);
  oldest_ = newest_ + 1;
}

void SampledSteps::observe(std::uint64_t tick, LocalTime at, LocalTime sent) {
  const std::uint64_t before = std::exchange(newest_, tick);
  if (at_.empty()) return;
  const std::uint64_t since = tick - before;
  // The previous step is only read if necessary, because it may not be in the cache if there are many devices.
  if (since > 1 && (before < oldest_ || since >= kRemembered)) {
    oldest_ = tick;
  } else if (since > 1) {
    const LocalTime last = at_[before % kRemembered];
    const Duration apart = (at - last) / static_cast<Duration::rep>(since);
    for (std::uint64_t i = 1; i < since; ++i) put(before + i, {last + static_cast<Duration::rep>(i) * apart, sent});
  }
  put(tick, {at, sent});
}

void SampledSteps::put(std::uint64_t tick, const Step& step) {
  using Sent = std::numeric_limits<std::uint32_t>;
  const Duration::rep after = (step.sent - step.at).count();
  at_[tick % kRemembered] = step.at;
  sent_after_ns_[tick % kRemembered] = static_cast<std::uint32_t>(std::clamp<Duration::rep>(after, 0, Sent::max()));
}

std::optional<SampledSteps::Step> SampledSteps::find(std::uint64_t tick) const {
  if (at_.empty() || tick < oldest_ || tick > newest_ || newest_ - tick >= kRemembered) return std::nullopt;
  const LocalTime at = at_[tick % kRemembered];
  return Step{.at = at, .sent = at + Duration(sent_after_ns_[tick % kRemembered])};
}

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#include "server/clients/sampled_steps.h"

#include <utility>

namespace tendon {

void SampledSteps::observe(std::uint64_t tick, LocalTime at, LocalTime sent) {
  const std::uint64_t before = std::exchange(newest_, tick);
  const std::uint64_t since = tick - before;
  // The previous step is only read if necessary, because it may not be in the cache if there are many devices.
  if (before > 0 && since > 1 && since < kRemembered) {
    const Numbered last = steps_[before % kRemembered];
    const Duration apart = (at - last.step.at) / static_cast<Duration::rep>(since);
    for (std::uint64_t i = 1; i < since; ++i) {
      const std::uint64_t between = last.tick + i;
      steps_[between % kRemembered] = {between, {last.step.at + static_cast<Duration::rep>(i) * apart, sent}};
    }
  }
  steps_[tick % kRemembered] = {tick, {at, sent}};
}

std::optional<SampledSteps::Step> SampledSteps::find(std::uint64_t tick) const {
  const Numbered& found = steps_[tick % kRemembered];
  if (tick == 0 || found.tick != tick) return std::nullopt;
  return found.step;
}

}  // namespace tendon

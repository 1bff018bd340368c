// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/passive_set_position.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/expect.h"

namespace tendon {

template <int N>
PassiveSetPosition<N>::PassiveSetPosition(const Config& config) : config_(config), ledger_(config.friction) {
  expect_above_zero(config.stiffness, "stiffness");
  expect_above_zero(seconds(config.longest_hold), "longest_hold");
  const double most = 2 * config.friction.viscous / seconds(config.longest_hold);
  expect(config.stiffness <= most * (1 + 1e-12), "stiffness", config.stiffness,  // 2b/T itself, however it was rounded
         "at most 2 b / T_max = " + shortest(most) + " N/m");
}

template <int N>
void PassiveSetPosition<N>::receive(const SetPosition<N>& message) noexcept {
  if (message.sequence > newest_.sequence && message.position.allFinite()) newest_ = message;
}

template <int N>
Demand<N> PassiveSetPosition<N>::command(const Vec<N>& position) noexcept {
  if (newest_.sequence == 0) return {0 * position};  // not finite when the position is not
  Vec<N> stretch = newest_.position - position;
  const double farthest = std::sqrt(2 * std::max(ledger_.energy(), 0.0) / config_.stiffness);
  const double distance = stretch.norm();
  if (distance > farthest) stretch *= farthest / distance;
  return {config_.stiffness * stretch, config_.stiffness * Mat<N>::Identity()};
}

template class PassiveSetPosition<1>;
template class PassiveSetPosition<3>;
template class PassiveSetPosition<6>;

}  // namespace tendon

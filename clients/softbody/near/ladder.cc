// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/ladder.h"

#include <utility>

namespace tendon::softbody {

Ladder::Ladder(std::vector<std::unique_ptr<Rung>> rungs, std::unique_ptr<NearModel> near)
    : rungs_(std::move(rungs)), answers_(rungs_.size()), near_(std::move(near)) {}

Reaction Ladder::press(const Patch& patch, Given given, double value) {
  return press_from(given == Given::kForce || patch.nodes.empty() ? rungs_.size() : 0, patch, given, value);
}

Reaction Ladder::press_from(std::size_t rung, const Patch& patch, Given given, double depth) {
  for (; rung < rungs_.size(); ++rung) {
    const auto answer = rungs_[rung]->press(patch, depth);
    // A rung holds the depth, and pulls where it has to.
    if (!answer || (given == Given::kLeastDepth && answer->reaction.force < 0)) continue;
    ++answers_[rung];
    if (answer->share >= 1) return answer->reaction;
    return blended(press_from(rung + 1, patch, given, depth), answer->reaction, answer->share);
  }
  return near_->press(patch, given, depth);
}

std::vector<Ladder::Step> Ladder::steps() const {
  std::vector<Step> all;
  for (std::size_t i = 0; i < rungs_.size(); ++i) all.push_back({rungs_[i]->size(), answers_[i]});
  return all;
}

std::size_t Ladder::bytes() const noexcept {
  std::size_t sum = near_->bytes();
  for (const auto& rung : rungs_) sum += rung->size().bytes;
  return sum;
}

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/fallback_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tendon::softbody {

FallbackModel::FallbackModel(std::vector<std::unique_ptr<FallbackLevel>> levels, std::unique_ptr<NearModel> near)
    : levels_(std::move(levels)), answers_(levels_.size()), near_(std::move(near)) {}

Reaction FallbackModel::press(const Patch& patch, Prescribed given, double value) {
  if (given == Prescribed::kForce || patch.nodes.empty()) return near_->press(patch, given, value);
  std::vector<FallbackLevel::Answer> answers;
  bool whole = false;
  for (std::size_t i = 0; i < levels_.size() && !whole; ++i) {
    const auto answer = levels_[i]->press(patch, value);
    // A level may pull.
    if (!answer || (given == Prescribed::kLeastDepth && answer->reaction.force < 0)) continue;
    ++answers_[i];
    answers.push_back(*answer);
    whole = answer->share >= 1;
  }
  Reaction felt;
  if (!whole) felt = near_->press(patch, given, value);
  for (auto answer = answers.rbegin(); answer != answers.rend(); ++answer) {
    felt = answer->share >= 1 ? answer->reaction : blended(felt, answer->reaction, answer->share);
  }
  if (whole) near_->follow(patch, felt, room(patch, value));
  return felt;
}

double FallbackModel::room(const Patch& patch, double depth) const {
  double most = 0;
  for (const auto& fallback_level : levels_) most = std::max(most, fallback_level->room(patch.middle, depth));
  return most;
}

void FallbackModel::cut(const Division& division, const EffectsConfig& effects) {
  levels_.clear();
  answers_.clear();
  near_->cut(division, effects);
}

void FallbackModel::go_on_from(const Model& before, std::span<const int> node_before) {
  near_->go_on_from(*static_cast<const FallbackModel&>(before).near_, node_before);  // same kind by contract
}

std::vector<FallbackModel::Step> FallbackModel::steps() const {
  std::vector<Step> all;
  for (std::size_t i = 0; i < levels_.size(); ++i) all.push_back({levels_[i]->size(), answers_[i]});
  return all;
}

std::size_t FallbackModel::bytes() const noexcept {
  std::size_t sum = near_->bytes();
  for (const auto& fallback_level : levels_) sum += fallback_level->size().bytes;
  return sum;
}

Reaction blended(const Reaction& from, const Reaction& to, double share) {
  const auto mix = [&](const auto& a, const auto& b) { return ((1 - share) * a + share * b); };
  Reaction all;
  all.force = mix(from.force, to.force);
  all.depth = mix(from.depth, to.depth);
  all.stiffness = mix(from.stiffness, to.stiffness);
  // Continuous at both ends, where rounding decides if there are two answers.
  const double between = std::min(1.0, 2 * std::min(share, 1 - share));
  all.error = mix(from.error, to.error) + between * std::abs(from.force - to.force);
  all.way = share < 0.5 ? from.way : to.way;
  if (!(std::abs(all.force) > 0)) return all;
  all.slope = mix(Vec2(from.force * from.slope), Vec2(to.force * to.slope)) / all.force;
  all.knows_glide = from.knows_glide && to.knows_glide;
  if (!all.knows_glide) return all;
  // Blends the parts of PatchContact's K: k along the normal, k s + F t mixed, and k s sᵀ + F (s tᵀ + t sᵀ − M − F D)
  // tangential. The result is stored in `curving`.
  const auto beside = [](const Reaction& r) { return Vec2(r.stiffness * r.slope + r.force * r.glide.tilting); };
  const auto across = [](const Reaction& r) {
    const Mat2 turned = r.slope * r.glide.tilting.transpose();
    return Mat2(r.stiffness * r.slope * r.slope.transpose() +
                r.force * (turned + turned.transpose() - r.glide.curving - r.force * r.glide.giving));
  };
  all.glide.tilting = (mix(beside(from), beside(to)) - all.stiffness * all.slope) / all.force;
  all.glide.curving = (across(all) - mix(across(from), across(to))) / all.force;
  return all;
}

}  // namespace tendon::softbody

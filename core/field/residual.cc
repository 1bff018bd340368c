// SPDX-License-Identifier: Apache-2.0
#include "core/field/residual.h"

#include <algorithm>

#include "core/base/portable_math.h"

namespace tendon::field {

void Residual::note(const Given& given) noexcept { steps_[given.tick % kSteps] = given; }

bool Residual::learn(std::uint64_t tick, const Vec3& truth, LocalTime now, double max_stiffness,
                     std::span<Material> materials, bool teaches) noexcept {
  const Given& given = steps_[tick % kSteps];
  if (!truth.allFinite() || given.tick != tick || (learned_ && tick <= *learned_)) return false;
  learned_ = tick;
  double known = given.spring;
  if (given.material < materials.size()) {
    Material& material = materials[given.material];
    DepthTable& table = material.table;
    if (teaches && given.depth > kLeastDepth) {
      const double error = truth.dot(given.direction) - given.spring - material.correction(given.depth);
      const double place = std::min(given.depth / table.step, static_cast<double>(DepthTable::kKnots));
      const std::size_t i = std::min(static_cast<std::size_t>(place), DepthTable::kKnots - 1);
      const double upper = place - static_cast<double>(i);
      const double lower = 1 - upper;
      const double lesson = kGain * error / (lower * lower + upper * upper);
      table.used = true;
      table.force[i] += lower * lesson;
      table.force[i + 1] += upper * lesson;
      bound_table(material, max_stiffness);
    }
    known += material.correction(given.depth);
  }
  rest_ = truth - known * given.direction;
  place_ = given.hand;
  rest_at_ = given.at;
  ease_ = given_ - faded(place_, now);
  return true;
}

Vec3 Residual::faded(const Vec3& x, LocalTime now) const noexcept {
  const double age = std::max(seconds(now - rest_at_), 0.0);
  const double way = (x - place_).squaredNorm();
  return rest_ * portable::exp(-age / kAge - way / (2 * kReach * kReach));
}

Vec3 Residual::held(const Motion& hand, double depth, double period) noexcept {
  if (!learned_) return Vec3::Zero();
  ease_ *= kEase / (kEase + period);
  given_ = faded(hand.position, hand.at) + ease_;
  return given_ * std::clamp(depth / kFullDepth, 0.0, 1.0);
}

}  // namespace tendon::field

// SPDX-License-Identifier: Apache-2.0
#include "core/remote/adaptive_local_model.h"

#include <algorithm>

#include "core/base/expect.h"
#include "core/remote/answer.h"

namespace tendon {
AdaptiveLocalModel::AdaptiveLocalModel(const Config& config) : config_(config) {
  expect(config.share > 0 && config.share <= 1, "share", config.share, "a number above 0 and at most 1");
  expect_not_negative(seconds(config.max_blend), "max_blend");
}

bool AdaptiveLocalModel::observe(const RemoteForce& force) noexcept {
  if (has_answer_ && force.answers <= answers_) return false;
  if (!is_sound(force)) return false;
  Line line{.at_origin = force.force, .model = force.model.value_or(LocalModel{})};
  line.model.stiffness *= config_.share;
  line.at_origin += line.model.stiffness * line.model.at;
  if (has_answer_) {
    const double share = share_of_new(force.received);
    old_ = {.at_origin = old_.at_origin + share * (new_.at_origin - old_.at_origin),
            .model = {.at = new_.model.at,
                      .stiffness = old_.model.stiffness + share * (new_.model.stiffness - old_.model.stiffness),
                      .valid_radius = new_.model.valid_radius}};
    blend_ = std::min(force.answers - answers_, config_.max_blend);
  } else {
    old_ = line;
  }
  new_ = line;
  answers_ = force.answers;
  received_ = force.received;
  has_answer_ = true;
  return true;
}

std::optional<Prediction> AdaptiveLocalModel::predict(const Motion& hand) const noexcept {
  if (!has_answer_ || !hand.position.allFinite()) return std::nullopt;
  const double share = share_of_new(hand.at);
  Prediction now = at(new_, hand.position);
  if (share >= 1) return now;
  const Prediction before = at(old_, hand.position);
  now.force = before.force + share * (now.force - before.force);
  now.stiffness = before.stiffness + share * (now.stiffness - before.stiffness);
  return now;
}

Prediction AdaptiveLocalModel::at(const Line& line, const Vec3& position) noexcept {
  const Vec3 trusted = within(line.model, position);
  return {.force = line.at_origin - line.model.stiffness * trusted,
          .stiffness = trusted == position ? line.model.stiffness : Mat3(Mat3::Zero())};
}

double AdaptiveLocalModel::share_of_new(LocalTime now) const noexcept {
  const Duration elapsed = now - received_;
  return elapsed >= blend_ ? 1 : std::max(0.0, seconds(elapsed) / seconds(blend_));
}

}  // namespace tendon

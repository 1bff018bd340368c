// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace tendon::softbody {

PatchContact::PatchContact(Model& model, const TouchSurface& surface, double tool_radius, Side side)
    : model_(model), surface_(surface), tool_radius_(tool_radius), side_(side) {
  if (!(tool_radius >= 0) || !std::isfinite(tool_radius)) {
    throw std::invalid_argument("the tool's radius: expected 0 or more");
  }
}

Feel PatchContact::at(const Vec3& tool) {
  Feel feel;
  feel.gap = std::numeric_limits<double>::infinity();
  if (!tool.allFinite()) return feel;
  const auto patch = surface_.patch(surface_.across(tool));
  if (!patch) {
    stuck_ = false;
    return feel;
  }
  const Vec3& n = surface_.normal();
  double height = 0;
  Vec2 height_slope = Vec2::Zero();
  for (Eigen::Index i = 0; i < patch->weights.size(); ++i) {
    const double here = surface_.height(patch->nodes[static_cast<std::size_t>(i)]);
    height += patch->weights[i] * here;
    height_slope += patch->slopes.col(i) * here;
  }
  feel.gap = n.dot(tool) - tool_radius_ - height;
  feel.touching = feel.gap < 0 || stuck_;
  if (!feel.touching) {
    feel.valid_radius = feel.gap;
    return feel;
  }
  stuck_ = side_ == Side::kBilateral;

  const Reaction reaction = model_.press(*patch, Given::kDepth, -feel.gap);
  const Vec3 tilt = surface_.from_across(reaction.slope - height_slope);
  feel.force = reaction.force * (n + tilt);
  const Vec3 steepest = n + surface_.from_across(2 * reaction.slope - height_slope);
  feel.stiffness = reaction.stiffness * steepest * steepest.transpose();
  feel.error = reaction.error;
  // Across, a patch is another one when it has moved by a quarter of its radius; along, when the tool has left.
  feel.valid_radius = std::min(side_ == Side::kBilateral ? surface_.radius() : -feel.gap, surface_.radius() / 4);
  return feel;
}

}  // namespace tendon::softbody

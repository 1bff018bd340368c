// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/contact.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/arithmetic.h"
#include "protocol/expect.h"

namespace tendon::softbody {

Mat3 not_negative(const Mat3& stiffness) {
  const Eigen::SelfAdjointEigenSolver<Mat3> parts((stiffness + stiffness.transpose()) / 2);
  return parts.eigenvectors() * parts.eigenvalues().cwiseMax(0.0).asDiagonal() * parts.eigenvectors().transpose();
}

PatchContact::PatchContact(Model& model, const TouchSurface& surface, double tool_radius, Side side,
                           std::unique_ptr<Friction> friction)
    : model_(model), surface_(surface), tool_radius_(tool_radius), side_(side), friction_(std::move(friction)) {
  expect_not_negative(tool_radius, "tool_radius");
}

Feel PatchContact::at(const Vec3& tool) {
  Feel feel;
  feel.gap = std::numeric_limits<double>::infinity();
  const bool glides = model_.glides();
  const Vec2 place = surface_.across(tool);
  const auto patch = glides ? surface_.patch_with_curvatures(place) : surface_.patch(place);
  if (!patch) {
    stuck_ = false;
    if (friction_) friction_->let_go();
    if (!model_.still()) model_.press({}, Prescribed::kForce, 0);
    return feel;
  }
  const Vec3& n = surface_.normal();
  double height = 0;
  Vec2 height_slope = Vec2::Zero();
  Vec3 curve = Vec3::Zero();
  for (Eigen::Index i = 0; i < patch->weights.size(); ++i) {
    const double here = surface_.height(patch->nodes[static_cast<std::size_t>(i)]);
    height += patch->weights[i] * here;
    height_slope += patch->slopes.col(i) * here;
    if (glides) curve += patch->curvatures.col(i) * here;
  }
  const Mat2 height_curve = (Mat2() << curve[0], curve[1], curve[1], curve[2]).finished();
  feel.gap = n.dot(tool) - tool_radius_ - height;
  Reaction reaction;
  feel.touching = stuck_;
  if (feel.gap < 0 || stuck_ || !model_.still()) {
    reaction = model_.press(*patch, stuck_ ? Prescribed::kDepth : Prescribed::kLeastDepth, -feel.gap);
    feel.touching = stuck_ || reaction.force > 0;
  }
  if (!feel.touching) {
    if (friction_) friction_->let_go();
    feel.gap += reaction.depth;
    feel.valid_radius = std::max(0.0, feel.gap);
    return feel;
  }
  stuck_ = side_ == Side::kBilateral;

  const Vec3 tilt = surface_.from_across(reaction.slope - height_slope);
  feel.force = reaction.force * (n + tilt);
  if (reaction.knows_glide) {
    const Reaction::Glide& glide = reaction.glide;
    const double force = reaction.force;
    const Vec3 steepest = n + tilt;
    const Vec3 tilting = surface_.from_across(glide.tilting);
    const Mat2 across = height_curve - glide.curving - force * glide.giving;
    feel.stiffness = reaction.stiffness * steepest * steepest.transpose() +
                     force * (steepest * tilting.transpose() + tilting * steepest.transpose()) +
                     force * surface_.form_from_across(across);
  } else {
    const Vec3 steepest = n + surface_.from_across(2 * reaction.slope - height_slope);
    feel.stiffness = reaction.stiffness * steepest * steepest.transpose();
  }
  feel.error = reaction.error;
  feel.way = reaction.way;
  feel.valid_radius = surface_.radius() / 4;  // farther away, the patch has other nodes
  if (friction_) rub(place, reaction.force, feel);
  return feel;
}

void PatchContact::rub(const Vec2& place, double normal_force, Feel& feel) {
  const Friction::Drag drag = friction_->move(place, normal_force);
  feel.force += surface_.from_across(drag.force);
  const Vec3& n = surface_.normal();
  feel.stiffness += drag.stiffness * (Mat3::Identity() - n * n.transpose());
  if (drag.until_slip > 0) feel.valid_radius = std::min(feel.valid_radius, drag.until_slip);
}

}  // namespace tendon::softbody

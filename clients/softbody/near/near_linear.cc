// SPDX-License-Identifier: Apache-2.0
// NearModel without a field: the linear solution with one Newton step, and the transition between two models.
#include <algorithm>
#include <cmath>

#include "clients/softbody/near/near_model.h"

namespace tendon::softbody {
namespace {

/// Safety factors of the estimated errors.
constexpr double kLinearSafety = 6;
constexpr double kStepSafety = 2;
constexpr double kPartedSafety = 3;

/// The step from the linear shape has its full weight up to kStrays, and no weight from kStraysTooFar. The criterion is
/// the part of the slope that remains after the step, plus kByEnergy times the part of the energy that the step
/// releases. Values on block B1: 0.3 at a/4 (ν = 0.45) and 0.9 next to a cut, where the step is good; 0.6 at a/20 and
/// 2.6 at a/10 (ν = 0.499), where it is bad. The slope alone is not sufficient: it is small again at 0.17 a.
constexpr double kStrays = 1;
constexpr double kStraysTooFar = 1.5;
constexpr double kByEnergy = 5;

}  // namespace

Reaction NearModel::linear_press(const Patch& patch, Prescribed given, double value) const {
  const VectorXd load = solid_.to_free(patch_load(solid_, surface_.normal(), patch));
  const VectorXd per_newton = at_rest_.solve(load);
  const double compliance = load.dot(per_newton);
  const double linear = constrained_force(given, value, 0, compliance);
  const VectorXd shape = linear * per_newton;
  VectorXd u = VectorXd::Zero(solid_.size());
  solid_.add_free(shape, u);
  VectorXd by_law = solid_.to_free(solid_.forces(u).force);
  const double work = per_newton.dot(by_law) / compliance;
  VectorXd step = -at_rest_.solve(by_law - work * load);
  step -= load.dot(step) / compliance * per_newton;
  const double slope = by_law.dot(step);
  solid_.add_free(step, u);
  by_law = solid_.to_free(solid_.forces(u).force);
  const double left = by_law.dot(step) / slope;
  const double strays = std::abs(left) + kByEnergy * std::abs(slope) / load.dot(shape) / linear;
  const bool leads = strays < kStraysTooFar;  // false if there is no step
  const double share = leads ? std::min(1.0, (kStraysTooFar - strays) / (kStraysTooFar - kStrays)) : 0;
  u.setZero();
  solid_.add_free(shape, u);
  Reaction reaction;
  reaction.way = SolverPath::kLinear;
  reaction.force = linear;
  if (leads) {
    const double length = 1 / (1 - left);
    reaction.force += share * (work - linear + length * (per_newton.dot(by_law) / compliance - work));
    solid_.add_free(share * length * step, u);
  }
  reaction.error =
      kStepSafety * std::abs(work - reaction.force) + (1 - share) * kLinearSafety * std::abs(work - linear);
  // The nonlinear part of the force is quadratic in the depth.
  reaction.stiffness = (linear != 0 ? 2 * reaction.force / linear - 1 : 1) / compliance;
  if (given == Prescribed::kForce) {
    solid_.add_free((value - reaction.force) * per_newton, u);
    reaction.force = value;
  }
  reaction.depth = depth_below(patch, surface_.normal(), u);
  reaction.slope = slope_below(patch, surface_.normal(), u);
  // The sides of a cut can rotate. This is the energy that is not yet released, per metre.
  if (parted_) reaction.error += kPartedSafety * std::abs(slope / reaction.depth);
  if (!std::isfinite(reaction.error)) reaction.error = std::abs(reaction.force);
  return reaction;
}

Handover NearModel::beyond_linear() const {
  if (by_linear_) return handover_;
  if (!(last_.felt.depth > 0)) return {};
  const Reaction there = linear_press(last_.patch, Prescribed::kDepth, last_.felt.depth);
  return handover(last_.felt, there, last_.felt.depth);
}

Handover handover(const Reaction& before, const Reaction& after, double depth) {
  const double ratio = before.force / after.force;
  if (!(before.force > 0 && after.force > 0 && std::isfinite(ratio))) return {};
  return {ratio, before.slope - after.slope, depth};
}

Reaction kept(const Handover& before, double share, const Reaction& reaction) {
  if (!(share > 0 && before.depth > 0)) return reaction;
  const double left = share * std::min(1.0, before.depth / std::abs(reaction.depth));
  const double times = 1 + left * (before.ratio - 1);
  Reaction all = reaction;
  all.force *= times;
  all.stiffness *= times;
  all.slope += left * before.slope;
  all.glide.giving /= times;
  const double force = std::max(std::abs(reaction.force), std::abs(all.force));
  all.error = std::max(1.0, times) * reaction.error + force * std::hypot(times - 1, left * before.slope.norm());
  return all;
}

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "clients/softbody/background.h"
#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/near/near_body.h"

namespace tendon::softbody {

/// Difference between two ways of answering at the point where the second takes over.
struct Handover {
  double ratio = 1;           ///< force before / force after
  Vec2 slope = Vec2::Zero();  ///< slope before − slope after
  double depth = 0;           ///< m, tool depth at the handover
};
Handover handover(const Reaction& before, const Reaction& after, double depth);

/// Adds `share` (0 … 1) of a handover's difference to force, stiffness and slope. Below the handover's depth the ratio
/// of the forces is applied, above it their difference. Also added to `error`.
Reaction kept(const Handover& before, double share, const Reaction& reaction);

/// Large rotations and strains near the tool, a linear body elsewhere: Newton's method on a NearBody around the patch.
/// The cost of an answer depends on the number of near elements, not on the size of the mesh.
///
/// The near field has radius ρ = max(1.5 a, a + 2 elements) around the patch at rest, and at least 2 a if ν > 0.45,
/// with a the patch radius; plus the elements that the patch touches within 0.45 a in any direction. When the patch has
/// moved half of that, a new near field is begun. A body that is entirely near is solved by QuasiStaticModel.
///
/// Without a background thread a field is linearized at rest and built in about 30 pieces. Most are solves with the
/// factor of the whole body, eight at a time; the longest are the two factors of the near field. Each answer makes one
/// piece and uses the old field. If the hand moves more than a/200 per answer, answers make more pieces, distributed up
/// to a distance of 0.38 a. If it leaves the old field, one answer makes all remaining pieces, or a whole field. Only
/// counts and positions decide, not a clock, so answers are the same on every machine.
///
/// With make_fields_by() answers make no pieces. When the patch has moved half its range, or its depth has changed by
/// a/10 since the last request, a new field is requested. The background thread solves the whole body by Newton's
/// method at a predicted hand position and linearizes about that shape. Fields are passed through one atomic pointer,
/// and old ones are returned the same way to be freed, so an answer takes no lock and never waits. A field that the
/// hand has already left is discarded. While no field contains the patch, answers come from the linear body and one
/// Newton step from its shape, with the factor K₀ of the whole body at rest:
///
///     u₀ = δ z,   F₀ = z·f(u₀),   s = −P K₀⁻¹ (f(u₀) − F₀ w),   q = s·f(u₀ + s) / s·f(u₀),
///     u = u₀ + s/(1 − q),         F = F₀ + (z·f(u₀ + s) − F₀)/(1 − q)
///
/// where z is the linear shape of unit depth, δ the depth, w the patch load, f the nonlinear forces (N), and P the
/// projection that keeps the depth. The error of F is of order δ⁴: within 1 % down to a/4 on block B1 (n = 8), where
/// the linear force is off by 15 %. If the step does not converge (ν = 0.499), its weight falls to zero and the linear
/// force remains, with a correspondingly larger error.
///
/// A cut discards everything built for the uncut body, including fields in progress. The next answer builds a field of
/// the cut body. With a background thread the field is requested instead, and the cut linear body answers until it
/// arrives.
///
/// When a field takes over, the force is continuous: the force ratio and the slope difference fade over a/4 of hand
/// motion, independent of time. Within one near field the force is the gradient of one energy. While a ratio fades it
/// is not: on different paths forth and back a hand may gain the difference times a/4, and this difference is included
/// in the error.
///
/// Reaction::error covers Newton's method and the approximations relative to the whole mesh: three times
/// NearBody::left_out() for the linear far field, and three times the largest excess stiffness of the modes over the
/// whole body, at five places of the near field.
class NearModel : public Model {
 public:
  struct Config {
    QuasiStaticModel::Config newton = {};
    int modes = NearBody::Config{}.modes;
  };
  /// Builds the near field of `first`. Solid and surface must outlive this object. Throws the errors of
  /// QuasiStaticModel.
  NearModel(const Solid& solid, const TouchSurface& surface, const Patch& first, const Config& config);
  /// Builds no field: `background` makes them (make_fields_by()), starting with the first answer.
  NearModel(const Solid& solid, const TouchSurface& surface, const Config& config, Background background);
  ~NearModel() override;

  /// Makes all further fields by `background`, one at a time; its tasks own a copy of the body. An exception in a task
  /// is rethrown by the next press().
  void make_fields_by(Background background);
  /// Abandons the field in progress and requests no more: the body is about to be cut.
  void make_no_more_fields();

  Reaction press(const Patch& patch, Given given, double value) override;
  /// To be called when a rung has answered instead. `room` is 1 far from the border of the rung's region and 0 at the
  /// border, where this model takes over. With a background thread the next field is requested as usual. Without one,
  /// nothing is built while `room` is 1; below 1 an answer makes a piece if the present field does not contain the
  /// patch, and more if `room` falls quickly, so that the field is complete at 0. No fading follows, since the previous
  /// force did not come from a field.
  void follow(const Patch& patch, const Reaction& felt, double room);
  void cut(const Division& division, const EffectsConfig& effects) override;
  /// The first answers are those of the cut body without a field, scaled by the nonlinear correction of the last force
  /// before the cut.
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  bool glides() const noexcept override { return true; }
  /// Includes the background thread's memory, but not a field in progress, which needs two numbers per unknown of the
  /// whole body and load (2 modes + 1 loads).
  std::size_t bytes() const noexcept override;

  /// The present near field (zero while a cut body has none), and counts since construction, also before cuts.
  struct Size {
    double radius = 0;         ///< ρ, m; 0: the whole body is near
    std::size_t elements = 0;  ///< near elements
    int interface = 0;         ///< unknowns of the nodes shared by near and far
    int modes = 0;             ///< that replace them
    int unknowns = 0;
    int made = 0;               ///< near fields used, including the first
    int pieces = 0;             ///< made by answers, including those of unfinished fields
    int late = 0;               ///< background fields that were discarded
    int linear = 0;             ///< answers without a field: linear body and one Newton step
    std::size_t elsewhere = 0;  ///< bytes kept by the background thread, part of bytes(); 0: no thread
  };
  Size size() const;

 private:
  /// The last answer.
  struct Hand {
    Patch patch;  ///< without curvatures
    Vec3 place = Vec3::Zero();
    Reaction felt;
  };
  struct Field;
  struct Making;
  struct Oracle;

  /// Begins a field around the patch, replacing the one in progress.
  void begin(const Patch& patch, double depth);
  /// Makes one piece of the field in progress, or as many as are due; all of them if `room` is 0.
  void go_on(const Patch& patch, const Vec3& place, double depth, double room);
  /// Advances or takes over a field for this patch.
  void make_or_take(const Patch& patch, const Vec3& place, double depth, double room);
  void keep(const Patch& patch, const Vec3& place, const Reaction& felt);
  void take_over(std::unique_ptr<Field> field);
  /// Discards the fields and the last patch position, which refer to the uncut body.
  void begin_cut();

  // With a background thread:
  void take_made(const Patch& patch, const Vec3& place, double depth);
  void ask();
  /// With the present field, or linear_press() if it does not contain the patch.
  Reaction press_by_field_or_linear(const Patch& patch, const Vec3& place, Given given, double value);
  /// The linear body and one Newton step from its shape.
  Reaction linear_press(const Patch& patch, Given given, double value) const;
  /// Difference between the last answer and linear_press() there.
  Handover beyond_linear() const;

  const Solid& solid_;
  const TouchSurface& surface_;
  Config config_;
  Factor at_rest_;  ///< of the whole body at rest
  Size size_;
  std::unique_ptr<Making> making_;  ///< the next field, or null
  std::unique_ptr<Field> field_;    ///< null if a cut body has none yet
  Hand last_;
  Handover handover_;
  double fading_over_ = 0;  ///< m, length of the fading
  double faded_ = 0;        ///< m, faded so far

  std::shared_ptr<Oracle> oracle_;  ///< null without a background thread
  Background background_;
  std::unique_ptr<Field> spent_;  ///< list of old fields to return to the background thread
  bool asked_ = false;
  bool by_linear_ = false;          ///< how the last answer was computed
  bool parted_ = false;             ///< the body has been cut
  int since_asked_ = 0;             ///< answers since the last request
  int last_took_ = 0;               ///< answers between request and use of the last field
  Vec3 per_answer_ = Vec3::Zero();  ///< m, hand motion per answer
};

}  // namespace tendon::softbody

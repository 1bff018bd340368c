// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "clients/softbody/background.h"
#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/near/near_body.h"

namespace tendon::softbody {

/// The difference between two methods where the second one takes over.
struct Handover {
  double ratio = 1;           ///< of the forces, before to after
  Vec2 slope = Vec2::Zero();  ///< before minus after
  double depth = 0;           ///< m, of the tool
};
Handover handover(const Reaction& before, const Reaction& after, double depth);

/// Returns `reaction` plus the share (0 … 1) of the difference. If the tool is less deep than at the handover, the
/// ratio of the forces is used, otherwise their difference.
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
  /// Builds the near field of `first`. `solid` and `surface` must outlive this object. Throws the errors of
  /// QuasiStaticModel.
  NearModel(const Solid& solid, const TouchSurface& surface, const Patch& first, const Config& config);
  /// Lets `background` build all near fields.
  NearModel(const Solid& solid, const TouchSurface& surface, const Config& config, Background background);
  ~NearModel() override;

  /// Lets `background` build the next fields, one at a time. The work owns a copy of the body. If it throws, the next
  /// press() rethrows the exception.
  void make_fields_by(Background background);
  /// Must be called before the body is cut.
  void make_no_more_fields();

  Reaction press(const Patch& patch, Given given, double value) override;
  /// Must be called if a rung has answered. `room` is 0 at the border of the rung and 1 far from it. The background
  /// thread makes fields as usual. Without it, answers build a field while `room` is below 1, so that it is complete at
  /// 0.
  void follow(const Patch& patch, const Reaction& felt, double room);
  void cut(const Division& division, const EffectsConfig& effects) override;
  /// The first answers are those of the cut body without a field, scaled by the nonlinear part of the last force.
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  bool glides() const noexcept override { return true; }
  /// Includes the background thread, but not a field that is being built. Such a field needs two numbers for each
  /// unknown and each of the 2 modes + 1 loads.
  std::size_t bytes() const noexcept override;

  /// The present near field, and counters since construction.
  struct Size {
    double radius = 0;  ///< ρ, m; 0 if the whole body is near
    std::size_t elements = 0;
    int interface = 0;  ///< unknowns on the boundary
    int modes = 0;      ///< number of modes that replace them
    int unknowns = 0;
    int made = 0;               ///< near fields that were used
    int pieces = 0;             ///< made by answers
    int late = 0;               ///< background fields that were discarded
    int linear = 0;             ///< answers without a field
    std::size_t elsewhere = 0;  ///< bytes of the background thread
  };
  Size size() const;

 private:
  struct Hand {
    Patch patch;  ///< without curvatures
    Vec3 place = Vec3::Zero();
    Reaction felt;
  };
  struct Field;
  struct Making;
  struct Oracle;

  /// Starts to build a field around the patch.
  void begin(const Patch& patch, double depth);
  /// Builds the pieces that are due. If `room` is 0, all of them are due.
  void go_on(const Patch& patch, const Vec3& place, double depth, double room);
  /// Builds or takes a field for the patch.
  void make_or_take(const Patch& patch, const Vec3& place, double depth, double room);
  void keep(const Patch& patch, const Vec3& place, const Reaction& felt);
  void take_over(std::unique_ptr<Field> field);
  void begin_cut();

  // With a background thread.
  void take_made(const Patch& patch, const Vec3& place, double depth);
  void ask();
  /// Uses linear_press() if the field does not contain the patch.
  Reaction press_by_field_or_linear(const Patch& patch, const Vec3& place, Given given, double value);
  /// Uses the linear body and one Newton step.
  Reaction linear_press(const Patch& patch, Given given, double value) const;
  /// Returns the difference between the last answer and linear_press().
  Handover beyond_linear() const;

  const Solid& solid_;
  const TouchSurface& surface_;
  Config config_;
  Factor at_rest_;  ///< of the whole body
  Size size_;
  std::unique_ptr<Making> making_;  ///< the next field
  std::unique_ptr<Field> field_;    ///< null if a cut body has none
  Hand last_;
  Handover handover_;
  double fading_over_ = 0;  ///< m
  double faded_ = 0;        ///< m

  std::shared_ptr<Oracle> oracle_;  ///< null if there is no background thread
  Background background_;
  std::unique_ptr<Field> spent_;  ///< to be freed by the background thread
  bool asked_ = false;
  bool by_linear_ = false;  ///< the last answer was linear_press()
  bool parted_ = false;
  int since_asked_ = 0;             ///< answers
  int last_took_ = 0;               ///< answers
  Vec3 per_answer_ = Vec3::Zero();  ///< m, motion of the hand
};

}  // namespace tendon::softbody

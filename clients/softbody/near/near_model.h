// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "clients/softbody/background.h"
#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/near/near_body.h"

namespace tendon::softbody {

/// The difference between the last answer of one method and the first answer of another.
struct Handover {
  double ratio = 1;           ///< force before / force after
  Vec2 slope = Vec2::Zero();  ///< before minus after
  double depth = 0;           ///< m, of the tool
};
Handover handover(const Reaction& before, const Reaction& after, double depth);

/// Returns `reaction` plus the share (0 … 1) of the difference. If the tool is less deep than at the handover, the
/// ratio of the forces is used, otherwise their difference.
Reaction kept(const Handover& before, double share, const Reaction& reaction);

/// Newton's method on a NearBody around the patch: large rotations and strains near the tool, and a linear body
/// elsewhere. The cost of an answer depends on the number of near elements.
///
/// The radius ρ of the near field is max(1.5 a, a + 2 elements), where a is the radius of the patch. It is at least 2 a
/// if ν > 0.45. The elements that the patch can touch within 0.45 a are also near. If the patch has moved by half of
/// this distance, a new field is built. If all elements are near, QuasiStaticModel is used.
///
/// Without a background thread, a field is linear about the shape at rest and is built in about 30 pieces: one per
/// answer, more if the hand moves by more than a/200 in an answer, and the rest at once if the hand leaves the old
/// field. No clock sets the number of pieces, so the answers are the same on every machine.
///
/// With make_fields_by(), a field is requested when the patch has moved or the depth has changed by a/10. The
/// background thread solves the whole body at a predicted position of the hand, and makes the field linear about this
/// shape. An atomic pointer transfers it, so that no answer waits or takes a lock; the background thread frees old
/// fields. Outside of a field, an answer is the linear shape and one Newton step with the factor K₀ at rest:
///
///     u₀ = δ z,   F₀ = z·f(u₀),   s = −P K₀⁻¹ (f(u₀) − F₀ w),   q = s·f(u₀ + s) / s·f(u₀),
///     u = u₀ + s/(1 − q),         F = F₀ + (z·f(u₀ + s) − F₀)/(1 − q)
///
/// z is the linear shape of unit depth, δ is the depth, w is the load of the patch, f are the nonlinear forces (N), and
/// P keeps the depth. The error of F is of the order δ⁴. It is less than 1 % down to a/4 for block B1 with n = 8, where
/// the error of the linear force is 15 %. If the step does not converge (ν = 0.499), its weight is reduced, and the
/// error is larger.
///
/// A cut discards all fields; the next answer builds or requests one. When a new field is used, the ratio of the forces
/// and the difference of the slopes decrease to zero while the hand moves by a/4. Meanwhile the force is not the
/// gradient of an energy, so a hand may gain the difference times a/4 on a closed path. Reaction::error includes this
/// difference, the error of Newton's method, three times NearBody::left_out(), and three times the error of the modes,
/// which is the largest excess of the stiffness at five positions.
class NearModel : public Model {
 public:
  struct Config {
    QuasiStaticModel::Config newton = {};
    int modes = NearBody::Config{}.modes;
  };
  /// Builds the near field of `first`. `solid` and `surface` must outlive this object. Throws as QuasiStaticModel does.
  NearModel(const Solid& solid, const TouchSurface& surface, const Patch& first, const Config& config);
  /// Builds all near fields in `background`.
  NearModel(const Solid& solid, const TouchSurface& surface, const Config& config, Background background);
  ~NearModel() override;

  /// Builds further fields one at a time, on a copy of the body. The next press() rethrows an exception of this work.
  void make_fields_by(Background background);
  void make_no_more_fields();  ///< must be called before the body is cut

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  /// Must be called if a level has answered. `room` is 0 at the border of the level, and 1 if the border is far. If
  /// there is no background thread, a field is built while `room` is less than 1, so that it is complete at 0.
  void follow(const Patch& patch, const Reaction& felt, double room);
  void cut(const Division& division, const EffectsConfig& effects) override;
  /// The first answers use the cut body without a field. They are scaled by the nonlinear part of the last force.
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  bool glides() const noexcept override { return true; }
  /// Includes the background thread, not a field being built: 2 numbers per unknown and each of 2 modes + 1 loads.
  std::size_t bytes() const noexcept override;

  /// The present near field, and counters since construction.
  struct Size {
    double radius = 0;  ///< ρ, m; 0 without a far field
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

  void begin(const Patch& patch, double depth);  ///< starts to build a field around the patch
  void go_on(const Patch& patch, const Vec3& place, double depth, double room);  ///< builds due pieces; all at room 0
  void make_or_take(const Patch& patch, const Vec3& place, double depth, double room);
  void keep(const Patch& patch, const Vec3& place, const Reaction& felt);
  void take_over(std::unique_ptr<Field> field);
  void begin_cut();

  // With a background thread.
  void take_made(const Patch& patch, const Vec3& place, double depth);
  void ask();
  Reaction press_by_field_or_linear(const Patch& patch, const Vec3& place, Prescribed given, double value);
  Reaction linear_press(const Patch& patch, Prescribed given, double value) const;  ///< linear body and one Newton step
  Handover beyond_linear() const;  ///< difference between the last answer and linear_press()

  const Solid& solid_;
  const TouchSurface& surface_;
  Config config_;
  Factor at_rest_;
  Size size_;
  std::unique_ptr<Making> making_;
  std::unique_ptr<Field> field_;  ///< null if a cut body has none
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
  int since_asked_ = 0;
  int last_took_ = 0;
  Vec3 per_answer_ = Vec3::Zero();  ///< m, motion of the hand
};

}  // namespace tendon::softbody

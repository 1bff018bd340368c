// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "clients/softbody/background.h"
#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/near/near_body.h"

namespace tendon::softbody {

/// How answers before one differ from those after it, where they meet.
struct Handover {
  double ratio = 1;           ///< of the force before to that after
  Vec2 slope = Vec2::Zero();  ///< that before minus that after
  double depth = 0;           ///< m, of the tool there
};
Handover handover(const Reaction& before, const Reaction& after, double depth);

/// The reaction that keeps `share` (0 … 1) of what was before, force, stiffness and slope alike. Less deep it is the
/// ratio of the forces that is kept, and deeper their difference. `error` adds what differs.
Reaction kept(const Handover& before, double share, const Reaction& reaction);

/// Large rotations and strains near the tool, a linear body elsewhere: Newton's method on a NearBody around the patch.
/// An answer costs what the near elements cost, whatever the size of the mesh.
///
/// The near field has the radius ρ = max(1.5 a, a + 2 elements) around the patch's place at rest, and 2 a at least where
/// ν > 0.45; a is the patch's radius. Beyond ρ it has what the patch touches on its way of 0.45 a to any side. When the
/// patch has gone half of this way, a near field around its place is begun. A body that is all near is the whole model,
/// QuasiStaticModel.
///
/// Without another thread a field is made in about 30 pieces, linear about the shape at rest: most are solutions by a
/// factor of the whole body, eight at a time, and the longest are the two factors of the near field. Each answer makes
/// one piece, and goes on by the old field. A hand that goes farther than a/200 with each answer has more pieces in an
/// answer, evenly over the way to 0.38 a. One that jumps out of the old field has all that are left, or a field of its
/// own, in that answer. Counts and places choose, and no clock: the answers are the same on every machine.
///
/// With make_fields_by() no answer makes a piece. Where the patch has gone half of its way, or a tenth of a deeper or
/// less deep than when the field was asked for, the other thread is asked for the next one. It presses the whole body
/// by Newton's method, and makes the field about this shape, ahead of the hand by the way that it goes meanwhile. What
/// is made goes through one atomic pointer, and fields that have served go back to be freed there: an answer takes no
/// lock and never waits. A field that the hand has left before it is whole is thrown away. While no field has the patch,
/// answers are those of the linear body and of one step of Newton's method from its shape, by the factor of the whole
/// body at rest K₀:
///
///     u₀ = δ z,   F₀ = z·f(u₀),   s = −P K₀⁻¹ (f(u₀) − F₀ w),   q = s·f(u₀ + s) / s·f(u₀),
///     u = u₀ + s/(1 − q),         F = F₀ + (z·f(u₀ + s) − F₀)/(1 − q)
///
/// with z the linear shape of unit depth δ, w the patch's load, f the forces by the law (N), and P what keeps the depth.
/// What F leaves out begins with δ⁴: on B1 (n = 8) it is within 1 % down to a/4, where the linear force is 15 % off. Where the
/// step leads nowhere (ν = 0.499), it counts less and less, and the linear force remains. The error says so.
///
/// A cut ends all that was made of the body before it. A field that is still being made about that body is thrown away,
/// wherever it is. The next answer makes one of the cut body; with another thread that is asked for one, and answers are
/// those of the cut linear body until it comes.
///
/// Where a field takes over, the force goes on from what was felt: the ratio of both forces fades over a way of the hand
/// of a/4, however long that takes, and so does the difference of the slopes. Within one near field the force is the
/// slope of one energy. While a ratio fades it is not: by going on and back over different ways a hand may gain the
/// difference times a/4, and answers say this difference as an error.
///
/// Reaction::error is of Newton's method, and of what the linear far field and the few modes leave out beside the whole
/// mesh: three times what NearBody::left_out() says that the far field's law adds to the force, and three times the
/// largest excess of stiffness over that of the whole body, of five places of the near field.
class NearModel : public Model {
 public:
  struct Config {
    QuasiStaticModel::Config newton = {};
    int modes = NearBody::Config{}.modes;
  };
  /// Makes the near field of `first`. Solid and surface must outlive this. Throws what QuasiStaticModel throws.
  NearModel(const Solid& solid, const TouchSurface& surface, const Patch& first, const Config& config);
  /// Makes no field: `background` makes them all, see make_fields_by(), and is asked with the first answer.
  NearModel(const Solid& solid, const TouchSurface& surface, const Config& config, Background background);
  ~NearModel() override;

  /// From now on the next fields are made by `background`, one at a time, by work that has a body of its own. Where the
  /// work throws, the next press() throws that.
  void make_fields_by(Background background);
  /// Gives up the field that the other thread makes, and asks for no more: the body is about to be cut.
  void make_no_more_fields();

  Reaction press(const Patch& patch, Given given, double value) override;
  /// Something else has answered, and will until `room` is 0; a hand far from there has a room of 1. The next field is made
  /// for that hand, as above, by the other thread. Without one nothing is made where the room is 1; below, an answer makes
  /// a piece of a field that the present one does not serve, and more where the room falls fast, so that it takes over
  /// before the room is 0. What is felt meanwhile is not of a field: where one takes over, nothing fades.
  void follow(const Patch& patch, const Reaction& felt, double room);
  void cut(const Division& division, const EffectsConfig& effects) override;
  /// The first answers are those of this body without a field, times what the law made of the last force before the cut.
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  bool glides() const noexcept override { return true; }
  /// With all that the other thread keeps. Without what is being made: two numbers for each unknown of the whole body and
  /// each of the 2 modes + 1 loads, for a while.
  std::size_t bytes() const noexcept override;

  /// The present near field, all zero while a cut body has none; and what was done since construction, before cuts
  /// included.
  struct Size {
    double radius = 0;         ///< ρ, m; 0: the whole body is near
    std::size_t elements = 0;  ///< near ones
    int interface = 0;         ///< unknowns of the nodes that near and far have in common
    int modes = 0;             ///< take their place
    int unknowns = 0;
    int made = 0;               ///< near fields that took over, the first included
    int pieces = 0;             ///< made by answers, also of fields that are not whole
    int late = 0;               ///< fields of the other thread that were thrown away
    int linear = 0;             ///< answers of the linear body and a step, where no field had the patch
    std::size_t elsewhere = 0;  ///< bytes that the other thread keeps, of bytes(); 0: there is none
  };
  Size size() const;

 private:
  /// What was answered last.
  struct Hand {
    Patch patch;  ///< without curvatures
    Vec3 place = Vec3::Zero();
    Reaction felt;
  };
  struct Field;
  struct Making;
  struct Oracle;

  /// A field around the patch, in place of what is being made.
  void begin(const Patch& patch, double depth);
  /// Does a piece of what is being made, or as many as are due where the present field cannot wait: with no room all.
  void go_on(const Patch& patch, const Vec3& place, double depth, double room);
  /// Comes nearer to a field for this patch, or takes it.
  void make_or_take(const Patch& patch, const Vec3& place, double depth, double room);
  void keep(const Patch& patch, const Vec3& place, const Reaction& felt);
  void take_over(std::unique_ptr<Field> field);
  /// Forgets the fields, and where the last patch was on the body before the cut.
  void begin_cut();

  // With another thread.
  void take_made(const Patch& patch, const Vec3& place, double depth);
  void ask();
  /// By the present field; where it does not have the patch, by linear_press().
  Reaction press_by_field_or_linear(const Patch& patch, const Vec3& place, Given given, double value);
  /// The linear body's, and one step of Newton's method from there.
  Reaction linear_press(const Patch& patch, Given given, double value) const;
  /// How what was felt last differs from linear_press() there.
  Handover beyond_linear() const;

  const Solid& solid_;
  const TouchSurface& surface_;
  Config config_;
  Factor at_rest_;  ///< of the whole body
  Size size_;
  std::unique_ptr<Making> making_;  ///< the next field, or null
  std::unique_ptr<Field> field_;    ///< null: a cut body has none yet
  Hand last_;
  Handover handover_;
  double fading_over_ = 0;  ///< m
  double faded_ = 0;        ///< m, of it

  std::shared_ptr<Oracle> oracle_;  ///< null: none
  Background background_;
  std::unique_ptr<Field> spent_;  ///< to be freed there, one behind the other
  bool asked_ = false;
  bool by_linear_ = false;          ///< the last answer was
  bool parted_ = false;             ///< the body has been cut
  int since_asked_ = 0;             ///< answers
  int last_took_ = 0;               ///< answers, from asking to taking
  Vec3 per_answer_ = Vec3::Zero();  ///< m, how far the hand goes
};

}  // namespace tendon::softbody

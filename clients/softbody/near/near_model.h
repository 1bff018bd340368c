// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/near/near_body.h"

namespace tendon::softbody {

/// Large rotations and strains near the tool, a linear body elsewhere: Newton's method on a NearBody around the patch.
/// An answer costs what the near elements cost, whatever the size of the mesh.
///
/// The near field has the radius ρ = max(1.5 a, a + 2 elements) around the patch's place at rest, and 2 a at least where
/// ν > 0.45; a is the patch's radius. Beyond ρ it has what the patch touches on its way of 0.45 a to any side. When the
/// patch has gone half of this way, a near field around its place is begun. It is made in about 30 pieces: most are
/// solutions by a factor of the whole body, eight at a time, and the longest are the two factors of the near field. Each
/// answer makes one piece, and goes on by the old field. When the new one is whole, the answers of both are blended over
/// a way of the hand of a/4, or as far as the old field has the patch, however long that takes.
///
/// A hand that goes farther than a/200 with each answer has more pieces in an answer, evenly over the way to 0.38 a.
/// One that jumps out of the old field has all that are left, or a field of its own, in that answer, and no blending.
/// Counts and places choose, and no clock: the answers are the same on every machine. A body that is all near is the
/// whole model, QuasiStaticModel.
///
/// Within one near field the force is the slope of one energy. Blended answers are not: by going on and back over
/// different ways a hand may gain their difference times a/4, and they say this difference as an error.
///
/// Reaction::error is of Newton's method, and of what the linear far field and the few modes leave out beside the whole
/// mesh: three times what NearBody::left_out() says that the far field's law adds to the force, and three times the
/// largest excess of stiffness over that of the whole body at first touch, of five places of the near field.
///
/// A BLAS need not allow two threads at once (OpenBLAS without threads does not), so that no thread makes fields.
class NearModel : public Model {
 public:
  struct Config {
    QuasiStaticModel::Config newton = {};
    int modes = NearBody::Config{}.modes;
  };
  /// Makes the near field of `first`. Solid and surface must outlive this. Throws what QuasiStaticModel throws.
  NearModel(const Solid& solid, const TouchSurface& surface, const Patch& first, const Config& config);
  ~NearModel() override;

  Reaction press(const Patch& patch, Given given, double value) override;
  bool glides() const noexcept override { return true; }
  /// Without what is being made: two numbers for each unknown of the whole body and each of the 2 modes + 1 loads, for a
  /// while.
  std::size_t bytes() const noexcept override;

  /// The present near field.
  struct Size {
    double radius = 0;         ///< ρ, m; 0: the whole body is near
    std::size_t elements = 0;  ///< near ones
    int interface = 0;         ///< unknowns of the nodes that near and far have in common
    int modes = 0;             ///< take their place
    int unknowns = 0;
    int made = 0;    ///< near fields since construction
    int pieces = 0;  ///< of such, also of those that are not whole
  };
  Size size() const;

 private:
  struct Field;
  struct Making;
  /// A field around the patch, in place of what is being made.
  void begin(const Patch& patch, double depth);
  /// Makes the field of `making`: pressed by the hand already, where that presses, with the factor of that shape.
  Pieces pieces_of(Making& making);
  /// Does a piece of what is being made, or all of them where the present field cannot wait.
  void go_on(const Patch& patch, double depth);

  const Solid& solid_;
  const TouchSurface& surface_;
  Config config_;
  Factor at_rest_;  ///< of the whole body
  int fields_ = 0;
  int pieces_ = 0;
  std::unique_ptr<Making> making_;  ///< the next field, or null
  std::unique_ptr<Field> field_;
  std::unique_ptr<Field> before_;  ///< the one before, while answers are blended; or null
  double blend_over_ = 0;          ///< m
  double blended_ = 0;             ///< m, of it
  Vec3 last_ = Vec3::Zero();       ///< m: the last patch's place, and how deep it was pressed
  double last_depth_ = 0;
};

/// The reaction whose force, and whose stiffness however a surface lies, are so far between those of two as `share`
/// (0 … 1) says. `error` adds how far they are apart.
Reaction blended(const Reaction& from, const Reaction& to, double share);

}  // namespace tendon::softbody

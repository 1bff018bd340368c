// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "clients/softbody/fem/material.h"

namespace tendon::softbody {

using Vec2 = Eigen::Vector2d;

/// Coulomb friction between a tool and a patch, with a small elastic range (Hayward & Armstrong 2000). A tangential
/// spring of constant stiffness connects the tool to an anchor, dragged so that |f| ≤ µ F for a normal force F.
/// Dragging only loses energy, and so does every closed path. The force does not deform the body. Thread-safe: no.
class Friction {
 public:
  Friction(double coefficient, double stiffness);  ///< `stiffness` in N/m; throws std::invalid_argument

  struct Drag {
    Vec2 force = Vec2::Zero();  ///< N, on the tool, tangential
    double stiffness = 0;       ///< N/m, −∂force/∂place
    double until_slip = 0;      ///< m, distance until the tool slides
  };
  /// Moves the tool to `place` (m). If `normal_force` (N) is not positive, the anchor is released.
  Drag move(const Vec2& place, double normal_force);
  void let_go() { anchor_.reset(); }

  std::size_t bytes() const noexcept { return sizeof *this; }

 private:
  double coefficient_;
  double stiffness_;
  std::optional<Vec2> anchor_;
};

/// Tangential stiffness (N/m) of a half space under a disc of `radius` a (m), no slip: 8 G a/(2 − ν) (Mindlin 1949).
double sideways_stiffness(const Material& material, double radius);

}  // namespace tendon::softbody

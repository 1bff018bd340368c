// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "clients/softbody/fem/material.h"

namespace tendon::softbody {

using Vec2 = Eigen::Vector2d;

/// Dry friction between a tool and the patch below it, after Coulomb with a little give (Hayward & Armstrong 2000): a
/// spring across the surface from the tool to an anchor, which is dragged along so that the spring never pulls with
/// more than
///
///     |f| ≤ µ F
///
/// F the force along the normal. The spring's stiffness is constant and its energy only ever lost to the dragging, so
/// on any closed way it takes energy and gives none. The body's own shape does not follow it aside.
///
/// Thread-safe: no.
class Friction {
 public:
  /// `coefficient` µ ≥ 0; `stiffness` N/m, above 0. Throws std::invalid_argument.
  Friction(double coefficient, double stiffness);

  struct Drag {
    Vec2 force = Vec2::Zero();  ///< N, on the tool, across
    double stiffness = 0;       ///< N/m, −∂force/∂place; 0 while it slides
    double until_slip = 0;      ///< m, how far the tool may go before it slides; 0 while it does
  };
  /// The tool is at `place` (m, across), pressed with `normal_force` N; where that is 0 or less it has let go.
  Drag move(const Vec2& place, double normal_force);
  void let_go() { anchor_.reset(); }

  std::size_t bytes() const noexcept { return sizeof *this; }

 private:
  double coefficient_;
  double stiffness_;
  std::optional<Vec2> anchor_;
};

/// What a half space gives way aside under a disc of `radius` m that does not slip: 8 G a/(2 − ν), N/m (Mindlin 1949).
double sideways_stiffness(const Material& material, double radius);

}  // namespace tendon::softbody

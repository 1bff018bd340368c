// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "clients/softbody/fem/material.h"

namespace tendon::softbody {

using Vec2 = Eigen::Vector2d;

/// Dry friction between a tool and the patch below it: Coulomb's, with a little elasticity (Hayward & Armstrong 2000).
/// A spring runs across the surface from the tool to an anchor. The anchor is dragged along, so that the spring never
/// pulls with more than
///
///     |f| ≤ µ F
///
/// where F is the force along the normal. The spring's stiffness is constant, and its energy is only lost, by dragging,
/// so on any closed path it takes energy and gives none. The body's shape does not follow it sideways.
///
/// Thread-safe: no.
class Friction {
 public:
  /// `coefficient` µ ≥ 0; `stiffness` N/m, above 0. Throws std::invalid_argument.
  Friction(double coefficient, double stiffness);

  struct Drag {
    Vec2 force = Vec2::Zero();  ///< N, on the tool, across
    double stiffness = 0;       ///< N/m, −∂force/∂place; 0 while it slides
    double until_slip = 0;      ///< m, how far the tool may go before it slides; 0 while it slides
  };
  /// Moves the tool to `place` (m, across), pressed with `normal_force` N. At 0 or less the tool has let go.
  Drag move(const Vec2& place, double normal_force);
  void let_go() { anchor_.reset(); }

  std::size_t bytes() const noexcept { return sizeof *this; }

 private:
  double coefficient_;
  double stiffness_;
  std::optional<Vec2> anchor_;
};

/// The sideways stiffness, N/m, of a half space under a disc of `radius` a (m) that does not slip: 8 G a/(2 − ν)
/// (Mindlin 1949).
double sideways_stiffness(const Material& material, double radius);

}  // namespace tendon::softbody

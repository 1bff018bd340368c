// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "clients/softbody/near/fallback_level.h"
#include "clients/softbody/near/press_grid.h"

namespace tendon::softbody {

/// The energy E(δ, c) of a body without memory, where δ is the depth and c is the position of the patch. Its
/// derivatives at a knot follow from a Reaction with the slope s and the glide t (tilting), M (curving) and D (giving):
///
///     ∂E/∂δ = F,   ∂E/∂c = −F s,   ∂²E/∂δ² = k,   ∂²E/∂δ∂c = −(k s + F t),
///     ∂²E/∂c² = k s sᵀ + F (s tᵀ + t sᵀ − M − F D)
///
/// Hermite interpolation is quintic in δ and bicubic in c. The force and the stiffness are derivatives of the
/// interpolated energy, so a closed path gives no energy.
struct TabulatedAnswers {
  PressGrid grid;
  static constexpr std::size_t kNumbers = 12;  ///< E, F and k in units of the grid, each with ∂x, ∂y, ∂x∂y
  std::vector<double> numbers{};
  std::vector<double> errors{};
};

TabulatedAnswers tabulate(const SolvedPresses& presses);  ///< the error is computed from the centers of the cells

struct TabulatedEnergy {
  double energy = 0;           ///< J
  double force = 0;            ///< N, ∂E/∂δ
  double stiffness = 0;        ///< N/m
  Vec2 across{0, 0};           ///< N, ∂E/∂c
  Vec2 mixed{0, 0};            ///< N/m, ∂²E/∂δ∂c
  Mat2 curves = Mat2::Zero();  ///< N/m, ∂²E/∂c²
};
TabulatedEnergy energy_at(const TabulatedAnswers& table, const PressGrid::Point& point);

class TabulatedLevel : public FallbackLevel {
 public:
  /// `tolerance` is the accepted relative error of the force.
  TabulatedLevel(TabulatedAnswers table, double tolerance);

  std::optional<Answer> press(const Patch& patch, double depth) const override;
  double room(const Vec2& middle, double depth) const override;
  Size size() const override;

 private:
  TabulatedAnswers table_;
  Trust trust_;
  Trust::Allowed allowed_;
  double tolerance_;
};

}  // namespace tendon::softbody

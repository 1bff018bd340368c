// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "clients/softbody/near/press_grid.h"
#include "clients/softbody/near/rung.h"

namespace tendon::softbody {

/// The energy of a body without memory under a patch, as a function of three numbers: E(depth δ, place c). At each knot of
/// a grid it is known with its slopes and the curvatures
///
///     ∂E/∂δ = F,   ∂E/∂c = −F s,   ∂²E/∂δ² = k,   ∂²E/∂δ∂c = −(k s + F t),
///     ∂²E/∂c² = k s sᵀ + F (s tᵀ + t sᵀ − M − F D)
///
/// of a Reaction (s its slope, t, M, D its glide). Between, it is quintic in the depth and bicubic across (Hermite), with
/// two continuous derivatives in the depth and one across. Force and stiffness are its derivatives, so that a closed way
/// gives nothing, whatever this is wrong by.
struct TabulatedAnswers {
  PressGrid grid;
  /// For each knot E, F and k in units of the grid, each with ∂x, ∂y, ∂x∂y, J.
  static constexpr std::size_t kNumbers = 12;
  std::vector<double> numbers{};
  std::vector<double> errors{};  ///< Trust::errors()
};

/// Answers in the middles of cells, which were solved too, tell how wrong it is. Nothing is known at a knot without its glide.
TabulatedAnswers tabulate(const SolvedPresses& presses);

/// E and its derivatives at a point of the grid, in SI units.
struct TabulatedEnergy {
  double energy = 0;           ///< J
  double force = 0;            ///< N, ∂E/∂δ
  double stiffness = 0;        ///< N/m
  Vec2 across{0, 0};           ///< N, ∂E/∂c
  Vec2 mixed{0, 0};            ///< N/m, ∂²E/∂δ∂c
  Mat2 curves = Mat2::Zero();  ///< N/m, ∂²E/∂c²
};
TabulatedEnergy energy_at(const TabulatedAnswers& table, const PressGrid::Point& point);

/// The table where its errors allow it: some microseconds for an answer.
class TabulatedRung : public Rung {
 public:
  /// `tolerance`: by how large a share of the force an answer may be wrong.
  TabulatedRung(TabulatedAnswers table, double tolerance);

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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// The presses that are solved at set-up: a square grid of tangential positions, a quarter of the patch radius apart,
/// with five depths each. A ring of positions beyond the requested square, and the last depths, serve the handover to
/// the next model (Trust).
struct PressGrid {
  Vec2 middle = Vec2::Zero();  ///< m, tangential
  double spacing = 0;          ///< m, between positions
  int around = 0;              ///< positions from the center to the edge; 2 around + 1 per side
  double step = 0;             ///< m, between depths; level 0 is rest
  static constexpr int kLevels = 5;

  /// Covers hands up to `reach` from the center along each axis.
  static PressGrid over(const Vec2& middle, double reach, double patch_radius);

  int side() const noexcept { return 2 * around + 1; }
  int places() const noexcept { return side() * side(); }
  int knots() const noexcept { return places() * (kLevels + 1); }
  int cells() const noexcept { return 4 * around * around * kLevels; }
  double deepest() const noexcept { return kLevels * step; }

  /// A knot is a position and depth, a cell the box between eight knots. Indices start at 0, with depth varying
  /// fastest.
  int knot(int i, int j, int level) const noexcept { return (i * side() + j) * (kLevels + 1) + level; }
  int cell(int i, int j, int level) const noexcept { return column(i, j) * kLevels + level; }
  /// Index of a column of cells over all depths. Integer arguments of place() are knots; half-integer ones are cell
  /// centers.
  int column(int i, int j) const noexcept { return i * 2 * around + j; }
  Vec2 place(double i, double j) const { return middle + spacing * Vec2(i - around, j - around); }

  /// A point of the grid: its cell and its coordinates in the cell, 0 … 1 (two tangential, depth).
  struct Point {
    int i;
    int j;
    int level;
    std::array<double, 3> in;
    int cell;
  };
  std::optional<Point> find(const Vec2& place, double depth) const;
  /// Trilinear interpolation: the eight knots of the cell and their weights.
  struct Corner {
    int knot;
    double share;
  };
  std::array<Corner, 8> corners(const Point& point) const;
  /// Cubic Lagrange interpolation: four knots per axis, around the cell or next to the edge of the grid, and their
  /// weights.
  std::array<Corner, 64> around_point(const Point& point) const;
};

/// The whole body's answer to one press.
struct SolvedPress {
  bool good = false;  ///< the patch is on the body, and Newton's method found the shape that continues those above
  double energy = 0;  ///< J
  Reaction reaction;
  VectorXd shape;  ///< m, free displacements; empty at rest, where only stiffness and tilting are known
};

/// Answers at every knot, and at the center of every cell. The latter have no shape or glide, and serve to validate
/// what was derived from the knots.
struct SolvedPresses {
  PressGrid grid;
  std::vector<SolvedPress> knots;
  std::vector<SolvedPress> middles;
  std::vector<double> at_rest{};  ///< N/m, initial stiffness above each cell center; 0: off the body
  /// Work done, in machine-independent counts.
  struct Work {
    int presses = 0;
    int steps = 0;    ///< Newton steps, each one solve with a factor
    int factors = 0;  ///< factorizations; each costs as much as many steps, more on finer meshes
  };
  Work work{};
};

/// Receives progress messages, one line without newline. May be null.
using Tell = std::function<void(std::string_view)>;

/// Solves the presses on the whole body by Newton's method, by increasing depth. A press starts from the extrapolation
/// of the shapes above it, scaled by what its neighbor needed; a cell center starts from the cubic interpolation of the
/// knots. This keeps to one branch if a body has several equilibria. A factor is kept until the extra steps it causes
/// cost as much as a new one. A press whose force does not follow from the one above, given both stiffnesses, is not
/// `good`: the body has changed to another branch. Positions below it are skipped, and so are cell centers between such
/// knots and positions where two neighbors failed.
///
/// `glides`: computes the glide at the knots, which tabulate() needs, for as many solves as all the rest.
///
/// Throws std::invalid_argument if no grid position is on the body, and the errors of QuasiStaticModel.
SolvedPresses solve_presses(const Solid& solid, const TouchSurface& surface, const PressGrid& grid, bool glides,
                            const Tell& tell);

/// The relative error of a rung for each cell of a grid, and thereby where it may answer.
///
/// Thread-safe: yes, after construction. Realtime-safe: only Allowed::share() and room().
class Trust {
 public:
  /// Relative force errors at the knots and cell centers; negative: no answer.
  Trust(const PressGrid& grid, const std::vector<double>& at_knots, const std::vector<double>& in_middles);
  /// From stored errors().
  Trust(const PressGrid& grid, std::vector<double> errors) : grid_(grid), errors_(std::move(errors)) {}

  const PressGrid& grid() const noexcept { return grid_; }
  /// Relative force error per cell: the maximum over its corners and the surrounding cell centers, with a safety
  /// factor. ∞: unknown.
  const std::vector<double>& errors() const noexcept { return errors_; }

  /// For answers with a relative error up to `tolerance`: share() is 1 where all surrounding cells are that accurate, 0
  /// where one is not, and piecewise linear in between, so that the force is continuous at the handover.
  class Allowed {
   public:
    Allowed(const Trust& trust, double tolerance);
    double share(const PressGrid::Point& point) const;
    /// Distance to where share() begins to fall: 0 there, 1 one cell away or farther, and linear in between.
    double room(const PressGrid::Point& point) const;
    int cells() const noexcept { return cells_; }  ///< accurate cells

   private:
    double share_of(const std::vector<bool>& knots, const PressGrid::Point& point) const;

    PressGrid grid_;
    std::vector<bool> at_knots_;
    std::vector<bool> amid_;  ///< knots surrounded by accurate knots only
    int cells_ = 0;
  };

 private:
  PressGrid grid_;
  std::vector<double> errors_;
};

}  // namespace tendon::softbody

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

/// Where a body is pressed at set-up, so that later presses between can be answered faster: a square of places across, a
/// quarter of the patch's radius apart, and five depths below each. Beyond the square that is asked for there is a ring of
/// places more: over it, and over the last depths, another way of answering takes over (Trust).
struct PressGrid {
  Vec2 middle = Vec2::Zero();  ///< m, across
  double spacing = 0;          ///< m, between two places
  int around = 0;              ///< places from the middle to the rim: 2 around + 1 on a side
  double step = 0;             ///< m, between two depths; the first is that of rest, 0
  static constexpr int kLevels = 5;

  /// For hands that go as far as `reach` from the middle along each axis.
  static PressGrid over(const Vec2& middle, double reach, double patch_radius);

  int side() const noexcept { return 2 * around + 1; }
  int places() const noexcept { return side() * side(); }
  int knots() const noexcept { return places() * (kLevels + 1); }
  int cells() const noexcept { return 4 * around * around * kLevels; }
  double deepest() const noexcept { return kLevels * step; }

  /// A knot is a place and a depth, a cell what is between eight of them. Both have numbers from 0, depths first.
  int knot(int i, int j, int level) const noexcept { return (i * side() + j) * (kLevels + 1) + level; }
  int cell(int i, int j, int level) const noexcept { return column(i, j) * kLevels + level; }
  /// The cells below each other, too. A place is that of a knot; with 0.5 more that of a cell's middle.
  int column(int i, int j) const noexcept { return i * 2 * around + j; }
  Vec2 place(double i, double j) const { return middle + spacing * Vec2(i - around, j - around); }

  /// A point of the grid: its cell, and how far in it, 0 … 1 along each axis (place, place, depth).
  struct Point {
    int i;
    int j;
    int level;
    std::array<double, 3> in;
    int cell;
  };
  std::optional<Point> find(const Vec2& place, double depth) const;
  /// The eight knots of a cell, and what each counts for at a point of it (trilinear).
  struct Corner {
    int knot;
    double share;
  };
  std::array<Corner, 8> corners(const Point& point) const;
  /// Four knots in a row along each axis, around the point's cell or next to the rim, and what each counts for (cubic,
  /// Lagrange).
  std::array<Corner, 64> around_point(const Point& point) const;
};

/// The whole body's answer to one press.
struct SolvedPress {
  bool good = false;  ///< the patch is on the body, and Newton's method found the shape that goes on from those above
  double energy = 0;  ///< J
  Reaction reaction;
  VectorXd shape;  ///< m, free displacements; empty at rest: stiffness and tilting are known there
};

/// The answers at every knot and in the middle of every cell; these have neither shape nor glide, and what was learned from
/// the knots is judged by them.
struct SolvedPresses {
  PressGrid grid;
  std::vector<SolvedPress> knots;
  std::vector<SolvedPress> middles;
  std::vector<double> at_rest{};  ///< N/m, the stiffness at first touch above each cell's middle; 0: off the body
  /// What they took, in counts that are the same everywhere.
  struct Work {
    int presses = 0;
    int steps = 0;    ///< of Newton's method, each a solution with a factor
    int factors = 0;  ///< each as much work as many steps, and the more the finer the mesh
  };
  Work work{};
};

/// What long work says: a line without an end. Null: nobody listens.
using Tell = std::function<void(std::string_view)>;

/// By Newton's method on the whole body, depth after depth. A press begins where the shapes above it go on to, as far as its
/// neighbour's did, and in a cell's middle at the cubic between the knots: so it ends next to them where a body has more
/// shapes of rest than one. One factor serves until the steps that it costs more than a new one would are as much work as
/// that. A press whose force does not go on from the one above, as the stiffness of both says, is not good: the body has come
/// to another shape. Below it nothing is pressed, nor in a middle between such knots, nor where two neighbours failed.
///
/// `glides`: the answers at the knots have their glide, which tabulate() needs. It takes as many solutions as the rest.
///
/// Throws std::invalid_argument when no place of the grid is on the body, and what QuasiStaticModel throws.
SolvedPresses solve_presses(const Solid& solid, const TouchSurface& surface, const PressGrid& grid, bool glides,
                            const Tell& tell);

/// How wrong a way of answering is, cell by cell of a grid, and so where it may answer.
///
/// Thread-safe: yes, once built. Realtime-safe: Allowed::share() and room() are.
class Trust {
 public:
  /// `at_knots` and `in_middles`: by how large a share of the force an answer was wrong there; negative: it was none.
  Trust(const PressGrid& grid, const std::vector<double>& at_knots, const std::vector<double>& in_middles);
  /// As errors() told it.
  Trust(const PressGrid& grid, std::vector<double> errors) : grid_(grid), errors_(std::move(errors)) {}

  const PressGrid& grid() const noexcept { return grid_; }
  /// Of the force, for each cell: the largest at its corners and in the middles around, and a safety. ∞: not known.
  const std::vector<double>& errors() const noexcept { return errors_; }

  /// For answers that may be wrong by the share `tolerance`: 1 where every cell around is that good, 0 where one is not,
  /// and evenly between; so that nothing jumps where another way takes over.
  class Allowed {
   public:
    Allowed(const Trust& trust, double tolerance);
    double share(const PressGrid::Point& point) const;
    /// 0 where share() begins to fall, 1 a cell away from there and farther, and evenly between.
    double room(const PressGrid::Point& point) const;
    int cells() const noexcept { return cells_; }  ///< that are good

   private:
    double share_of(const std::vector<bool>& knots, const PressGrid::Point& point) const;

    PressGrid grid_;
    std::vector<bool> at_knots_;
    std::vector<bool> amid_;  ///< knots that have such knots alone around them
    int cells_ = 0;
  };

 private:
  PressGrid grid_;
  std::vector<double> errors_;
};

}  // namespace tendon::softbody

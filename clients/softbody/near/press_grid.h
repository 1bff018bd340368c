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

/// The presses that are solved in advance: a square grid of positions at steps of a quarter of the patch radius, with
/// five depths each. The outer ring and the last depth are for the transition to the next model (Trust).
struct PressGrid {
  Vec2 middle = Vec2::Zero();  ///< m, tangential
  double spacing = 0;          ///< m
  int around = 0;              ///< positions between the center and the edge
  double step = 0;             ///< m, between depths
  static constexpr int kLevels = 5;

  static PressGrid over(const Vec2& middle, double reach, double patch_radius);  ///< hands within `reach` (m) per axis

  int side() const noexcept { return 2 * around + 1; }
  int places() const noexcept { return side() * side(); }
  int knots() const noexcept { return places() * (kLevels + 1); }
  int cells() const noexcept { return 4 * around * around * kLevels; }
  double deepest() const noexcept { return kLevels * step; }

  /// A knot is a position with a depth. A cell is between eight knots.
  int knot(int i, int j, int level) const noexcept { return (i * side() + j) * (kLevels + 1) + level; }
  int cell(int i, int j, int level) const noexcept { return column(i, j) * kLevels + level; }
  /// The index of a column of cells. place() accepts half steps for the centers of cells.
  int column(int i, int j) const noexcept { return i * 2 * around + j; }
  Vec2 place(double i, double j) const { return middle + spacing * Vec2(i - around, j - around); }

  struct Point {  // a cell, and the coordinates 0 … 1 in the cell (position, position, depth)
    int i;
    int j;
    int level;
    std::array<double, 3> in;
    int cell;
  };
  std::optional<Point> find(const Vec2& place, double depth) const;
  struct Corner {  // a knot of a cell with its trilinear weight
    int knot;
    double share;
  };
  std::array<Corner, 8> corners(const Point& point) const;
  /// The knots around the cell, four along each axis, with the weights of cubic Lagrange interpolation.
  std::array<Corner, 64> around_point(const Point& point) const;
};

struct SolvedPress {  // the answer of the whole body to one press
  bool good = false;  ///< Newton's method has found the expected shape
  double energy = 0;  ///< J
  Reaction reaction;
  VectorXd shape;  ///< m, free
};

struct SolvedPresses {  // at all knots, and at the centers of all cells for validation
  PressGrid grid;
  std::vector<SolvedPress> knots;
  std::vector<SolvedPress> middles;
  std::vector<double> at_rest{};  ///< N/m at the centers of cells; 0 if the position is not on the body
  struct Work {
    int presses = 0;
    int steps = 0;
    int factors = 0;
  };
  Work work{};
};

using Tell = std::function<void(std::string_view)>;  ///< receives the progress as text

/// Solves all presses on the whole body by Newton's method, from small to large depths. Each press starts from the
/// extrapolation of the shapes above it, and each center of a cell from the cubic interpolation of the knots, so that
/// all solutions are on the same branch. A factor is used again until this costs more steps than a new factor. If a
/// force does not follow from the press above, the body has changed to another branch; the press is not `good`, and
/// deeper ones are skipped. `glides` computes Reaction::glide, which doubles the number of solves. Throws
/// std::invalid_argument if no position is on the body, and the errors of QuasiStaticModel.
SolvedPresses solve_presses(const Solid& solid, const TouchSurface& surface, const PressGrid& grid, bool glides,
                            const Tell& tell);

/// The relative error of a level in each cell.
/// Thread-safe: yes, after construction. Realtime-safe: only Allowed::share() and room().
class Trust {
 public:
  /// The relative errors of the force. A negative value means that there is no answer.
  Trust(const PressGrid& grid, const std::vector<double>& at_knots, const std::vector<double>& in_middles);
  Trust(const PressGrid& grid, std::vector<double> errors) : grid_(grid), errors_(std::move(errors)) {}

  const PressGrid& grid() const noexcept { return grid_; }
  /// The maximum error around each cell, with a safety factor. Infinite if it is unknown.
  const std::vector<double>& errors() const noexcept { return errors_; }
  /// The largest finite error of the cells that contain a point. Several do at a border, where rounding decides in which
  /// cell PressGrid::find() puts the point.
  double error(const PressGrid::Point& point) const;

  /// The answers with a relative error of at most `tolerance`. share() is 1 if all cells around a point are accurate
  /// and 0 at inaccurate cells, and is continuous.
  class Allowed {
   public:
    Allowed(const Trust& trust, double tolerance);
    double share(const PressGrid::Point& point) const;
    double room(const PressGrid::Point& point) const;  ///< 1 if all cells around are accurate, 0 where share() falls
    int cells() const noexcept { return cells_; }

   private:
    double share_of(const std::vector<bool>& knots, const PressGrid::Point& point) const;

    PressGrid grid_;
    std::vector<bool> at_knots_;
    std::vector<bool> amid_;  ///< knots between accurate knots
    int cells_ = 0;
  };

 private:
  PressGrid grid_;
  std::vector<double> errors_;
};

}  // namespace tendon::softbody

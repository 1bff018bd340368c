// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/press_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "clients/softbody/models/quasi_static.h"

namespace tendon::softbody {
namespace {

/// Places are at most so many radii of the patch apart, and depths so many. Shapes a quarter of a radius apart have all
/// between them to some thousandths of the force; five depths of 0.07 go as far as a patch should be pressed, 0.3, and
/// leave the last of them for what takes over.
constexpr double kPlaceApart = 0.25;
constexpr double kDepthApart = 0.07;

/// Solutions are better than the answers that are learned from them.
constexpr double kSolvedTo = 1e-6;
constexpr double kSolvedWellEnough = 1e-4;
constexpr int kMostIterations = 200;

/// So much more than what was seen in the middle of cells and at their corners may an answer between be wrong.
constexpr double kUnseenBetween = 2;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Presses one body again and again, from shape to shape.
class Presser {
 public:
  Presser(const Solid& solid, const TouchSurface& surface)
      : solid_(solid), model_(solid, surface, {.max_iterations = kMostIterations, .tolerance = kSolvedTo}) {}

  SolvedPress press(const std::optional<Patch>& patch, double depth, double step) {
    SolvedPress solved;
    if (!patch) return solved;
    take(*patch, depth, solved);
    if (!solved.good) {  // from rest, in small steps
      model_.set_displacements(VectorXd::Zero(solid_.size()));
      const int steps = static_cast<int>(std::ceil(2 * depth / step));
      for (int i = 1; i <= steps; ++i) take(*patch, depth * i / steps, solved);
    }
    if (!solved.good) model_.set_displacements(VectorXd::Zero(solid_.size()));
    return solved;
  }

  /// At rest, before the first press.
  SolvedPress touch(const std::optional<Patch>& patch, const Vec3& normal) const {
    SolvedPress solved;
    if (!patch) return solved;
    const VectorXd load = solid_.to_free(patch_load(solid_, normal, *patch));
    VectorXd shape = VectorXd::Zero(solid_.size());
    solid_.add_free(VectorXd(model_.factor().solve(load)), shape);
    solved.reaction.stiffness = 1 / depth_below(*patch, normal, shape);
    solved.reaction.glide.tilting = solved.reaction.stiffness * slope_below(*patch, normal, shape);
    solved.good = true;
    return solved;
  }

  /// The same press with a factor of its shape: stiffness and glide are then exact.
  void sharpen(const Patch& patch, double depth, SolvedPress& solved) {
    model_.renew_factor();
    model_.forget_forces();
    take(patch, depth, solved);
  }

  VectorXd shape() const { return solid_.to_free(model_.displacements()); }

 private:
  void take(const Patch& patch, double depth, SolvedPress& solved) {
    solved.reaction = model_.press(patch, Given::kDepth, depth);
    solved.energy = model_.forces().energy;
    solved.good = solved.reaction.force > 0 && solved.reaction.error <= kSolvedWellEnough * solved.reaction.force &&
                  solved.reaction.knows_glide && std::isfinite(solved.energy);
  }

  const Solid& solid_;
  QuasiStaticModel model_;
};

}  // namespace

PressGrid PressGrid::over(const Vec2& middle, double reach, double patch_radius) {
  const int places = std::max(1, static_cast<int>(std::ceil(reach / (kPlaceApart * patch_radius) - 1e-9)));
  return {.middle = middle, .spacing = reach / places, .around = places + 1, .step = kDepthApart * patch_radius};
}

std::optional<PressGrid::Point> PressGrid::find(const Vec2& place, double depth) const {
  const Vec2 at = (place - middle) / spacing + Vec2::Constant(around);
  const double down = depth / step;
  const double last = 2 * around;
  if (!(at.minCoeff() >= 0 && at.maxCoeff() <= last && down >= 0 && down <= kLevels)) return std::nullopt;
  Point point{};
  point.i = std::min(static_cast<int>(at.x()), 2 * around - 1);
  point.j = std::min(static_cast<int>(at.y()), 2 * around - 1);
  point.level = std::min(static_cast<int>(down), kLevels - 1);
  point.in = {at.x() - point.i, at.y() - point.j, down - point.level};
  point.cell = cell(point.i, point.j, point.level);
  return point;
}

std::array<PressGrid::Corner, 8> PressGrid::corners(const Point& point) const {
  std::array<Corner, 8> all{};
  for (int c = 0; c < 8; ++c) {
    const int x = c / 4;
    const int y = c / 2 % 2;
    const int z = c % 2;
    const auto along = [&](int axis, int far) {
      const double in = point.in[static_cast<std::size_t>(axis)];
      return far != 0 ? in : 1 - in;
    };
    all[static_cast<std::size_t>(c)] = {knot(point.i + x, point.j + y, point.level + z),
                                        along(0, x) * along(1, y) * along(2, z)};
  }
  return all;
}

SolvedPresses solve_presses(const Solid& solid, const TouchSurface& surface, const PressGrid& grid, const Tell& tell) {
  SolvedPresses all{.grid = grid, .knots = {}, .middles = {}, .at_rest = {}};
  all.knots.resize(at(grid.knots()));
  all.middles.resize(at(grid.cells()));
  const int side = grid.side();
  const int columns = grid.places() + (side - 1) * (side - 1);
  int done = 0;
  const auto told = [&] {
    if (tell) {
      tell("pressing the body: " + std::to_string(++done) + " of " + std::to_string(columns) + " places");
    }
  };
  // To and fro, down and up: each press is next to the one before.
  Presser presser(solid, surface);
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      all.knots[at(grid.knot(i, j, 0))] = presser.touch(surface.patch(grid.place(i, j)), surface.normal());
    }
  }
  for (int i = 0; i + 1 < side; ++i) {
    for (int j = 0; j + 1 < side; ++j) {
      const auto patch = surface.patch(grid.place(i + 0.5, j + 0.5));
      all.at_rest.push_back(presser.touch(patch, surface.normal()).reaction.stiffness);
    }
  }
  bool down = true;
  int good = 0;
  const auto order = [](int i, int k, int count) { return i % 2 == 0 ? k : count - 1 - k; };
  for (int i = 0; i < side; ++i) {
    for (int k = 0; k < side; ++k) {
      const int j = order(i, k, side);
      const auto patch = surface.patch_with_curvatures(grid.place(i, j));
      for (int step = 0; step < PressGrid::kLevels; ++step) {
        const int level = down ? step + 1 : PressGrid::kLevels - step;
        SolvedPress& solved = all.knots[at(grid.knot(i, j, level))];
        solved = presser.press(patch, level * grid.step, grid.step);
        if (solved.good) presser.sharpen(*patch, level * grid.step, solved);
        if (!solved.good) continue;
        solved.shape = presser.shape();
        ++good;
      }
      down = !down;
      told();
    }
  }
  if (good == 0) throw std::invalid_argument("of all places to learn from none is on the body");
  for (int i = 0; i + 1 < side; ++i) {
    for (int k = 0; k + 1 < side; ++k) {
      const int j = order(i, k, side - 1);
      const auto patch = surface.patch_with_curvatures(grid.place(i + 0.5, j + 0.5));
      for (int step = 0; step < PressGrid::kLevels; ++step) {
        const int level = down ? step : PressGrid::kLevels - 1 - step;
        all.middles[at(grid.cell(i, j, level))] = presser.press(patch, (level + 0.5) * grid.step, grid.step);
      }
      down = !down;
      told();
    }
  }
  return all;
}

Trust::Trust(const PressGrid& grid, const std::vector<double>& at_knots, const std::vector<double>& in_middles)
    : grid_(grid), errors_(at(grid.cells())) {
  const int last = 2 * grid.around;
  const auto worse = [](double& error, double seen) { error = std::max(error, seen < 0 ? kInfinite : seen); };
  for (int i = 0; i < last; ++i) {
    for (int j = 0; j < last; ++j) {
      for (int level = 0; level < PressGrid::kLevels; ++level) {
        double& error = errors_[at(grid.cell(i, j, level))];
        for (int c = 0; c < 8; ++c) {
          worse(error, at_knots[at(grid.knot(i + c / 4, j + c / 2 % 2, level + c % 2))]);
        }
        // The middles around tell how fast it changes; where one of them is none, only the cell itself must be good.
        worse(error, in_middles[at(grid.cell(i, j, level))]);
        for (int c = 0; c < 27; ++c) {
          const int x = i + c / 9 - 1;
          const int y = j + c / 3 % 3 - 1;
          const int z = level + c % 3 - 1;
          if (x < 0 || y < 0 || z < 0 || x >= last || y >= last || z >= PressGrid::kLevels) continue;
          error = std::max(error, in_middles[at(grid.cell(x, y, z))]);
        }
        error *= kUnseenBetween;
      }
    }
  }
}

Trust::Allowed::Allowed(const Trust& trust, double tolerance)
    : grid_(trust.grid()), at_knots_(at(grid_.knots()), true) {
  const int last = 2 * grid_.around;
  for (int i = 0; i <= last; ++i) {
    for (int j = 0; j <= last; ++j) {
      // Nothing is known beyond the rim and below the last depth; above the first one nothing touches.
      const bool rim = i == 0 || j == 0 || i == last || j == last;
      for (int level = 0; level <= PressGrid::kLevels; ++level) {
        if (rim || level == PressGrid::kLevels) at_knots_[at(grid_.knot(i, j, level))] = false;
      }
    }
  }
  for (int i = 0; i < last; ++i) {
    for (int j = 0; j < last; ++j) {
      for (int level = 0; level < PressGrid::kLevels; ++level) {
        if (trust.errors()[at(grid_.cell(i, j, level))] <= tolerance) {
          ++cells_;
          continue;
        }
        for (int c = 0; c < 8; ++c) at_knots_[at(grid_.knot(i + c / 4, j + c / 2 % 2, level + c % 2))] = false;
      }
    }
  }
  amid_ = at_knots_;
  for (int i = 1; i < last; ++i) {  // those of the rim are none already
    for (int j = 1; j < last; ++j) {
      for (int level = 0; level < PressGrid::kLevels; ++level) {
        for (int c = 0; c < 27; ++c) {
          const int z = level + c % 3 - 1;
          if (z < 0 || at_knots_[at(grid_.knot(i + c / 9 - 1, j + c / 3 % 3 - 1, z))]) continue;
          amid_[at(grid_.knot(i, j, level))] = false;
        }
      }
    }
  }
}

double Trust::Allowed::share_of(const std::vector<bool>& knots, const PressGrid::Point& point) const {
  double share = 1;  // exactly, among good ones
  for (const auto& [knot, counts] : grid_.corners(point)) share -= knots[at(knot)] ? 0 : counts;
  return std::max(0.0, share);
}

double Trust::Allowed::share(const PressGrid::Point& point) const { return share_of(at_knots_, point); }
double Trust::Allowed::room(const PressGrid::Point& point) const { return share_of(amid_, point); }

}  // namespace tendon::softbody

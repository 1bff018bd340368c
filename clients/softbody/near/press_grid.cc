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

/// The maximum steps in patch radii. With these positions, the relative error of interpolated forces is about 1e-3.
/// Five depths of 0.07 are sufficient for the maximum depth of a patch, 0.3, and for the transition.
constexpr double kPlaceApart = 0.25;
constexpr double kDepthApart = 0.07;

/// The error of the force is 2e-6, as it includes the last step, and that of the stiffness about kTangentTo².
constexpr double kSolvedTo = 1e-5;
constexpr double kTangentTo = 1e-3;
constexpr double kSolvedWellEnough = 1e-4;
constexpr int kMostIterations = 60;

constexpr int kSmallSteps = 4;  ///< if a press does not converge, it is repeated in this number of steps

constexpr int kStepsOfFactor = 30;  ///< cost of a factor, in steps

/// If a force differs from its extrapolation by more than this fraction, the body is on another branch.
constexpr double kGoesOn = 0.05;

constexpr double kUnseenBetween = 2;  ///< safety factor for points between knots and centers

constexpr double kOnBorder = 1e-9;  ///< maximum distance from a border of a cell, relative to its size

constexpr double kInfinite = std::numeric_limits<double>::infinity();

class Presser {
 public:
  Presser(const Solid& solid, const TouchSurface& surface)
      : solid_(solid),
        model_(solid, surface, {.max_iterations = kMostIterations, .tolerance = kSolvedTo, .tangent = kTangentTo}) {}

  /// Must be called before the first press. `shape` is the shape of unit depth.
  SolvedPress touch(const std::optional<Patch>& patch, const Vec3& normal, VectorXd& shape) const {
    SolvedPress solved;
    if (!patch) return solved;
    const VectorXd load = solid_.to_free(patch_load(solid_, normal, *patch));
    shape = model_.factor().solve(load);
    const VectorXd all = displaced(shape);
    solved.reaction.stiffness = 1 / depth_below(*patch, normal, all);
    solved.reaction.glide.tilting = solved.reaction.stiffness * slope_below(*patch, normal, all);
    shape *= solved.reaction.stiffness;
    solved.good = true;
    return solved;
  }

  SolvedPress press(const Patch& patch, double depth, const VectorXd& start) {
    const int factors = model_.factors();
    if (lost_) {
      model_.set_displacements(displaced(start));
    } else {
      model_.move(start - shape());
      if (wasted_ >= kStepsOfFactor) model_.renew_factor();
    }
    SolvedPress solved;
    solved.reaction = model_.press(patch, Prescribed::kDepth, depth);
    solved.energy = model_.forces().energy;
    solved.good = solved.reaction.force > 0 && solved.reaction.error <= kSolvedWellEnough * solved.reaction.force &&
                  (solved.reaction.knows_glide || patch.curvatures.size() == 0) && std::isfinite(solved.energy);
    lost_ = !solved.good;
    const int steps = model_.iterations();
    const bool fresh = model_.factors() > factors;
    least_ = fresh ? steps : std::min(least_, steps);
    wasted_ = fresh ? 0 : wasted_ + steps - least_;
    ++work_.presses;
    work_.steps += steps;
    work_.factors = model_.factors();
    return solved;
  }

  void leave() { lost_ = true; }  // the next press does not use the present state

  VectorXd shape() const { return solid_.to_free(model_.displacements()); }
  Eigen::Index size() const { return solid_.free_count(); }
  const SolvedPresses::Work& work() const noexcept { return work_; }

 private:
  VectorXd displaced(const VectorXd& free) const {
    VectorXd all = VectorXd::Zero(solid_.size());
    solid_.add_free(free, all);
    return all;
  }

  const Solid& solid_;
  QuasiStaticModel model_;
  SolvedPresses::Work work_{};
  bool lost_ = false;
  int least_ = kMostIterations;  ///< best number of steps with this factor
  int wasted_ = 0;               ///< additional steps with this factor
};

class KnotPresses {
 public:
  KnotPresses(const TouchSurface& surface, const PressGrid& grid, Presser& presser, std::vector<SolvedPress>& all)
      : surface_(surface), grid_(grid), presser_(presser), all_(all), first_(at(grid.places())) {
    for (int i = 0; i < grid.side(); ++i) {
      for (int j = 0; j < grid.side(); ++j) {
        VectorXd& first = first_[at(place(i, j))];
        of(i, j, 0) = presser.touch(surface.patch(grid.place(i, j)), surface.normal(), first);
        first *= grid.step;
      }
    }
  }

  void press(int i, int j, int level, bool glides) {
    const SolvedPress& above = of(i, j, level - 1);
    const SolvedPress* const beside = j > 0 ? &of(i, j - 1, level) : nullptr;
    const SolvedPress* const behind = i > 0 ? &of(i - 1, j, level) : nullptr;
    const bool among_bad = beside != nullptr && behind != nullptr && !beside->good && !behind->good;
    if (!above.good || among_bad) return;
    VectorXd start = foreseen(i, j, level);
    if (beside != nullptr && beside->good) {
      start += beside->shape - foreseen(i, j - 1, level);
    } else if (behind != nullptr && behind->good) {
      start += behind->shape - foreseen(i - 1, j, level);
    }
    const Vec2 middle = grid_.place(i, j);
    const auto patch = glides ? surface_.patch_with_curvatures(middle) : surface_.patch(middle);
    SolvedPress solved = presser_.press(*patch, level * grid_.step, start);
    if (!solved.good) {
      VectorXd from = level > 1 ? above.shape : VectorXd::Zero(start.size());
      for (int small = 1; small <= kSmallSteps; ++small) {
        solved = presser_.press(*patch, (level - 1 + small / double{kSmallSteps}) * grid_.step, from);
        if (!solved.good) return;
        from = presser_.shape();
      }
    }
    solved.good = goes_on(above.reaction, solved.reaction);
    if (!solved.good) {
      presser_.leave();
      return;
    }
    solved.shape = presser_.shape();
    of(i, j, level) = std::move(solved);
  }

  /// Returns an empty vector if a corner of the cell has no shape.
  VectorXd between(const PressGrid::Point& point) const {
    const auto good = [&](const auto& corners) {
      return std::ranges::all_of(corners, [&](const PressGrid::Corner& corner) { return all_[at(corner.knot)].good; });
    };
    const auto sum = [&](const auto& corners) {
      VectorXd shape = VectorXd::Zero(presser_.size());
      for (const auto& [knot, share] : corners) {
        if (all_[at(knot)].shape.size() > 0) shape += share * all_[at(knot)].shape;
      }
      return shape;
    };
    const auto near = grid_.corners(point);
    if (!good(near)) return {};
    const auto around = grid_.around_point(point);
    return good(around) ? sum(around) : sum(near);
  }

 private:
  int place(int i, int j) const { return i * grid_.side() + j; }
  SolvedPress& of(int i, int j, int level) { return all_[at(grid_.knot(i, j, level))]; }

  /// Extrapolates the shapes above: u(l) = l t + l² v(l), with the slope t at rest and a polynomial v.
  VectorXd foreseen(int i, int j, int level) {
    const VectorXd& first = first_[at(place(i, j))];
    VectorXd shape = level * first;
    double weight = level % 2 == 0 ? 1 : -1;
    for (int k = 1; k < level; ++k) {
      shape += weight * level * level / (k * k) * (of(i, j, k).shape - k * first);
      weight *= -double(level - k) / k;
    }
    return shape;
  }

  bool goes_on(const Reaction& above, const Reaction& here) const {
    const double grown = grid_.step * (above.stiffness + here.stiffness) / 2;
    return std::abs(above.force + grown - here.force) <= kGoesOn * here.force;
  }

  const TouchSurface& surface_;
  const PressGrid& grid_;
  Presser& presser_;
  std::vector<SolvedPress>& all_;
  std::vector<VectorXd> first_;  ///< linear shapes of the first depth, m
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

std::array<PressGrid::Corner, 64> PressGrid::around_point(const Point& point) const {
  struct Row {
    Row(int cell, double in, int last) : first(std::clamp(cell - 1, 0, last - 3)) {
      const double x = cell - first + in;
      for (int k = 0; k < 4; ++k) {
        for (int other = 0; other < 4; ++other) {
          if (other != k) shares[at(k)] *= (x - other) / (k - other);
        }
      }
    }
    int first;
    std::array<double, 4> shares{1, 1, 1, 1};
  };
  const Row x(point.i, point.in[0], 2 * around);
  const Row y(point.j, point.in[1], 2 * around);
  const Row z(point.level, point.in[2], kLevels);
  std::array<Corner, 64> all{};
  for (int c = 0; c < 64; ++c) {
    const int i = c / 16;
    const int j = c / 4 % 4;
    const int k = c % 4;
    all[at(c)] = {knot(x.first + i, y.first + j, z.first + k), x.shares[at(i)] * y.shares[at(j)] * z.shares[at(k)]};
  }
  return all;
}

SolvedPresses solve_presses(const Solid& solid, const TouchSurface& surface, const PressGrid& grid, bool glides,
                            const Tell& tell) {
  SolvedPresses all{.grid = grid, .knots = {}, .middles = {}, .at_rest = {}};
  all.knots.resize(at(grid.knots()));
  all.middles.resize(at(grid.cells()));
  const int side = grid.side();
  const int presses = grid.places() * PressGrid::kLevels + grid.cells();
  int done = 0;
  const auto told = [&] {
    if (tell) tell("pressing the body: " + std::to_string(++done) + " of " + std::to_string(presses) + " presses");
  };
  Presser presser(solid, surface);
  KnotPresses knots(surface, grid, presser, all.knots);
  for (int i = 0; i + 1 < side; ++i) {
    for (int j = 0; j + 1 < side; ++j) {
      const auto patch = surface.patch(grid.place(i + 0.5, j + 0.5));
      VectorXd shape;
      all.at_rest.push_back(presser.touch(patch, surface.normal(), shape).reaction.stiffness);
    }
  }
  for (int level = 1; level <= PressGrid::kLevels; ++level) {
    for (int i = 0; i < side; ++i) {
      for (int j = 0; j < side; ++j) {
        knots.press(i, j, level, glides);
        told();
      }
    }
  }
  if (std::ranges::none_of(all.knots, [](const SolvedPress& press) { return press.shape.size() > 0; })) {
    throw std::invalid_argument("expected at least one place for learning on the body, found none");
  }
  for (int level = PressGrid::kLevels; level-- > 0;) {  // starts at the last knots
    for (int i = 0; i + 1 < side; ++i) {
      for (int j = 0; j + 1 < side; ++j) {
        const Vec2 place = grid.place(i + 0.5, j + 0.5);
        const double depth = (level + 0.5) * grid.step;
        const auto patch = surface.patch(place);
        const VectorXd start = knots.between(*grid.find(place, depth));
        if (patch && start.size() > 0) all.middles[at(grid.cell(i, j, level))] = presser.press(*patch, depth, start);
        told();
      }
    }
  }
  all.work = presser.work();
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
        // If a neighbor has no value, only the cell itself must be accurate.
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

double Trust::error(const PressGrid::Point& point) const {
  double most = errors_[at(point.cell)];
  for (int c = 0; c < 27; ++c) {
    const std::array<int, 3> by{c / 9 - 1, c / 3 % 3 - 1, c % 3 - 1};
    const std::array<int, 3> cell{point.i + by[0], point.j + by[1], point.level + by[2]};
    bool contains = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double in = by[axis] < 0 ? point.in[axis] : 1 - point.in[axis];
      const int cells = axis < 2 ? 2 * grid_.around : PressGrid::kLevels;
      contains = contains && (by[axis] == 0 || in <= kOnBorder) && cell[axis] >= 0 && cell[axis] < cells;
    }
    if (!contains) continue;
    const double error = errors_[at(grid_.cell(cell[0], cell[1], cell[2]))];
    if (error < kInfinite) most = std::max(most, error);
  }
  return most;
}

Trust::Allowed::Allowed(const Trust& trust, double tolerance)
    : grid_(trust.grid()), at_knots_(at(grid_.knots()), true) {
  const int last = 2 * grid_.around;
  for (int i = 0; i <= last; ++i) {
    for (int j = 0; j <= last; ++j) {
      // The edge and the last depth have no neighbors.
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
  for (int i = 1; i < last; ++i) {
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
  double share = 1;  // exact if all knots are good
  for (const auto& [knot, counts] : grid_.corners(point)) share -= knots[at(knot)] ? 0 : counts;
  return std::max(0.0, share);
}

double Trust::Allowed::share(const PressGrid::Point& point) const { return share_of(at_knots_, point); }
double Trust::Allowed::room(const PressGrid::Point& point) const { return share_of(amid_, point); }

}  // namespace tendon::softbody

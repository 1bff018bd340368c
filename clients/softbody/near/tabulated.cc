// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/tabulated.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace tendon::softbody {
namespace {

struct Cubic {
  explicit Cubic(double x) {
    const double x2 = x * x;
    const double x3 = x2 * x;
    value = {2 * x3 - 3 * x2 + 1, x3 - 2 * x2 + x, 3 * x2 - 2 * x3, x3 - x2};
    first = {6 * x2 - 6 * x, 3 * x2 - 4 * x + 1, 6 * x - 6 * x2, 3 * x2 - 2 * x};
    second = {12 * x - 6, 6 * x - 4, 6 - 12 * x, 6 * x - 2};
  }
  std::array<double, 4> value{};
  std::array<double, 4> first{};
  std::array<double, 4> second{};
};

struct Quintic {
  explicit Quintic(double x) {
    const double x2 = x * x;
    const double x3 = x2 * x;
    const double x4 = x3 * x;
    const double x5 = x4 * x;
    value = {1 - 10 * x3 + 15 * x4 - 6 * x5, x - 6 * x3 + 8 * x4 - 3 * x5, 0.5 * x2 - 1.5 * x3 + 1.5 * x4 - 0.5 * x5,
             10 * x3 - 15 * x4 + 6 * x5,     -4 * x3 + 7 * x4 - 3 * x5,    0.5 * x3 - x4 + 0.5 * x5};
    first = {-30 * x2 + 60 * x3 - 30 * x4, 1 - 18 * x2 + 32 * x3 - 15 * x4, x - 4.5 * x2 + 6 * x3 - 2.5 * x4,
             30 * x2 - 60 * x3 + 30 * x4,  -12 * x2 + 28 * x3 - 15 * x4,    1.5 * x2 - 4 * x3 + 2.5 * x4};
    second = {-60 * x + 180 * x2 - 120 * x3, -36 * x + 96 * x2 - 60 * x3, 1 - 9 * x + 18 * x2 - 10 * x3,
              60 * x - 180 * x2 + 120 * x3,  -24 * x + 84 * x2 - 60 * x3, 3 * x - 12 * x2 + 10 * x3};
  }
  std::array<double, 6> value{};
  std::array<double, 6> first{};
  std::array<double, 6> second{};
};

enum Number : std::uint8_t { kValue, kAlongX, kAlongY, kTwisted };
constexpr std::size_t number(std::size_t field, Number which) { return 4 * field + which; }

class Knots {
 public:
  Knots(const PressGrid& grid, TabulatedAnswers& table, const std::vector<bool>& known)
      : grid_(grid), table_(table), known_(known) {}

  double& at_knot(int i, int j, int level, std::size_t which) {
    return table_.numbers[at(grid_.knot(i, j, level)) * TabulatedAnswers::kNumbers + which];
  }
  /// One-sided if only one neighbor is known.
  double slope(int i, int j, int level, std::size_t which, bool along_x) {
    const auto there = [&](int by) {
      const int x = i + (along_x ? by : 0);
      const int y = j + (along_x ? 0 : by);
      const bool inside = x >= 0 && y >= 0 && x < grid_.side() && y < grid_.side();
      return inside && known_[at(grid_.knot(x, y, level))] ? by : 0;
    };
    const int more = there(1);
    const int less = there(-1);
    if (more == less) return 0;
    const auto number_at = [&](int by) {
      return along_x ? at_knot(i + by, j, level, which) : at_knot(i, j + by, level, which);
    };
    return (number_at(more) - number_at(less)) / (more - less);
  }

 private:
  const PressGrid& grid_;
  TabulatedAnswers& table_;
  const std::vector<bool>& known_;
};

}  // namespace

TabulatedAnswers tabulate(const SolvedPresses& presses) {
  const PressGrid& grid = presses.grid;
  TabulatedAnswers table{.grid = grid};
  table.numbers.assign(at(grid.knots()) * TabulatedAnswers::kNumbers, 0);
  std::vector<bool> known(at(grid.knots()));
  Knots knots(grid, table, known);
  const auto for_each_knot = [&](const auto& act) {
    for (int i = 0; i < grid.side(); ++i) {
      for (int j = 0; j < grid.side(); ++j) {
        for (int level = 0; level <= PressGrid::kLevels; ++level) act(i, j, level, at(grid.knot(i, j, level)));
      }
    }
  };
  for_each_knot([&](int i, int j, int level, std::size_t knot) {
    const SolvedPress& press = presses.knots[knot];
    known[knot] = press.good && (level == 0 || press.reaction.knows_glide);
    if (!known[knot]) return;
    const Reaction& r = press.reaction;
    const double twisted = r.stiffness * r.slope.x() * r.slope.y() +
                           r.force * (r.slope.x() * r.glide.tilting.y() + r.slope.y() * r.glide.tilting.x() -
                                      r.glide.curving(0, 1) - r.force * r.glide.giving(0, 1));
    const Vec2 across = -grid.spacing * r.force * r.slope;
    const Vec2 mixed = -grid.spacing * grid.step * (r.stiffness * r.slope + r.force * r.glide.tilting);
    knots.at_knot(i, j, level, number(0, kValue)) = press.energy;
    knots.at_knot(i, j, level, number(0, kAlongX)) = across.x();
    knots.at_knot(i, j, level, number(0, kAlongY)) = across.y();
    knots.at_knot(i, j, level, number(0, kTwisted)) = grid.spacing * grid.spacing * twisted;
    knots.at_knot(i, j, level, number(1, kValue)) = grid.step * r.force;
    knots.at_knot(i, j, level, number(1, kAlongX)) = mixed.x();
    knots.at_knot(i, j, level, number(1, kAlongY)) = mixed.y();
    knots.at_knot(i, j, level, number(2, kValue)) = grid.step * grid.step * r.stiffness;
    if (level > 0) return;
    // At rest k = 1/(w·K⁻¹w), with derivative −2 k t.
    const Vec2 steeper = -2 * grid.spacing * grid.step * grid.step * r.stiffness * r.glide.tilting;
    knots.at_knot(i, j, level, number(2, kAlongX)) = steeper.x();
    knots.at_knot(i, j, level, number(2, kAlongY)) = steeper.y();
  });
  // Third derivatives.
  for_each_knot([&](int i, int j, int level, std::size_t knot) {
    if (!known[knot]) return;
    knots.at_knot(i, j, level, number(1, kTwisted)) =
        (knots.slope(i, j, level, number(1, kAlongX), false) + knots.slope(i, j, level, number(1, kAlongY), true)) / 2;
    if (level == 0) return;
    knots.at_knot(i, j, level, number(2, kAlongX)) = knots.slope(i, j, level, number(2, kValue), true);
    knots.at_knot(i, j, level, number(2, kAlongY)) = knots.slope(i, j, level, number(2, kValue), false);
  });
  for_each_knot([&](int i, int j, int level, std::size_t knot) {
    if (known[knot]) {
      knots.at_knot(i, j, level, number(2, kTwisted)) = knots.slope(i, j, level, number(2, kAlongX), false);
    }
  });

  std::vector<double> at_knots(at(grid.knots()));
  for (std::size_t knot = 0; knot < at_knots.size(); ++knot) at_knots[knot] = known[knot] ? 0 : -1;
  std::vector<double> in_middles(at(grid.cells()), -1);
  for (int i = 0; i < 2 * grid.around; ++i) {
    for (int j = 0; j < 2 * grid.around; ++j) {
      for (int level = 0; level < PressGrid::kLevels; ++level) {
        const std::size_t cell = at(grid.cell(i, j, level));
        const SolvedPress& truth = presses.middles[cell];
        const auto point = grid.find(grid.place(i + 0.5, j + 0.5), (level + 0.5) * grid.step);
        const auto corners = grid.corners(*point);
        const bool all = std::ranges::all_of(corners, [&](const auto& corner) { return known[at(corner.knot)]; });
        if (!truth.good || !all) continue;
        in_middles[cell] = std::abs(energy_at(table, *point).force / truth.reaction.force - 1);
        if (level > 0) continue;
        const auto rest = grid.find(grid.place(i + 0.5, j + 0.5), 0);
        const double stiffness = energy_at(table, *rest).stiffness;
        in_middles[cell] = std::max(in_middles[cell], std::abs(stiffness / presses.at_rest[at(grid.column(i, j))] - 1));
      }
    }
  }
  table.errors = Trust(grid, at_knots, in_middles).errors();
  return table;
}

TabulatedEnergy energy_at(const TabulatedAnswers& table, const PressGrid::Point& point) {
  const PressGrid& grid = table.grid;
  const Cubic x(point.in[0]);
  const Cubic y(point.in[1]);
  const Quintic z(point.in[2]);
  TabulatedEnergy all;
  double mixed_x = 0;
  double mixed_y = 0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t cx = corner / 4;
    const std::size_t cy = corner / 2 % 2;
    const std::size_t cz = corner % 2;
    const int knot =
        grid.knot(point.i + static_cast<int>(cx), point.j + static_cast<int>(cy), point.level + static_cast<int>(cz));
    const double* const numbers = table.numbers.data() + at(knot) * TabulatedAnswers::kNumbers;
    for (std::size_t field = 0; field < 3; ++field) {
      const std::size_t in_z = 3 * cz + field;
      for (std::size_t which = 0; which < 4; ++which) {
        const double n = numbers[4 * field + which];
        const std::size_t in_x = 2 * cx + which % 2;
        const std::size_t in_y = 2 * cy + which / 2;
        const double here = n * x.value[in_x] * y.value[in_y];
        const double along_x = n * x.first[in_x] * y.value[in_y];
        const double along_y = n * x.value[in_x] * y.first[in_y];
        all.energy += here * z.value[in_z];
        all.force += here * z.first[in_z];
        all.stiffness += here * z.second[in_z];
        all.across += Vec2(along_x, along_y) * z.value[in_z];
        mixed_x += along_x * z.first[in_z];
        mixed_y += along_y * z.first[in_z];
        const double twisted = n * x.first[in_x] * y.first[in_y] * z.value[in_z];
        all.curves(0, 0) += n * x.second[in_x] * y.value[in_y] * z.value[in_z];
        all.curves(1, 1) += n * x.value[in_x] * y.second[in_y] * z.value[in_z];
        all.curves(0, 1) += twisted;
        all.curves(1, 0) += twisted;
      }
    }
  }
  all.force /= grid.step;
  all.stiffness /= grid.step * grid.step;
  all.across /= grid.spacing;
  all.mixed = Vec2(mixed_x, mixed_y) / (grid.spacing * grid.step);
  all.curves /= grid.spacing * grid.spacing;
  return all;
}

TabulatedLevel::TabulatedLevel(TabulatedAnswers table, double tolerance)
    : table_(std::move(table)),
      trust_(table_.grid, table_.errors),
      allowed_(trust_, tolerance),
      tolerance_(tolerance) {}

std::optional<FallbackLevel::Answer> TabulatedLevel::press(const Patch& patch, double depth) const {
  const auto point = table_.grid.find(patch.middle, depth);
  if (!point) return std::nullopt;
  const double share = allowed_.share(*point);
  if (!(share > 0)) return std::nullopt;
  const TabulatedEnergy e = energy_at(table_, *point);
  Reaction reaction;
  reaction.way = SolverPath::kTabulated;
  reaction.force = e.force;
  reaction.depth = depth;
  reaction.stiffness = e.stiffness;
  reaction.error = trust_.error(*point) * std::abs(e.force);
  if (!(e.force > 0)) return Answer{reaction, share};
  // The components of PatchContact's K. `giving` is 0.
  const Vec2 slope = -e.across / e.force;
  reaction.slope = slope;
  reaction.knows_glide = patch.curvatures.size() > 0;
  if (!reaction.knows_glide) return Answer{reaction, share};
  const Vec2 tilting = -(e.mixed + e.stiffness * slope) / e.force;
  const Mat2 turned = slope * tilting.transpose();
  reaction.glide.tilting = tilting;
  reaction.glide.curving =
      e.stiffness / e.force * slope * slope.transpose() + turned + turned.transpose() - e.curves / e.force;
  return Answer{reaction, share};
}

double TabulatedLevel::room(const Vec2& middle, double depth) const {
  const auto point = table_.grid.find(middle, depth);
  return point ? allowed_.room(*point) : 0;
}

FallbackLevel::Size TabulatedLevel::size() const {
  Size size{.name = name_of(SolverPath::kTabulated),
            .bytes = (table_.numbers.size() + table_.errors.size()) * sizeof(double),
            .cells = allowed_.cells(),
            .of_cells = static_cast<int>(table_.errors.size())};
  for (const double error : table_.errors) {
    if (error <= tolerance_) size.error = std::max(size.error, error);
  }
  return size;
}

}  // namespace tendon::softbody

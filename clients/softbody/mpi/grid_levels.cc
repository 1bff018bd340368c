// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/mpi/grid_levels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace tendon::softbody {
namespace {

constexpr double kSame = 1e-6;  // relative

struct Grid {  // `free` is −1 for fixed nodes
  std::array<int, 3> count{};
  std::vector<int> free;
  int free_nodes = 0;

  std::size_t at(int i, int j, int k) const {
    return static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * count[1] + j) * count[0] + i);
  }
};

/// Returns an empty list if the steps are not equal.
std::vector<double> places(const Mesh& mesh, Eigen::Index axis) {
  std::vector<double> all;
  all.reserve(mesh.nodes.size());
  for (const Vec3& node : mesh.nodes) all.push_back(node[axis]);
  std::ranges::sort(all);
  const double extent = all.back() - all.front();
  const auto last = std::unique(all.begin(), all.end(), [&](double a, double b) { return b - a < 1e-9 * extent; });
  all.erase(last, all.end());
  const double step = extent / static_cast<double>(all.size() - 1);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!(std::abs(all[i] - all.front() - static_cast<double>(i) * step) < kSame * step)) return {};
  }
  return all;
}

std::optional<Grid> grid_of(const Solid& solid) {
  const Mesh& mesh = solid.mesh();
  Grid grid;
  std::array<double, 3> first{};
  std::array<double, 3> step{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double> along = places(mesh, static_cast<Eigen::Index>(axis));
    if (along.size() < 2) return std::nullopt;
    grid.count[axis] = static_cast<int>(along.size());
    first[axis] = along.front();
    step[axis] = (along.back() - along.front()) / static_cast<double>(along.size() - 1);
  }
  const auto all = static_cast<std::size_t>(grid.count[0]) * static_cast<std::size_t>(grid.count[1]) *
                   static_cast<std::size_t>(grid.count[2]);
  if (all != mesh.nodes.size()) return std::nullopt;
  grid.free.assign(all, -2);
  for (std::size_t node = 0; node < all; ++node) {
    std::array<int, 3> place{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place[axis] =
          static_cast<int>(std::lround((mesh.nodes[node][static_cast<Eigen::Index>(axis)] - first[axis]) / step[axis]));
    }
    int& entry = grid.free[grid.at(place[0], place[1], place[2])];
    if (entry != -2) return std::nullopt;
    const int free = solid.free_of(3 * static_cast<int>(node));
    entry = free < 0 ? -1 : free / 3;
  }
  grid.free_nodes = solid.free_count() / 3;
  return grid;
}

Grid coarser(const Grid& fine) {
  Grid coarse;
  for (std::size_t axis = 0; axis < 3; ++axis) coarse.count[axis] = (fine.count[axis] - 1) / 2 + 1;
  for (int k = 0; k < coarse.count[2]; ++k) {
    for (int j = 0; j < coarse.count[1]; ++j) {
      for (int i = 0; i < coarse.count[0]; ++i) {
        const bool is_free = fine.free[fine.at(2 * i, 2 * j, 2 * k)] >= 0;
        coarse.free.push_back(is_free ? coarse.free_nodes++ : -1);
      }
    }
  }
  return coarse;
}

struct Along {
  int node;
  double weight;
};

/// Returns the interpolation weights of fine node `i`.
std::vector<Along> along(int i, int count, int order) {
  const int wide = 2 * order;
  const int cell = std::min(i / wide, (count - 1) / wide - 1);
  const double t = static_cast<double>(i - cell * wide) / wide;
  std::vector<Along> found;
  const auto add = [&](int node, double weight) {
    if (weight != 0) found.push_back({cell * order + node, weight});
  };
  if (order == 1) {
    add(0, 1 - t);
    add(1, t);
  } else {
    add(0, (1 - t) * (1 - 2 * t));
    add(1, 4 * t * (1 - t));
    add(2, t * (2 * t - 1));
  }
  return found;
}

GridLevel level_between(const Grid& fine, const Grid& coarse, int order) {
  GridLevel level{.rows = std::vector<std::vector<GridLevel::Weight>>(static_cast<std::size_t>(fine.free_nodes)),
                  .nodes = coarse.free_nodes};
  std::array<std::vector<std::vector<Along>>, 3> axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < fine.count[axis]; ++i) axes[axis].push_back(along(i, fine.count[axis], order));
  }
  for (int k = 0; k < fine.count[2]; ++k) {
    for (int j = 0; j < fine.count[1]; ++j) {
      for (int i = 0; i < fine.count[0]; ++i) {
        const int row = fine.free[fine.at(i, j, k)];
        if (row < 0) continue;
        for (const Along& z : axes[2][static_cast<std::size_t>(k)]) {
          for (const Along& y : axes[1][static_cast<std::size_t>(j)]) {
            for (const Along& x : axes[0][static_cast<std::size_t>(i)]) {
              const int column = coarse.free[coarse.at(x.node, y.node, z.node)];
              if (column < 0) continue;
              level.rows[static_cast<std::size_t>(row)].push_back({column, x.weight * y.weight * z.weight});
            }
          }
        }
      }
    }
  }
  return level;
}

}  // namespace

std::vector<GridLevel> grid_levels(const Solid& solid, int least) {
  std::vector<GridLevel> levels;
  std::optional<Grid> fine = grid_of(solid);
  const int order = solid.mesh().shape == Shape::kHex27 ? 2 : 1;
  while (fine && fine->free_nodes > least) {
    if (std::ranges::any_of(fine->count, [&](int count) { return (count - 1) % (2 * order) != 0; })) break;
    Grid coarse = coarser(*fine);
    levels.push_back(level_between(*fine, coarse, order));
    fine = std::move(coarse);
  }
  return levels;
}

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "clients/softbody/fem/solid.h"

namespace tendon::softbody {

/// Interpolation from a coarser to a finer grid, for geometric multigrid. Identical on every rank.
///
/// Requires a mesh whose nodes form a grid with equal steps, as made by block(). A coarse cell covers two fine cells
/// along each axis; displacements between its nodes are those of its element: quadratic for hex27, linear otherwise.
/// The components of a node must be all free or all fixed.
struct GridLevel {
  /// An interpolation weight of a coarse node.
  struct Weight {
    int node;  ///< index among the free coarse nodes
    double value;
  };
  std::vector<std::vector<Weight>> rows;  ///< per free fine node
  int nodes = 0;                          ///< number of free coarse nodes
};

/// Levels from finest to coarsest. Stops when an axis has an odd number of cells or fewer than `least` nodes are free.
/// Empty if the nodes do not form a grid.
std::vector<GridLevel> grid_levels(const Solid& solid, int least = 1000);

}  // namespace tendon::softbody

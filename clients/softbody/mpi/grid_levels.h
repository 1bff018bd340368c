// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "clients/softbody/fem/solid.h"

namespace tendon::softbody {

/// The interpolation from a coarse grid to a fine grid, for geometric multigrid, the same on every rank. The nodes must
/// form a grid with equal steps, as in block(); a coarse cell contains two fine cells along each axis. Interpolation is
/// quadratic for hex27 and linear for other elements. The components of a node must be all free or all fixed.
struct GridLevel {
  struct Weight {
    int node;
    double value;
  };
  std::vector<std::vector<Weight>> rows;
  int nodes = 0;  ///< free coarse nodes
};

/// Returns the levels from fine to coarse. A level is the last one if an axis has an odd number of cells, or if fewer
/// than `least` nodes are free. The result is empty if the nodes do not form a grid.
std::vector<GridLevel> grid_levels(const Solid& solid, int least = 1000);

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "clients/softbody/fem/solid.h"

namespace tendon::softbody {

/// A coarser grid below a finer one, for multigrid: how the unknowns of the finer follow those of the coarser. Plain
/// numbers, on every rank alike.
///
/// For a mesh whose nodes fill a grid of equal steps, as block() makes. A coarser cell is two of the finer along each
/// axis; between its nodes displacements are those of its element: quadratic for hex27, linear for others. All
/// components of a node are free, or none.
struct GridLevel {
  /// An entry of the interpolation from coarser nodes to finer ones.
  struct Weight {
    int node;  ///< of the coarser grid, among its free ones
    double value;
  };
  std::vector<std::vector<Weight>> rows;  ///< for each free node of the finer grid
  int nodes = 0;                          ///< free ones of the coarser grid
};

/// From the finest to the coarsest. Ends where the cells of an axis are odd, or fewer than `least` nodes are free. Empty:
/// the nodes fill no grid.
std::vector<GridLevel> grid_levels(const Solid& solid, int least = 1000);

}  // namespace tendon::softbody

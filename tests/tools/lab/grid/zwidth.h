// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/tools/lab/grid/table.h"

namespace tendon::lab {

/// A point of the figure: the stiffest wall that is quiet and passive with every seed and rate.
struct StiffestWall {
  double round_trip = 0;  ///< s, median over the cells of the network
  double commanded = 0;   ///< N/m; 0 if no wall is quiet and passive
  double felt = 0;        ///< N/m, the largest median over its seeds of any of these walls
};

struct WidthOfLaw {
  std::string law;
  std::vector<StiffestWall> walls;  ///< by increasing round trip; one per network
};

/// Z-width over delay (Colgate and Brown, ICRA 1994): the range of stiffness that a device can render. Networks without
/// a known round trip are left out.
std::vector<WidthOfLaw> widths_of(const std::vector<GridRow>& rows, const Thresholds& thresholds);

/// Draws `stem`.svg and `stem`.png, which contain the origin as text and as metadata, and returns their names. Throws
/// the exceptions of draw_panels.
std::vector<std::filesystem::path> draw_zwidth(const std::filesystem::path& stem, const std::vector<GridRow>& rows,
                                               const Thresholds& thresholds, const Origin& origin);

}  // namespace tendon::lab

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

/// Points coincide below this fraction of the longest side of the bounding box: the rounding of a file with six digits.
inline constexpr double kSamePlace = 1e-6;

Eigen::AlignedBox3d box_around(std::span<const Vec3> points);

using Cell = std::array<std::int64_t, 3>;
struct HashOfCell {
  std::size_t operator()(const Cell& cell) const;
};
Cell cell_of(const Vec3& point, const Vec3& origin, double size);  ///< `point` within 10¹⁸ `size` of `origin`

std::vector<int> first_at_place(std::span<const Vec3> points);  ///< index of the first point that coincides

std::string in_words(const Vec3& place);  ///< formats the coordinates with four digits: "(1, 2, 3)"

/// Formats a count with its noun: "1 place", "2 places".
std::string counted(std::size_t count, std::string_view one, std::string_view several);

}  // namespace tendon::softbody

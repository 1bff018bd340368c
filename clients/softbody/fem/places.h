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

/// Two points are at the same place if their distance is less than this fraction of the longest side of the bounding
/// box. A file with six digits is rounded to about this value.
inline constexpr double kSamePlace = 1e-6;

/// The bounding box of one or more points.
Eigen::AlignedBox3d box_around(std::span<const Vec3> points);

/// A cell of a grid that is used to find neighbours.
using Cell = std::array<std::int64_t, 3>;
struct HashOfCell {
  std::size_t operator()(const Cell& cell) const;
};
/// The distance between the point and `origin` must be less than 10¹⁸ times `size`.
Cell cell_of(const Vec3& point, const Vec3& origin, double size);

/// For each point, the index of the first point at the same place.
std::vector<int> first_at_place(std::span<const Vec3> points);

/// The coordinates with four digits: "(1, 2, 3)".
std::string in_words(const Vec3& place);

/// The number and the singular or plural: "1 place", "2 places".
std::string counted(std::size_t count, std::string_view one, std::string_view several);

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

/// A triangle surface. Corners are counterclockwise seen from outside. Lengths are in the unit of the file.
struct Triangles {
  std::vector<Vec3> points;
  std::vector<std::array<int, 3>> facets;
  std::vector<int> numbers{};  ///< numbers of the facets in the file, if they are different
  std::vector<std::string> notes{};

  double volume() const;  ///< negative if the surface is inside out
  double longest_side() const;
  int number(std::size_t facet) const { return numbers.empty() ? static_cast<int>(facet) + 1 : numbers[facet]; }
  std::array<Vec3, 3> corners(std::size_t facet) const;
  std::string place(std::size_t facet) const;  ///< "facet 7 at (1, 2, 3)"
};

/// Reads a surface file (read_facets()) and triangulates it (triangles_of()). Each repair is added to `notes`:
///
/// - Coincident points (kSamePlace) are merged. For STL this is normal and not a repair.
/// - A facet with fewer than three distinct corners is removed.
/// - A duplicate facet is removed.
///
/// Throws std::invalid_argument "FILE: …" with the line or the facet if read_facets() fails, if a polygon is not
/// simple, if there are no facets, or if the file is larger than kMaxMeshBytes.
Triangles read_surface(const std::filesystem::path& file);
/// `ending` is the extension (".stl"), and `name` is used in error messages.
Triangles parse_surface(std::string_view text, std::string_view ending, std::string_view name);

inline constexpr std::size_t kMostCorners = 10'000;  ///< maximum number of corners of a polygon

/// Checks that the surface bounds one or more volumes: each edge belongs to two facets with opposite directions, no two
/// facets intersect or overlap, and each shell is oriented correctly (check_shells()). Otherwise throws
/// std::invalid_argument "`name`: …" with the number and place of a facet.
void check(const Triangles& surface, std::string_view name);

void write_stl(const std::filesystem::path& file, const Triangles& surface);

}  // namespace tendon::softbody

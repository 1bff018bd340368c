// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

/// The facets of a surface file: polygons with three or more corners.
struct Facets {
  std::vector<Vec3> points;
  std::vector<int> corners{};       ///< points of all facets
  std::vector<std::size_t> ends{};  ///< end of each facet in `corners`
  bool each_by_itself = false;      ///< true for STL: facets do not share points

  std::span<const int> facet(std::size_t number) const {
    const std::size_t begin = number == 0 ? 0 : ends[number - 1];
    return std::span(corners).subspan(begin, ends[number] - begin);
  }
};

inline constexpr std::size_t kStlHead = 84;   ///< bytes, header of a binary STL file
inline constexpr std::size_t kStlFacet = 50;  ///< bytes, facet of a binary STL file

/// Reads a surface. `ending` is the file extension (".stl"), and `name` is used in error messages. The formats are:
///
/// - STL: binary or text. The keywords may be in upper case, and line breaks do not matter.
/// - OBJ: `v` and `f`. A backslash at the end of a line continues it.
/// - OFF: text. Colours, normals and texture coordinates (COFF, NOFF, STOFF) are ignored.
///
/// Throws std::invalid_argument "`name`: …" with the line or the facet if a number is missing, not finite or out of
/// range, or if the extension is not one of these.
Facets read_facets(std::string_view bytes, std::string_view ending, std::string_view name);

}  // namespace tendon::softbody

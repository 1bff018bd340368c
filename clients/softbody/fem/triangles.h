// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "clients/softbody/fem/mesh.h"

namespace tendon::softbody {

/// A surface of triangles, each anticlockwise seen from outside. Lengths in the unit of its file.
struct Triangles {
  std::vector<Vec3> points;
  std::vector<std::array<int, 3>> facets;

  /// The volume that the surface encloses; below 0 when it is turned inside out.
  double volume() const;
  double longest_side() const;  ///< of the box around it
};

/// Reads an STL (text or binary), OBJ or OFF file, by its name's ending. Polygons of OBJ and OFF become triangles around
/// their first corner; what is not geometry is left out. Points that are closer than 1e-6 of the box around the surface
/// become one, and triangles that then have no area are left out: STL has each corner of each triangle by itself.
///
/// Throws std::invalid_argument "FILE: …" that names the line (text) or the facet when a number is missing, not finite or
/// out of range, when the file has another ending or no facet, or is larger than kMaxMeshBytes.
Triangles read_surface(const std::filesystem::path& file);
/// The same for text or bytes in memory, of that ending (".stl"); errors call it `name`.
Triangles parse_surface(std::string_view text, std::string_view ending, std::string_view name);

/// Throws std::invalid_argument "`name`: …" unless a volume lies within: every edge belongs to two facets, which run along
/// it in opposite directions, no facet cuts another, and the volume is above 0. The sentence names the facet, counted from
/// 1 in the order of the file, and its place.
void check(const Triangles& surface, std::string_view name);

/// As binary STL.
void write_stl(const std::filesystem::path& file, const Triangles& surface);

}  // namespace tendon::softbody

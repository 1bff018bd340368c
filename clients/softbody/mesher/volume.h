// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "clients/softbody/fem/mesh.h"
#include "clients/softbody/surface/triangles.h"

namespace tendon::softbody {

/// How to mesh the volume inside a surface for touch. Lengths are in the unit of the surface file.
struct VolumeConfig {
  double size = 0;                ///< element edge length at the touched place; > 0
  double coarsest = 3;            ///< factor on `size` away from the touched place; >= 1
  std::optional<Vec3> touched{};  ///< center of the touched place; empty: `size` everywhere
  double reach = 0;               ///< radius of the fine region; > 0 with `touched`
  /// Dihedral angle between facet normals above which an edge is preserved, rad.
  double sharp = 40 * std::numbers::pi / 180;
  /// Splits each tetrahedron into four hexahedra: a linear tetrahedron is far too stiff (README.md).
  bool hexahedra = true;
};

/// Runs gmsh (4.8 or later) for each body of the surface (bodies()). The surface must have passed check(). The output
/// of gmsh is appended to `words`, even if gmsh fails.
///
/// Each tetrahedron becomes four hexahedra, with new nodes at the centers of its edges, faces and volume. New boundary
/// nodes are moved towards the nearest surface point as far as their elements stay well shaped: moving all of them
/// fully would invert some elements, and not moving them would lose volume.
///
/// Throws std::invalid_argument, naming the invalid field of `config`, and std::runtime_error if gmsh is not installed
/// or produces no volume.
Mesh volume_of(const Triangles& surface, const VolumeConfig& config, std::string& words);

/// The mesh as text in gmsh's format 2.2.
std::string to_gmsh(const Mesh& mesh);

/// Quality of a mesh for touch.
struct MeshReport {
  int nodes = 0;
  int elements = 0;
  double volume = 0;        ///< in cubic file units
  double volume_error = 0;  ///< relative to the surface's volume: the part cut off by flat element faces
  /// Scaled Jacobian of an element: the minimum over its corners of the volume spanned by the three edges over the
  /// product of their lengths (times √2 for a tetrahedron). 1 for a cube and a regular tetrahedron, 0 for a flat
  /// element.
  double worst = 0;
  double worst_percent = 0;  ///< 1 % quantile
  double median = 0;
  Vec3 worst_at = Vec3::Zero();  ///< center of the worst element
  double shortest_edge = 0;
  double longest_edge = 0;
  /// Problems that the user should know of.
  std::vector<std::string> warnings{};
};
/// `mesh` is in the unit of the surface file.
MeshReport report_on(const Mesh& mesh, const Triangles& surface);

/// Scaled Jacobian below which an element is inaccurate however fine the mesh.
inline constexpr double kPoorElement = 0.1;

}  // namespace tendon::softbody

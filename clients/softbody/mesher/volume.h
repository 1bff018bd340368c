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

/// All lengths are in the unit of the surface file.
struct VolumeConfig {
  double size = 0;                             ///< of elements at the touched place
  double coarsest = 3;                         ///< ratio between the largest edge and `size`
  std::optional<Vec3> touched{};               ///< center of the touched place; if empty, all elements are small
  double reach = 0;                            ///< radius of the touched place
  double sharp = 40 * std::numbers::pi / 180;  ///< rad, edges with a larger angle between facets are preserved
  bool hexahedra = true;  ///< divides each tetrahedron into four hexahedra, because linear tetrahedra are too stiff
};

/// Runs gmsh (4.8 or later) for each body of `surface`, which must have passed check(), and adds its output to `words`,
/// even if it fails. Each tetrahedron becomes four hexahedra, with new nodes in the middle of its edges, faces and
/// volume; those on the boundary are moved to the surface as far as their elements stay well shaped. Throws
/// std::invalid_argument with the name of the field, and std::runtime_error if gmsh is missing or makes no volume.
Mesh volume_of(const Triangles& surface, const VolumeConfig& config, std::string& words);

std::string to_gmsh(const Mesh& mesh);  ///< mesh in the text format 2.2 of gmsh

struct MeshReport {
  int nodes = 0;
  int elements = 0;
  double volume = 0;
  double volume_error = 0;  ///< relative to the volume of the surface
  /// Scaled Jacobian of an element: the minimum over its corners of the volume spanned by the three edges over the
  /// product of their lengths (times √2 for a tetrahedron). 1: cube or regular tetrahedron; 0: flat.
  double worst = 0;
  double worst_percent = 0;  ///< 1 % quantile
  double median = 0;
  Vec3 worst_at = Vec3::Zero();  ///< center of the worst element
  double shortest_edge = 0;
  double longest_edge = 0;
  std::vector<std::string> warnings{};
};
MeshReport report_on(const Mesh& mesh, const Triangles& surface);

inline constexpr double kPoorElement = 0.1;  ///< minimum quality of an accurate element

}  // namespace tendon::softbody

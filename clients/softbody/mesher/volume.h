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

/// How a surface becomes a volume that is fit for touch. Lengths in the unit of the surface's file.
struct VolumeConfig {
  double size = 0;                ///< edge of an element below the place that is touched; > 0
  double coarsest = 3;            ///< elements elsewhere are so many times as large; >= 1
  std::optional<Vec3> touched{};  ///< the middle of that place; empty: elements are small everywhere
  double reach = 0;               ///< how far from there they are small; > 0 with `touched`
  /// Edges between facets whose normals differ by more stay edges of the body, rad.
  double sharp = 40 * std::numbers::pi / 180;
  /// Every tetrahedron becomes four hexahedra: a linear tetrahedron is far too stiff (README.md).
  bool hexahedra = true;
};

/// Runs gmsh (4.8 or later) for each body of the surface (bodies()). The surface must have passed check(). The output
/// of gmsh is added to `words`, even if gmsh fails.
///
/// gmsh makes tetrahedra. Each becomes four hexahedra, with new nodes in the middles of its edges, of its faces and
/// of itself. Those on the boundary are moved to the nearest point of the surface, each as far as its elements stay
/// well shaped: all the way some would be turned inside out, and not at all the body would be too small.
///
/// Throws std::invalid_argument naming a field of `config` that is impossible, std::runtime_error when gmsh is not
/// installed or makes no volume.
Mesh volume_of(const Triangles& surface, const VolumeConfig& config, std::string& words);

/// As text of gmsh's format 2.2.
std::string to_gmsh(const Mesh& mesh);

/// How fit a mesh is for touch.
struct MeshReport {
  int nodes = 0;
  int elements = 0;
  double volume = 0;        ///< in cubes of the file's unit
  double volume_error = 0;  ///< relative to the surface's: how much the elements' flat faces cut off
  /// The scaled Jacobian of an element is the least, at its corners, of the volume of its three edges over the product of
  /// their lengths (for a tetrahedron times √2): 1 for a cube, and for a regular tetrahedron; 0 when it is flat.
  double worst = 0;
  double worst_percent = 0;  ///< quantile 0.01
  double median = 0;
  Vec3 worst_at = Vec3::Zero();  ///< middle of the worst
  double shortest_edge = 0;
  double longest_edge = 0;
  /// What a person should read before trusting it; empty: nothing.
  std::vector<std::string> warnings{};
};
/// `mesh` in the unit of the surface's file.
MeshReport report_on(const Mesh& mesh, const Triangles& surface);

/// Below it an element answers wrongly, however fine the mesh.
inline constexpr double kPoorElement = 0.1;

}  // namespace tendon::softbody

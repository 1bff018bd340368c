// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

struct Mesh {
  Shape shape = Shape::kTet4;
  std::vector<Vec3> nodes;
  std::vector<int> elements;  ///< nodes of each element, concatenated, in gmsh's order

  int element_count() const noexcept { return static_cast<int>(elements.size()) / nodes_of(shape); }
  std::span<const int> element(int index) const noexcept;
};

/// A block with layers at `xs`, `ys` and `zs` (m, ascending, at least two each), which may be graded. With an even
/// number of cells the tetrahedra of the two halves are mirror images, so a press at the center gives no lateral force.
Mesh block(Shape shape, std::span<const double> xs, std::span<const double> ys, std::span<const double> zs);

/// A block of `size` (m) on the plane z = 0, centered above the origin, with equal `cells` per axis.
Mesh block(Shape shape, const Vec3& size, const std::array<int, 3>& cells);

/// A cylinder on the plane z = 0 around the z axis, with `across` cells across its square core, half as many from the
/// core to the outer surface, and `up` along the axis. Throws std::invalid_argument if `across` is odd.
Mesh cylinder(Shape shape, double radius, double height, int across, int up);

/// Returns the volume of the elements, m³. Throws std::invalid_argument "`name`: element N: …" if an element is
/// inverted or has no volume: its Jacobian is at most kLeastQuality times that of a cube with the same longest edge.
double check(const Mesh& mesh, std::string_view name);

/// Rounding in a file with 6 digits leaves 1e-6 of a flat element, and mesh generators produce no slivers below 1e-4.
inline constexpr double kLeastQuality = 1e-9;

/// Volume assigned to each node, m³, all positive: the diagonal of the consistent mass matrix, scaled to sum to the
/// total volume (Hinton, Rock & Zienkiewicz 1976).
std::vector<double> nodal_volumes(const Mesh& mesh);

Vec3 middle(const Mesh& mesh, int element);

struct Facet {
  int element;
  int face;
};

/// The surface: faces that coincide with no other face. The two sides of a closed cut coincide and are excluded.
std::vector<Facet> surface(const Mesh& mesh);

std::vector<Facet> sides(const Mesh& mesh);  ///< faces that belong to one element, including both sides of a cut

std::vector<std::pair<Facet, Facet>> inner_faces(const Mesh& mesh);

std::vector<int> nodes_on(const Mesh& mesh, const Facet& facet);

}  // namespace tendon::softbody

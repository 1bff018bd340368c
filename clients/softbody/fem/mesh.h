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

/// A body at rest, cut into elements of one shape.
struct Mesh {
  Shape shape = Shape::kTet4;
  std::vector<Vec3> nodes;    ///< m
  std::vector<int> elements;  ///< the nodes of each element, one after the other, in gmsh's order

  int element_count() const noexcept { return static_cast<int>(elements.size()) / nodes_of(shape); }
  std::span<const int> element(int index) const noexcept;
};

/// A block whose layers lie at `xs`, `ys` and `zs` (m, ascending, at least two each): equal steps, or finer where it is
/// touched. The tetrahedra of the two halves of an even block are mirror images, so that pressing its middle gives no
/// sideways force.
Mesh block(Shape shape, std::span<const double> xs, std::span<const double> ys, std::span<const double> zs);

/// A block of `size` m on the plane z = 0, its middle above the origin, in `cells` equal cells for each axis.
Mesh block(Shape shape, const Vec3& size, const std::array<int, 3>& cells);

/// A cylinder on the plane z = 0 around the z axis: `across` cells from side to side of its square core, half as many
/// from the core to the mantle, `up` along the axis. Throws std::invalid_argument when `across` is odd.
Mesh cylinder(Shape shape, double radius, double height, int across, int up);

/// The volume of the elements, m³. Throws std::invalid_argument "`name`: element N: …" when one is turned inside out or
/// has no volume: its Jacobian is not above `kLeastQuality` times that of a cube with the same longest edge.
double check(const Mesh& mesh, std::string_view name);

/// 1e-9: rounding in a file of 6 digits leaves 1e-6 of a flat element, and no mesh generator
/// hands out slivers below 1e-4.
inline constexpr double kLeastQuality = 1e-9;

/// The volume that belongs to each node, m³, all above 0: the diagonal of the consistent mass matrix,
/// scaled so that their sum is the volume (Hinton, Rock & Zienkiewicz 1976).
std::vector<double> nodal_volumes(const Mesh& mesh);

/// The mean of an element's corners, m.
Vec3 middle(const Mesh& mesh, int element);

/// A face of an element.
struct Facet {
  int element;
  int face;
};

/// The surface: the faces on which no other face lies. The two sides of a cut that is still closed lie on each other
/// and do not count.
std::vector<Facet> surface(const Mesh& mesh);

/// The faces that belong to one element only: the surface, and both sides of a cut, even where they touch.
std::vector<Facet> sides(const Mesh& mesh);

/// The faces that two elements share.
std::vector<std::pair<Facet, Facet>> inner_faces(const Mesh& mesh);

/// The nodes on a facet.
std::vector<int> nodes_on(const Mesh& mesh, const Facet& facet);

}  // namespace tendon::softbody

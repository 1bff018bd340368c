// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace tendon::softbody {

using Vec3 = Eigen::Vector3d;  ///< m or N, scene frame
using Mat3 = Eigen::Matrix3d;

/// Nodes and elements have signed numbers, like Eigen's rows; this converts one for the standard containers.
inline std::size_t at(int index) noexcept { return static_cast<std::size_t>(index); }

/// The shape of an element, and where its nodes are, in gmsh's order.
enum class Shape : std::uint8_t { kTet4, kHex8, kHex20, kHex27 };

/// A shape, and the rule that integrates its energy.
enum class Element : std::uint8_t { kTet4, kHex8, kHex8Sri, kHex20, kHex27, kHex27Sri };

struct ElementInfo {
  Element element;
  Shape shape;
  std::string_view name;  ///< in scenes, tables and command lines
  std::string_view what;  ///< one line
  /// Above this Poisson ratio it locks: it is stiffer than the material, without limit as ν approaches ½.
  double locks_above;
};

/// Every element, in the order in which tables list them.
std::span<const ElementInfo> elements() noexcept;
const ElementInfo& info(Element element) noexcept;
std::optional<Element> element_named(std::string_view name) noexcept;

inline constexpr int kMaxNodes = 27;
int nodes_of(Shape shape) noexcept;
int corners_of(Shape shape) noexcept;  ///< the first nodes of an element; their number

/// A reference element is the cube [−1, 1]³, or the tetrahedron 0 ≤ x, y, z, x + y + z ≤ 1.
Vec3 node_at(Shape shape, int node) noexcept;

/// The shape functions at one point of a reference element.
struct ShapeValues {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxNodes, 1> value;     ///< Nᵢ; their sum is 1
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxNodes> gradient;  ///< ∂Nᵢ/∂(reference coordinate)
};
ShapeValues shape_at(Shape shape, const Vec3& at);

/// A point of integration. The shares `mu` and `lambda` say which part of the material is integrated here: with
/// selective reduced integration the volumetric part (Lamé's λ) has fewer points than the rest (µ), so that a nearly
/// incompressible material is not kept from bending (Hughes 1980).
struct QuadraturePoint {
  Vec3 at;
  double weight;  ///< of the reference element's volume
  double mu;      ///< 0 or 1
  double lambda;  ///< 0 or 1
};
std::span<const QuadraturePoint> quadrature(Element element);

/// A face of a reference element: `origin` + s·`along_s` + t·`along_t`, with s, t from −1 to 1 on a cube and
/// s, t ≥ 0, s + t ≤ 1 on a tetrahedron. along_s × along_t points out.
struct Face {
  Vec3 origin;
  Vec3 along_s;
  Vec3 along_t;
};
std::span<const Face> faces(Shape shape) noexcept;

}  // namespace tendon::softbody

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

/// Converts an index for the standard containers.
inline std::size_t at(int index) noexcept { return static_cast<std::size_t>(index); }

enum class Shape : std::uint8_t { kTet4, kHex8, kHex20, kHex27 };  ///< the node order is that of gmsh

enum class Element : std::uint8_t { kTet4, kHex8, kHex8Sri, kHex20, kHex27, kHex27Sri };

struct ElementInfo {
  Element element;
  Shape shape;
  std::string_view name;
  std::string_view what;
  /// Poisson ratio above which the element locks: its stiffness error grows without limit as ν approaches ½.
  double locks_above;
};

std::span<const ElementInfo> elements() noexcept;
const ElementInfo& info(Element element) noexcept;
std::optional<Element> element_named(std::string_view name) noexcept;

inline constexpr int kMaxNodes = 27;
int nodes_of(Shape shape) noexcept;
int corners_of(Shape shape) noexcept;

/// Node position in the reference element: the cube [−1, 1]³ or the tetrahedron x, y, z ≥ 0, x + y + z ≤ 1.
Vec3 node_at(Shape shape, int node) noexcept;

struct ShapeValues {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxNodes, 1> value;     ///< Nᵢ; their sum is 1
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxNodes> gradient;  ///< ∂Nᵢ/∂ξ, ξ the reference coordinate
};
ShapeValues shape_at(Shape shape, const Vec3& at);

/// A quadrature point. `mu` and `lambda` select the part of the material that is integrated here. With selective
/// reduced integration the volumetric part (Lamé's λ) is integrated with fewer points than the deviatoric part (µ),
/// which avoids volumetric locking in nearly incompressible materials (Hughes 1980).
struct QuadraturePoint {
  Vec3 at;
  double weight;
  double mu;
  double lambda;
};
std::span<const QuadraturePoint> quadrature(Element element);

/// A face of the reference element: origin + s·along_s + t·along_t, with s, t ∈ [−1, 1] for a cube, and s, t ≥ 0, s + t
/// ≤ 1 for a tetrahedron. along_s × along_t points outward.
struct Face {
  Vec3 origin;
  Vec3 along_s;
  Vec3 along_t;
};
std::span<const Face> faces(Shape shape) noexcept;

}  // namespace tendon::softbody

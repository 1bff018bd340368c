// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/element.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace tendon::softbody {
namespace {

// Stiffness errors on block B1 (REFERENCE.md) at ν = 0.45 and 0.499: tet4 70 % and 1208 %, fully integrated hex8 24 %
// and 257 %, quadratic 2 % and 8 %.
constexpr std::array kElements{
    ElementInfo{Element::kTet4, Shape::kTet4, "tet4", "linear tetrahedron: any mesh, but far too stiff", 0.45},
    ElementInfo{Element::kHex8, Shape::kHex8, "hex8", "trilinear hexahedron, fully integrated", 0.45},
    ElementInfo{Element::kHex8Sri, Shape::kHex8, "hex8-sri", "trilinear hexahedron, volumetric part at one point", 0.5},
    ElementInfo{Element::kHex20, Shape::kHex20, "hex20", "quadratic hexahedron without inner nodes", 0.495},
    ElementInfo{Element::kHex27, Shape::kHex27, "hex27", "quadratic hexahedron", 0.495},
    ElementInfo{Element::kHex27Sri, Shape::kHex27, "hex27-sri", "quadratic hexahedron, volumetric part at 8 points",
                0.5},
};

/// The order of gmsh.
constexpr std::array<std::array<int, 2>, 12> kEdges{
    {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3}, {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}}};
constexpr std::array<std::array<int, 2>, 6> kFaceDiagonals{{{0, 2}, {0, 5}, {0, 7}, {1, 6}, {2, 7}, {4, 6}}};

Vec3 hex_node(int node) {
  if (node < 8) {
    const bool right = node % 4 == 1 || node % 4 == 2;
    return {right ? 1.0 : -1.0, node % 4 >= 2 ? 1.0 : -1.0, node >= 4 ? 1.0 : -1.0};
  }
  if (node == 26) return Vec3::Zero();
  const auto& [a, b] =
      node < 20 ? kEdges[static_cast<std::size_t>(node) - 8] : kFaceDiagonals[static_cast<std::size_t>(node) - 20];
  return 0.5 * (hex_node(a) + hex_node(b));
}

struct Along {
  double value;
  double slope;
};

Along linear(double x, double node) { return {0.5 * (1 + node * x), 0.5 * node}; }

Along quadratic(double x, double node) {
  if (node == 0) return {1 - x * x, -2 * x};
  return {0.5 * x * (x + node), x + 0.5 * node};
}

template <class Polynomial>
void set_product(ShapeValues& values, int node, const Vec3& at, const Vec3& place, Polynomial polynomial) {
  const Along x = polynomial(at.x(), place.x());
  const Along y = polynomial(at.y(), place.y());
  const Along z = polynomial(at.z(), place.z());
  values.value[node] = x.value * y.value * z.value;
  values.gradient.col(node) << x.slope * y.value * z.value, x.value * y.slope * z.value, x.value * y.value * z.slope;
}

/// Serendipity: a node on an edge has (1 − x²)(1 ± y)(1 ± z) / 4.
void set_serendipity(ShapeValues& values, const Vec3& at) {
  for (int node = 0; node < 8; ++node) set_product(values, node, at, hex_node(node), linear);
  for (int node = 8; node < 20; ++node) {
    set_product(values, node, at, hex_node(node), [](double x, double place) {
      return place == 0 ? Along{1 - x * x, -2 * x} : linear(x, place);
    });
    for (const int corner : kEdges[static_cast<std::size_t>(node) - 8]) {
      values.value[corner] -= 0.5 * values.value[node];
      values.gradient.col(corner) -= 0.5 * values.gradient.col(node);
    }
  }
}

struct GaussPoint {
  double at;
  double weight;
};

std::vector<GaussPoint> gauss(int points) {
  if (points == 1) return {{0, 2}};
  if (points == 2) return {{-std::sqrt(1 / 3.0), 1}, {std::sqrt(1 / 3.0), 1}};
  return {{-std::sqrt(0.6), 5 / 9.0}, {0, 8 / 9.0}, {std::sqrt(0.6), 5 / 9.0}};
}

void append_cube(std::vector<QuadraturePoint>& points, int per_axis, double mu, double lambda) {
  const std::vector<GaussPoint> line = gauss(per_axis);
  for (const GaussPoint& z : line) {
    for (const GaussPoint& y : line) {
      for (const GaussPoint& x : line) {
        points.push_back({Vec3(x.at, y.at, z.at), x.weight * y.weight * z.weight, mu, lambda});
      }
    }
  }
}

std::vector<QuadraturePoint> points_of(Element element) {
  std::vector<QuadraturePoint> points;
  switch (element) {
    case Element::kTet4:
      points.push_back({Vec3::Constant(0.25), 1 / 6.0, 1, 1});
      break;
    case Element::kHex8:
      append_cube(points, 2, 1, 1);
      break;
    case Element::kHex8Sri:
      append_cube(points, 2, 1, 0);
      append_cube(points, 1, 0, 1);
      break;
    case Element::kHex20:
    case Element::kHex27:
      append_cube(points, 3, 1, 1);
      break;
    case Element::kHex27Sri:
      append_cube(points, 3, 1, 0);
      append_cube(points, 2, 0, 1);
      break;
  }
  return points;
}

}  // namespace

std::span<const ElementInfo> elements() noexcept { return kElements; }

const ElementInfo& info(Element element) noexcept { return kElements[static_cast<std::size_t>(element)]; }

std::optional<Element> element_named(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(kElements, name, &ElementInfo::name);
  return found == kElements.end() ? std::nullopt : std::optional(found->element);
}

int nodes_of(Shape shape) noexcept {
  constexpr std::array kNodes{4, 8, 20, 27};
  return kNodes[static_cast<std::size_t>(shape)];
}

int corners_of(Shape shape) noexcept { return shape == Shape::kTet4 ? 4 : 8; }

Vec3 node_at(Shape shape, int node) noexcept {
  if (shape != Shape::kTet4) return hex_node(node);
  return node == 0 ? Vec3(Vec3::Zero()) : Vec3(Vec3::Unit(node - 1));
}

ShapeValues shape_at(Shape shape, const Vec3& at) {
  const int nodes = nodes_of(shape);
  ShapeValues values;
  values.value.resize(nodes);
  values.gradient.resize(3, nodes);
  switch (shape) {
    case Shape::kTet4:
      values.value << 1 - at.sum(), at;
      values.gradient << Vec3::Constant(-1), Mat3::Identity();
      break;
    case Shape::kHex8:
      for (int node = 0; node < nodes; ++node) set_product(values, node, at, hex_node(node), linear);
      break;
    case Shape::kHex20:
      set_serendipity(values, at);
      break;
    case Shape::kHex27:
      for (int node = 0; node < nodes; ++node) set_product(values, node, at, hex_node(node), quadratic);
      break;
  }
  return values;
}

std::span<const QuadraturePoint> quadrature(Element element) {
  static const std::array<std::vector<QuadraturePoint>, kElements.size()> kPoints = [] {
    std::array<std::vector<QuadraturePoint>, kElements.size()> points;
    for (const ElementInfo& each : kElements) points[static_cast<std::size_t>(each.element)] = points_of(each.element);
    return points;
  }();
  return kPoints[static_cast<std::size_t>(element)];
}

std::span<const Face> faces(Shape shape) noexcept {
  static const std::array<Face, 4> kTetFaces{{{Vec3::Zero(), Vec3::UnitY(), Vec3::UnitX()},
                                              {Vec3::Zero(), Vec3::UnitX(), Vec3::UnitZ()},
                                              {Vec3::Zero(), Vec3::UnitZ(), Vec3::UnitY()},
                                              {Vec3::UnitX(), Vec3(-1, 1, 0), Vec3(-1, 0, 1)}}};
  static const std::array<Face, 6> kHexFaces{{{-Vec3::UnitZ(), Vec3::UnitY(), Vec3::UnitX()},
                                              {-Vec3::UnitY(), Vec3::UnitX(), Vec3::UnitZ()},
                                              {-Vec3::UnitX(), Vec3::UnitZ(), Vec3::UnitY()},
                                              {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()},
                                              {Vec3::UnitY(), Vec3::UnitZ(), Vec3::UnitX()},
                                              {Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY()}}};
  if (shape == Shape::kTet4) return kTetFaces;
  return kHexFaces;
}

}  // namespace tendon::softbody

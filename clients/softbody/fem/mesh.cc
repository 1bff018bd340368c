// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/mesh.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <type_traits>
#include <utility>

namespace tendon::softbody {
namespace {

/// Quadrilaterals that are extruded. Tetrahedra start at the node with the lowest rank, then the lowest number.
struct Outline {
  std::vector<Eigen::Vector2d> nodes;
  std::vector<std::array<int, 4>> quads;
  std::vector<int> rank;
};

Mesh draw_up_hexahedra(const Outline& outline, std::span<const double> zs) {
  Mesh mesh{.shape = Shape::kHex8, .nodes = {}, .elements = {}};
  const int per_layer = static_cast<int>(outline.nodes.size());
  for (const double z : zs) {
    for (const Eigen::Vector2d& node : outline.nodes) mesh.nodes.emplace_back(node.x(), node.y(), z);
  }
  for (int layer = 0; layer + 1 < static_cast<int>(zs.size()); ++layer) {
    for (const auto& quad : outline.quads) {
      for (const int up : {0, 1}) {
        for (const int node : quad) mesh.elements.push_back((layer + up) * per_layer + node);
      }
    }
  }
  return mesh;
}

/// Splits quadrilaterals along the diagonal through the lowest rank, and prisms into three tetrahedra (Kuhn). The faces
/// of neighbors match, because the order of nodes is the same everywhere.
Mesh draw_up_tetrahedra(const Outline& outline, std::span<const double> zs) {
  Mesh mesh = draw_up_hexahedra(outline, zs);
  mesh.shape = Shape::kTet4;
  mesh.elements.clear();
  const int per_layer = static_cast<int>(outline.nodes.size());
  const auto lower = [&](int a, int b) {
    return std::pair(outline.rank[at(a)], a) < std::pair(outline.rank[at(b)], b);
  };
  for (int layer = 0; layer + 1 < static_cast<int>(zs.size()); ++layer) {
    const int base = layer * per_layer;
    for (const auto& quad : outline.quads) {
      const auto first = static_cast<std::size_t>(std::ranges::min_element(quad, lower) - quad.begin());
      for (const std::size_t turn : {1U, 2U}) {
        std::array<int, 3> t{quad[first], quad[(first + turn) % 4], quad[(first + turn + 1) % 4]};
        std::ranges::sort(t, lower);
        for (std::size_t up = 0; up < 3; ++up) {
          std::array<int, 4> tet{};
          std::size_t next = 0;
          for (std::size_t i = 0; i <= up; ++i) tet[next++] = base + t[i];
          for (std::size_t i = up; i < 3; ++i) tet[next++] = base + per_layer + t[i];
          Mat3 edges;
          for (int i = 0; i < 3; ++i) edges.col(i) = mesh.nodes[at(tet[at(i + 1)])] - mesh.nodes[at(tet[0])];
          if (edges.determinant() < 0) std::swap(tet[2], tet[3]);
          mesh.elements.insert(mesh.elements.end(), tet.begin(), tet.end());
        }
      }
    }
  }
  return mesh;
}

Mesh quadratic(const Mesh& mesh, Shape shape) {
  Mesh fine{.shape = shape, .nodes = mesh.nodes, .elements = {}};
  std::map<std::vector<int>, int> between;  // corners around a node → node
  for (int e = 0; e < mesh.element_count(); ++e) {
    const auto corners = mesh.element(e);
    fine.elements.insert(fine.elements.end(), corners.begin(), corners.end());
    for (int node = 8; node < nodes_of(shape); ++node) {
      const Vec3 place = node_at(shape, node);
      std::vector<int> key;
      Vec3 middle = Vec3::Zero();
      for (int corner = 0; corner < 8; ++corner) {
        // A node lies between the corners that share its nonzero coordinates.
        const Vec3 side = node_at(shape, corner);
        if ((place.array() == 0 || place.array() == side.array()).all()) {
          key.push_back(corners[at(corner)]);
          middle += mesh.nodes[at(key.back())];
        }
      }
      middle /= static_cast<double>(key.size());
      std::ranges::sort(key);
      const auto [found, is_new] = between.try_emplace(std::move(key), static_cast<int>(fine.nodes.size()));
      if (is_new) fine.nodes.push_back(middle);
      fine.elements.push_back(found->second);
    }
  }
  return fine;
}

Mesh draw_up(const Outline& outline, std::span<const double> zs, Shape shape) {
  if (shape == Shape::kTet4) return draw_up_tetrahedra(outline, zs);
  const Mesh mesh = draw_up_hexahedra(outline, zs);
  return shape == Shape::kHex8 ? mesh : quadratic(mesh, shape);
}

void expect_ascending(std::span<const double> layers, std::string_view name) {
  if (layers.size() < 2 || !std::ranges::is_sorted(layers, std::less_equal<>())) {
    throw std::invalid_argument(std::string(name) + ": expected two or more ascending numbers");
  }
}

std::vector<double> steps(double from, double to, int count, std::string_view name) {
  if (count < 1 || !(to > from)) {
    throw std::invalid_argument(std::string(name) + ": expected a length above 0 in 1 or more cells");
  }
  std::vector<double> at(static_cast<std::size_t>(count) + 1);
  for (int i = 0; i <= count; ++i) at[static_cast<std::size_t>(i)] = from + (to - from) * i / count;
  return at;
}

double longest_edge(const Mesh& mesh, std::span<const int> element) {
  double longest = 0;
  for (int a = 0; a < corners_of(mesh.shape); ++a) {
    for (int b = 0; b < a; ++b) {
      longest = std::max(longest, (mesh.nodes[at(element[at(a)])] - mesh.nodes[at(element[at(b)])]).norm());
    }
  }
  return longest;
}

/// Calls `use(shape functions, det J, weight)` at points that integrate the mass matrix exactly.
template <class Use>
void for_points(const Mesh& mesh, int element, Use use) {
  const auto nodes = mesh.element(element);
  const Element full = std::ranges::find(elements(), mesh.shape, &ElementInfo::shape)->element;
  for (const QuadraturePoint& point : quadrature(full)) {
    const ShapeValues shape = shape_at(mesh.shape, point.at);
    Mat3 jacobian = Mat3::Zero();
    for (int i = 0; i < nodes_of(mesh.shape); ++i) {
      jacobian += mesh.nodes[at(nodes[at(i)])] * shape.gradient.col(i).transpose();
    }
    use(shape, jacobian.determinant(), point.weight);
  }
}

std::vector<int> corners_on(const Mesh& mesh, const Facet& facet) {
  std::vector<int> nodes = nodes_on(mesh, facet);
  std::erase_if(nodes, [&](int node) {
    const auto element = mesh.element(facet.element);
    return std::ranges::find(element, node) - element.begin() >= corners_of(mesh.shape);
  });
  return nodes;
}

template <class Name>
auto faces_by(const Mesh& mesh, Name name) {
  std::map<std::vector<std::decay_t<decltype(name(0))>>, std::vector<Facet>> sharing;
  for (int e = 0; e < mesh.element_count(); ++e) {
    for (int face = 0; face < static_cast<int>(faces(mesh.shape).size()); ++face) {
      std::vector<std::decay_t<decltype(name(0))>> corners;
      for (const int node : corners_on(mesh, {e, face})) corners.push_back(name(node));
      std::ranges::sort(corners);
      sharing[std::move(corners)].push_back({e, face});
    }
  }
  return sharing;
}

template <class Name>
std::vector<Facet> alone(const std::map<Name, std::vector<Facet>>& sharing) {
  std::vector<Facet> alone;
  for (const auto& [corners, facets] : sharing) {
    if (facets.size() == 1) alone.push_back(facets.front());
  }
  std::ranges::sort(alone, {}, [](const Facet& facet) { return std::pair(facet.element, facet.face); });
  return alone;
}

}  // namespace

std::span<const int> Mesh::element(int index) const noexcept {
  const auto size = static_cast<std::size_t>(nodes_of(shape));
  return std::span(elements).subspan(at(index) * size, size);
}

Mesh block(Shape shape, std::span<const double> xs, std::span<const double> ys, std::span<const double> zs) {
  expect_ascending(xs, "xs");
  expect_ascending(ys, "ys");
  expect_ascending(zs, "zs");
  const int nx = static_cast<int>(xs.size());
  const int ny = static_cast<int>(ys.size());
  Outline outline;
  for (const double y : ys) {
    for (const double x : xs) outline.nodes.emplace_back(x, y);
  }
  for (int j = 0; j + 1 < ny; ++j) {
    for (int i = 0; i + 1 < nx; ++i) {
      const int corner = j * nx + i;
      outline.quads.push_back({corner, corner + 1, corner + nx + 1, corner + nx});
    }
  }
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) outline.rank.push_back(-std::abs(2 * i - nx + 1) - std::abs(2 * j - ny + 1));
  }
  return draw_up(outline, zs, shape);
}

Mesh block(Shape shape, const Vec3& size, const std::array<int, 3>& cells) {
  return block(shape, steps(-size.x() / 2, size.x() / 2, cells[0], "size.x"),
               steps(-size.y() / 2, size.y() / 2, cells[1], "size.y"), steps(0, size.z(), cells[2], "size.z"));
}

Mesh cylinder(Shape shape, double radius, double height, int across, int up) {
  if (!(radius > 0) || across < 2 || across % 2 != 0) {
    throw std::invalid_argument("cylinder: expected a radius above 0 and an even number of cells across, at least 2");
  }
  // The factor 0.6 makes the outer cells of the core as wide as the rings.
  const double half = 0.6 * radius * std::numbers::sqrt2 / 2;
  const int rings = across / 2;
  const int around = 4 * across;
  Outline outline;
  for (int j = 0; j <= across; ++j) {
    for (int i = 0; i <= across; ++i) {
      // Curved sides keep the angles above 45°.
      const Eigen::Vector2d square(2.0 * i / across - 1, 2.0 * j / across - 1);
      const Eigen::Vector2d bulge(square.x() * (1 + 0.15 * (1 - square.y() * square.y())),
                                  square.y() * (1 + 0.15 * (1 - square.x() * square.x())));
      outline.nodes.push_back(half * bulge);
    }
  }
  for (int j = 0; j < across; ++j) {
    for (int i = 0; i < across; ++i) {
      const int corner = j * (across + 1) + i;
      outline.quads.push_back({corner, corner + 1, corner + across + 2, corner + across + 1});
    }
  }
  std::vector<int> inner;
  for (int i = 0; i < across; ++i) inner.push_back(i);
  for (int j = 0; j < across; ++j) inner.push_back(j * (across + 1) + across);
  for (int i = across; i > 0; --i) inner.push_back(across * (across + 1) + i);
  for (int j = across; j > 0; --j) inner.push_back(j * (across + 1));
  const std::vector<int> rim = inner;
  for (int ring = 1; ring <= rings; ++ring) {
    std::vector<int> outer;
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around - 0.75 * std::numbers::pi;
      const Eigen::Vector2d mantle = radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d core = outline.nodes[at(rim[at(k)])];
      outer.push_back(static_cast<int>(outline.nodes.size()));
      outline.nodes.emplace_back(core + (mantle - core) * ring / rings);
    }
    for (int k = 0; k < around; ++k) {
      const int next = (k + 1) % around;
      outline.quads.push_back({inner[at(k)], outer[at(k)], outer[at(next)], inner[at(next)]});
    }
    inner = outer;
  }
  outline.rank.resize(outline.nodes.size());
  std::iota(outline.rank.begin(), outline.rank.end(), 0);
  return draw_up(outline, steps(0, height, up, "height"), shape);
}

double check(const Mesh& mesh, std::string_view name) {
  double volume = 0;
  for (int e = 0; e < mesh.element_count(); ++e) {
    const double longest = longest_edge(mesh, mesh.element(e));
    for_points(mesh, e, [&](const ShapeValues&, double determinant, double weight) {
      if (!(determinant > kLeastQuality * longest * longest * longest)) {
        throw std::invalid_argument(std::string(name) + ": element " + std::to_string(e + 1) +
                                    (determinant < 0 ? " is turned inside out" : " has no volume"));
      }
      volume += weight * determinant;
    });
  }
  return volume;
}

std::vector<double> nodal_volumes(const Mesh& mesh) {
  std::vector<double> volumes(mesh.nodes.size());
  for (int e = 0; e < mesh.element_count(); ++e) {
    const auto nodes = mesh.element(e);
    Eigen::VectorXd squares = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(nodes.size()));
    double volume = 0;
    for_points(mesh, e, [&](const ShapeValues& shape, double determinant, double weight) {
      squares += weight * determinant * shape.value.cwiseAbs2();
      volume += weight * determinant;
    });
    squares *= volume / squares.sum();
    for (std::size_t i = 0; i < nodes.size(); ++i) volumes[at(nodes[i])] += squares[static_cast<Eigen::Index>(i)];
  }
  return volumes;
}

std::vector<Facet> surface(const Mesh& mesh) {
  const auto place = [&](int node) {
    const Vec3& at_rest = mesh.nodes[at(node)];
    return std::array{at_rest.x(), at_rest.y(), at_rest.z()};
  };
  return alone(faces_by(mesh, place));
}

std::vector<Facet> sides(const Mesh& mesh) { return alone(faces_by(mesh, std::identity())); }

std::vector<std::pair<Facet, Facet>> inner_faces(const Mesh& mesh) {
  std::vector<std::pair<Facet, Facet>> shared;
  for (const auto& [corners, facets] : faces_by(mesh, std::identity())) {
    if (facets.size() == 2) shared.emplace_back(facets.front(), facets.back());
  }
  return shared;
}

std::vector<int> nodes_on(const Mesh& mesh, const Facet& facet) {
  const Face& face = faces(mesh.shape)[at(facet.face)];
  const Vec3 out = face.along_s.cross(face.along_t);
  std::vector<int> nodes;
  const auto element = mesh.element(facet.element);
  for (int i = 0; i < nodes_of(mesh.shape); ++i) {
    if (std::abs(out.dot(node_at(mesh.shape, i) - face.origin)) < 1e-12) nodes.push_back(element[at(i)]);
  }
  return nodes;
}

Vec3 middle(const Mesh& mesh, int element) {
  Vec3 sum = Vec3::Zero();
  const auto corners = mesh.element(element).first(at(corners_of(mesh.shape)));
  for (const int node : corners) sum += mesh.nodes[at(node)];
  return sum / static_cast<double>(corners.size());
}

}  // namespace tendon::softbody

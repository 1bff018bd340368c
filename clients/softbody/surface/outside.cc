// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/surface/outside.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <vector>

namespace tendon::softbody {
namespace {

/// Returns the corners of a facet, counterclockwise seen from outside. The fourth corner of a triangle is −1.
std::array<int, 4> corners_of(const Mesh& mesh, const Facet& facet) {
  const Face& face = faces(mesh.shape)[static_cast<std::size_t>(facet.face)];
  const bool triangle = mesh.shape == Shape::kTet4;
  const auto element = mesh.element(facet.element);
  std::array<int, 4> corners{-1, -1, -1, -1};
  for (const int node : nodes_on(mesh, facet)) {
    const int local = static_cast<int>(std::ranges::find(element, node) - element.begin());
    if (local >= corners_of(mesh.shape)) continue;
    const Vec3 from = node_at(mesh.shape, local) - face.origin;
    const double middle = triangle ? 0.5 : 0;  // of s and t
    const bool s = from.dot(face.along_s) > middle * face.along_s.squaredNorm();
    const bool t = from.dot(face.along_t) > middle * face.along_t.squaredNorm();
    corners[t ? (s ? 2 : 3) : (s ? 1 : 0)] = node;
  }
  return corners;
}

}  // namespace

Triangles outside(const Mesh& mesh) {
  Triangles found;
  std::map<int, int> points;
  const auto point = [&](int node) {
    const auto [place, is_new] = points.try_emplace(node, static_cast<int>(found.points.size()));
    if (is_new) found.points.push_back(mesh.nodes[static_cast<std::size_t>(node)]);
    return place->second;
  };
  for (const Facet& facet : surface(mesh)) {
    std::vector<int> around;
    for (const int node : corners_of(mesh, facet)) {
      if (node >= 0) around.push_back(point(node));
    }
    for (std::size_t i = 2; i < around.size(); ++i) found.facets.push_back({around[0], around[i - 1], around[i]});
  }
  return found;
}

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/region.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace tendon::softbody {

bool Region::has(const Vec3& place) const {
  if (const auto* ball = std::get_if<Ball>(&where)) return (place - ball->middle).norm() <= ball->radius;
  const auto& box = std::get<Box>(where);
  return ((place - box.middle).cwiseAbs().array() <= box.size.array() / 2).all();
}

std::vector<Material> materials_of(const Mesh& mesh, const Material& elsewhere, std::span<const Region> regions) {
  if (regions.empty()) return {};
  std::vector<std::size_t> region_of(at(mesh.element_count()), regions.size());
  for (int e = 0; e < mesh.element_count(); ++e) {
    const Vec3 place = middle(mesh, e);
    for (std::size_t i = 0; i < regions.size(); ++i) {
      if (regions[i].has(place)) region_of[at(e)] = i;
    }
  }
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (std::ranges::find(region_of, i) != region_of.end()) continue;
    throw std::invalid_argument(
        "region " + std::to_string(i + 1) +
        " has no elements: it is outside the body, smaller than an element, or covered by a later region");
  }
  std::vector<Material> all;
  for (const std::size_t region : region_of) {
    all.push_back(region < regions.size() ? regions[region].material : elsewhere);
  }
  return all;
}

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "clients/softbody/surface/triangles.h"

namespace tendon::softbody::testing {

/// `round` facets along the equator, which are at `radius` on average.
inline Triangles ball(double radius, int round) {
  const int up = round / 2;
  const double step = std::numbers::pi / up;
  const double out = radius / (1 - step * step / 12);
  Triangles made;
  made.points.emplace_back(0, 0, -out);
  for (int j = 1; j < up; ++j) {
    for (int i = 0; i < round; ++i) {
      const double longitude = 2 * std::numbers::pi * i / round;
      const double latitude = std::numbers::pi * (static_cast<double>(j) / up - 0.5);
      made.points.emplace_back(out * Vec3(std::cos(longitude) * std::cos(latitude),
                                          std::sin(longitude) * std::cos(latitude), std::sin(latitude)));
    }
  }
  made.points.emplace_back(0, 0, out);
  const auto number = [&](int i, int j) { return 1 + (j - 1) * round + i % round; };
  const int last = static_cast<int>(made.points.size()) - 1;
  for (int i = 0; i < round; ++i) {
    made.facets.push_back({0, number(i + 1, 1), number(i, 1)});
    made.facets.push_back({last, number(i, up - 1), number(i + 1, up - 1)});
    for (int j = 1; j < up - 1; ++j) {
      made.facets.push_back({number(i, j), number(i + 1, j), number(i + 1, j + 1)});
      made.facets.push_back({number(i, j), number(i + 1, j + 1), number(i, j + 1)});
    }
  }
  return made;
}

/// A box around the origin with two facets per side.
inline Triangles box_surface(const Vec3& size) {
  Triangles made;
  for (const double z : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      for (const double x : {-0.5, 0.5}) made.points.emplace_back(size.cwiseProduct(Vec3(x, y, z)));
    }
  }
  constexpr std::array<std::array<int, 4>, 6> kSides{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& side : kSides) {
    made.facets.push_back({side[0], side[1], side[2]});
    made.facets.push_back({side[0], side[2], side[3]});
  }
  return made;
}

inline Triangles moved(Triangles surface, double scale, const Vec3& way) {
  for (Vec3& point : surface.points) point = scale * point + way;
  return surface;
}

inline Triangles together(const Triangles& first, const Triangles& second) {
  Triangles made = first;
  const int shift = static_cast<int>(first.points.size());
  made.points.insert(made.points.end(), second.points.begin(), second.points.end());
  for (const auto& facet : second.facets) made.facets.push_back({facet[0] + shift, facet[1] + shift, facet[2] + shift});
  return made;
}

inline Triangles turned_inside_out(Triangles surface) {
  for (auto& facet : surface.facets) std::swap(facet[1], facet[2]);
  return surface;
}

}  // namespace tendon::softbody::testing

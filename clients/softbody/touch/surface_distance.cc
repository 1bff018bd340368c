// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/surface_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace tendon::softbody {
namespace {

constexpr int kFacetsOfABox = 4;

double squared_way_to(const Vec3& low, const Vec3& high, const Vec3& x) {
  return (low - x).cwiseMax(x - high).cwiseMax(0.0).squaredNorm();
}

}  // namespace

SurfaceDistance::SurfaceDistance(const Triangles& surface) {
  std::map<std::pair<int, int>, Vec3> normal_left_of;  // edge → normal of its facet
  std::vector<Vec3> at_points(surface.points.size(), Vec3::Zero());
  facets_.resize(surface.facets.size());
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    const auto& points = surface.facets[f];
    auto& corners = facets_[f].corners;
    for (std::size_t i = 0; i < 3; ++i) corners[i] = surface.points[softbody::at(points[i])];
    facets_[f].normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    for (std::size_t i = 0; i < 3; ++i) {
      normal_left_of[{points[i], points[(i + 1) % 3]}] = facets_[f].normal;
      const Vec3 ahead = (corners[(i + 1) % 3] - corners[i]).normalized();
      const Vec3 behind = (corners[(i + 2) % 3] - corners[i]).normalized();
      at_points[softbody::at(points[i])] += std::acos(std::clamp(ahead.dot(behind), -1.0, 1.0)) * facets_[f].normal;
    }
  }
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    const auto& points = surface.facets[f];
    for (std::size_t i = 0; i < 3; ++i) {
      facets_[f].edges[i] = facets_[f].normal + normal_left_of.at({points[(i + 1) % 3], points[i]});
      facets_[f].of_corners[i] = at_points[softbody::at(points[i])];
    }
  }
  divide(0, static_cast<int>(facets_.size()));
}

int SurfaceDistance::divide(int first, int count) {
  BoxOfFacets made{.low = Vec3::Constant(std::numeric_limits<double>::infinity()),
                   .high = Vec3::Constant(-std::numeric_limits<double>::infinity()),
                   .first = first,
                   .count = count};
  for (int f = first; f < first + count; ++f) {
    for (const Vec3& corner : facets_[softbody::at(f)].corners) {
      made.low = made.low.cwiseMin(corner);
      made.high = made.high.cwiseMax(corner);
    }
  }
  const int number = static_cast<int>(boxes_.size());
  boxes_.push_back(made);
  if (count <= kFacetsOfABox) return number;
  Eigen::Index along = 0;
  (made.high - made.low).maxCoeff(&along);
  const auto begin = facets_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count, [&](const FlatFacet& a, const FlatFacet& b) {
    return a.corners[0][along] + a.corners[1][along] + a.corners[2][along] <
           b.corners[0][along] + b.corners[1][along] + b.corners[2][along];
  });
  boxes_[softbody::at(number)].count = 0;
  divide(first, count / 2);
  const int second = divide(first + count / 2, count - count / 2);
  boxes_[softbody::at(number)].second = second;
  return number;
}

/// Ericson, Real-Time Collision Detection, 2005, 5.1.5.
SurfaceDistance::NearestPoint SurfaceDistance::nearest(const FlatFacet& facet, const Vec3& x) {
  const auto& [a, b, c] = facet.corners;
  const auto found = [&](const Vec3& point, const Vec3& normal) {
    return NearestPoint{(x - point).squaredNorm(), x - point, normal};
  };
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const double d1 = ab.dot(x - a);
  const double d2 = ac.dot(x - a);
  if (d1 <= 0 && d2 <= 0) return found(a, facet.of_corners[0]);
  const double d3 = ab.dot(x - b);
  const double d4 = ac.dot(x - b);
  if (d3 >= 0 && d4 <= d3) return found(b, facet.of_corners[1]);
  const double d5 = ab.dot(x - c);
  const double d6 = ac.dot(x - c);
  if (d6 >= 0 && d5 <= d6) return found(c, facet.of_corners[2]);
  if (d1 * d4 - d3 * d2 <= 0 && d1 >= 0 && d3 <= 0) return found(a + d1 / (d1 - d3) * ab, facet.edges[0]);
  if (d5 * d2 - d1 * d6 <= 0 && d2 >= 0 && d6 <= 0) return found(a + d2 / (d2 - d6) * ac, facet.edges[2]);
  if (d3 * d6 - d5 * d4 <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return found(b + (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b), facet.edges[1]);
  }
  return found(x - facet.normal.dot(x - a) * facet.normal, facet.normal);
}

void SurfaceDistance::look(int number, const Vec3& x, NearestPoint& found) const {
  const BoxOfFacets& box = boxes_[softbody::at(number)];
  for (int f = box.first; f < box.first + box.count; ++f) {
    const NearestPoint there = nearest(facets_[softbody::at(f)], x);
    if (there.squared < found.squared) found = there;
  }
  if (box.count > 0) return;
  std::array<int, 2> halves{number + 1, box.second};
  std::array<double, 2> ways{};
  for (std::size_t i = 0; i < 2; ++i) {
    const BoxOfFacets& half = boxes_[softbody::at(halves[i])];
    ways[i] = squared_way_to(half.low, half.high, x);
  }
  const std::size_t nearer = ways[0] <= ways[1] ? 0 : 1;
  if (ways[nearer] < found.squared) look(halves[nearer], x, found);
  if (ways[1 - nearer] < found.squared) look(halves[1 - nearer], x, found);
}

double SurfaceDistance::at(const Vec3& x, double at_most) const {
  // The margin is for rounding errors.
  NearestPoint found{at_most * at_most * (1 + 1e-6) + std::numeric_limits<double>::min(), Vec3::Zero(), Vec3::Zero()};
  look(0, x, found);
  return std::copysign(std::sqrt(found.squared), found.away.dot(found.normal));
}

Vec3 SurfaceDistance::nearest_point(const Vec3& x, double at_most) const {
  NearestPoint found{at_most * at_most, Vec3::Zero(), Vec3::Zero()};
  look(0, x, found);
  return x - found.away;
}

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "clients/softbody/surface/triangles.h"

namespace tendon::softbody {

/// The exact signed distance from a closed surface of triangles, negative inside. The sign follows from the normal at
/// the nearest point: of a facet, the mean of two, or the mean of all facets at a corner weighted by their angles
/// (Bærentzen & Aanæs, Signed distance computation using the angle weighted pseudonormal, 2005). The facets are in a
/// tree of boxes: a query of twice as many needs some hundred instructions more.
/// Stateless. Thread-safe: yes. Realtime-safe: yes, after construction.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const Triangles& surface);  ///< `surface` must have passed check()

  /// The distance of `x` must not be larger than `at_most`, which limits the search.
  double at(const Vec3& x, double at_most = std::numeric_limits<double>::infinity()) const;

  /// Returns `x` if the surface is farther than `at_most`.
  Vec3 nearest_point(const Vec3& x, double at_most) const;

 private:
  struct FlatFacet {
    std::array<Vec3, 3> corners;
    Vec3 normal;  ///< unit vector
    std::array<Vec3, 3> edges;
    std::array<Vec3, 3> of_corners;
  };
  struct BoxOfFacets {
    Vec3 low, high;
    int first = 0;
    int count = 0;  ///< if 0, the halves are the next box and `second`
    int second = 0;
  };
  struct NearestPoint {
    double squared;
    Vec3 away;
    Vec3 normal;  ///< of any length
  };
  int divide(int first, int count);
  static NearestPoint nearest(const FlatFacet& facet, const Vec3& x);
  void look(int box, const Vec3& x, NearestPoint& found) const;

  std::vector<FlatFacet> facets_;
  std::vector<BoxOfFacets> boxes_;
};

}  // namespace tendon::softbody

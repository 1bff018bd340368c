// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "clients/softbody/surface/triangles.h"

namespace tendon::softbody {

/// The exact signed distance from a closed triangle surface, negative inside. The nearest point is in a facet, on an
/// edge or at a corner. The sign comes from the pseudonormal there: the facet normal, the mean of two facets, or the
/// angle-weighted mean around the corner (Bærentzen & Aanæs, Signed distance computation using the angle weighted
/// pseudonormal, 2005).
///
/// Facets are kept in a tree of boxes; a query costs some hundred instructions per doubling of their number.
///
/// Stateless. Thread-safe: yes. Realtime-safe: yes, after construction.
class SurfaceDistance {
 public:
  /// `surface` must have passed check() and have at least one facet.
  explicit SurfaceDistance(const Triangles& surface);

  /// At `x`, in the surface's unit. `at_most`: upper bound of the distance, which limits the search.
  double at(const Vec3& x, double at_most = std::numeric_limits<double>::infinity()) const;

 private:
  struct FlatFacet {
    std::array<Vec3, 3> corners;
    Vec3 normal;                     ///< unit vector
    std::array<Vec3, 3> edges;       ///< edge normals, from each corner to the next
    std::array<Vec3, 3> of_corners;  ///< corner normals
  };
  /// A box around some facets: a leaf, or an inner node with two halves.
  struct BoxOfFacets {
    Vec3 low, high;
    int first = 0;  ///< facet
    int count = 0;  ///< own facets; 0: the halves are the next box and `second`
    int second = 0;
  };
  struct NearestPoint {
    double squared;
    Vec3 away;    ///< from the nearest surface point to x
    Vec3 normal;  ///< pseudonormal, not normalized
  };
  int divide(int first, int count);
  static NearestPoint nearest(const FlatFacet& facet, const Vec3& x);
  void look(int box, const Vec3& x, NearestPoint& found) const;

  std::vector<FlatFacet> facets_;
  std::vector<BoxOfFacets> boxes_;
};

}  // namespace tendon::softbody

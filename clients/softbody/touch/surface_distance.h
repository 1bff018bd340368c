// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "clients/softbody/surface/triangles.h"

namespace tendon::softbody {

/// The exact signed distance of a point from a closed surface of triangles: that to the nearest point of the surface,
/// below 0 inside. The nearest point lies in a facet, on an edge or in a corner; there the surface's normal is the
/// facet's, the mean of both facets' or that of all facets around the corner, each by its angle there, and its side
/// says the sign (Bærentzen & Aanæs, Signed distance computation using the angle weighted pseudonormal, 2005).
///
/// Facets lie in a tree of boxes: a question costs some hundred instructions for each doubling of their number.
///
/// Without state. Thread-safe: yes. Realtime-safe: yes, once built.
class SurfaceDistance {
 public:
  /// `surface` must have passed check(), and have 1 facet or more.
  explicit SurfaceDistance(const Triangles& surface);

  /// At `x`, in the surface's unit. `at_most`: no point of the surface that is farther is looked for; the nearest may not
  /// be farther.
  double at(const Vec3& x, double at_most = std::numeric_limits<double>::infinity()) const;

 private:
  struct FlatFacet {
    std::array<Vec3, 3> corners;
    Vec3 normal;                     ///< a unit vector
    std::array<Vec3, 3> edges;       ///< normals, of the edge from each corner to the next
    std::array<Vec3, 3> of_corners;  ///< normals
  };
  /// A box around some facets: two halves, or few facets.
  struct BoxOfFacets {
    Vec3 low, high;
    int first = 0;  ///< facet
    int count = 0;  ///< of its own; 0: the halves are the next box and `second`
    int second = 0;
  };
  struct NearestPoint {
    double squared;
    Vec3 away;    ///< from the surface's point to x
    Vec3 normal;  ///< of the surface there, of any length
  };
  int divide(int first, int count);
  static NearestPoint nearest(const FlatFacet& facet, const Vec3& x);
  void look(int box, const Vec3& x, NearestPoint& found) const;

  std::vector<FlatFacet> facets_;
  std::vector<BoxOfFacets> boxes_;
};

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "clients/softbody/surface/triangles.h"
#include "clients/softbody/touch/distance_grid.h"

namespace tendon::softbody {

/// Returns the shortest rotation. For opposite directions, the axis is close to z, or to x if `from` is close to z.
Mat3 shortest_rotation(const Vec3& from, const Vec3& to);

/// The shape of a rigid tool, as the signed distance from all points within `rounding` of a box, the core. A core
/// without size is a sphere, a core with one length is a capsule, and other cores are boxes with round edges. With the
/// componentwise q = |x| − core and w = max(q, 0):
///
///     φ = |w| − rounding outside the core,   max q − rounding inside it
///
/// φ is exact outside the core, and its gradient is continuous there. Its second derivative has a step between flat and
/// round sides. Inside the core, the gradient has a step halfway between two sides. The shape can also be the inside of
/// a closed surface, with distances on a grid (DistanceGrid).
///
/// Stateless. Thread-safe: yes. Realtime-safe: yes, after construction.
class RigidShape {
 public:
  static RigidShape sphere(double radius);  ///< lengths in m; throws std::invalid_argument with the field's name
  /// `half_length` is the distance from the center to the center of an end. `axis` is a unit vector.
  static RigidShape capsule(double radius, double half_length, const Vec3& axis);
  static RigidShape box(const Vec3& size, double edge);  ///< `edge` rounds edges and corners, ≤ half of the least size
  /// The inside of `surface`. `scale` is the number of units per metre, and `around` is the margin of the grid (m).
  /// Throws std::invalid_argument with `name` if the surface does not pass check(), contains parts inside each other,
  /// or is thinner than two cells.
  static RigidShape mesh(const Triangles& surface, double scale, double cell, double around, std::string_view name);

  Distance distance(const Vec3& x) const;  ///< `x` in the tool frame; value() is faster
  double value(const Vec3& x) const;

  double reach() const noexcept { return reach_; }  ///< distance (m) from the center to the farthest point

  double thinnest() const noexcept { return thinnest_; }  ///< lower bound of the thickness (m)

  Vec3 farthest(const Vec3& direction) const;  ///< m, point along `direction`, a unit vector; tool frame

  struct MeshFacts {
    std::size_t facets;
    Vec3 size;    ///< m
    double cell;  ///< m
    std::size_t points;
    std::size_t bytes;
    double error;  ///< m, the largest |φ| on the surface
  };
  const MeshFacts* mesh_facts() const noexcept { return mesh_ ? &mesh_->facts : nullptr; }

 private:
  RigidShape(const Vec3& core, double rounding, const Mat3& turn);
  struct Mesh {
    std::vector<Vec3> points;
    DistanceGrid grid;
    MeshFacts facts;
    double thinnest;  ///< m
  };
  explicit RigidShape(Mesh mesh);

  Vec3 core_ = Vec3::Zero();  ///< m, half of the size
  double rounding_ = 0;
  Mat3 turn_ = Mat3::Identity();  ///< axes of the core in the tool frame
  std::optional<Mesh> mesh_;      ///< used in place of the members above
  double reach_;
  double thinnest_;
};

}  // namespace tendon::softbody

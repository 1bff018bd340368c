// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "clients/softbody/surface/triangles.h"
#include "clients/softbody/touch/distance_grid.h"

namespace tendon::softbody {

/// The shortest rotation that takes direction `from` to `to`; both nonzero. For opposite directions: half a turn about
/// the perpendicular axis closest to z, or to x if `from` is closer to z.
Mat3 shortest_rotation(const Vec3& from, const Vec3& to);

/// The shape of a rigid tool around its center, as a signed distance: all points within `rounding` of a box, the core.
/// A core of size zero gives a sphere, a one-dimensional core a capsule, and others a box with round edges. With the
/// componentwise q = |x| − core and w = max(q, 0):
///
///     φ = |w| − rounding outside the core,   max q − rounding inside it
///
/// φ is exact outside the core. There its gradient is continuous, and the second derivative jumps where a flat side
/// meets a round edge. Inside the core the gradient is discontinuous halfway between two sides.
///
/// Or the inside of a closed triangle surface, with distances on a grid (DistanceGrid): φ then has two continuous
/// derivatives, with the error given in MeshFacts.
///
/// Stateless. Thread-safe: yes. Realtime-safe: yes, after construction.
class RigidShape {
 public:
  /// Lengths in m. Each throws std::invalid_argument that names the field.
  static RigidShape sphere(double radius);
  /// `half_length`: from the center to the center of each end, ≥ 0; `axis`: unit vector.
  static RigidShape capsule(double radius, double half_length, const Vec3& axis);
  /// `size`: of the whole box along its axes; `edge`: radius of edges and corners, positive and at most half of the
  /// smallest size.
  static RigidShape box(const Vec3& size, double edge);
  /// The inside of `surface` around its origin, with `scale` units per metre, cells of `cell` m, and a grid margin of
  /// `around` m. Takes some µs per grid point. Throws std::invalid_argument that starts with `name` if the surface does
  /// not pass check(), has nested parts, or is thinner than 2 cells at some place, which the message names: the grid
  /// could not resolve it.
  static RigidShape mesh(const Triangles& surface, double scale, double cell, double around, std::string_view name);

  /// At `x`, m, tool frame. value() returns φ only, for a fraction of the work.
  Distance distance(const Vec3& x) const;
  double value(const Vec3& x) const;

  /// m, distance from the center to the farthest surface point.
  double reach() const noexcept { return reach_; }

  /// m, lower bound of the tool's thickness: a point that moves an eighth of it cannot pass through the tool
  /// undetected.
  double thinnest() const noexcept { return thinnest_; }

  /// Surface point farthest along `direction`, m, relative to the center. `direction` is a unit vector in the tool
  /// frame.
  Vec3 farthest(const Vec3& direction) const;

  /// Properties of a surface and its grid.
  struct MeshFacts {
    std::size_t facets;
    Vec3 size;           ///< m, of the bounding box
    double cell;         ///< m
    std::size_t points;  ///< of the grid
    std::size_t bytes;   ///< kept by each copy of the shape
    double error;        ///< m, largest |φ| at corners and at the centers of edges and facets, where φ should be 0
  };
  /// null unless made by mesh()
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

  Vec3 core_ = Vec3::Zero();  ///< half of the core's size, m
  double rounding_ = 0;
  Mat3 turn_ = Mat3::Identity();  ///< the core's axes, as columns, in the tool frame
  std::optional<Mesh> mesh_;      ///< replaces the members above
  double reach_;
  double thinnest_;
};

}  // namespace tendon::softbody

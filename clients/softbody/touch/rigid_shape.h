// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "clients/softbody/surface/triangles.h"
#include "clients/softbody/touch/distance_grid.h"

namespace tendon::softbody {

/// The shortest rotation that takes the direction of `from` to that of `to`; neither is zero. Between opposite directions
/// it is half a turn about the axis across `from` that is nearest to z, or to x where `from` is nearer to z.
Mat3 shortest_rotation(const Vec3& from, const Vec3& to);

/// The shape of a rigid tool, around its own middle, as a signed distance: all points within `rounding` of a box, the
/// core. A core without size makes a sphere, one of a single length a capsule, and any other a box with round edges.
/// With q = |x| − core, taken for each axis, and w the part of q above 0:
///
///     φ = |w| − rounding outside the core,   max q − rounding inside it
///
/// φ is the exact distance everywhere outside the core. There it has one derivative everywhere, and a second one that
/// jumps where a flat side meets a round edge. Inside the core it lacks the first one halfway between two sides.
///
/// Or the inside of a closed surface of triangles, whose distances are kept on a grid (DistanceGrid): φ then has two
/// continuous derivatives everywhere, and is right to what MeshFacts says.
///
/// Without state. Thread-safe: yes. Realtime-safe: yes, once built.
class RigidShape {
 public:
  /// Lengths in m. Each throws std::invalid_argument that names the field.
  static RigidShape sphere(double radius);
  /// `half_length`: from the middle to the centre of each end, 0 or more; `axis`: a unit vector.
  static RigidShape capsule(double radius, double half_length, const Vec3& axis);
  /// `size`: of the whole box along its three axes; `edge`: the radius of its edges and corners, above 0 and at most
  /// half of the least size.
  static RigidShape box(const Vec3& size, double edge);
  /// The inside of `surface` (in units of which `scale` is one in m), around its origin; with cells of `cell`, m, on a
  /// grid that goes on for `around`, m, outside of it. Takes some µs for each point of the grid. Throws
  /// std::invalid_argument, which begins with `name`, when the surface does not pass check(), has parts within others,
  /// or is somewhere thinner than 2 cells: the grid would not see that. The sentence names the place.
  static RigidShape mesh(const Triangles& surface, double scale, double cell, double around, std::string_view name);

  /// At `x`, m, in the tool's frame; and φ alone, for a fraction of the work.
  Distance distance(const Vec3& x) const;
  double value(const Vec3& x) const;

  /// m, from the middle to the point of the surface that is farthest from it.
  double reach() const noexcept { return reach_; }

  /// m, how thick the tool is where it is thinnest, or less: a point that goes an eighth as far cannot come through it
  /// unseen.
  double thinnest() const noexcept { return thinnest_; }

  /// m, from the middle to the point of the surface that is farthest along `direction`, a unit vector in the tool's
  /// frame.
  Vec3 farthest(const Vec3& direction) const;

  /// What a surface and its grid are.
  struct MeshFacts {
    std::size_t facets;
    Vec3 size;           ///< m, of the box around the surface
    double cell;         ///< m
    std::size_t points;  ///< of the grid
    std::size_t bytes;   ///< kept, by each copy of the shape
    double error;  ///< m, the largest |φ| at corners and in the middles of edges and facets, where φ should be 0
  };
  const MeshFacts* mesh_facts() const noexcept { return mesh_ ? &mesh_->facts : nullptr; }  ///< of mesh(), or null

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
  Mat3 turn_ = Mat3::Identity();  ///< the core's axes, as columns, in the tool's frame
  std::optional<Mesh> mesh_;      ///< in place of these
  double reach_;
  double thinnest_;
};

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>
#include <variant>

#include "clients/softbody/touch/rigid_shape.h"

namespace tendon::softbody {

/// Presses a surface patch of fixed size.
struct PatchTool {
  double radius = 0;  ///< m; contact starts this much earlier. 0 for a point.
};
struct SphereTool {
  double radius;  ///< m
};
struct CapsuleTool {
  double radius;              ///< m
  double half_length;         ///< m, from the center to the center of an end
  Vec3 axis = Vec3::UnitZ();  ///< unit vector, handle frame
};
struct BoxTool {
  Vec3 size;    ///< m, along the handle axes
  double edge;  ///< m, radius of edges and corners
};
/// The inside of a closed surface: RigidShape::mesh().
struct MeshTool {
  std::filesystem::path file;  ///< read by read_surface(); axes are the handle's
  double scale;                ///< from file units to m
  double cell;                 ///< m, cell size of the distance grid
};
/// All tools except the patch are rigid, with a contact area that grows with the force. kCondensed supports sphere and
/// capsule, without friction. kCorotational and kNeoHookean support all tools (touch/rigid_contact.h).
using Tool = std::variant<PatchTool, SphereTool, CapsuleTool, BoxTool, MeshTool>;

inline bool is_patch(const Tool& tool) { return std::holds_alternative<PatchTool>(tool); }
inline bool is_sphere(const Tool& tool) { return std::holds_alternative<SphereTool>(tool); }

/// Name with its article, for messages: "a sphere".
std::string_view name_of(const Tool& tool);

/// m; 0 for a box and a mesh.
double radius_of(const Tool& tool);

/// The shape of a rigid tool; a patch counts as a sphere of its radius. `layer` is Layer::Config::thickness in m. For a
/// mesh, computes a distance grid, which takes a few tenths of a second. Throws std::invalid_argument if the file or
/// its surface is invalid.
RigidShape shape_of(const Tool& tool, double layer);

/// Vector from the tool's center to its lowest point, m. `up` is a unit vector. Both are in the body frame; `turn`
/// rotates the handle frame into it. Throws the errors of shape_of().
Vec3 lowest_of(const Tool& tool, double layer, const Mat3& turn, const Vec3& up);

}  // namespace tendon::softbody

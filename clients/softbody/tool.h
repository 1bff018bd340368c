// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>
#include <variant>

#include "clients/softbody/touch/rigid_shape.h"

namespace tendon::softbody {

/// Presses a patch of the surface. The size of the patch does not change.
struct PatchTool {
  double radius = 0;  ///< m. The tool touches earlier by this distance. It is 0 for a point.
};
struct SphereTool {
  double radius;  ///< m
};
struct CapsuleTool {
  double radius;              ///< m
  double half_length;         ///< m. The distance from the middle to the centre of an end.
  Vec3 axis = Vec3::UnitZ();  ///< A unit vector in the handle frame, from end to end.
};
struct BoxTool {
  Vec3 size;    ///< m. The axes are those of the handle.
  double edge;  ///< m. The radius of the edges and corners.
};
/// The inside of a closed surface: RigidShape::mesh().
struct MeshTool {
  std::filesystem::path file;  ///< Read by read_surface(). The axes are those of the handle.
  double scale;                ///< Converts the units of the file to m.
  double cell;                 ///< m. The cell size of the distance grid.
};
/// All tools except the patch are rigid, and their contact area grows with the force. The model kCondensed supports the
/// sphere and the capsule, without friction. kCorotational and kNeoHookean support all tools (touch/rigid_contact.h).
using Tool = std::variant<PatchTool, SphereTool, CapsuleTool, BoxTool, MeshTool>;

inline bool is_patch(const Tool& tool) { return std::holds_alternative<PatchTool>(tool); }
inline bool is_sphere(const Tool& tool) { return std::holds_alternative<SphereTool>(tool); }

/// Returns the name with its article, for messages: "a sphere".
std::string_view name_of(const Tool& tool);

/// Returns the radius in m. It is 0 for a box and a mesh.
double radius_of(const Tool& tool);

/// Returns the shape of a rigid tool. `layer` is Layer::Config::thickness in m. For a mesh, this computes a distance grid,
/// which takes a few tenths of a second. Throws std::invalid_argument if the file or its surface is refused. A patch
/// counts as a sphere with the same radius.
RigidShape shape_of(const Tool& tool, double layer);

/// Returns the vector in m from the middle of the tool to its lowest point. `up` is a unit vector. Both are in the body
/// frame, and `turn` rotates the handle frame into it. Throws the same errors as shape_of().
Vec3 lowest_of(const Tool& tool, double layer, const Mat3& turn, const Vec3& up);

}  // namespace tendon::softbody

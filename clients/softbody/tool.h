// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>
#include <variant>

#include "clients/softbody/touch/rigid_shape.h"

namespace tendon::softbody {

/// A patch of the surface with a fixed size.
struct PatchTool {
  double radius = 0;  ///< m; contact starts at this distance
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
struct MeshTool {
  std::filesystem::path file;
  double scale;
  double cell;  ///< m, cell size of the distance grid
};
/// All tools except the patch are rigid. kCondensed supports sphere and capsule without friction. kCorotational and
/// kNeoHookean support all tools (touch/rigid_contact.h).
using Tool = std::variant<PatchTool, SphereTool, CapsuleTool, BoxTool, MeshTool>;

inline bool is_patch(const Tool& tool) { return std::holds_alternative<PatchTool>(tool); }
inline bool is_sphere(const Tool& tool) { return std::holds_alternative<SphereTool>(tool); }

std::string_view name_of(const Tool& tool);  ///< with an article: "a sphere"

double radius_of(const Tool& tool);  ///< radius in m, or 0 for a box and a mesh

/// Returns the shape of a rigid tool. A patch is treated as a sphere. `layer` is Layer::Config::thickness. A mesh needs
/// some tenths of a second for its grid. Throws std::invalid_argument if the file is invalid.
RigidShape shape_of(const Tool& tool, double layer);

/// Returns the vector (m) from the center of the tool to its lowest point. `up` is a unit vector. Both are in the body
/// frame, and `turn` is the rotation from the handle frame. Throws the errors of shape_of().
Vec3 lowest_of(const Tool& tool, double layer, const Mat3& turn, const Vec3& up);

}  // namespace tendon::softbody

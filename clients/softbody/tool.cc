// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/tool.h"

#include <array>
#include <cmath>

#include "clients/softbody/surface/surface_file.h"

namespace tendon::softbody {

std::string_view name_of(const Tool& tool) {
  constexpr std::array kNames = {"a patch", "a sphere", "a capsule", "a box", "a tool of a file"};
  static_assert(kNames.size() == std::variant_size_v<Tool>);
  return kNames[tool.index()];
}

double radius_of(const Tool& tool) {
  if (const auto* patch = std::get_if<PatchTool>(&tool)) return patch->radius;
  if (const auto* sphere = std::get_if<SphereTool>(&tool)) return sphere->radius;
  const auto* capsule = std::get_if<CapsuleTool>(&tool);
  return capsule != nullptr ? capsule->radius : 0;
}

RigidShape shape_of(const Tool& tool, double layer) {
  if (const auto* capsule = std::get_if<CapsuleTool>(&tool)) {
    return RigidShape::capsule(capsule->radius, capsule->half_length, capsule->axis);
  }
  if (const auto* box = std::get_if<BoxTool>(&tool)) return RigidShape::box(box->size, box->edge);
  if (const auto* mesh = std::get_if<MeshTool>(&tool)) {
    return RigidShape::mesh(read_surface(mesh->file), mesh->scale, mesh->cell, layer, mesh->file.string());
  }
  return RigidShape::sphere(radius_of(tool));
}

Vec3 lowest_of(const Tool& tool, double layer, const Mat3& turn, const Vec3& up) {
  if (std::holds_alternative<BoxTool>(tool) || std::holds_alternative<MeshTool>(tool)) {
    return turn * shape_of(tool, layer).farthest(turn.transpose() * -up);
  }
  Vec3 lowest = -radius_of(tool) * up;
  if (const auto* capsule = std::get_if<CapsuleTool>(&tool)) {
    const Vec3 half = turn * (capsule->half_length * capsule->axis);
    const double along = half.dot(up);
    if (std::abs(along) > 1e-9 * capsule->half_length) lowest -= std::copysign(1.0, along) * half;
  }
  return lowest;
}

}  // namespace tendon::softbody

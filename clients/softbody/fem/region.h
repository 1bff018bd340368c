// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <variant>
#include <vector>

#include "clients/softbody/fem/material.h"
#include "clients/softbody/fem/mesh.h"

namespace tendon::softbody {

/// A part of a body that is made of another material: a tumour, a bone, a layer. It has the elements whose middle lies
/// in it, so its side is as smooth as the mesh.
struct Region {
  struct Ball {
    Vec3 middle;    ///< m, in the body's frame at rest
    double radius;  ///< m
  };
  struct Box {
    Vec3 middle;  ///< m
    Vec3 size;    ///< m, along the axes of the body's frame
  };
  std::variant<Ball, Box> where;
  Material material;

  bool has(const Vec3& place) const;
};

/// The material of each element: that of the last region that has its middle, else `elsewhere`. Empty without regions.
/// Throws std::invalid_argument that names the region when no element is of its material.
std::vector<Material> materials_of(const Mesh& mesh, const Material& elsewhere, std::span<const Region> regions);

}  // namespace tendon::softbody

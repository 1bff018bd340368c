// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <variant>
#include <vector>

#include "clients/softbody/fem/material.h"
#include "clients/softbody/fem/mesh.h"

namespace tendon::softbody {

/// A part of a body with a different material: a tumor, a bone, a layer. It consists of the elements whose center lies
/// inside, so its boundary is as smooth as the mesh.
struct Region {
  struct Ball {
    Vec3 middle;    ///< m, body frame at rest
    double radius;  ///< m
  };
  struct Box {
    Vec3 middle;
    Vec3 size;  ///< m
  };
  std::variant<Ball, Box> where;
  Material material;

  bool has(const Vec3& place) const;
};

/// The material of each element: that of the last region containing its center, else `elsewhere`. Empty if there are no
/// regions. Throws std::invalid_argument, naming the region, if a region contains no element center.
std::vector<Material> materials_of(const Mesh& mesh, const Material& elsewhere, std::span<const Region> regions);

}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "core/field/brick_field.h"
#include "core/field/fixture.h"
#include "core/field/material.h"
#include "core/field/primitives.h"

namespace tendon::field {

/// The description of one object that is uploaded by an engine. The solid is the union of all shapes:
///     φ = the smallest φ of the bricks and the primitives
/// Where two of them meet, they should overlap by 1 mm or more, because the proxy can slide into a seam.
/// Must be built outside the haptic thread.
struct Field {
  static constexpr std::size_t kMostPrimitives = 32;
  static constexpr std::size_t kMostMaterials = 8;
  static constexpr std::size_t kMostTables = 3;  ///< of the materials; a UseField must fit into a datagram
  static constexpr std::size_t kMostFixtures = 4;
  static constexpr double kPrimitiveSpacing = 1e-3;  ///< m, the spacing of a field without bricks

  const BrickField* bricks = nullptr;  ///< may be null; not owned. An unknown material of a brick is material 0
  std::vector<Primitive> primitives{};
  std::vector<Material> materials{Material{}};
  std::vector<Fixture> fixtures{};

  /// Throws std::invalid_argument with the name of the field if there are too many parts, if a part is out of its
  /// range, if a material is stiffer than `max_stiffness` (N/m), or if a primitive has a material that does not exist.
  void expect_valid(double max_stiffness) const;

  bool has_surface() const noexcept { return bricks != nullptr || !primitives.empty(); }

  /// Realtime-safe: yes.
  SurfacePoint at(const Vec3& x) const noexcept;
  double spacing() const noexcept { return bricks != nullptr ? bricks->lattice().spacing : kPrimitiveSpacing; }
};

}  // namespace tendon::field

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <vector>

#include "core/base/bytes.h"
#include "core/field/brick_field.h"
#include "core/field/primitives.h"
#include "protocol/field/sender.h"

namespace tendon {

/// An object in bricks, as an engine uploads it.
struct FieldShape {
  FieldLattice lattice;
  std::vector<FieldSender::Brick> bricks;
  std::vector<field::Primitive> primitives{};

  /// The bricks, as the haptic thread uses it.
  field::BrickField built() const {
    field::BrickField field;
    field.reset(lattice);
    for (const FieldSender::Brick& brick : bricks) {
      field::BrickField::Weights weights;
      for (std::size_t i = 0; i < weights.size(); ++i) {
        weights[i] = static_cast<std::int16_t>(get_little_endian<std::uint16_t>(&brick.bytes[2 * i]));
      }
      field.put({static_cast<std::uint16_t>(brick.place[0]), static_cast<std::uint16_t>(brick.place[1]),
                 static_cast<std::uint16_t>(brick.place[2])},
                weights, brick.material);
    }
    field.finish();
    return field;
  }
};

using SignedDistance = std::function<double(const Vec3&)>;

inline SignedDistance sphere_at(const Vec3& centre, double radius) {
  return [=](const Vec3& x) { return (x - centre).norm() - radius; };
}

/// The bricks of `distance` in a cube with the least corner `low`, of `side` bricks along each axis.
inline FieldShape shape_of(const SignedDistance& distance, const Vec3& low, std::uint16_t side, double spacing) {
  FieldShape shape{
      .lattice = {.origin = low, .spacing = spacing, .scale = 16 * spacing / 32767, .bricks = {side, side, side}},
      .bricks = {}};
  const double brick = 8 * spacing;
  for (std::uint16_t z = 0; z < side; ++z) {
    for (std::uint16_t y = 0; y < side; ++y) {
      for (std::uint16_t x = 0; x < side; ++x) {
        const Vec3 centre = low + brick * Vec3(x + 0.5, y + 0.5, z + 0.5);
        if (std::abs(distance(centre)) > brick * 0.87 + 2.5 * spacing) continue;
        const auto weights = field::weights_of(distance, shape.lattice, {x, y, z});
        FieldSender::Brick& one = shape.bricks.emplace_back();
        one.place = {x, y, z};
        for (std::size_t i = 0; i < weights.size(); ++i) {
          put_little_endian(static_cast<std::uint16_t>(weights[i]), &one.bytes[2 * i]);
        }
      }
    }
  }
  return shape;
}

}  // namespace tendon

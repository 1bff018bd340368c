// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/field_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/base/bytes.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::field_of_test {
namespace {

/// A cube with sides of 40 mm around the origin.
Triangles cube() {
  Triangles surface;
  for (int i = 0; i < 8; ++i) {
    surface.points.push_back(0.02 * Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  }
  surface.facets = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return surface;
}

TEST(FieldOf, ACubeHasItsSidesAtTheirPlaces) {
  const Field field = field_of(cube(), {.spacing = 2e-3, .material = 3});
  field::BrickField bricks;
  bricks.reset(field.lattice);
  for (const FieldSender::Brick& brick : field.bricks) {
    field::BrickField::Place place{};
    std::ranges::transform(brick.place, place.begin(), [](auto along) { return static_cast<std::uint16_t>(along); });
    field::BrickField::Weights weights{};
    for (std::size_t i = 0; i < weights.size(); ++i) {
      weights[i] = static_cast<std::int16_t>(get_little_endian<std::uint16_t>(&brick.bytes[2 * i]));
    }
    bricks.put(place, weights, brick.material);
  }
  bricks.finish();
  for (const double depth : {-0.002, 0.0, 0.002}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-1.0, 1.0}) {
        Vec3 x(0.003, -0.004, 0.005);
        x[axis] = side * (0.02 - depth);
        const auto point = bricks.at(x);
        EXPECT_NEAR(point.distance, -depth, 1e-5);
        EXPECT_NEAR(point.gradient[axis], side, 0.01);
        EXPECT_EQ(point.material, 3);
      }
    }
  }
}

TEST(FieldOf, AnOpenSurfaceIsRefused) {
  Triangles open = cube();
  open.facets.pop_back();
  const std::string said = thrown_by([&] { field_of(open, {}, "open.stl"); });
  EXPECT_TRUE(said.starts_with("open.stl: ")) << said;
}

}  // namespace
}  // namespace tendon::softbody::field_of_test

// SPDX-License-Identifier: Apache-2.0
#include "core/field/field.h"

#include <cmath>
#include <limits>
#include <string>

#include "core/base/expect.h"

namespace tendon::field {
namespace {

void expect_few(std::size_t count, std::size_t most, const char* what) {
  expect(count <= most, what, static_cast<double>(count), "at most " + std::to_string(most));
}

void expect_fixture(const Fixture& fixture, double max_stiffness) {
  expect_finite(fixture.at, "fixture.at");
  expect(std::abs(fixture.direction.norm() - 1) <= 1e-3, "fixture.direction", fixture.direction.norm(),
         "a vector of length 1");
  expect(fixture.stiffness > 0 && fixture.stiffness <= max_stiffness, "fixture.stiffness", fixture.stiffness,
         "above 0, and at most " + shortest(max_stiffness) + " N/m");
  expect(fixture.most_force > 0, "fixture.most_force", fixture.most_force, "a number above 0 N");
}

}  // namespace

void Field::expect_valid(double max_stiffness) const {
  expect_few(primitives.size(), kMostPrimitives, "primitives");
  expect_few(fixtures.size(), kMostFixtures, "fixtures");
  expect_few(materials.size(), kMostMaterials, "materials");
  expect(!materials.empty(), "materials", 0, "1 or more");
  for (const Material& material : materials) material.expect_valid(max_stiffness);
  for (const Fixture& fixture : fixtures) expect_fixture(fixture, max_stiffness);
  for (const Primitive& primitive : primitives) {
    field::expect_valid(primitive);
    expect(primitive.material < materials.size(), "primitive.material", primitive.material,
           "below " + std::to_string(materials.size()));
  }
}

SurfacePoint Field::at(const Vec3& x) const noexcept {
  SurfacePoint nearest{.distance = std::numeric_limits<double>::infinity()};
  if (bricks != nullptr) nearest = bricks->at(x);
  for (const Primitive& primitive : primitives) {
    const SurfacePoint point = distance(primitive, x);
    if (point.distance < nearest.distance) nearest = point;
  }
  return nearest;
}

}  // namespace tendon::field

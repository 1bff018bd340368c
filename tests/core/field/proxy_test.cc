// SPDX-License-Identifier: Apache-2.0
#include "core/field/proxy.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/field/field.h"
#include "tests/core/field/shapes.h"
#include "tests/support/dice.h"

namespace tendon::field::proxy_test {
namespace {

Field flat() {
  Field field;
  field.primitives = {{.shape = Plane{}}};
  return field;
}

TEST(FieldProxy, OnAPlaneItStaysAboveTheHandAndOnTheBorderOfItsCone) {
  const Field field = flat();
  Proxy proxy{.position = {0, 0, 0.001}};
  proxy = moved(field, proxy, {0, 0, -0.002}, 0.5);
  proxy = moved(field, proxy, {0, 0, -0.002}, 0.5);
  EXPECT_TRUE(proxy.touching);
  EXPECT_LT(proxy.position.norm(), 1e-12);
  proxy = moved(field, proxy, {0.0009, 0, -0.002}, 0.5);  // inside the friction cone
  EXPECT_LT(proxy.position.norm(), 1e-12);
  proxy = moved(field, proxy, {0.0015, 0, -0.002}, 0.5);
  EXPECT_NEAR(proxy.position.x(), 0.0005, 1e-12);
  proxy = moved(field, proxy, {0.0015, 0, 0.001}, 0.5);  // leaves the surface
  proxy = moved(field, proxy, {0.0015, 0, 0.001}, 0.5);
  proxy = moved(field, proxy, {0.0015, 0, 0.001}, 0.5);
  EXPECT_EQ(proxy.position, Vec3(0.0015, 0, 0.001));
  EXPECT_FALSE(proxy.touching);
}

TEST(FieldProxy, ItDoesNotPassAWallOfOneSpacing) {
  Field field;
  field.primitives = {{.shape = Box{.half = {0.02, 0.02, 0.0005}}}};  // 1 mm, in a field of 1 mm
  Dice dice(1);
  for (int run = 0; run < 200; ++run) {
    Vec3 x(0, 0, 0.004);
    Proxy proxy{.position = x};
    for (int k = 0; k < 100; ++k) {
      x += Vec3(dice.within(-5e-4, 5e-4), dice.within(-5e-4, 5e-4), dice.within(-1e-3, 0));
      proxy = moved(field, proxy, x, 0.3);
      ASSERT_GT(proxy.position.z(), 0) << "run " << run << ", step " << k;
    }
  }
}

TEST(FieldProxy, DeepInASolidWithoutAGradientItIsTheHand) {
  BrickField bricks;
  sample(sphere, Vec3::Constant(-0.04), Vec3::Constant(0.04), 1e-3, bricks);
  const Field field{.bricks = &bricks};
  const Proxy proxy = moved(field, Proxy{.position = {0, 0, 0.001}}, {0.001, 0, 0}, 0.3);
  EXPECT_EQ(proxy.position, Vec3(0.001, 0, 0));
  EXPECT_FALSE(proxy.touching);
}

/// Returns the largest distance of the proxy from a hand that flies `above` a surface at `speed` (m/s).
double lag(const Field& field, double above, double speed) {
  Proxy proxy{.position = {0, 0, 0.03 + above}};
  double most = 0;
  for (int k = 0; k < 400; ++k) {
    const double angle = speed * 1e-3 * k / (0.03 + above);
    const Vec3 x = (0.03 + above) * Vec3(std::sin(angle), 0, std::cos(angle));
    proxy = moved(field, proxy, x, 0.8);
    most = std::max(most, (proxy.position - x).norm());
  }
  return most;
}

TEST(FieldProxy, AGrazingHandIsNotDragged) {
  BrickField bricks;
  sample(sphere, Vec3::Constant(-0.04), Vec3::Constant(0.04), 1e-3, bricks);
  const Field field{.bricks = &bricks};
  for (const double above : {5e-6, 2e-5, 1e-4, 1e-3, 6e-3}) {
    for (const double speed : {0.05, 0.2, 0.48}) {
      EXPECT_LT(lag(field, above, speed), 1e-15) << above << " m, " << speed << " m/s";
    }
  }
}

TEST(FieldProxy, ItSlidesAroundASphereWithoutFriction) {
  Field field;
  field.primitives = {{.shape = Sphere{.centre = Vec3::Zero(), .radius = 0.03}}};
  Proxy proxy{.position = {0, 0, 0.03}};
  for (int k = 0; k < 2000; ++k) {
    const double angle = 1e-3 * k;
    const Vec3 x = 0.027 * Vec3(std::sin(angle), 0, std::cos(angle));
    proxy = moved(field, proxy, x, 0);
    if (k > 10) {
      ASSERT_NEAR(proxy.position.norm(), 0.03, 2e-7);
      ASSERT_LT((proxy.position.normalized() - x.normalized()).norm(), 2e-3) << k;
    }
  }
}

}  // namespace
}  // namespace tendon::field::proxy_test

// SPDX-License-Identifier: Apache-2.0
#include "core/field/residual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/field/renderer.h"

namespace tendon::field::residual_test {
namespace {

using std::chrono::milliseconds;

constexpr double kPaid = 1e9;  // J

LocalTime at_ms(int ms) { return LocalTime(milliseconds(ms)); }

Field flat(double stiffness) {
  Field field;
  field.primitives = {{.shape = Plane{}}};
  field.materials = {{.stiffness = stiffness}};
  return field;
}

/// Presses for 4 s into a surface that is harder than its field; every 16 ms a truth arrives, `delay` ms late.
DepthTable learned(int delay) {
  const Field field = flat(500);
  Renderer renderer({.max_stiffness = 1500});
  renderer.use(&field, at_ms(0));
  std::vector<double> depths;
  for (int k = 0; k < 5000; ++k) {
    const double depth = k < 4000 ? 0.006 * (1 - std::cos(2 * std::numbers::pi * 1e-3 * k)) - 0.001 : -0.001;
    depths.push_back(depth);
    const int answered = k - delay;
    if (answered >= 0 && answered < 4000 && answered % 16 == 0) {
      const double d = std::max(depths[static_cast<std::size_t>(answered)], 0.0);
      EXPECT_TRUE(renderer.observe(static_cast<std::uint64_t>(answered), Vec3(0, 0, 500 * d + 4e4 * d * d), at_ms(k)));
    }
    renderer.render({.at = at_ms(k), .position = {0, 0, -depth}}, kPaid, static_cast<std::uint64_t>(k));
  }
  return renderer.material(0).table;
}

TEST(FieldResidual, ATableLearnsTheSameAtAnyDelay) {
  const DepthTable at_once = learned(1);
  for (const int delay : {50, 200, 600}) EXPECT_EQ(learned(delay).force, at_once.force) << delay << " ms";
  for (std::size_t i = 2; i <= 10; ++i) {
    const double d = 1e-3 * static_cast<double>(i);
    EXPECT_NEAR(at_once.force[i], 4e4 * d * d, 0.05) << i;
  }
}

TEST(FieldResidual, WrongTruthsCannotMakeATableSteeperThanAllowed) {
  Material material{.stiffness = 500};
  Residual residual;
  for (std::uint64_t k = 1; k < 500; ++k) {
    const double depth = 0.02 * std::abs(std::sin(static_cast<double>(k)));
    residual.note({.tick = k, .depth = depth, .direction = Vec3::UnitZ(), .spring = 500 * depth});
    const Vec3 truth(0, 0, k % 2 == 0 ? 1e6 : -1e6);
    EXPECT_TRUE(residual.learn(k, truth, at_ms(static_cast<int>(k)), 1500, std::span(&material, 1)));
    EXPECT_LE(material.most_stiffness(), 1500 + 1e-6);
    for (std::size_t i = 1; i <= DepthTable::kKnots; ++i) {
      EXPECT_GE(material.table.force[i] - material.table.force[i - 1], -0.9 * 500 * material.table.step - 1e-12);
    }
  }
}

TEST(FieldResidual, AnUnknownStepOrANumberThatIsNotFiniteTeachesNothing) {
  Material material;
  Residual residual;
  const std::span<Material> all(&material, 1);
  residual.note({.tick = 5});
  EXPECT_FALSE(residual.learn(4, Vec3::Zero(), at_ms(9), 1500, all));
  EXPECT_FALSE(residual.learn(5, {0, std::numeric_limits<double>::quiet_NaN(), 0}, at_ms(9), 1500, all));
  EXPECT_TRUE(residual.learn(5, Vec3::Zero(), at_ms(9), 1500, all));
  EXPECT_FALSE(residual.learn(5, Vec3::Zero(), at_ms(9), 1500, all)) << "twice";
  residual.note({.tick = 5 + Residual::kSteps});
  EXPECT_FALSE(residual.learn(5, Vec3::Zero(), at_ms(9), 1500, all)) << "overwritten";
}

TEST(FieldResidual, ATruthAboutTheFieldBeforeIsRefused) {
  const Field first = flat(500);
  const Field second = flat(800);
  Renderer renderer({});
  EXPECT_FALSE(renderer.observe(0, Vec3::Zero(), at_ms(0)));
  renderer.use(&first, at_ms(0));
  for (int k = 0; k < 20; ++k) {
    if (k == 10) renderer.use(&second, at_ms(k));
    renderer.render({.at = at_ms(k)}, kPaid, static_cast<std::uint64_t>(k));
  }
  EXPECT_FALSE(renderer.observe(9, Vec3::Zero(), at_ms(20)));
  EXPECT_TRUE(renderer.observe(10, Vec3::Zero(), at_ms(20)));
}

TEST(FieldResidual, TheHeldRestFadesAndIsZeroOutOfContact) {
  Residual residual;
  residual.note({.tick = 1, .depth = 0.002, .direction = Vec3::UnitZ()});
  ASSERT_TRUE(residual.learn(1, {1, 0, 0}, at_ms(0), 1500, {}));
  const auto held = [&](int ms, const Vec3& x, double depth) {
    Residual copy = residual;
    for (int i = 0; i < 100; ++i) copy.held({.at = at_ms(ms), .position = x}, depth, 1e-3);  // r₀ has faded
    return copy.held({.at = at_ms(ms), .position = x}, depth, 1e-3).x();
  };
  EXPECT_NEAR(held(0, Vec3::Zero(), 0.002), 1, 1e-3);
  EXPECT_NEAR(held(100, Vec3::Zero(), 0.002), std::exp(-1), 1e-3);
  EXPECT_NEAR(held(0, {0, 0.003, 0}, 0.002), std::exp(-0.5), 1e-3);
  EXPECT_NEAR(held(0, Vec3::Zero(), 0.00015), 0.5, 1e-3);
  EXPECT_EQ(held(0, Vec3::Zero(), 0), 0);
}

TEST(FieldResidual, TheRestOfATruthThatIsLateHasFaded) {
  Residual residual;
  residual.note({.tick = 1, .at = at_ms(10), .depth = 0.002, .direction = Vec3::UnitZ()});
  ASSERT_TRUE(residual.learn(1, {1, 0, 0}, at_ms(310), 1500, {}));
  Vec3 held;
  for (int ms = 310; ms <= 410; ++ms) held = residual.held({.at = at_ms(ms)}, 0.002, 1e-3);
  EXPECT_NEAR(held.x(), std::exp(-4), 1e-3);
}

TEST(FieldResidual, ATruthDoesNotMakeTheHeldForceJump) {
  Residual residual;
  Vec3 before = Vec3::Zero();
  for (std::uint64_t k = 1; k < 300; ++k) {
    residual.note({.tick = k, .at = at_ms(static_cast<int>(k)), .depth = 0.002, .direction = Vec3::UnitZ()});
    if (k % 30 == 0) {
      ASSERT_TRUE(residual.learn(k, {k % 60 == 0 ? 1.0 : -1.0, 0, 0}, at_ms(static_cast<int>(k)), 1500, {}));
    }
    const Vec3 now = residual.held({.at = at_ms(static_cast<int>(k))}, 0.002, 1e-3);
    EXPECT_LT((now - before).norm(), 0.17);
    before = now;
  }
}

}  // namespace
}  // namespace tendon::field::residual_test

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "tests/tools/lab/models/explicit.h"
#include "tests/tools/lab/models/pressed_b1.h"

namespace tendon::softbody::compared::effects_test {
namespace {

using compared::testing::pressed_b1;
using compared::testing::soon_at_rest;

TEST(ComparedEffects, TheToolMeetsTheSurfaceWhereTheWeightHasSunkItTo) {
  for (const Kind kind : {Kind::kMassSpring, Kind::kTensorMass, Kind::kProjective}) {
    Config config = soon_at_rest(kind);
    config.effects.density = 1000;
    config.effects.gravity = Vec3(0, 0, -9.81);
    PressedBody body = pressed_b1(kind, Element::kTet4, 4, config);
    const double sunk = body.settle(Prescribed::kForce, 0).depth;
    EXPECT_GT(sunk, 1e-4);
    const Feel above = body.touch(Vec3(0, 0, 0.05 - 0.9 * sunk));
    EXPECT_FALSE(above.touching) << info(kind).name;
    EXPECT_NEAR(above.gap, 0.1 * sunk, 0.02 * sunk) << info(kind).name;
    Feel below;
    for (int i = 0; i < (body.step() > 0 ? 1000 : 50); ++i) below = body.touch(Vec3(0, 0, 0.05 - sunk - 1e-4));
    EXPECT_TRUE(below.touching);
    EXPECT_NEAR(below.force.z() / 1e-4 / below.stiffness(2, 2), 1, 0.03) << info(kind).name;
  }
}

/// A cube of 100 mm that can only move along z. This is equivalent to a mass of 0.5 kg on a spring of 1 kN/m.
TEST(TensorMass, OneMassSwingsDampedAndUnderItsWeightAsOnPaper) {
  constexpr double kMass = 0.5;
  constexpr double kSpring = 1000;
  Mesh mesh = block(Shape::kHex8, Vec3(0.1, 0.1, 0.1), {1, 1, 1});
  Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
  for (std::size_t i = 0; i < fixed.size(); ++i) fixed[i] = fixed[i] || i % 3 != 2;
  const Solid solid(std::move(mesh), Element::kHex8, {.young = 1e4, .poisson = 0}, Law::kLinear, fixed);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), 0.05);
  const Patch patch = *top.patch(Vec2::Zero());
  const double dt = 2e-3;
  const double damping = 7;
  const double weight = kMass * 9.81;  // increases the depth
  ExplicitModel model(solid, top,
                      {.density = 1000, .step = dt, .gravity = Vec3(0, 0, -9.81), .inertia = true, .damping = damping});
  double depth = weight / kSpring;
  double velocity = 0;
  for (int i = 0; i < 500; ++i) {
    const double force = i < 200 ? 2 : 0;
    velocity = (velocity + dt * (weight + force - kSpring * depth) / kMass) / (1 + damping * dt);
    depth += dt * velocity;
    EXPECT_NEAR(model.press(patch, Prescribed::kForce, force).depth, depth, 1e-9);
  }
  EXPECT_NEAR(largest_step(solid, 1000), 2 / std::sqrt(kSpring / kMass), 1e-6);
}

TEST(ComparedEffects, DampingTakesTheEnergyThatASwingHas) {
  for (const Kind kind : {Kind::kTensorMass, Kind::kProjective}) {
    std::array<double, 2> left{};
    for (const bool damped : {false, true}) {
      Config config;
      config.effects = {.density = 1000, .step = 5e-4, .inertia = true};
      if (damped) config.effects.damping = 100;
      PressedBody body = pressed_b1(kind, Element::kTet4, 4, config);
      for (int i = 0; i < 50; ++i) body.press(Prescribed::kForce, 0.3);
      double largest = 0;
      for (int i = 0; i < 400; ++i) {
        const double depth = body.press(Prescribed::kForce, 0).depth;
        if (i > 200) largest = std::max(largest, std::abs(depth));
      }
      left[damped ? 1 : 0] = largest;
    }
    EXPECT_LT(left[1], 0.1 * left[0]) << info(kind).name;
  }
}

TEST(MassSpring, ABodyCreepsWithTheRelaxationTimeOfItsMaterial) {
  // K (u + τ u̇) = f; with implicit Euler, u after n steps is u∞ (1 − (1 + dt/τ)⁻ⁿ) for all shapes.
  const double in_the_end = pressed_b1(Kind::kMassSpring, Element::kTet4, 4).press(Prescribed::kForce, 1e-3).depth;
  Config config;
  config.effects = {.step = 0.01, .viscosity = 0.05};
  PressedBody body = pressed_b1(Kind::kMassSpring, Element::kTet4, 4, config);
  for (int n = 1; n <= 20; ++n) {
    EXPECT_NEAR(body.press(Prescribed::kForce, 1e-3).depth / in_the_end, 1 - std::pow(1.2, -n), 1e-3);
  }
}

TEST(MassSpring, ItsRestDoesNotDependOnTheStep) {
  const Reaction still = pressed_b1(Kind::kMassSpring, Element::kTet4, 4).press(Prescribed::kForce, 0.3);
  for (const double step : {1e-3, 1e-2, 0.2}) {
    Config config;
    config.effects = {.density = 1000, .step = step, .inertia = true, .damping = 40};
    const Reaction found = pressed_b1(Kind::kMassSpring, Element::kTet4, 4, config).settle(Prescribed::kForce, 0.3);
    EXPECT_NEAR(found.depth / still.depth, 1, 1e-3) << step;
    EXPECT_NEAR(found.stiffness * still.depth / 0.3, 1, 1e-3) << step;
  }
}

TEST(MassSpring, EffectsThatAreNotListedKeepNothing) {
  Config config;
  const auto with = [&] { return pressed_b1(Kind::kMassSpring, Element::kTet4, 4, config).size().bytes; };
  const std::size_t bare = with();
  config.effects.density = 1000;  // not used by any enabled effect
  config.effects.step = 0.01;
  EXPECT_EQ(with(), bare);
  EXPECT_EQ(pressed_b1(Kind::kMassSpring, Element::kTet4, 4, config).step(), 0);
  config.effects.inertia = true;
  const std::size_t with_inertia = with();
  EXPECT_GT(with_inertia, bare);
  config.effects.viscosity = 0.01;
  EXPECT_GT(with(), with_inertia);
}

}  // namespace
}  // namespace tendon::softbody::compared::effects_test

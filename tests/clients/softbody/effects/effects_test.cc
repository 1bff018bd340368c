// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/effects/effects.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include "clients/softbody/models/linear.h"
#include "clients/softbody/models/quasi_static.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::effects_test {
namespace {

using testing::kB1PatchRadius;
using testing::pressed_block;
using testing::pressed_body;

constexpr ModelKind kImplicit[] = {ModelKind::kLinear, ModelKind::kCorotational, ModelKind::kNeoHookean};

TEST(Effects, MassesAreThoseOfTheVolumeWhateverTheElement) {
  for (const Shape shape : {Shape::kTet4, Shape::kHex8, Shape::kHex20, Shape::kHex27}) {
    const std::vector<double> volumes = nodal_volumes(cylinder(shape, 0.02, 0.03, 4, 3));
    EXPECT_NEAR(
        std::accumulate(volumes.begin(), volumes.end(), 0.0) / check(cylinder(shape, 0.02, 0.03, 4, 3), "cylinder"), 1,
        1e-12);
    EXPECT_GT(*std::ranges::min_element(volumes), 0);
  }
}

TEST(Gravity, AColumnSagsUnderItsOwnWeightAsMuchAsItShould) {
  // With ν = 0 the block does not widen: u(top) = ρ g h²/2E.
  for (const ModelKind model : kImplicit) {
    BodyConfig config = pressed_body(model, Element::kHex8, 4);
    config.material.poisson = 0;
    config.effects.density = 1000;
    config.effects.gravity = Vec3(0, 0, -0.1);  // so small that all models are linear
    const Reaction untouched = Body(config).press(Prescribed::kForce, 0);
    EXPECT_NEAR(untouched.depth, 1000 * 0.1 * 0.05 * 0.05 / 2e4, 1e-3 * untouched.depth) << static_cast<int>(model);
    EXPECT_EQ(untouched.force, 0);
  }
}

TEST(Gravity, TheToolMeetsTheSurfaceWhereItHasSunkTo) {
  for (const ModelKind model : {ModelKind::kLinear, ModelKind::kNeoHookean}) {
    BodyConfig config = pressed_body(model, Element::kTet4, 4);
    config.effects.density = 1000;
    config.effects.gravity = Vec3(0, 0, -9.81);
    Body body(config);
    const double sunk = body.settle(Prescribed::kForce, 0).depth;
    EXPECT_GT(sunk, 1e-4);
    const Feel above = body.touch(Vec3(0, 0, 0.05 - 0.9 * sunk));
    EXPECT_FALSE(above.touching) << static_cast<int>(model);
    EXPECT_NEAR(above.gap, 0.1 * sunk, 0.02 * sunk) << static_cast<int>(model);
    Feel below;
    for (int i = 0; i < 50; ++i) below = body.touch(Vec3(0, 0, 0.05 - sunk - 1e-4));
    EXPECT_TRUE(below.touching);
    EXPECT_NEAR(below.force.z() / 1e-4 / below.stiffness(2, 2), 1, 0.03) << static_cast<int>(model);
  }
}

/// A cube of 100 mm between frictionless walls: 0.5 kg (the other half is at the fixed nodes) and 1 kN/m.
Solid one_mass() {
  Mesh mesh = block(Shape::kHex8, Vec3(0.1, 0.1, 0.1), {1, 1, 1});
  Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
  for (std::size_t i = 0; i < fixed.size(); ++i) fixed[i] = fixed[i] || i % 3 != 2;
  return {std::move(mesh), Element::kHex8, {.young = 1e4, .poisson = 0}, Law::kLinear, fixed};
}
constexpr double kMass = 0.5;
constexpr double kSpring = 1000;

TEST(Inertia, OneMassSwingsDampedAndViscousAndUnderItsWeightAsOnPaper) {
  const Solid solid = one_mass();
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), 0.05);
  const Patch patch = *top.patch(Vec2::Zero());
  const double dt = 2e-3;
  const double damping = 7;
  const double relaxation = 0.003;
  const double weight = kMass * 9.81;  // positive: downward is deeper
  const EffectsConfig all{.density = 1000,
                          .step = dt,
                          .gravity = Vec3(0, 0, -9.81),
                          .inertia = true,
                          .damping = damping,
                          .viscosity = relaxation};
  LinearModel linear(solid, top, all);
  QuasiStaticModel newton(solid, top, {}, all);
  double now = weight / kSpring;
  double before = now;
  for (int i = 0; i < 500; ++i) {
    const double force = i < 200 ? 2 : 0;
    // m (u⁺ − 2u + u⁻)/dt² + m·rate (u⁺ − u)/dt + kτ (u⁺ − u)/dt + k u⁺ = weight + force
    const double slow = (kMass * damping + kSpring * relaxation) / dt;
    const double next =
        (weight + force + kMass / (dt * dt) * (2 * now - before) + slow * now) / (kMass / (dt * dt) + slow + kSpring);
    before = now;
    now = next;
    EXPECT_NEAR(linear.press(patch, Prescribed::kForce, force).depth, now, 1e-9);
    EXPECT_NEAR(newton.press(patch, Prescribed::kForce, force).depth, now, 1e-9);
  }
}

TEST(Inertia, AFastPushMeetsTheMassFirst) {
  BodyConfig config = pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4);
  const double still = Body(config).press(Prescribed::kDepth, 1e-4).force;
  config.effects = {.density = 1000, .step = 1e-3, .inertia = true};
  Body body(config);
  EXPECT_GT(body.press(Prescribed::kDepth, 1e-4).force, 3 * still);
}

TEST(Damping, TakesTheEnergyThatASwingHas) {
  for (const ModelKind model : {ModelKind::kLinear, ModelKind::kNeoHookean}) {
    double left[2];
    for (const bool damped : {false, true}) {
      BodyConfig config = pressed_body(model, Element::kTet4, 4);
      config.effects = {.density = 1000, .step = 5e-4, .inertia = true};
      if (damped) config.effects.damping = 100;
      Body body(config);
      for (int i = 0; i < 50; ++i) body.press(Prescribed::kForce, 0.3);
      double largest = 0;
      for (int i = 0; i < 400; ++i) {
        const double depth = body.press(Prescribed::kForce, 0).depth;
        if (i > 200) largest = std::max(largest, std::abs(depth));
      }
      left[damped ? 1 : 0] = largest;
    }
    EXPECT_LT(left[1], 0.1 * left[0]) << static_cast<int>(model);
  }
}

TEST(Viscosity, ABodyCreepsWithTheRelaxationTimeOfItsMaterial) {
  // K (u + τ u̇) = f. With implicit Euler, u = u∞ (1 − (1 + dt/τ)⁻ⁿ) after n steps, for every shape.
  for (const ModelKind model : kImplicit) {
    BodyConfig config = pressed_body(model, Element::kTet4, 4);
    const double in_the_end = Body(config).press(Prescribed::kForce, 1e-3).depth;
    config.effects = {.step = 0.01, .viscosity = 0.05};
    Body body(config);
    for (int n = 1; n <= 20; ++n) {
      EXPECT_NEAR(body.press(Prescribed::kForce, 1e-3).depth / in_the_end, 1 - std::pow(1.2, -n), 1e-3)
          << static_cast<int>(model);
    }
  }
}

TEST(Viscosity, AQuickPressIsStifferThanASlowOne) {
  BodyConfig config = pressed_body(ModelKind::kNeoHookean, Element::kHex8Sri, 4);
  config.effects = {.step = 0.01, .viscosity = 0.05};
  const auto force_at_5_mm = [&](int steps) {
    Body body(config);
    Reaction reaction;
    for (int i = 1; i <= steps; ++i) reaction = body.press(Prescribed::kDepth, 0.005 * i / steps);
    return reaction.force;
  };
  const double still =
      Body(pressed_body(ModelKind::kNeoHookean, Element::kHex8Sri, 4)).press(Prescribed::kDepth, 0.005).force;
  EXPECT_GT(force_at_5_mm(5), 1.8 * still);
  EXPECT_NEAR(force_at_5_mm(500) / still, 1, 0.05);
}

TEST(Effects, WhatIsNotListedKeepsNothing) {
  for (const ModelKind model : kImplicit) {
    BodyConfig config = pressed_body(model, Element::kTet4, 4);
    const std::size_t bare = Body(config).size().bytes;
    config.effects.density = 1000;  // set, but not used by any effect
    config.effects.step = 0.01;
    EXPECT_EQ(Body(config).size().bytes, bare);
    EXPECT_EQ(Body(config).step(), 0);
    config.effects.inertia = true;
    const std::size_t with_inertia = Body(config).size().bytes;
    EXPECT_GT(with_inertia, bare);
    config.effects.viscosity = 0.01;
    EXPECT_GT(Body(config).size().bytes, with_inertia);
  }
}

TEST(Effects, NonsenseIsRefusedByName) {
  const auto refusal = [](const EffectsConfig& effects) { return thrown_by([&] { check(effects); }); };
  EXPECT_EQ(refusal({.step = 1e-3, .inertia = true}), "density = 0: expected a finite number above 0");
  EXPECT_EQ(refusal({.density = 1000, .inertia = true}), "step = 0: expected a finite number above 0");
  EXPECT_EQ(refusal({.step = 1e-3, .viscosity = -1}), "viscosity = -1: expected a finite number above 0");
  EXPECT_EQ(refusal({.density = 1, .gravity = Vec3(std::nan(""), 0, 0)}), "gravity.x = nan: expected a finite number");
  EXPECT_EQ(refusal({}), "");
}

TEST(Friction, HoldsTheToolUntilTheConeAndThenPullsAlongIt) {
  Friction friction(0.5, 1000);
  friction.move(Vec2(0, 0), 2);
  const Friction::Drag stuck = friction.move(Vec2(0.0005, 0), 2);
  EXPECT_EQ(stuck.force, Vec2(-0.5, 0));
  EXPECT_EQ(stuck.stiffness, 1000);
  EXPECT_NEAR(stuck.until_slip, 0.0005, 1e-15);
  const Friction::Drag sliding = friction.move(Vec2(0.003, 0.004), 2);
  EXPECT_NEAR(sliding.force.norm(), 1, 1e-12);
  EXPECT_NEAR(sliding.force.x() / sliding.force.y(), 0.75, 1e-12);
  EXPECT_EQ(sliding.stiffness, 0);
  EXPECT_EQ(friction.move(Vec2(0.01, 0), 0).force, Vec2::Zero());  // lifted
  EXPECT_EQ(friction.move(Vec2(0.02, 0), 1).force, Vec2::Zero());
  EXPECT_THROW(Friction(-0.1, 1000), std::invalid_argument);
  EXPECT_THROW(Friction(std::numeric_limits<double>::quiet_NaN(), 1000), std::invalid_argument);
  EXPECT_THROW(Friction(0.1, 0), std::invalid_argument);
}

TEST(Friction, TakesEnergyOnEveryClosedWayAndGivesNone) {
  Dice dice(3);
  for (int way = 0; way < 200; ++way) {
    Friction friction(0.4, 1000);
    double work = 0;
    Vec2 place(0, 0);
    friction.move(place, 1);
    for (int i = 0; i < 100; ++i) {
      const Vec2 next = i == 99 ? Vec2(0, 0) : Vec2(dice.within(-0.003, 0.003), dice.within(-0.003, 0.003));
      const double normal = dice.within(0.01, 3);
      // Along a straight line, in steps so short that the force is nearly constant.
      for (int k = 1; k <= 50; ++k) {
        const Vec2 to = place + (next - place) * k / 50.0;
        const Vec2 from = place + (next - place) * (k - 1) / 50.0;
        work += friction.move(to, normal).force.dot(to - from);
      }
      place = next;
    }
    EXPECT_LT(work, 0);
  }
}

TEST(Friction, IsBoundedByTheForceAlongTheNormalWhereverTheToolGoes) {
  BodyConfig config = pressed_body(ModelKind::kCondensed, Element::kHex8Sri, 8);
  Body smooth(config);
  config.friction = 0.3;
  Body rough(config);
  Dice dice(11);
  double largest = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 tool(dice.within(-0.02, 0.02), dice.within(-0.02, 0.02), dice.within(0.047, 0.051));
    const Feel without = smooth.touch(tool);
    const Feel with = rough.touch(tool);
    const Vec3 drag = with.force - without.force;
    EXPECT_NEAR(drag.z(), 0, 1e-12);
    EXPECT_LE(drag.norm(), 0.3 * without.force.z() + 1e-12);
    largest = std::max(largest, drag.norm());
    EXPECT_LT((with.stiffness - with.stiffness.transpose()).norm(), 1e-9);
  }
  EXPECT_GT(largest, 0.3);
}

TEST(Models, EachGivesTheSameStiffnessWhetherDepthOrForceIsGiven) {
  for (const ModelInfo& model : models()) {
    const BodyConfig config = pressed_body(model.kind, Element::kTet4, 4);
    const Reaction by_force = Body(config).settle(Prescribed::kForce, 0.3);
    const Reaction by_depth = Body(config).settle(Prescribed::kDepth, by_force.depth);
    EXPECT_NEAR(by_depth.force, 0.3, 5e-4) << model.name;
    EXPECT_LT((by_depth.slope - by_force.slope).norm(), 1e-3) << model.name;
    const Reaction pulled = Body(config).settle(Prescribed::kDepth, -by_force.depth);
    EXPECT_LT(pulled.force, -0.2) << model.name;
    const Reaction left = Body(config).settle(Prescribed::kLeastDepth, -by_force.depth);
    EXPECT_EQ(left.force, 0) << model.name;
    EXPECT_NEAR(left.depth, 0, 1e-8) << model.name;
  }
}

TEST(Models, EachRefusesWhatItDoesNotSimulate) {
  for (const ModelInfo& model : models()) {
    BodyConfig config = pressed_body(model.kind, Element::kTet4, 2);
    config.effects = {.step = 1e-3, .viscosity = 0.01};
    EXPECT_EQ(thrown_by([&] { Body{config}; }),
              model.may.has(EffectKind::kViscosity)
                  ? ""
                  : "the model \"" + std::string(model.name) + "\" does not simulate viscosity");
  }
}

}  // namespace
}  // namespace tendon::softbody::effects_test

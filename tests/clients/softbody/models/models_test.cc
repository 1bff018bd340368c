// SPDX-License-Identifier: Apache-2.0
//
// The models for comparison: what each makes of the pressed block B1 is known from another implementation of them, to
// ± 1.5 points.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "clients/softbody/body.h"
#include "clients/softbody/fem/spectrum.h"
#include "clients/softbody/models/linear.h"
#include "clients/softbody/models/mass_spring.h"
#include "clients/softbody/models/modal.h"
#include "clients/softbody/models/projective.h"
#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::models_test {
namespace {

using testing::kB1;
using testing::kB1PatchRadius;
using testing::pressed_block;
using testing::pressed_body;

/// B1 under 0.3 N, once it is at rest: how much stiffer the body is than it should be.
double error_percent(const BodyConfig& config) {
  const Reaction reaction = Body(config).settle(Given::kForce, 0.3);
  return 100 * (reaction.force / reaction.depth / kB1 - 1);
}

TEST(MassSpring, GivesThePressedBlockTheKnownStiffness) {
  EXPECT_NEAR(error_percent(pressed_body(ModelKind::kMassSpring, Element::kTet4, 4)), 112, 1.5);
  EXPECT_NEAR(error_percent(pressed_body(ModelKind::kMassSpring, Element::kTet4, 8)), 55, 1.5);
}

TEST(MassSpring, ForcesAreTheSlopeOfTheEnergyAndTheStiffnessThatOfTheForces) {
  const Solid solid = pressed_block(Element::kTet4, 2, 0.3);
  const SpringNet net(solid.mesh(), 1e4, solid.fixed());
  VectorXd u = VectorXd::Zero(net.size());
  for (int i = 0; i < net.size(); ++i) u[i] = net.free_of(i) < 0 ? 0 : 0.004 * std::sin(3.0 * i);
  SymmetricMatrix stiffness = net.pattern();
  net.stiffness(u, Elastic::Curvature::kExact, stiffness);
  const double h = 1e-7;
  for (int i = 0; i < net.size(); ++i) {
    if (net.free_of(i) < 0) continue;
    VectorXd low = u;
    VectorXd high = u;
    low[i] -= h;
    high[i] += h;
    EXPECT_NEAR((net.energy(high) - net.energy(low)) / (2 * h), net.forces(u).force[i], 1e-6);
    const VectorXd slope = net.to_free(net.forces(high).force - net.forces(low).force) / (2 * h);
    const VectorXd column = stiffness.times(VectorXd::Unit(net.free_count(), net.free_of(i)));
    EXPECT_LT((slope - column).norm(), 1e-5 * column.norm());
  }
}

TEST(TensorMass, GivesThePressedBlockTheKnownStiffness) {
  BodyConfig config = pressed_body(ModelKind::kTensorMass, Element::kTet4, 4);
  EXPECT_NEAR(error_percent(config), 211, 1.5);
  config = pressed_body(ModelKind::kTensorMass, Element::kTet4, 8);
  EXPECT_NEAR(error_percent(config), 70, 1.5);
}

TEST(Tled, GivesThePressedBlockTheKnownStiffness) {
  EXPECT_NEAR(error_percent(pressed_body(ModelKind::kTled, Element::kTet4, 4)), 208, 1.5);
  EXPECT_NEAR(error_percent(pressed_body(ModelKind::kTled, Element::kTet4, 8)), 66, 1.5);
}

TEST(Xpbd, ThePressedBlocksStiffnessIsAMatterOfTheStep) {
  BodyConfig config = pressed_body(ModelKind::kXpbd, Element::kTet4, 8);
  config.iterations = 1;
  EXPECT_NEAR(error_percent(config), 43, 1.5);
  // With one step for 10 ms nothing but the order of the tetrahedra says how much is still missing.
  config.effects.step = 0.01;
  EXPECT_LT(error_percent(config), -90);
  config = pressed_body(ModelKind::kXpbd, Element::kTet4, 4);
  config.iterations = 1;
  EXPECT_NEAR(error_percent(config), 196, 1.5);
  config.effects.step = 0.2e-3;
  EXPECT_NEAR(error_percent(config), 212, 1.5);
}

TEST(Xpbd, MoreIterationsDoNotBringItCloserToItsMaterialShorterStepsDo) {
  // A step takes the slopes of its constraints from where each was met on the way, not from where it ends.
  BodyConfig config = pressed_body(ModelKind::kXpbd, Element::kTet4, 4);
  config.effects.step = 0.01;
  for (const int iterations : {1, 10, 100}) {
    config.iterations = iterations;
    EXPECT_NEAR(error_percent(config), -72, 2);
  }
}

TEST(Projective, GivesThePressedBlockTheKnownStiffnessWithAnyNumberOfRounds) {
  for (const int iterations : {1, 10}) {
    BodyConfig config = pressed_body(ModelKind::kProjective, Element::kTet4, 4);
    config.iterations = iterations;
    EXPECT_NEAR(error_percent(config), 16, 1.5);
    config.shape = BlockShape{Vec3(0.1, 0.1, 0.05), {8, 8, 4}};
    EXPECT_NEAR(error_percent(config), -21, 1.5);
  }
}

TEST(Projective, IsAtRestWhereItsEnergyIsLeast) {
  // With ν = 0 it is the corotational material.
  for (const Element element : {Element::kTet4, Element::kHex8Sri}) {
    BodyConfig config = pressed_body(ModelKind::kProjective, element, 4);
    config.material.poisson = 0;
    const Reaction found = Body(config).settle(Given::kDepth, 0.004);
    config.model = ModelKind::kCorotational;
    const Reaction expected = Body(config).press(Given::kDepth, 0.004);
    EXPECT_NEAR(found.force / expected.force, 1, 1e-3);
    EXPECT_LT((found.slope - expected.slope).norm(), 1e-3);
  }
}

TEST(Modal, FewSwingsAreFarTooStiffAndAllOfThemAreTheLinearModel) {
  const auto error = [](int n, int swings) {
    BodyConfig config = pressed_body(ModelKind::kModal, Element::kTet4, n);
    config.swings = swings;
    return error_percent(config);
  };
  EXPECT_NEAR(error(4, 10), 1562, 1.5);
  EXPECT_NEAR(error(4, 30), 457, 1.5);
  EXPECT_NEAR(error(4, 100), 233, 1.5);
  EXPECT_NEAR(error(4, 150), 211, 1.5);
  EXPECT_NEAR(error(8, 10), 714, 1.5);
  EXPECT_NEAR(error(8, 100), 105, 1.5);
}

TEST(Modal, AStaticModeOfThePatchMakesItExactThereAndCloseBetweenTwo) {
  const Solid solid = pressed_block(Element::kHex8Sri, 6, 0.45);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  ModalModel modal(solid, top, {.swings = 10, .patches = {Vec2(-0.005, 0), Vec2(0.005, 0)}});
  LinearModel linear(solid, top);
  const auto ratio = [&](const Vec2& middle) {
    const Patch patch = *top.patch(middle);
    return modal.press(patch, Given::kDepth, 1e-3).force / linear.press(patch, Given::kDepth, 1e-3).force;
  };
  EXPECT_NEAR(ratio(Vec2(0.005, 0)), 1, 1e-9);
  EXPECT_GT(ratio(Vec2(0, 0)), 1);
  EXPECT_LT(ratio(Vec2(0, 0)), 1.1);
  EXPECT_THROW(ModalModel(solid, top, {.swings = 0, .patches = {}}), std::invalid_argument);
  EXPECT_THROW(ModalModel(solid, top, {.swings = 1, .patches = {Vec2(1, 0)}}), std::invalid_argument);
}

TEST(Spectrum, SwingsSolveTheirEquationAndTheFastestIsAboveAll) {
  const Solid solid = pressed_block(Element::kTet4, 4, 0.45);
  SymmetricMatrix stiffness = solid.pattern();
  solid.stiffness(VectorXd::Zero(solid.size()), Elastic::Curvature::kExact, stiffness);
  const VectorXd mass = lumped_mass(solid, 1000);
  for (const int count : {5, 150}) {
    const Swings swings = slowest_swings(stiffness, mass, count);
    for (int i = 0; i < count; ++i) {
      const VectorXd x = swings.shapes.col(i);
      EXPECT_NEAR(x.dot(mass.cwiseProduct(x)), 1, 1e-9);
      EXPECT_LT((stiffness.times(x) - swings.squares[i] * mass.cwiseProduct(x)).norm(),
                1e-5 * stiffness.times(x).norm());
    }
    if (count == 150) {
      EXPECT_NEAR(std::sqrt(swings.squares[149]) / fastest_swing(stiffness, mass), 1, 1e-6);
    } else {
      EXPECT_NEAR(swings.squares[0] / slowest_swings(stiffness, mass, 150).squares[0], 1, 1e-6);
    }
  }
}

TEST(Models, EachGivesTheSameStiffnessWhetherDepthOrForceIsGiven) {
  for (const ModelInfo& model : models()) {
    const BodyConfig config = pressed_body(model.kind, Element::kTet4, 4);
    const Reaction by_force = Body(config).settle(Given::kForce, 0.3);
    const Reaction by_depth = Body(config).settle(Given::kDepth, by_force.depth);
    // Of xpbd it is a little another, because the tool comes before the tetrahedra or after them; nor is it at rest
    // quite where the mesh is.
    const bool rough = model.kind == ModelKind::kXpbd;
    EXPECT_NEAR(by_depth.force, 0.3, rough ? 5e-3 : 5e-4) << model.name;
    EXPECT_LT((by_depth.slope - by_force.slope).norm(), 1e-3) << model.name;
    const Reaction pulled = Body(config).settle(Given::kDepth, -by_force.depth);
    EXPECT_LT(pulled.force, -0.2) << model.name;
    const Reaction left = Body(config).settle(Given::kLeastDepth, -by_force.depth);
    EXPECT_EQ(left.force, 0) << model.name;
    EXPECT_NEAR(left.depth, 0, rough ? 3e-5 : 1e-8) << model.name;
  }
}

TEST(Models, EachRefusesWhatItDoesNotSimulate) {
  for (const ModelInfo& model : models()) {
    BodyConfig config = pressed_body(model.kind, Element::kTet4, 2);
    config.effects.density = 1000;
    config.effects.step = 1e-3;
    config.effects.viscosity = 0.01;
    if (model.may.has(EffectKind::kViscosity)) {
      EXPECT_NO_THROW(Body{config}) << model.name;
    } else {
      EXPECT_THROW(Body{config}, std::invalid_argument) << model.name;
    }
    if (model.has_time()) {
      config = pressed_body(model.kind, Element::kTet4, 2);
      config.effects.inertia = false;
      EXPECT_THROW(Body{config}, std::invalid_argument) << model.name;
    }
    if (model.tetrahedra) {
      EXPECT_THROW(Body(pressed_body(model.kind, Element::kHex8, 2)), std::invalid_argument) << model.name;
    }
  }
}

}  // namespace
}  // namespace tendon::softbody::models_test

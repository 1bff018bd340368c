// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <stdexcept>

#include "clients/softbody/body.h"
#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::models_test {
namespace {

using testing::pressed_body;

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
    config.effects.density = 1000;
    config.effects.step = 1e-3;
    config.effects.viscosity = 0.01;
    if (model.may.has(EffectKind::kViscosity)) {
      EXPECT_NO_THROW(Body{config}) << model.name;
    } else {
      EXPECT_THROW(Body{config}, std::invalid_argument) << model.name;
    }
  }
}

}  // namespace
}  // namespace tendon::softbody::models_test

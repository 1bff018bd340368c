// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/stiffening.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "tests/clients/softbody/pressed_block.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::stiffening_test {
namespace {

using testing::pressed_body;

TEST(Stiffening, ModulusGoesStraightFromPointToPointAndStaysBeforeAndAfter) {
  const StiffnessOverTime law{.at = {1, 3, 4}, .factor = {1, 2, 0.5}};
  EXPECT_EQ(law.factor_at(0), 1);
  EXPECT_EQ(law.factor_at(1), 1);
  EXPECT_EQ(law.factor_at(2), 1.5);
  EXPECT_EQ(law.factor_at(3), 2);
  EXPECT_EQ(law.factor_at(3.5), 1.25);
  EXPECT_EQ(law.factor_at(9), 0.5);
}

TEST(Stiffening, EveryAnswerIsThatOfABodyOfThatModulus) {
  for (const ModelInfo& model : models()) {
    if (!model.may.has(EffectKind::kStiffening)) continue;
    BodyConfig config = pressed_body(model.kind, Element::kHex8Sri, 4);
    BodyConfig stiffer = config;
    config.stiffening = StiffnessOverTime{.at = {0, 10}, .factor = {1, 3}};
    Body body(config);
    EXPECT_TRUE(body.has_clock());
    for (const double time : {2.5, 10.0}) {
      body.tick(time);
      stiffer.material.young = config.material.young * (1 + 0.2 * time);
      Body expected(stiffer);
      for (const double depth : {1e-4, 2e-3}) {
        const Reaction a = body.settle(Prescribed::kDepth, depth);
        const Reaction b = expected.settle(Prescribed::kDepth, depth);
        EXPECT_NEAR(a.force / b.force, 1, 1e-5) << model.name;
        EXPECT_NEAR(a.stiffness / b.stiffness, 1, 3e-3) << model.name;
        EXPECT_LT((a.slope - b.slope).norm(), 1e-5) << model.name;
      }
      EXPECT_NEAR(body.settle(Prescribed::kForce, 0.3).depth / expected.settle(Prescribed::kForce, 0.3).depth, 1, 1e-4)
          << model.name;
    }
    EXPECT_GT(body.size().bytes, Body(stiffer).size().bytes);
  }
}

TEST(Stiffening, AViscousBodyCreepsAsOneOfThatModulusAndTheSameRelaxation) {
  BodyConfig config = pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4);
  config.effects = {.step = 0.01, .viscosity = 0.05};
  BodyConfig stiffer = config;
  stiffer.material.young *= 2;
  config.stiffening = StiffnessOverTime{.at = {0}, .factor = {2}};
  Body body(config);
  Body expected(stiffer);
  for (int i = 0; i < 20; ++i) {
    EXPECT_NEAR(body.press(Prescribed::kForce, 0.1).depth / expected.press(Prescribed::kForce, 0.1).depth, 1, 1e-9);
  }
}

TEST(Stiffening, ATensedBodyGivesOutWhatTensingPutInAndNoMore) {
  // The stiffness doubles at δ = 2 mm, so the hand receives ½ k δ² more than it gave when it retracts.
  BodyConfig config = pressed_body(ModelKind::kCondensed, Element::kHex8Sri, 4);
  config.stiffening = StiffnessOverTime{.at = {0, 1}, .factor = {1, 2}};
  Body body(config);
  const double k = body.press(Prescribed::kDepth, 1e-3).stiffness;
  const auto work = [&](double from, double to) {
    double sum = 0;
    for (int i = 0; i < 100; ++i) {
      sum += body.touch(Vec3(0, 0, 0.05 - from - (to - from) * (i + 0.5) / 100)).force.z() * (from - to) / 100;
    }
    return sum;
  };
  double gained = work(0, 2e-3);
  body.tick(1);
  gained += work(2e-3, 0);
  EXPECT_NEAR(gained, 0.5 * k * 4e-6, 1e-3 * k * 4e-6);
}

TEST(Stiffening, NonsenseIsRefusedByName) {
  const auto refusal = [](const StiffnessOverTime& law) { return thrown_by([&] { check(law); }); };
  EXPECT_EQ(refusal({.at = {0, 1}, .factor = {1, 2}}), "");
  const std::string times = "stiffening.at: expected ascending times, one or more";
  EXPECT_EQ(refusal({.at = {}, .factor = {}}), times);
  EXPECT_EQ(refusal({.at = {1, 1}, .factor = {1, 2}}), times);
  EXPECT_EQ(refusal({.at = {0, std::nan("")}, .factor = {1, 2}}), times);
  const std::string factors = "stiffening.factor: expected a number above 0 for each time";
  EXPECT_EQ(refusal({.at = {0, 1}, .factor = {1}}), factors);
  EXPECT_EQ(refusal({.at = {0, 1}, .factor = {1, 0}}), factors);
  BodyConfig config = pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4);
  config.stiffening = StiffnessOverTime{.at = {0}, .factor = {2}};
  config.effects = {.density = 1000, .gravity = Vec3(0, 0, -9.81)};
  EXPECT_THROW(Body{config}, std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::stiffening_test

// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/placed_body.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/clients/softbody/scene_text.h"

namespace tendon::softbody {
namespace {

using testing::kGood;
using testing::with;

TEST(PlacedBody, PushesTheHandBackAlongTheWayItCame) {
  PlacedBody body(parse_scene(kGood, "s.toml", "."));
  EXPECT_EQ(body.touch(Vec3(0.009, 0, 0)).force, Vec3::Zero());
  const Feel feel = body.touch(Vec3(0.012, 0, 0));
  EXPECT_LT(feel.force.x(), -0.5);
  EXPECT_LT(feel.force.tail<2>().norm(), 1e-9);
  EXPECT_NEAR(feel.stiffness(0, 0), -feel.force.x() / 0.002, 1e-6);
  DeviceState hand;
  hand.position = Vec3(0.012, 0, 0);
  const Touch touch = body.answer(hand);
  EXPECT_EQ(touch.force, feel.force);
  EXPECT_EQ(touch.stiffness, feel.stiffness);
}

TEST(PlacedBody, AnswersForEveryModelThatASceneCanName) {
  for (const ModelInfo& model : models()) {
    std::string text = with("\"condensed\"", "\"" + std::string(model.name) + "\"");
    std::string effects = "[\"contact\"";
    if (model.large_rotations) effects += ", \"geometric-nonlinearity\"";
    if (model.large_strains) effects += ", \"material-nonlinearity\"";
    text.replace(text.find("[\"contact\""), 10, effects);
    PlacedBody body(parse_scene(text, "s.toml", "."));
    const double stiffness = -body.touch(Vec3(0.01001, 0, 0)).force.x() / 1e-5;
    EXPECT_NEAR(stiffness, 470, 1) << model.name;
  }
}

}  // namespace
}  // namespace tendon::softbody

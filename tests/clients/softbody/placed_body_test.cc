// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/placed_body.h"

#include <gtest/gtest.h>

#include <string>

#include "core/remote/answer.h"
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
  EXPECT_EQ(touch.valid_radius, feel.valid_radius);
  EXPECT_EQ(touch.error, feel.error);
  ASSERT_TRUE(touch.contact);
  EXPECT_NEAR((touch.contact->normal - -Vec3::UnitX()).norm(), 0, 1e-12);
  EXPECT_NEAR(touch.contact->gap, -0.002, 1e-9);
  EXPECT_FALSE(touch.contact->table);
}

TEST(PlacedBody, ABodyThatSticksSendsNoSurfaceThatOnlyPushes) {
  PlacedBody body(parse_scene(with("patch_radius_mm", "side = \"bilateral\"\npatch_radius_mm"), "s.toml", "."));
  DeviceState hand;
  hand.position = Vec3(0.012, 0, 0);
  EXPECT_FALSE(body.answer(hand).contact);
}

/// What a server takes the answer of `body` at `x` to mean `deeper` down.
Vec3 meant(PlacedBody& body, const Vec3& x, double deeper) {
  DeviceState hand;
  hand.position = x;
  const Touch touch = body.answer(hand);
  RemoteForce answer{.force = touch.force};
  answer.model =
      LocalModel{.at = x, .stiffness = *touch.stiffness, .valid_radius = touch.valid_radius, .contact = touch.contact};
  EXPECT_TRUE(is_sound(answer));
  return reconstruct(believed(answer, 1e6), x + deeper * Vec3::UnitX()).force;
}

TEST(PlacedBody, ATableFollowsASpheresGrowingContactWhereAStiffnessDoesNot) {
  const auto scene = [](const std::string& more) {
    std::string text = with("patch_radius_mm", more + "tool = \"sphere\"\ntool_radius_mm = 20\npatch_radius_mm");
    text.replace(text.find("[4, 4, 2]"), 9, "[12, 12, 6]");
    return parse_scene(text, "s.toml", ".");
  };
  PlacedBody plain(scene(""));
  PlacedBody tabled(scene("table_mm = 8\n"));
  const double surface = 0.01 - 0.02;  // the sphere's middle, when it touches
  double of_table = 0;
  double of_stiffness = 0;
  for (const double from : {-0.001, 0.002, 0.004}) {
    for (const double deeper : {-0.002, 0.002}) {
      const Vec3 x((surface + from) * Vec3::UnitX());
      const Vec3 truth = plain.touch(x + deeper * Vec3::UnitX()).force;
      of_table += (meant(tabled, x, deeper) - truth).squaredNorm();
      of_stiffness += (meant(plain, x, deeper) - truth).squaredNorm();
      EXPECT_LT((meant(tabled, x, deeper) - truth).norm(), 0.01 + 0.03 * truth.norm()) << from << ' ' << deeper;
    }
  }
  EXPECT_LT(of_table, 0.01 * of_stiffness);
}

/// A scene of one of the models, with the effects that it cannot do without.
std::string scene_of(const ModelInfo& model) {
  std::string text = with("\"condensed\"", "\"" + std::string(model.name) + "\"");
  std::string names;
  for (const EffectInfo& effect : effects()) {
    if (!model.always.has(effect.kind)) continue;
    names += (names.empty() ? "[\"" : ", \"") + std::string(effect.name) + '"';
  }
  if (model.has_time()) {
    names += ", \"damping\"]\nstep_ms = 1\ndamping_per_s = 40";
    text.replace(text.find("poisson"), 7, "density_kg_per_m3 = 1000, poisson");
  } else {
    names += ']';
  }
  text.replace(text.find("[\"contact\"]"), 11, names);
  if (model.tetrahedra) text.replace(text.find("hex8-sri"), 8, "tet4");
  return text;
}

DeviceState hand_at(double depth, Duration at) {
  DeviceState hand;
  hand.sampled = PeerTime(at);
  hand.position = Vec3(0.01 + depth, 0, 0);
  return hand;
}

TEST(PlacedBody, AnswersForEveryModelThatASceneCanName) {
  for (const ModelInfo& model : models()) {
    PlacedBody body(parse_scene(scene_of(model), "s.toml", "."));
    double stiffness = 0;
    for (int i = 0; i < 60; ++i) {  // 0.6 s
      stiffness = -body.answer(hand_at(1e-4, std::chrono::milliseconds(10 * i))).force.x() / 1e-4;
    }
    const double expected =
        Body(parse_scene(scene_of(model), "s.toml", ".").body).settle(Given::kDepth, 1e-4).force / 1e-4;
    EXPECT_NEAR(stiffness / expected, 1, 2e-3) << model.name;
    if (!model.tetrahedra && model.kind != ModelKind::kProjective && model.kind != ModelKind::kModal) {
      EXPECT_NEAR(stiffness, 470, 3) << model.name;
    }
  }
}

TEST(PlacedBody, WhatIsPlannedOverTimeCountsFromTheFirstAnswersSample) {
  std::string text = with("\"condensed\"", "\"linear\"");
  text.replace(text.find("[\"contact\"]"), 11, "[\"contact\", \"cutting\", \"stiffening\"]");
  text +=
      "[[cutting]]\ncorner_mm = [0, -60, 25]\nalong_mm = [0, 120, 0]\ndeep_mm = [0, 0, 30]\nat_s = 1\n"
      "[stiffening]\nat_s = [2, 4]\nfactor = [1, 3]\n";
  PlacedBody body(parse_scene(text, "s.toml", "."));
  const auto force = [&](int ms) { return -body.answer(hand_at(1e-3, std::chrono::milliseconds(ms))).force.x(); };
  const double whole = force(70'000);
  EXPECT_EQ(force(70'900), whole);
  const double cut = force(71'000);
  EXPECT_LT(cut, 0.99 * whole);
  EXPECT_EQ(force(72'000), cut);
  EXPECT_NEAR(force(73'000) / cut, 2, 1e-9);
  EXPECT_NEAR(force(75'000) / cut, 3, 1e-9);
  EXPECT_NEAR(force(60'000) / cut, 1, 1e-9);  // set back: the modulus of before, but no cut heals
}

TEST(PlacedBody, ABodyWithTimeAdvancesByTheTimeBetweenSamples) {
  const Scene scene = parse_scene(scene_of(info(ModelKind::kTensorMass)), "s.toml", ".");
  PlacedBody often(scene);
  PlacedBody seldom(scene);
  Vec3 force;
  for (int i = 0; i <= 40; ++i) {  // 10 ms in quarters of a millisecond, at an even speed
    force = often.answer(hand_at(1e-5 * i, std::chrono::microseconds(250 * i))).force;
  }
  seldom.answer(hand_at(0, Duration(0)));
  const Vec3 at_once = seldom.answer(hand_at(4e-4, std::chrono::milliseconds(10))).force;
  EXPECT_LT((force - at_once).norm(), 1e-9);
  EXPECT_LT(force.x(), -0.01);
  // A pause is not made up for, and time that goes back stops nothing.
  const Vec3 after_a_pause = often.answer(hand_at(4e-4, std::chrono::seconds(100))).force;
  EXPECT_EQ(after_a_pause, seldom.answer(hand_at(4e-4, std::chrono::seconds(1))).force);
  EXPECT_TRUE(often.answer(hand_at(4e-4, Duration(0))).force.allFinite());
}

}  // namespace
}  // namespace tendon::softbody

// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/placed_body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/cpp/engine/self_test.h"
#include "core/base/rotation.h"
#include "core/remote/answer.h"
#include "tests/clients/softbody/scene_text.h"

namespace tendon::softbody::placed_body_test {
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
  EXPECT_EQ(touch.way, 0U) << "this body has one way of answering";
  ASSERT_TRUE(touch.contact);
  EXPECT_NEAR((touch.contact->normal - -Vec3::UnitX()).norm(), 0, 1e-12);
  EXPECT_NEAR(touch.contact->gap, -0.002, 1e-9);
  EXPECT_FALSE(touch.contact->table);
}

TEST(PlacedBody, TwoHandsAreAnsweredAtOnceEachInItsOwnDevicesFrame) {
  const std::string text =
      testing::listing("corotational", R"(["contact", "geometric-nonlinearity"])",
                       "[[hands]]\ndevice = \"left\"\nat_mm = [10, 30, 0]\n[[hands]]\ndevice = \"right\"\nat_mm = [10, "
                       "-30, 0]\n");
  std::string rigid = text;
  rigid.replace(rigid.find("at_mm = [10, 0, 0]\n"), 19, "");
  rigid.replace(rigid.find("patch_radius_mm"), 0, "tool = \"sphere\"\ntool_radius_mm = 10\n");
  PlacedBody body(parse_scene(rigid, "s.toml", "."));
  std::vector<std::optional<DeviceState>> hands(2);
  hands[0].emplace().position = Vec3(0.003, 0, 0);
  hands[1].emplace().position = Vec3(0.003, 0.001, 0);
  const std::vector<Touch> both = body.answer(hands);
  for (const Touch& touch : both) {
    EXPECT_FALSE(touch.unknown);
    EXPECT_LT(touch.force.x(), -0.1);
    EXPECT_GT((*touch.stiffness)(0, 0), 50);
    ASSERT_TRUE(touch.contact);
    EXPECT_LT(touch.contact->normal.x(), -0.9);
    EXPECT_NEAR(touch.contact->gap, -0.0031, 4e-4);
  }
  EXPECT_LT(both[0].force.y() * both[1].force.y(), 0);
  hands[1].reset();
  const std::vector<Touch> one = body.answer(hands);
  EXPECT_TRUE(one[1].unknown);
  EXPECT_LT(one[0].force.x(), -0.1);
}

TEST(PlacedBody, ABodyThatSticksSendsNoSurfaceThatOnlyPushes) {
  PlacedBody body(parse_scene(with("patch_radius_mm", "side = \"bilateral\"\npatch_radius_mm"), "s.toml", "."));
  DeviceState hand;
  hand.position = Vec3(0.012, 0, 0);
  EXPECT_FALSE(body.answer(hand).contact);
}

/// Extrapolated by the server from the answer at `x` to a point `deeper` (m) along x.
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
  const double surface = 0.01 - 0.02;  // center of the sphere at the first contact
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

constexpr std::string_view kSphereBelow =
    "tool = \"sphere\"\ntool_radius_mm = 20\ntool_offset_mm = [60, 0, 20]\nreach_mm = 20\npatch_radius_mm";

Scene with_tool(std::string_view tool) {
  std::string text = with("patch_radius_mm", tool);
  text.replace(text.find("[4, 4, 2]"), 9, "[12, 12, 6]");
  return parse_scene(text, "s.toml", ".");
}

/// The tool is `offset` (m) from the handle.
DeviceState hand_with(const Vec3& tool, const Vec3& offset, const Quat& turn) {
  DeviceState hand;
  hand.position = tool - rotated(turn, offset);
  hand.turning = Turning{.orientation = turn};
  return hand;
}

TEST(PlacedBody, ASphereAtAnOffsetIsThatSphereAndItsForceHasALever) {
  PlacedBody plain(with_tool("tool = \"sphere\"\ntool_radius_mm = 20\nreach_mm = 20\npatch_radius_mm"));
  PlacedBody held(with_tool(kSphereBelow));
  const Vec3 offset(0.06, 0, 0.02);
  const Vec3 tool(-0.0075, 0.004, -0.003);
  DeviceState there;
  there.position = tool;
  const Touch alone = plain.answer(there);
  EXPECT_LT(alone.force.x(), -0.1);
  EXPECT_FALSE(alone.torque);
  for (const Vec3& by : {Vec3(0, 0, 0), Vec3(0, 0, 1), Vec3(0.5, -1, 0.3)}) {
    const Quat turn = rotation_by(by);
    const Touch touch = held.answer(hand_with(tool, offset, turn));
    EXPECT_LT((touch.force - alone.force).norm(), 1e-9);
    ASSERT_TRUE(touch.torque && touch.angular_stiffness);
    EXPECT_LT((*touch.torque - rotated(turn, offset).cross(alone.force)).norm(), 1e-9);
    EXPECT_GT(touch.torque->norm(), 1e-3);
  }
  // If the device does not measure the orientation, the handle has the orientation of the scene.
  DeviceState unturned = hand_with(tool, offset, Quat{});
  unturned.turning.reset();
  const Touch touch = held.answer(unturned);
  EXPECT_LT((*touch.torque - offset.cross(alone.force)).norm(), 1e-9);
  EXPECT_FALSE(touch.angular_stiffness);
}

TEST(PlacedBody, ACapsuleTurnsWithTheHandleAndAnswersWithATorque) {
  const Scene scene = with_tool(
      "tool = \"capsule\"\ntool_radius_mm = 15\ntool_length_mm = 30\ntool_axis = [0, 0, 1]\n"
      "tool_offset_mm = [50, 0, 10]\nreach_mm = 30\npatch_radius_mm");
  PlacedBody body(scene);
  EXPECT_EQ(std::get<CapsuleTool>(scene.body.tool).half_length, 0.015);
  const Vec3 offset(0.05, 0, 0.01);
  // The hand approaches from −x in the device's frame. A transverse capsule touches 15 mm early, one along x 30 mm.
  const auto gap = [&](const Quat& turn) {
    return body.answer(hand_with(Vec3(-0.04, 0, 0), offset, turn)).contact->gap;
  };
  EXPECT_NEAR(gap(Quat{}), 0.05 - 0.015, 2e-3);
  EXPECT_NEAR(gap(rotation_by(Vec3(0, std::numbers::pi / 2, 0))), 0.05 - 0.03, 2e-3);
  const Quat turn = rotation_by(Vec3(0, 0.2, 0));
  const DeviceState hand = hand_with(Vec3(-0.005, 0, 0), offset, turn);
  const Touch touch = body.answer(hand);
  EXPECT_LT(touch.force.x(), -0.1);
  ASSERT_TRUE(touch.torque && touch.angular_stiffness);
  // The line of action of the force passes through the contact area.
  const Vec3 arm(-rotated(turn, offset));
  const Vec3 about_tool = *touch.torque + arm.cross(touch.force);
  EXPECT_LT(about_tool.norm(), 0.03 * touch.force.norm());
  EXPECT_GT(about_tool.norm(), 0.001 * touch.force.norm());
  // The change of the torque under a small rotation must match the angular stiffness.
  const Vec3 small(0, 0, 1e-5);
  DeviceState turned = hand;
  turned.turning->orientation = product(rotation_by(small), turn);
  const Vec3 change = *body.answer(turned).torque - *touch.torque;
  EXPECT_LT((change + *touch.angular_stiffness * small).norm(), 0.1 * change.norm() + 1e-8);
  EXPECT_TRUE(is_sound(
      RemoteForce{.force = touch.force, .model = LocalModel{.at = hand.position, .stiffness = *touch.stiffness}}));
}

TEST(PlacedBody, APatchAtAnOffsetGivesATorqueOnEveryModel) {
  std::string text = with("patch_radius_mm", "tool_offset_mm = [0, 30, 0]\npatch_radius_mm");
  text.replace(text.find("\"condensed\""), 11, "\"corotational\"");
  text.replace(text.find("[\"contact\"]"), 11, "[\"contact\", \"geometric-nonlinearity\"]");
  PlacedBody body(parse_scene(text, "s.toml", "."));
  const Vec3 offset(0, 0.03, 0);
  const Touch touch = body.answer(hand_with(Vec3(0.012, 0, 0), offset, Quat{}));
  EXPECT_LT(touch.force.x(), -0.5);
  EXPECT_LT((*touch.torque - offset.cross(touch.force)).norm(), 1e-14);
}

std::string scene_of(const ModelInfo& model) {
  std::string text = with("\"condensed\"", "\"" + std::string(model.name) + "\"");
  std::string names;
  for (const EffectInfo& effect : effects()) {
    if (!model.always.has(effect.kind)) continue;
    names += (names.empty() ? "[\"" : ", \"") + std::string(effect.name) + '"';
  }
  text.replace(text.find("[\"contact\"]"), 11, names + ']');
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
    for (int i = 0; i < 60; ++i) {
      stiffness = -body.answer(hand_at(1e-4, std::chrono::milliseconds(10 * i))).force.x() / 1e-4;
    }
    const double expected =
        Body(parse_scene(scene_of(model), "s.toml", ".").body).settle(Prescribed::kDepth, 1e-4).force / 1e-4;
    EXPECT_NEAR(stiffness / expected, 1, 2e-3) << model.name;
    EXPECT_NEAR(stiffness, 470, 3) << model.name;
  }
}

TEST(PlacedBody, ABodyOfSeveralWaysSaysWhichOneItWas) {
  PlacedBody body(parse_scene(scene_of(info(ModelKind::kNear)), "s.toml", "."));
  DeviceState hand;
  hand.position = Vec3(0.012, 0, 0);
  const std::uint32_t way = body.answer(hand).way;
  ASSERT_GT(way, 0U);
  const std::string_view name = kSolverPathNames.at(way - 1);
  EXPECT_TRUE(name == "near" || name == "whole") << name;
  hand.position = Vec3(0.009, 0, 0);
  EXPECT_EQ(body.answer(hand).way, 0U) << "nothing touches the body";
}

/// The closed paths of the self-test leave the region of the near field and return.
TEST(PlacedBody, ANearFieldThatFollowsTheHandPassesTheSelfTest) {
  std::string text = scene_of(info(ModelKind::kNear));
  text.replace(text.find("[4, 4, 2]"), 9, "[8, 8, 4]");
  text.replace(text.find("\"near\""), 6, "\"near\"\nerror_percent = 0.01");
  PlacedBody body(parse_scene(text, "s.toml", "."));
  SelfTestScript script;
  script.start = Vec3(0.007, 0, 0);
  script.depth = 0.006;
  script.slide = 0.012;
  script.rate_hz = 200;
  const SelfTest result = self_test([&](const DeviceState& hand) { return body.answer(hand); }, script);
  EXPECT_TRUE(result.passed()) << result.text();
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
  EXPECT_NEAR(force(60'000) / cut, 1, 1e-9);  // the clock is set back, which resets the modulus but not the cut
}

TEST(PlacedBody, ABodyWithTimeAdvancesByTheTimeBetweenSamples) {
  std::string text = with("\"condensed\"", "\"linear\"");
  text.replace(text.find("[\"contact\"]"), 11,
               "[\"contact\", \"inertia\", \"damping\"]\nstep_ms = 1\ndamping_per_s = 40");
  text.replace(text.find("poisson"), 7, "density_kg_per_m3 = 1000, poisson");
  const Scene scene = parse_scene(text, "s.toml", ".");
  PlacedBody often(scene);
  PlacedBody seldom(scene);
  Vec3 force;
  for (int i = 0; i <= 40; ++i) {  // 10 ms in steps of 0.25 ms at constant speed
    force = often.answer(hand_at(1e-5 * i, std::chrono::microseconds(250 * i))).force;
  }
  seldom.answer(hand_at(0, Duration(0)));
  const Vec3 at_once = seldom.answer(hand_at(4e-4, std::chrono::milliseconds(10))).force;
  EXPECT_LT((force - at_once).norm(), 1e-9);
  EXPECT_LT(force.x(), -0.01);
  // A long pause is skipped without catching up, and time that goes backward does not stop the body.
  const Vec3 after_a_pause = often.answer(hand_at(4e-4, std::chrono::seconds(100))).force;
  EXPECT_EQ(after_a_pause, seldom.answer(hand_at(4e-4, std::chrono::seconds(1))).force);
  EXPECT_TRUE(often.answer(hand_at(4e-4, Duration(0))).force.allFinite());
}

std::string text_of(const std::string& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

SelfTest expect_passed(const Scene& scene, double rate_hz = 1000) {
  PlacedBody body(scene);
  SelfTestScript script;
  script.start = scene.at + 0.003 * scene.towards_hand;
  script.into = -scene.towards_hand;
  script.depth = 0.006;
  script.slide = 0.003;
  script.rate_hz = rate_hz;
  SelfTest result = self_test([&](const DeviceState& hand) { return body.answer(hand); }, script);
  EXPECT_TRUE(result.passed()) << result.text();
  return result;
}

TEST(PlacedBody, TheShippedOrgansPassTheSelfTest) {
  for (const std::string name : {"kidney", "tumour", "liver_near"})
    expect_passed(read_scene(TENDON_SCENES "/" + name + ".toml"));
}

/// At this rate the self-test can judge the stiffness at the largest depth.
TEST(PlacedBody, AnswersOfTheNearLiverWithoutAStepHaveTheirStiffness) {
  const SelfTest result = expect_passed(read_scene(TENDON_SCENES "/liver_near.toml"), 200);
  const auto judged = std::ranges::find_if(result.findings, [](const SelfTest::Finding& finding) {
    return finding.what.starts_with("its stiffness matches its force, 0.006 m");
  });
  ASSERT_NE(judged, result.findings.end());
  EXPECT_EQ(judged->verdict, SelfTest::Verdict::kPassed) << judged->text();
}

TEST(PlacedBody, ALiverOfALinearMaterialPassesTheSelfTestAtEveryPoint) {
  std::string text = text_of(TENDON_SCENES "/liver.toml");
  for (const auto& [old, replacement] :
       {std::pair(", \"geometric-nonlinearity\", \"material-nonlinearity\"", ""), std::pair("error_percent", "# ")}) {
    text.replace(text.find(old), std::string_view(old).size(), replacement);
  }
  for (const std::string model : {"condensed", "linear"}) {
    std::string of_model = text;
    of_model.replace(of_model.find("neo-hookean"), 11, model);
    expect_passed(parse_scene(of_model, "liver.toml", TENDON_SCENES));
  }
}

}  // namespace
}  // namespace tendon::softbody::placed_body_test

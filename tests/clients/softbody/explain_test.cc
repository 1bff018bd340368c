// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/explain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/scene_text.h"
#include "tests/support/property_cases.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::explain_test {
namespace {

using testing::kCut;
using testing::kGood;
using testing::listing;
using testing::pressed_body;
using testing::with;

/// A clock that returns `times` in order and then repeats the last.
std::function<double()> saying(std::vector<double> times) {
  return [times, next = std::size_t{0}]() mutable { return times[std::min(next++, times.size() - 1)]; };
}

std::string explained(const Scene& scene) { return in_words(scene, explain(scene, saying({0, 1e6}))); }

TEST(SoftbodyExplain, SaysWhatIsSimulatedWhatNotAndWarnsOfElementsThatLock) {
  const std::string text = explained(parse_scene(kGood, "s.toml", "."));
  for (const std::string_view part : {"simulated:\n  contact: unilateral", "condensed", "not simulated:", "gravity",
                                      "75 nodes, 32 elements", "unknowns: 150", "touchable nodes: 25"}) {
    EXPECT_PRED2(says, text, part);
  }
  EXPECT_EQ(text.find("warning"), std::string::npos);
  std::string locking = with("hex8-sri", "tet4");
  locking.replace(locking.find("0.45"), 4, "0.49");
  EXPECT_PRED2(says, explained(parse_scene(locking, "s.toml", ".")), "warning: tet4 locks");
}

TEST(SoftbodyExplain, EveryEffectIsNamedWhereItIsListedAndWhereItIsNot) {
  const std::string text = listing("linear", "[\"contact\", \"cutting\"]", std::string(kCut) + "at_s = 1\n");
  const std::string cutting = explained(parse_scene(text, "s.toml", "."));
  const std::size_t rest = cutting.find("not simulated:");
  for (const EffectInfo& effect : effects()) {
    const std::size_t line = cutting.find("\n  " + std::string(effect.name));
    ASSERT_NE(line, std::string::npos) << effect.name << '\n' << cutting;
    const bool listed = effect.kind == EffectKind::kContact || effect.kind == EffectKind::kCutting;
    EXPECT_EQ(line < rest, listed) << effect.name << '\n' << cutting;
  }
}

TEST(SoftbodyExplain, SaysWhatWasLearnedAndWhatAnswersCost) {
  Scene scene{.body = pressed_body(ModelKind::kNear, Element::kHex8Sri, 6)};
  scene.body.model = NearConfig{.newton = {.tolerance = 0.02}, .learn = true, .tabulate = true};
  scene.body.reach = 0.005;
  const Explanation explanation = explain(scene, saying({0, 1e6}));
  ASSERT_EQ(explanation.learned.size(), 2U);
  const std::string text = in_words(scene, explanation);
  EXPECT_PRED2(says, text, "answers, where accurate enough: tabulated, within ");
  EXPECT_PRED2(says, text, "answers, where accurate enough: learned, within ");
  EXPECT_PRED2(says, text, " in 80 of 80 cells, error up to ");
  EXPECT_PRED2(says, text, "answers elsewhere: near field, within ");
  const auto json = nlohmann::json::parse(in_json(scene, explanation));
  EXPECT_EQ(json["learned"][0]["name"], "tabulated");
  EXPECT_EQ(json["learned"][1]["name"], "learned");
  EXPECT_EQ(json["learned"][1]["shapes"], 45);
  EXPECT_LE(json["learned"][1]["error"], 0.02);
  EXPECT_TRUE(json["near"].contains("answer_s"));
}

TEST(SoftbodyExplain, SaysHowMuchOfABodyIsNearTheTool) {
  Scene scene{.body = pressed_body(ModelKind::kNear, Element::kHex8Sri, 8)};
  const Explanation explanation = explain(scene, saying({0, 1e6}));
  const std::string text = in_words(scene, explanation);
  EXPECT_PRED2(says, text,
               "near the tool: corotational, 112 of 256 elements, within 45 mm or on the path of the tool; 312 "
               "unknowns, including 60 modes instead of the 408 unknowns of the interface\n");
  const auto json = nlohmann::json::parse(in_json(scene, explanation));
  EXPECT_EQ(json["near"]["elements"], 112);
  EXPECT_EQ(json["near"]["modes"], 60);
  EXPECT_GT(json["bytes"], 100'000);
  const bool beside = factors_may_work_at_once();
  EXPECT_PRED2(says, text, beside ? "next near field: in another thread" : "next near field: for the shape at rest");
  EXPECT_EQ(json["near"].contains("field_s"), beside);
  EXPECT_EQ(json["near"].contains("thread_bytes"), beside);
  scene.body.shape = BlockShape{Vec3(0.1, 0.1, 0.05), {4, 4, 2}};
  EXPECT_PRED2(says, explained(scene), "near the tool: the whole body");
  scene.body.model = LinearConfig{};
  EXPECT_EQ(explained(scene).find("near the tool"), std::string::npos);
}

TEST(SoftbodyExplain, SixtyModesAreTheExactInterfaceToHalfAPercentWhenAsked) {
  for (const auto& [n, poisson] : {std::pair(8, 0.3), std::pair(12, 0.499), std::pair(16, 0.45)}) {
    if (n > 12 && property_cases() < 10'000) continue;
    Scene scene{.body = pressed_body(ModelKind::kNear, Element::kHex8Sri, n)};
    scene.body.material.poisson = poisson;
    const double off = off_the_exact_interface(scene.body);
    EXPECT_GT(off, 1e-6) << n;
    EXPECT_LT(off, 0.005) << n;
    if (n > 8) continue;
    Explanation explanation = explain(scene, saying({0, 1e6}));
    EXPECT_EQ(in_words(scene, explanation).find("compared with the exact interface"), std::string::npos);
    EXPECT_FALSE(nlohmann::json::parse(in_json(scene, explanation))["near"].contains("off_exact"));
    explanation.off_exact = 0.00123;
    EXPECT_PRED2(says, in_words(scene, explanation),
                 "compared with the exact interface: forces differ by up to 0.12 % for depths up to 4 mm\n");
    EXPECT_EQ(nlohmann::json::parse(in_json(scene, explanation))["near"]["off_exact"], 0.00123);
  }
  EXPECT_THROW(off_the_exact_interface(pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4)), std::invalid_argument);
}

TEST(SoftbodyExplain, SaysWhatAToolOfAFileIsAndCosts) {
  Scene scene{.body = pressed_body(ModelKind::kNeoHookean, Element::kHex8Sri, 4)};
  EXPECT_EQ(explained(scene).find("\ntool: "), std::string::npos);
  scene.body.tool = MeshTool{TENDON_SCENES "/spoon.off", 1e-3, 8e-4};
  const Explanation explanation = explain(scene, saying({0, 0.25, 1e6}));
  const RigidShape::MeshFacts& facts = explanation.tool.value().facts;
  EXPECT_EQ(facts.facets, 1720);
  EXPECT_EQ(explanation.tool->made_s, 0.25);
  const std::string text = in_words(scene, explanation);
  EXPECT_PRED2(says, text, "with a tool with the surface " TENDON_SCENES "/spoon.off, with a torque");
  EXPECT_PRED2(says, text, "\ntool: 1720 facets, ");
  EXPECT_PRED2(says, text, std::to_string(facts.points) + " distances on a grid with a cell size of 0.8 mm, ");
  EXPECT_PRED2(says, text, " MB, computed in 250 ms of processor time; accuracy of the surface ");
  EXPECT_PRED2(says, text, " x 76 mm; ");
  const auto json = nlohmann::json::parse(in_json(scene, explanation));
  EXPECT_EQ(json["tool"]["bytes"], facts.bytes);
  EXPECT_EQ(json["tool"]["points"], facts.points);
  EXPECT_NEAR(json["tool"]["size_m"][2].get<double>(), 0.076, 1e-6);
  EXPECT_EQ(json["tool"]["made_s"], 0.25);
}

TEST(SoftbodyExplain, WhatAnEffectAddsIsTheDifferenceToTheBodyWithoutIt) {
  Scene scene{.body = pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4)};
  const auto bytes = [](const BodyConfig& body) { return static_cast<std::int64_t>(Body(body).size().bytes); };
  const std::int64_t bare = bytes(scene.body);
  scene.body.effects.density = 1000;
  scene.body.effects.gravity = Vec3(0, 0, -9.81);
  // The scene takes 10 s and 12 s, and the one without gravity 4 s, for 40 answers each. Then time is up.
  const Explanation explanation = explain(scene, saying({0, 0, 10, 10, 22, 22, 26, 26}));
  EXPECT_NEAR(explanation.all.answer_s, 0.25, 1e-12);
  EXPECT_NEAR(explanation.resolution_s, 0.05, 1e-12);
  for (const Explanation::Part& part : explanation.parts) {
    EXPECT_EQ(part.simulated, part.kind == EffectKind::kContact || part.kind == EffectKind::kGravity);
    ASSERT_EQ(part.adds.has_value(), part.kind == EffectKind::kGravity);
    if (!part.adds) continue;
    EXPECT_NEAR(part.adds->answer_s, 0.15, 1e-12);
    EXPECT_EQ(part.adds->bytes, bytes(scene.body) - bare);
    EXPECT_GT(part.adds->bytes, 0);
  }
  EXPECT_PRED2(says, in_words(scene, explanation), "gravity: the body deforms under its weight; adds 150 ms and ");
  const auto json = nlohmann::json::parse(in_json(scene, explanation));
  EXPECT_EQ(json["model"], "linear");
  EXPECT_EQ(json["unknowns"], 150);
  EXPECT_NEAR(json["linear_up_to_m"].get<double>(), Body(scene.body).linear_up_to(), 1e-9);
  EXPECT_EQ(json["effects"].size(), effects().size());
  for (const auto& effect : json["effects"]) EXPECT_EQ(effect.contains("adds_s"), effect["name"] == "gravity");
  EXPECT_TRUE(json["warnings"].empty());
}

constexpr NearModel::Size kNear{.made = 5, .late = 1, .linear = 3};

TEST(Answered, SaysTheSameCountsInWordsAndInJson) {
  const Answered both{{{.size = {.name = "tabulated"}, .answers = 812}, {.size = {.name = "learned"}, .answers = 97}},
                      kNear};
  EXPECT_EQ(in_json(both), R"({"answers":{"tabulated":812,"learned":97,"linear":3,"fields":5,"fields_late":1}})"
                           "\n");
  EXPECT_EQ(in_words(both),
            "812 answers were tabulated, 97 answers were learned, 3 answers were from the linear body, 5 near fields "
            "were computed by the other thread, 1 of them were too late\n");
}

TEST(Answered, WithoutAnotherThreadThereAreLevelsAlone) {
  const Answered levels{{{.size = {.name = "learned"}, .answers = 0}}, {}};
  EXPECT_EQ(in_json(levels), "{\"answers\":{\"learned\":0}}\n");
  EXPECT_EQ(in_words(levels), "0 answers were learned\n");
}

TEST(Answered, ABodyWithoutEitherHasNothingToSay) {
  EXPECT_EQ(in_json({}), "");
  EXPECT_EQ(in_words({}), "");
}

}  // namespace
}  // namespace tendon::softbody::explain_test

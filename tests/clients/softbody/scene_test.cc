// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/scene.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/clients/softbody/scene_text.h"

namespace tendon::softbody {
namespace {

using testing::kGood;
using testing::with;

std::string refusal(const std::string& text) {
  try {
    parse_scene(text, "s.toml", ".");
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

TEST(SoftbodyScene, EveryValueArrives) {
  const Scene scene = parse_scene(kGood, "s.toml", ".");
  const auto& block = std::get<BlockShape>(scene.body.shape);
  EXPECT_EQ(block.size, Vec3(0.1, 0.1, 0.05));
  EXPECT_EQ(block.cells, (std::array{4, 4, 2}));
  EXPECT_EQ(scene.body.element, Element::kHex8Sri);
  EXPECT_EQ(scene.body.material.young, 1e4);
  EXPECT_EQ(scene.body.patch_radius, 0.02);
  EXPECT_EQ(scene.at, Vec3(0.01, 0, 0));
}

TEST(SoftbodyScene, ThoseThatAreShippedMakeBodiesThatNobodyHasToBeWarnedOf) {
  for (const char* name : {"softbody.toml", "liver.toml"}) {
    const Scene scene = read_scene(std::filesystem::path(TENDON_SCENES) / name);
    EXPECT_EQ(warnings(scene.body), std::vector<std::string>{}) << name;
    Body body(scene.body);
    EXPECT_GT(body.press(Given::kLeastDepth, 0.001).force, 0.1) << name;
  }
}

TEST(SoftbodyScene, AnUnknownEffectIsAnErrorWithItsLine) {
  EXPECT_EQ(refusal(with("[\"contact\"]", "[\n  \"contact\",\n  \"gravitation\"]")),
            "s.toml:3: effects: unknown effect \"gravitation\"; expected one of contact, geometric-nonlinearity, "
            "material-nonlinearity, gravity, inertia, damping, viscosity, friction");
}

TEST(SoftbodyScene, WhatIsListedIsWhatTheModelSimulatesNoMoreAndNoFewer) {
  EXPECT_EQ(refusal(with("[\"contact\"]", "[]")),
            "s.toml:1: effects: the model \"condensed\" simulates \"contact\", which is not listed");
  EXPECT_EQ(refusal(with("[\"contact\"]", "[\"contact\", \"geometric-nonlinearity\"]")),
            "s.toml:1: effects: the model \"condensed\" does not simulate \"geometric-nonlinearity\", which is listed");
  EXPECT_EQ(refusal(with("\"condensed\"", "\"neo-hookean\"")),
            "s.toml:1: effects: the model \"neo-hookean\" simulates \"geometric-nonlinearity\", which is not listed");
  EXPECT_EQ(refusal(with("effects = [\"contact\"]\n", "")),
            "s.toml: effects: expected a list of effects, found nothing");
}

TEST(SoftbodyScene, AnEffectsKeysAreKnownOnlyWhereItIsListed) {
  std::string text = with("\"condensed\"", "\"linear\"");
  text.replace(text.find("[\"contact\"]"), 11,
               "[\"contact\", \"gravity\", \"inertia\", \"damping\", \"viscosity\", \"friction\"]\nstep_ms = 2\n"
               "gravity_m_per_s2 = [0, 0, -1]\ndamping_per_s = 3\nviscosity_ms = 4\nfriction = 0.5");
  text.replace(text.find("poisson"), 7, "density_kg_per_m3 = 900, poisson");
  const BodyConfig body = parse_scene(text, "s.toml", ".").body;
  EXPECT_TRUE(body.effects.inertia);
  EXPECT_EQ(body.effects.step, 0.002);
  EXPECT_EQ(body.effects.gravity, Vec3(0, 0, -1));
  EXPECT_EQ(body.effects.damping, 3);
  EXPECT_EQ(body.effects.viscosity, 0.004);
  EXPECT_EQ(body.effects.density, 900);
  EXPECT_EQ(body.friction, 0.5);
  EXPECT_EQ(refusal(with("[body]", "friction = 0.5\n[body]")),
            "s.toml:2: friction: unknown key; expected one of body, effects, model, place, touch");
  EXPECT_EQ(refusal(with("[\"contact\"]", "[\"contact\", \"friction\"]")),
            "s.toml: friction: expected a number of at least 0 and at most 10, found nothing");
  EXPECT_EQ(refusal(with("[\"contact\"]", "[\"contact\",\n\"inertia\"]")),
            "s.toml:2: effects: the model \"condensed\" does not simulate \"inertia\", which is listed");
  text.replace(text.find("density_kg_per_m3 = 900, "), 25, "");
  EXPECT_EQ(refusal(text),
            "s.toml: body.material.density_kg_per_m3: expected a number above 0 and at most 1e+06, found nothing");
}

TEST(SoftbodyScene, MistakesAreNamedWithLineKeyAndWhatWasExpected) {
  EXPECT_EQ(refusal(with("cells = [4, 4, 2]", "cells = [4, 4]")),
            "s.toml:5: body.cells: expected three whole numbers from 1 to 200");
  EXPECT_EQ(refusal(with("hex8-sri", "hex9")),
            "s.toml:6: body.element: expected one of tet4, hex8, hex8-sri, hex20, hex27, hex27-sri, found \"hex9\"");
  EXPECT_EQ(refusal(with("poisson = 0.45", "poisson = 0.5")),
            "s.toml:7: body.material.poisson: expected a number of at least 0 and at most 0.4999");
  EXPECT_EQ(refusal(with("young_pa = 10000", "young_pa = nan")),
            "s.toml:7: body.material.young_pa: expected a number above 0 and at most 1e+12");
  EXPECT_EQ(refusal(with("patch_radius_mm = 20", "patch_radius_m = 20")),
            "s.toml: touch.patch_radius_mm: expected a number above 0 and at most 1e+06, found nothing");
  EXPECT_EQ(refusal(with("patch_radius_mm = 20", "patch_radius_mm = 20\nfriction = 1")),
            "s.toml:12: touch.friction: unknown key; expected one of from, middle_mm, patch_radius_mm, reach_mm, side, "
            "tool, tool_radius_mm");
  EXPECT_EQ(refusal(with("[-1, 0, 0]", "[0, 0, 0]")),
            "s.toml:14: place.towards_hand: expected a direction, not [0, 0, 0]");
  EXPECT_EQ(refusal("x = "), "s.toml:1: Error while parsing key-value pair: encountered end-of-file");
  EXPECT_THROW(read_scene("/nowhere/s.toml"), SceneError);
}

TEST(SoftbodyScene, ExplainSaysWhatIsSimulatedWhatNotAndWarnsOfElementsThatLock) {
  const std::string text = explain(parse_scene(kGood, "s.toml", "."));
  for (const std::string_view part : {"simulated:\n  contact: unilateral", "condensed", "not simulated:", "gravity",
                                      "75 nodes, 32 elements", "unknowns: 150", "touchable nodes: 25"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << '\n' << text;
  }
  EXPECT_EQ(text.find("warning"), std::string::npos);
  std::string locking = with("hex8-sri", "tet4");
  locking.replace(locking.find("0.45"), 4, "0.49");
  EXPECT_NE(explain(parse_scene(locking, "s.toml", ".")).find("warning: tet4 locks"), std::string::npos);
}

}  // namespace
}  // namespace tendon::softbody

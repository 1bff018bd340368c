// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/scene.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "clients/softbody/fem/gmsh.h"
#include "tests/clients/softbody/scene_text.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::scene_test {
namespace {

using testing::kCut;
using testing::kGood;
using testing::listing;
using testing::with;

const std::string kEffectNames =
    R"("contact", "geometric-nonlinearity", "material-nonlinearity", "gravity", "inertia", "damping", "viscosity", )"
    R"("friction", "cutting", "stiffening", "plasticity", "self-collision")";

std::string refusal(const std::string& text) {
  return thrown_by<SceneError>([&] { parse_scene(text, "s.toml", "."); });
}

Newton newton_of(const std::string& text) {
  const Scene scene = parse_scene(text, "s.toml", ".");
  return *softbody::newton_of(scene.body.model);
}

NearConfig near_of(const std::string& text) {
  return std::get<NearConfig>(parse_scene(text, "s.toml", ".").body.model);
}

TEST(SoftbodyScene, ATableInAFileIsForTheModelCondensedAndBesideTheScene) {
  const Scene scene =
      parse_scene(with("kind = \"condensed\"", "kind = \"condensed\"\ntable = \"b.table\""), "s.toml", "/scenes");
  EXPECT_EQ(std::get<CondensedConfig>(scene.body.model).table_file, "/scenes/b.table");
  EXPECT_FALSE(std::get<CondensedConfig>(parse_scene(kGood, "s.toml", ".").body.model).table_file);
  EXPECT_THROW(parse_scene(with("kind = \"condensed\"", "kind = \"linear\"\ntable = \"b.table\""), "s.toml", "."),
               SceneError);
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
  for (const char* name : {"softbody.toml", "liver.toml", "liver_near.toml", "kidney.toml", "tumour.toml"}) {
    const Scene scene = read_scene(std::filesystem::path(TENDON_SCENES) / name);
    EXPECT_EQ(warnings(scene.body), std::vector<std::string>{}) << name;
    Body body(scene.body);
    EXPECT_GT(body.press(Prescribed::kLeastDepth, 0.001).force, 0.1) << name;
  }
}

TEST(SoftbodyScene, AnUnknownEffectIsAnErrorWithItsLine) {
  EXPECT_EQ(refusal(with("[\"contact\"]", "[\n  \"contact\",\n  \"gravitation\"]")),
            "s.toml:3: effects: expected one of " + kEffectNames + ", found \"gravitation\"");
  EXPECT_TRUE(refusal(with("[\"contact\"]", "[\"contcat\"]")).ends_with("found \"contcat\"; did you mean contact?"));
}

TEST(SoftbodyScene, WhatIsListedIsWhatTheModelSimulatesNoMoreAndNoFewer) {
  EXPECT_EQ(refusal(with("[\"contact\"]", "[]")),
            "s.toml:1: effects: the model \"condensed\" simulates \"contact\", which is not listed");
  EXPECT_EQ(refusal(with("[\"contact\"]", "[\"contact\", \"geometric-nonlinearity\"]")),
            "s.toml:1: effects: the model \"condensed\" does not simulate \"geometric-nonlinearity\", which is listed");
  EXPECT_EQ(refusal(with("\"condensed\"", "\"neo-hookean\"")),
            "s.toml:1: effects: the model \"neo-hookean\" simulates \"geometric-nonlinearity\", which is not listed");
  EXPECT_EQ(refusal(with("effects = [\"contact\"]\n", "")),
            "s.toml: effects: missing, expected […], each one of " + kEffectNames);
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
  EXPECT_EQ(
      refusal(with("[body]", "friction = 0.5\n[body]")),
      "s.toml:2: friction: unknown key; expected one of effects, model, body, region, touch, hands, place, field");
  EXPECT_EQ(refusal(with("[\"contact\"]", "[\"contact\", \"friction\"]")),
            "s.toml: friction: missing, expected a number from 0 to 10");
  EXPECT_EQ(refusal(with("[\"contact\"]", "[\"contact\",\n\"inertia\"]")),
            "s.toml:2: effects: the model \"condensed\" does not simulate \"inertia\", which is listed");
  text.replace(text.find("density_kg_per_m3 = 900, "), 25, "");
  EXPECT_EQ(refusal(text),
            "s.toml:12: body.material.density_kg_per_m3: missing, expected a number above 0 and up to 1000000 kg/m³");
}

TEST(SoftbodyScene, CutsAndAModulusOverTimeArrive) {
  std::string tables;
  tables.append(kCut).append("at_s = 2\n").append(kCut).append("above_n = 0.5\n");
  tables.append("[stiffening]\nat_s = [0, 4]\nfactor = [1, 2]\n");
  const std::string text = listing("linear", "[\"contact\", \"cutting\", \"stiffening\"]", tables);
  const BodyConfig body = parse_scene(text, "s.toml", ".").body;
  ASSERT_EQ(body.cuts.size(), 2U);
  EXPECT_EQ(body.cuts[0].cut.corner, Vec3(0, -0.06, 0.025));
  EXPECT_EQ(body.cuts[0].cut.along, Vec3(0, 0.12, 0));
  EXPECT_EQ(body.cuts[0].cut.deep, Vec3(0, 0, 0.03));
  EXPECT_EQ(body.cuts[0].when, PlannedCut::When::kTime);
  EXPECT_EQ(body.cuts[0].value, 2);
  EXPECT_EQ(body.cuts[1].when, PlannedCut::When::kForce);
  EXPECT_EQ(body.cuts[1].value, 0.5);
  ASSERT_TRUE(body.stiffening);
  EXPECT_EQ(body.stiffening->factor_at(2), 1.5);
}

TEST(SoftbodyScene, WhatIsWrongWithACutIsNamed) {
  const std::string cut(kCut);
  const std::string effects = "[\"contact\",\n\"cutting\"]";
  EXPECT_EQ(refusal(listing("condensed", effects, cut + "at_s = 1\n")),
            "s.toml:2: effects: the model \"condensed\" does not simulate \"cutting\", which is listed");
  EXPECT_EQ(refusal(listing("linear", "[\"contact\", \"cutting\",\n\"viscosity\"]", cut + "at_s = 1\n")),
            "s.toml:2: effects: \"viscosity\" cannot be simulated together with \"cutting\"");
  EXPECT_EQ(refusal(listing("linear", "[\"contact\", \"gravity\",\n\"stiffening\"]", "")),
            "s.toml:2: effects: \"stiffening\" cannot be simulated together with \"gravity\"");
  EXPECT_EQ(refusal(listing("linear", effects, "")),
            "s.toml: cutting: missing, expected one or more tables [[cutting]]");
  EXPECT_EQ(
      refusal(listing("linear", "[\"contact\"]", cut + "at_s = 1\n")),
      "s.toml:15: cutting: unknown key; expected one of effects, model, body, region, touch, hands, place, field");
  EXPECT_EQ(refusal(listing("linear", effects, cut)), "s.toml:16: cutting[0]: expected either at_s or above_n");
  EXPECT_EQ(refusal(listing("linear", effects, cut + "at_s = 1\nabove_n = 1\n")),
            "s.toml:16: cutting[0]: expected either at_s or above_n");
  EXPECT_EQ(refusal(listing("linear", effects, cut + "at_s = 1\n" + cut + "at_s = 1\nwidth_mm = 3\n")),
            "s.toml:26: cutting[1].width_mm: unknown key; expected one of corner_mm, along_mm, deep_mm, at_s, above_n");
}

TEST(SoftbodyScene, WhatIsWrongWithAModulusOverTimeIsNamed) {
  const std::string effects = "[\"contact\", \"stiffening\"]";
  EXPECT_EQ(refusal(listing("condensed", effects, "[stiffening]\nat_s = [0, 1]\nfactor = [1, 0]\n")),
            "s.toml:17: stiffening.factor: expected a number above 0, found 0");
  EXPECT_EQ(refusal(listing("condensed", effects, "[stiffening]\nat_s = [1, 0]\nfactor = [1, 2]\n")),
            "s.toml:15: stiffening: stiffening.at: expected ascending times, one or more");
  EXPECT_EQ(refusal(listing("condensed", effects, "[stiffening]\nat_s = [0]\nfactor = [1]\nyoung = 3\n")),
            "s.toml:18: stiffening.young: unknown key; expected one of at_s, factor");
  EXPECT_EQ(refusal(listing("condensed", effects, "")),
            "s.toml: stiffening.at_s: missing, expected […], each a number of 0 s or more");
}

TEST(SoftbodyScene, HowWrongAnAnswerMayBeArrivesAndIsForNewtonsMethodAlone) {
  const std::string effects = "[\"contact\", \"geometric-nonlinearity\"]";
  const auto asking = [&](const std::string& percent) {
    return listing("corotational\"\nerror_percent = " + percent + " #", effects, "");
  };
  EXPECT_NEAR(newton_of(asking("0.5")).tolerance, 5e-3, 1e-15);
  EXPECT_NEAR(newton_of(listing("corotational", effects, "")).tolerance, 1e-6, 1e-18);
  for (const char* bad : {"0", "-1", "11", "true", "\"half\""}) {
    EXPECT_EQ(refusal(asking(bad)),
              "s.toml:10: model.error_percent: expected a number above 0 and up to 10 %, found " + std::string(bad));
  }
  EXPECT_EQ(refusal(listing("condensed\"\nerror_percent = 1 #", "[\"contact\"]", "")),
            "s.toml:10: model.error_percent: unknown key; expected one of kind, table");
}

TEST(SoftbodyScene, ALawOfTheElementsNearTheToolArrivesAndFitsTheEffects) {
  const std::string rotations = "[\"contact\", \"geometric-nonlinearity\"]";
  const std::string strains = "[\"contact\", \"geometric-nonlinearity\", \"material-nonlinearity\"]";
  const auto near = [](const std::string& more, const std::string& effects) {
    return listing("near\"\n" + more + " #", effects, "");
  };
  const NearConfig made = near_of(near("law = \"neo-hookean\"\nerror_percent = 2", strains));
  EXPECT_EQ(made.law, Law::kNeoHookean);
  EXPECT_NEAR(made.newton.tolerance, 0.02, 1e-15);
  EXPECT_EQ(near_of(near("law = \"stvk\"", rotations)).law, Law::kStVenantKirchhoff);
  EXPECT_EQ(near_of(near("", rotations)).law, Law::kCorotational);
  EXPECT_EQ(refusal(near("law = \"linear\"", rotations)),
            "s.toml:10: model.law: expected one of \"corotational\", \"stvk\", \"neo-hookean\", found \"linear\"");
  EXPECT_EQ(refusal(near("law = \"neo-hookean\"", rotations)),
            "s.toml:1: effects: the law \"neo-hookean\" simulates \"material-nonlinearity\", which is not listed");
  EXPECT_EQ(refusal(near("law = \"stvk\"", strains)),
            "s.toml:1: effects: the law does not simulate \"material-nonlinearity\", which is listed: only "
            "\"neo-hookean\" does");
  EXPECT_EQ(refusal(listing("corotational\"\nlaw = \"stvk\" #", rotations, "")),
            "s.toml:10: model.law: unknown key; expected one of kind, max_iterations, error_percent");
}

TEST(SoftbodyScene, WhatABodyIsToLearnArrivesAndWantsItsReach) {
  const auto near = [](const std::string& more, const std::string& reach) {
    std::string text = listing("near\"\n" + more + " #", "[\"contact\", \"geometric-nonlinearity\"]", "");
    return text.replace(text.find("patch_radius_mm = 20"), 20, "patch_radius_mm = 20\n" + reach);
  };
  const std::string all = "learn = true\ntabulate = true\nlearned_in = \"kept\"";
  const BodyConfig body = parse_scene(near(all, "reach_mm = 10"), "s.toml", "/scenes").body;
  const auto& made = std::get<NearConfig>(body.model);
  EXPECT_TRUE(made.learn);
  EXPECT_TRUE(made.tabulate);
  EXPECT_EQ(made.learned_in, "/scenes/kept");
  EXPECT_EQ(body.reach, 0.01);
  EXPECT_EQ(made.newton.tolerance, 0.02);
  EXPECT_EQ(near_of(near("learn = true\nerror_percent = 1", "reach_mm = 10")).newton.tolerance, 0.01);
  const NearConfig nothing = near_of(near("", ""));
  EXPECT_FALSE(nothing.learns());
  EXPECT_EQ(nothing.newton.tolerance, Newton().tolerance);
  EXPECT_EQ(refusal(near("learn = true", "")),
            "s.toml:11: touch.reach_mm: missing, expected a number above 0 and up to 30 mm");
  EXPECT_EQ(refusal(near("tabulate = true", "reach_mm = 31")),
            "s.toml:13: touch.reach_mm: expected a number above 0 and up to 30 mm, found 31");
  EXPECT_EQ(refusal(near("learned_in = \"kept\"", "reach_mm = 10")),
            "s.toml:10: model.learned_in: unknown key; expected one of kind, law, learn, tabulate, "
            "max_iterations, error_percent");
  EXPECT_EQ(refusal(near("learn = 1", "reach_mm = 10")), "s.toml:10: model.learn: expected true or false, found 1");
  EXPECT_EQ(refusal(listing("condensed\"\nlearn = true #", "[\"contact\"]", "")),
            "s.toml:10: model.learn: unknown key; expected one of kind, table");
}

TEST(SoftbodyScene, AYieldArrivesAndWhatIsWrongWithItIsNamed) {
  const std::string effects = "[\"contact\", \"geometric-nonlinearity\",\n\"plasticity\"]";
  const std::string table = "[plasticity]\nyield_pa = 500\nhardening_pa = 2000\n";
  const Scene scene = parse_scene(listing("corotational", effects, table), "s.toml", ".");
  const std::optional<Yield> yield = std::get<CorotationalConfig>(scene.body.model).plasticity;
  ASSERT_TRUE(yield);
  EXPECT_EQ(yield->stress, 500);
  EXPECT_EQ(yield->hardening, 2000);
  EXPECT_PRED2(says, scene_reference(), "\n  yield_pa\n");
  EXPECT_EQ(newton_of(listing("linear\"\nmax_iterations = 7 #", "[\"contact\", \"plasticity\"]", table)).max_iterations,
            7);
  EXPECT_EQ(refusal(listing("corotational", effects, "[plasticity]\nyield_pa = 0\nhardening_pa = 1\n")),
            "s.toml:17: plasticity.yield_pa: expected a number above 0 Pa, found 0");
  EXPECT_EQ(refusal(listing("corotational", effects, "[plasticity]\nyield_pa = 1\n")),
            "s.toml:16: plasticity.hardening_pa: missing, expected a number above 0 Pa");
  EXPECT_EQ(refusal(listing("corotational", effects, table + "creep = 1\n")),
            "s.toml:19: plasticity.creep: unknown key; expected one of yield_pa, hardening_pa");
  EXPECT_EQ(
      refusal(listing("linear", "[\"contact\"]", table)),
      "s.toml:15: plasticity: unknown table; expected one of effects, model, body, region, touch, hands, place, field");
  for (const std::string model : {"condensed", "neo-hookean", "near"}) {
    EXPECT_EQ(refusal(listing(model, "[\"contact\",\n\"plasticity\"]", table)),
              "s.toml:2: effects: the model \"" + model + "\" does not simulate \"plasticity\", which is listed");
  }
  for (const std::string other : {"inertia", "damping", "viscosity", "cutting", "stiffening"}) {
    EXPECT_EQ(refusal(listing("linear", "[\"contact\", \"" + other + "\",\n\"plasticity\"]", table)),
              "s.toml:2: effects: \"plasticity\" cannot be simulated together with \"" + other + '"');
  }
}

TEST(SoftbodyScene, ALayerBetweenTheSidesArrivesAndWhatIsWrongWithItIsNamed) {
  const std::string effects = "[\"contact\", \"geometric-nonlinearity\",\n\"self-collision\"]";
  const Scene scene =
      parse_scene(listing("corotational", effects, "[self-collision]\nlayer_mm = 0.2\n"), "s.toml", ".");
  const std::optional<double> layer = std::get<CorotationalConfig>(scene.body.model).self_collision;
  ASSERT_TRUE(layer);
  EXPECT_NEAR(*layer, 2e-4, 1e-18);
  EXPECT_EQ(refusal(listing("corotational", effects, "[self-collision]\nlayer_mm = 0\n")),
            "s.toml:17: self-collision.layer_mm: expected a number above 0 and up to 1000000 mm, found 0");
  EXPECT_EQ(refusal(listing("linear", "[\"contact\",\n\"self-collision\"]", "")),
            "s.toml:2: effects: the model \"linear\" does not simulate \"self-collision\", which is listed");
}

TEST(SoftbodyScene, TheWholeStiffnessIsAskedForWhereAModelLeavesItOut) {
  const std::string asked = "patch_radius_mm = 20\nwhole_stiffness = true";
  EXPECT_FALSE(parse_scene(kGood, "s.toml", ".").body.whole_stiffness);
  EXPECT_TRUE(parse_scene(with("patch_radius_mm = 20", asked), "s.toml", ".").body.whole_stiffness);
  EXPECT_EQ(refusal(with("patch_radius_mm = 20", "patch_radius_mm = 20\nwhole_stiffness = 1")),
            "s.toml:12: touch.whole_stiffness: expected true or false, found 1");
  std::string newton = listing("corotational", "[\"contact\", \"geometric-nonlinearity\"]", "");
  newton.replace(newton.find("patch_radius_mm = 20"), 20, asked);
  EXPECT_PRED2(says, refusal(newton), "touch.whole_stiffness: unknown key");
}

TEST(SoftbodyScene, MistakesAreNamedWithLineKeyAndWhatWasExpected) {
  EXPECT_EQ(refusal(with("cells = [4, 4, 2]", "cells = [4, 4]")),
            "s.toml:5: body.cells: expected [nx, ny, nz], each a whole number from 1 to 200, found an array of 2");
  EXPECT_EQ(
      refusal(with("hex8-sri", "hex9")),
      "s.toml:6: body.element: expected one of \"tet4\", \"hex8\", \"hex8-sri\", \"hex20\", \"hex27\", \"hex27-sri\", "
      "found \"hex9\"; did you mean hex8?");
  EXPECT_EQ(refusal(with("poisson = 0.45", "poisson = 0.5")),
            "s.toml:7: body.material.poisson: expected a number from 0 to 0.4999, found 0.5");
  EXPECT_EQ(refusal(with("young_pa = 10000", "young_pa = nan")),
            "s.toml:7: body.material.young_pa: expected a number above 0 Pa, found nan");
  EXPECT_EQ(refusal(with("patch_radius_mm = 20", "patch_radius_m = 20")),
            "s.toml:11: touch.patch_radius_m: unknown key; patch_radius is given in mm: patch_radius_mm");
  EXPECT_EQ(refusal(with("patch_radius_mm = 20", "patch_radius_mm = 20\nfriction = 1")),
            "s.toml:12: touch.friction: unknown key; expected one of from, middle_mm, patch_radius_mm, reach_mm, tool, "
            "tool_radius_mm, tool_offset_mm, side, whole_stiffness, table_mm");
  EXPECT_EQ(refusal(with("patch_radius_mm = 20", "patch_radius_mm = 20\nside = \"bilateral\"\ntable_mm = 5")),
            "s.toml:13: touch.table_mm: expected the model condensed, unilateral and without friction, because the "
            "others depend on the past");
  EXPECT_EQ(refusal(with("[-1, 0, 0]", "[0, 0, 0]")),
            "s.toml:14: place.towards_hand: expected a direction [x, y, z] other than zero, found an array of 3");
  EXPECT_EQ(refusal("x = "), "s.toml:1: not TOML: Error while parsing key-value pair: encountered end-of-file");
  EXPECT_THROW(read_scene("/nowhere/s.toml"), std::runtime_error);
}

TEST(SoftbodyScene, AModelThatTheLabHasTakenIsAnErrorThatSaysWhereItIs) {
  const std::string expected =
      R"(s.toml:9: model.kind: expected one of "linear", "condensed", "corotational", "neo-hookean", "near")";
  for (const std::string model : {"stvk", "mass-spring", "projective", "modal", "tensor-mass", "tled", "xpbd"}) {
    EXPECT_EQ(refusal(listing(model, "[\"contact\"]", "")),
              expected + ", found \"" + model +
                  "\", which is only a model of the accuracy experiment (tests/tools/lab/models)");
  }
  EXPECT_EQ(refusal(listing("modul", "[\"contact\"]", "")), expected + ", found \"modul\"");
}

TEST(SoftbodyScene, SlitsAreAKeyOfAMeshFile) {
  const std::string file = "shape = \"file\"\nfile = \"b.msh\"\nunits_per_m = 1000\n";
  const auto scene = [&](const std::string& more) {
    std::string text = with("shape = \"block\"\nsize_mm = [100, 100, 50]\ncells = [4, 4, 2]\n", file + more);
    return std::get<FileShape>(parse_scene(text, "s.toml", "/scenes").body.shape);
  };
  EXPECT_FALSE(scene("").slits);
  EXPECT_TRUE(scene("slits = true\n").slits);
  EXPECT_EQ(scene("").file, "/scenes/b.msh");
  EXPECT_PRED2(says, refusal(with("shape = \"block\"", "shape = \"block\"\nslits = true")), "body.slits: unknown key");
  EXPECT_PRED2(says, scene_reference(), "\n  slits\n");
}

TEST(SoftbodyScene, TheReferenceListsTheKeysWithUnitMeaningAndDefault) {
  const std::string text = scene_reference();
  EXPECT_PRED2(says, text,
               "\n  patch_radius_mm\n"
               "      Radius of the patch on which the tool presses.\n"
               "      A number above 0 and up to 1000000 mm. Required.\n");
  for (const std::string key : {"effects", "step_ms", "yield_pa", "cells_up", "table", "learned_in", "tool_cell_mm",
                                "layer_mm", "whole_stiffness", "at_mm", "towards_hand"}) {
    EXPECT_PRED2(says, text, "  " + key + "\n") << key;
  }
}

TEST(SoftbodyScene, APipeOrAFolderIsNoSceneAndNoMesh) {
  const std::string folder = ::testing::TempDir() + "tendon_softbody_" + std::to_string(::getpid());
  ASSERT_EQ(::mkdir(folder.c_str(), 0700), 0);
  const std::string pipe = folder + "/pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const auto& [file, why] : {std::pair(pipe, "it is not a regular file"), std::pair(folder, "it is a folder"),
                                  std::pair(folder + "/none", "no such file")}) {
    const std::string expected = "cannot read " + file + ": " + why;
    EXPECT_EQ(thrown_by<std::exception>([&, &path = file] { read_scene(path); }), expected);
    EXPECT_EQ(thrown_by<std::exception>([&, &path = file] { read_gmsh(path, 1); }), expected);
  }
  ::unlink(pipe.c_str());
  ::rmdir(folder.c_str());
}

}  // namespace
}  // namespace tendon::softbody::scene_test

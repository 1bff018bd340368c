// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "clients/softbody/scene.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/scene_text.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::region_test {
namespace {

using testing::pressed_body;

BodyConfig of_model(const ModelInfo& model) { return pressed_body(model.kind, Element::kHex8Sri, 4); }

Region half_with(const Material& material) {
  return {.where = Region::Box{.middle = Vec3(-0.025, 0, 0.025), .size = Vec3(0.05, 0.2, 0.06)}, .material = material};
}

TEST(Regions, OfEqualMaterialsAreOneBodyForEveryModel) {
  for (const ModelInfo& model : models()) {
    BodyConfig config = of_model(model);
    Body one(config);
    config.regions = {half_with(config.material)};
    Body two(config);
    for (int i = 0; i < 5; ++i) {
      const double depth = 1e-4 * (1 + i);
      const double expected = one.press(Prescribed::kDepth, depth).force;
      EXPECT_GT(expected, 0) << model.name;
      EXPECT_NEAR(two.press(Prescribed::kDepth, depth).force / expected, 1, 1e-12) << model.name;
    }
  }
}

TEST(Regions, AStiffHalfMakesEveryModelStiffer) {
  for (const ModelInfo& model : models()) {
    BodyConfig config = of_model(model);
    const double soft = Body(config).settle(Prescribed::kDepth, 1e-4).force;
    config.regions = {half_with({.young = 4 * config.material.young, .poisson = config.material.poisson})};
    const double mixed = Body(config).settle(Prescribed::kDepth, 1e-4).force;
    config.regions = {};
    config.material.young *= 4;
    const double stiff = Body(config).settle(Prescribed::kDepth, 1e-4).force;
    EXPECT_GT(mixed, 1.2 * soft) << model.name;
    EXPECT_LT(mixed, 0.9 * stiff) << model.name;
  }
}

TEST(Regions, ABarOfTwoMaterialsIsTwoSpringsInSeries) {
  constexpr double kArea = 0.02 * 0.02;  // m²
  const Material soft{.young = 1e4, .poisson = 0};
  const Material stiff{.young = 7e4, .poisson = 0};
  for (const ElementInfo& element : elements()) {
    Mesh bar = block(element.shape, Vec3(0.02, 0.02, 0.1), {2, 2, 10});
    const Region upper{.where = Region::Box{.middle = Vec3(0, 0, 0.08), .size = Vec3(1, 1, 0.0801)}, .material = stiff};
    std::vector<Material> of_elements = materials_of(bar, soft, std::vector{upper});
    const Fixed fixed = fix_where(bar, [](const Vec3& node) { return node.z() < 1e-9; });
    const Solid solid(std::move(bar), element.element, soft, Law::kLinear, fixed, std::move(of_elements));
    // Two springs in series under 1 N: 40 mm of the soft material, then 60 mm of the stiff one.
    VectorXd u = VectorXd::Zero(solid.size());
    for (std::size_t i = 0; i < solid.mesh().nodes.size(); ++i) {
      const double z = solid.mesh().nodes[i].z();
      u[static_cast<Eigen::Index>(3 * i) + 2] =
          std::min(z, 0.04) / (soft.young * kArea) + std::max(0.0, z - 0.04) / (stiff.young * kArea);
    }
    const Elastic::Forces forces = solid.forces(u);
    EXPECT_NEAR(2 * forces.energy / (0.04 / (soft.young * kArea) + 0.06 / (stiff.young * kArea)), 1, 1e-12);
    double pulls = 0;
    for (std::size_t i = 0; i < solid.mesh().nodes.size(); ++i) {
      const Vec3 force = forces.force.segment<3>(static_cast<Eigen::Index>(3 * i));
      const double z = solid.mesh().nodes[i].z();
      if (z > 0.1 - 1e-9) pulls += force.z();
      if (z < 1e-9 || z > 0.1 - 1e-9) continue;
      EXPECT_LT(force.norm(), 1e-12) << element.name << z;
    }
    EXPECT_NEAR(pulls, 1, 1e-12) << element.name;
  }
}

TEST(Regions, AfterACutEveryElementThatIsLeftIsOfItsMaterial) {
  const Solid whole = testing::pressed_block(Element::kHex8Sri, 8, 0.45);
  // The cuts detach a piece at the side. Elements with higher numbers remain and are renumbered.
  const std::vector<Cut> around{{Vec3(0.025, -0.06, 0.0125), Vec3(0, 0.12, 0), Vec3(0, 0, 0.0125)},
                                {Vec3(0.025, -0.06, 0.0125), Vec3(0, 0.12, 0), Vec3(0.03, 0, 0)},
                                {Vec3(0.025, -0.06, 0.025), Vec3(0, 0.12, 0), Vec3(0.03, 0, 0)}};
  const Division division = divide(whole.mesh(), whole.fixed(), around);
  ASSERT_EQ(division.lost, 16);
  ASSERT_EQ(static_cast<int>(division.element_before.size()), division.mesh.element_count());
  for (int e = 0; e < division.mesh.element_count(); ++e) {
    EXPECT_EQ(middle(division.mesh, e), middle(whole.mesh(), division.element_before[at(e)]));
  }

  BodyConfig config = pressed_body(ModelKind::kLinear, Element::kHex8Sri, 8);
  const Material stiff{.young = 9e4, .poisson = 0.3};
  config.regions = {half_with(stiff)};
  for (const Cut& cut : around) config.cuts.push_back({cut, PlannedCut::When::kTime, 1});
  Body body(config);
  const double before = body.press(Prescribed::kDepth, 1e-3).force;
  body.tick(1);
  const Solid parted(division.mesh, Element::kHex8Sri, config.material, Law::kLinear, division.fixed,
                     materials_of(division.mesh, config.material, config.regions));
  const TouchSurface top(parted.mesh(), Vec3::UnitZ(), config.patch_radius);
  const double expected = LinearModel(parted, top).press(*top.patch(Vec2::Zero()), Prescribed::kDepth, 1e-3).force;
  EXPECT_NEAR(body.press(Prescribed::kDepth, 1e-3).force / expected, 1, 1e-9);
  EXPECT_LT(expected, 0.999 * before);
}

TEST(Regions, TheLaterOneCountsAndOneWithoutAnElementIsRefused) {
  const Mesh mesh = block(Shape::kHex8, Vec3(0.1, 0.1, 0.05), {4, 4, 2});
  const Material soft{.young = 1, .poisson = 0};
  const Region ball{.where = Region::Ball{.middle = Vec3(0.0125, 0.0125, 0.0375), .radius = 0.026},
                    .material = {.young = 2, .poisson = 0}};
  Region inside = ball;
  inside.where = Region::Ball{.middle = Vec3(0.0125, 0.0125, 0.0375), .radius = 0.001};
  inside.material.young = 3;
  int balls = 0;
  int insides = 0;
  for (const Material& each : materials_of(mesh, soft, std::vector{ball, inside})) {
    balls += each.young == 2 ? 1 : 0;
    insides += each.young == 3 ? 1 : 0;
  }
  EXPECT_EQ(balls, 5);  // the neighbors of the innermost element
  EXPECT_EQ(insides, 1);
  try {
    materials_of(mesh, soft, std::vector{inside, ball});
    FAIL() << "nothing is left of the smaller one";
  } catch (const std::invalid_argument& refused) {
    EXPECT_EQ(std::string(refused.what()).find("region 1 has no elements: "), 0U) << refused.what();
  }
}

TEST(Regions, AboveALumpTheTissueIsStifferThanBesideIt) {
  BodyConfig config = read_scene(TENDON_SCENES "/tumour.toml").body;
  Body body(config);
  config.regions.clear();
  Body sound(config);
  const auto stiffness = [](Body& of, double aside) {
    return of.touch(of.touch_point() + Vec3(aside, 0, -2e-3)).force.z() / 2e-3;
  };
  EXPECT_NEAR(stiffness(body, 0) / stiffness(body, 0.025), 1.70, 0.01);
  EXPECT_NEAR(stiffness(body, 0) / stiffness(sound, 0), 1.66, 0.01);
  EXPECT_NEAR(stiffness(body, 0.025) / stiffness(sound, 0.025), 1.013, 0.002);
}

TEST(SoftbodyScene, RegionsArriveAndWhatIsWrongWithThemIsNamed) {
  const std::string material = "material = { young_pa = 50000, poisson = 0.3 }\n";
  const std::string ball = "[[region]]\nmiddle_mm = [0, 0, 30]\nradius_mm = 12\n" + material;
  const std::string box = "[[region]]\nmiddle_mm = [0, 0, 10]\nsize_mm = [10, 20, 30]\n" + material;
  const Scene scene = parse_scene(testing::kGood + ball + box, "s.toml", ".");
  ASSERT_EQ(scene.body.regions.size(), 2U);
  EXPECT_EQ(std::get<Region::Ball>(scene.body.regions[0].where).radius, 0.012);
  EXPECT_EQ(std::get<Region::Box>(scene.body.regions[1].where).size, Vec3(0.01, 0.02, 0.03));
  EXPECT_EQ(scene.body.regions[1].material.young, 5e4);
  const auto refusal = [](const std::string& text) {
    return thrown_by<std::exception>([&] { Body(parse_scene(text, "s.toml", ".").body); });
  };
  EXPECT_EQ(refusal(testing::kGood + "[[region]]\nmiddle_mm = [0, 0, 30]\n" + material),
            "s.toml:15: region[0]: expected either radius_mm or size_mm");
  EXPECT_EQ(refusal(testing::kGood + ball + "[[region]]\nmiddle_mm = [0, 0, 30]\nradius_mm = 12\n"),
            "s.toml:19: region[1].material.young_pa: missing, expected a number above 0 Pa");
  EXPECT_EQ(refusal(testing::kGood + "[[region]]\nmiddle_mm = [0, 0, 90]\nradius_mm = 12\n" + material),
            "region 1 has no elements: it is outside the body, smaller than an element, or covered by a later region");
}

}  // namespace
}  // namespace tendon::softbody::region_test

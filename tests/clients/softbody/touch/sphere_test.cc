// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/sphere.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/softbody/scene.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/scene_text.h"
#include "tests/clients/softbody/touch/half_space.h"
#include "tests/clients/softbody/touch/ways.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::sphere_test {
namespace {

constexpr double kRadius = 0.01;            // m
constexpr double kDeepest = 0.1 * kRadius;  // Hertz's theory is valid up to this depth
constexpr Material kSoft{.young = 1e4, .poisson = 0.3};

/// A quarter. The cells near the contact are 1/8 of its largest radius.
Solid half_space() {
  const double widest = std::sqrt(kRadius * kDeepest);
  std::vector<double> out{0};
  while (out.back() < 1.2 * widest) out.push_back(out.back() + widest / 8);
  const std::vector<double> outer = testing::graded(widest / 6, 60 * widest, 6);
  const double fine = out.back();
  for (std::size_t i = 1; i < outer.size(); ++i) out.push_back(fine + outer[i]);
  return testing::quarter_of_half_space(Element::kHex8Sri, out, kSoft);
}

TEST(Sphere, OnAHalfSpaceIsWhatHertzSays) {
  const Solid quarter = half_space();
  const TouchSurface top(quarter.mesh(), Vec3::UnitZ(), 0.3 * kRadius);
  const CondensedModel body(quarter, top, top.nodes_of_patches(Vec2::Zero(), 0.2 * kRadius));
  SphereContact sphere(body, top, kRadius);
  const double modulus = kSoft.young / (1 - kSoft.poisson * kSoft.poisson);
  std::vector<double> force;
  for (const double depth : {kDeepest / 2, kDeepest}) {
    const Feel feel = sphere.at(Vec3(0, 0, kRadius - depth));
    force.push_back(4 * feel.force.z());
    const double hertz = 4.0 / 3 * modulus * std::sqrt(kRadius) * std::pow(depth, 1.5);
    EXPECT_NEAR(force.back() / hertz, 1, 0.06) << depth;
    EXPECT_NEAR(4 * feel.stiffness(2, 2) / (1.5 * hertz / depth), 1, 0.08) << depth;
    EXPECT_NEAR(sphere.contact_radius() / std::sqrt(kRadius * depth), 1, 0.15) << depth;
  }
  EXPECT_NEAR(std::log2(force[1] / force[0]), 1.5, 0.04);  // 1 for a contact of constant size
}

class Spheres : public ::testing::Test {
 protected:
  Solid solid_ = testing::pressed_block(Element::kHex8Sri, 12, 0.45);
  TouchSurface top_{solid_.mesh(), Vec3::UnitZ(), testing::kB1PatchRadius};
  CondensedModel body_{solid_, top_, top_.nodes_of_patches(Vec2::Zero(), 0.02)};
  SphereContact sphere_{body_, top_, 0.02};
};

TEST_F(Spheres, NoNodeIsPulledAndNoneIsInside) {
  for (const Vec3& q : {Vec3(0, 0, 0.067), Vec3(0.004, -0.007, 0.066), Vec3(0, 0, 0.0699), Vec3(0.003, 0, 0.068)}) {
    const Feel feel = sphere_.at(q);
    EXPECT_TRUE(feel.touching);
    EXPECT_GT(feel.force.z(), 0);
    EXPECT_LT((feel.stiffness - feel.stiffness.transpose()).norm(), 1e-9 * feel.stiffness.norm());
    // Starting without an active set gives the same force.
    SphereContact fresh(body_, top_, 0.02);
    EXPECT_LT((fresh.at(q).force - feel.force).norm(), 1e-9);
  }
}

TEST_F(Spheres, AClosedWayThroughTheBodyGivesBackExactlyWhatItTook) {
  const auto place = [](double turn) {
    const double angle = 2 * std::numbers::pi * turn;
    // Off center, where the energy is only conserved with the tangential force.
    return Pose{.position = Vec3(0.018 + 0.008 * std::cos(angle), -0.012 + 0.008 * std::sin(angle),
                                 0.067 + 0.001 * std::sin(2 * angle))};
  };
  const auto felt = [&](const Pose& tool) { return sphere_.at(tool.position); };
  const testing::ClosedWay way = testing::closed_way(place, 1000, felt);
  EXPECT_GT(way.most, 1e-4);
  EXPECT_LT(std::abs(way.work), 1e-3 * way.most);
}

TEST_F(Spheres, OutsideOrNowhereNothingIsFeltAndBeyondTheTableItSaysSo) {
  EXPECT_EQ(sphere_.at(Vec3(0, 0, 0.071)).force, Vec3::Zero());
  EXPECT_NEAR(sphere_.at(Vec3(0, 0, 0.071)).gap, 0.001, 1e-12);
  EXPECT_EQ(sphere_.at(Vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0)).force, Vec3::Zero());
  EXPECT_THROW(sphere_.at(Vec3(0.045, 0, 0.067)), std::out_of_range);
  EXPECT_THROW(SphereContact(body_, top_, 0), std::invalid_argument);
}

TEST(SphereScene, ASceneChoosesItWhereItCanBe) {
  using testing::with;
  std::string text =
      with("patch_radius_mm = 20", "patch_radius_mm = 20\ntool = \"sphere\"\ntool_radius_mm = 15\nreach_mm = 5");
  text.replace(text.find("[4, 4, 2]"), 9, "[20, 20, 6]");
  const Scene scene = parse_scene(text, "s.toml", ".");
  Body body(scene.body);
  // At small depth it is softer than the patch, and its stiffness grows.
  const double shallow = body.touch(Vec3(0, 0, 0.0645)).stiffness(2, 2);
  const double deep = body.touch(Vec3(0, 0, 0.060)).stiffness(2, 2);
  EXPECT_GT(shallow, 0);
  EXPECT_GT(deep, 1.2 * shallow);
  BodyConfig other = scene.body;
  other.model = LinearConfig{};
  EXPECT_THROW(Body{other}, std::invalid_argument);
  EXPECT_THROW(parse_scene(with("patch_radius_mm = 20", "patch_radius_mm = 20\ntool = \"cube\""), "s.toml", "."),
               SceneError);
}

TEST(CapsuleScene, ItsKeysAreItsOwnAndItRefusesWhatItCannotDo) {
  using testing::with;
  const auto scene = [](const std::string& touch) {
    return parse_scene(with("patch_radius_mm = 20", touch + "\npatch_radius_mm = 20"), "s.toml", ".");
  };
  const std::string capsule = "tool = \"capsule\"\ntool_radius_mm = 15\n";
  const BodyConfig config =
      scene(capsule + "tool_length_mm = 30\ntool_axis = [0, 3, 4]\ntool_offset_mm = [1, 2, 3]").body;
  const CapsuleTool tool = std::get<CapsuleTool>(config.tool);
  EXPECT_DOUBLE_EQ(tool.radius, 0.015);
  EXPECT_DOUBLE_EQ(tool.half_length, 0.015);
  EXPECT_LT((tool.axis - Vec3(0, 0.6, 0.8)).norm(), 1e-15);
  EXPECT_LT((config.tool_offset - Vec3(0.001, 0.002, 0.003)).norm(), 1e-15);
  EXPECT_TRUE(turns_the_hand(config));
  EXPECT_FALSE(turns_the_hand(scene("tool = \"sphere\"\ntool_radius_mm = 15").body));
  for (const std::string& wrong :
       {capsule, capsule + "tool_length_mm = -1", capsule + "tool_length_mm = 30\ntool_axis = [0, 0, 0]",
        std::string("tool_length_mm = 30"), std::string("tool_axis = [1, 0, 0]"), std::string("tool_offset_mm = 3")}) {
    EXPECT_THROW(scene(wrong), SceneError) << wrong;
  }
  expect_refusals(config, Makes<Body>(),
                  {
                      {"a capsule requires the model", [](auto& c) { c.model = LinearConfig{}; }},
                      {"a capsule has no friction on the model", [](auto& c) { c.friction = 0.3; }},
                      {"norm of tool_axis = 2", [](auto& c) { std::get<CapsuleTool>(c.tool).axis = Vec3(0, 0, 2); }},
                      {"radius", [](auto& c) { std::get<CapsuleTool>(c.tool).radius = 0; }},
                  });
}

}  // namespace
}  // namespace tendon::softbody::sphere_test

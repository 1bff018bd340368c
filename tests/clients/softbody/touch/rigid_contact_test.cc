// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/rigid_contact.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "clients/softbody/fem/gmsh.h"
#include "clients/softbody/models/linear.h"
#include "clients/softbody/scene.h"
#include "clients/softbody/touch/sphere.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/scene_text.h"
#include "tests/clients/softbody/touch/contact_integral.h"
#include "tests/clients/softbody/touch/half_space.h"
#include "tests/clients/softbody/touch/pressed_by_tools.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::rigid_contact_test {
namespace {

using testing::config_of;
using testing::kExact;
using testing::one;
using testing::PressedByTools;
using testing::slopes;
using testing::support;

constexpr double kRadius = 0.01;  // m
constexpr Material kSoft{.young = 1e4, .poisson = 0.3};

TEST(RigidContact, ASphereOnAHalfSpaceIsNearHertzAndTheCondensedSphere) {
  constexpr double kDeepest = 0.02 * kRadius;
  const double widest = std::sqrt(kRadius * kDeepest);
  std::vector<double> out{0};
  while (out.back() < 1.2 * widest) out.push_back(out.back() + widest / 6);
  const std::vector<double> outer = testing::graded(widest / 4.5, 60 * widest, 6);
  const double fine = out.back();
  for (std::size_t i = 1; i < outer.size(); ++i) out.push_back(fine + outer[i]);
  const Solid quarter = testing::quarter_of_half_space(Element::kHex8Sri, out, kSoft);
  const TouchSurface top(quarter.mesh(), Vec3::UnitZ(), 0.3 * kRadius);
  QuasiStaticModel model(quarter, top, {});
  RigidContact::Config config = config_of(kSoft);
  config.layer.thickness = 1e-6;
  RigidContact contact(model, quarter, top, one(RigidShape::sphere(kRadius)), config);
  const CondensedModel condensed(quarter, top, top.nodes_of_patches(Vec2::Zero(), 0.1 * kRadius));
  SphereContact sphere(condensed, top, kRadius);
  const double modulus = kSoft.young / (1 - kSoft.poisson * kSoft.poisson);
  std::vector<double> force;
  for (const double depth : {kDeepest / 2, kDeepest}) {
    const Pose place{.position = Vec3(0, 0, kRadius - depth)};
    const Feel feel = contact.press(std::vector{std::optional(place)}).front();
    force.push_back(4 * feel.force.z());
    const double hertz = 4.0 / 3 * modulus * std::sqrt(kRadius) * std::pow(depth, 1.5);
    // Half of the tolerance is the mesh error: the condensed sphere differs by 3 to 5 %.
    EXPECT_NEAR(force.back() / hertz, 1, 0.1) << depth;
    EXPECT_NEAR(4 * feel.stiffness(2, 2) / (1.5 * hertz / depth), 1, 0.12) << depth;
    EXPECT_NEAR(feel.force.z() / sphere.at(place.position).force.z(), 1, 0.055) << depth;
  }
  EXPECT_NEAR(std::log2(force[1] / force[0]), 1.5, 0.03);  // 1 for a contact of constant size
}

TEST(RigidContact, PressesALinearBodyAsAContactIntegralOfAnotherWay) {
  const testing::FineBlock block(0.002, 0.012, 0.012);
  const TouchSurface top(block.solid.mesh(), Vec3::UnitZ(), 0.003);
  QuasiStaticModel model(block.solid, top, {});
  RigidContact::Config config = config_of(block.solid.material());
  config.layer.thickness = 1e-5;
  const double stiff = config.layer.young / config.layer.thickness;
  testing::ContactIntegral integral(block, stiff, testing::ContactIntegral::Rule::kGauss);
  for (const double tilt : {0.0, 0.26}) {
    const Vec3 axis(std::cos(tilt), 0, std::sin(tilt));
    const double half_length = tilt > 0 ? 0.006 : 0;  // a sphere, and a capsule on its lower end
    const testing::ContactIntegral::Tool tool{Vec3(0.001, -0.0015, 0.0578) + half_length * axis, axis, 0.01,
                                              half_length};
    const Vec3 about = tool.middle + Vec3(0.02, 0.01, 0.05);
    const auto truth = integral.press(tool, about);
    RigidContact contact(model, block.solid, top,
                         one(RigidShape::capsule(0.01, half_length, axis), tool.middle - about), config);
    // The cushion begins at the surface, the layer 0.95 of its thickness above it.
    const Pose handle{.position = about + Vec3(0, 0, 0.95e-5)};
    const Feel feel = contact.press(std::vector{std::optional(handle)}).front();
    EXPECT_GT(truth.force.norm(), 0.1);
    EXPECT_LT((feel.force - truth.force).norm(), 0.025 * truth.force.norm()) << tilt;
    EXPECT_LT((feel.torque->torque - truth.torque).norm(), 0.025 * truth.torque.norm()) << tilt;
  }
}

TEST(RigidContact, ItsStiffnessesAreTheSlopesOfForceAndTorque) {
  for (const Law law : {Law::kCorotational, Law::kNeoHookean, Law::kStVenantKirchhoff}) {
    const std::vector<std::pair<HeldTool, Pose>> cases{
        {{RigidShape::sphere(0.02), Vec3::Zero()}, {.position = Vec3(0.007, -0.004, 0.065)}},
        {{RigidShape::capsule(0.012, 0.015, Vec3::UnitX()), Vec3(0.01, 0, -0.05)},
         {.position = Vec3(0, 0.002, 0.106), .turn = Eigen::AngleAxisd(0.2, Vec3(0.6, 0.8, 0)).toRotationMatrix()}},
        {{RigidShape::box(Vec3(0.03, 0.02, 0.02), 0.003), Vec3::Zero()},
         {.position = Vec3(0.003, -0.004, 0.0565),
          .turn = Eigen::AngleAxisd(0.1, Vec3(0, 0.6, 0.8)).toRotationMatrix()}}};
    for (const auto& [tool, pose] : cases) {
      PressedByTools pressed(law, {tool}, 0, kExact);
      const Feel feel = pressed.at(pose);
      const Layer::Mat6 found = slopes(pressed, pose);
      const Mat3 moved = found.topLeftCorner<3, 3>();
      const Mat3 turned = found.bottomRightCorner<3, 3>();
      EXPECT_GT(feel.force.norm(), 0.5);
      EXPECT_LT((feel.stiffness - moved).norm(), 0.01 * moved.norm());
      if (feel.torque->torque.norm() < 1e-9) continue;  // a sphere centered on the handle
      EXPECT_LT((feel.torque->stiffness - not_negative(turned)).norm(), 0.01 * turned.norm());
    }
  }
}

void expect_slope(PressedByTools& pressed, const Pose& handle, double share) {
  const Feel feel = pressed.at(handle);
  const Layer::Mat6 found = slopes(pressed, handle);
  const Mat3 moved = found.topLeftCorner<3, 3>();
  EXPECT_LT((feel.stiffness - moved).norm(), share * moved.norm()) << handle.position.transpose();
}

TEST(HardTool, OnACornerAndBesideTheHeldRimTheStiffnessIsTheForcesOwnSlope) {
  for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
    PressedByTools corner(law, one(RigidShape::sphere(0.012)), 0, kExact);
    const Pose over{.position = Vec3(0.05, 0.05, 0.05) + 0.009 * Vec3(1, 1, 1.5).normalized()};
    const Feel on_corner = corner.at(over);
    EXPECT_GT(on_corner.force.minCoeff(), 0.005);  // pushed away from the corner along each axis
    EXPECT_EQ(corner.solid.inverted(corner.model.displacements()), 0);
    expect_slope(corner, over, 0.01);

    PressedByTools rim(law, one(RigidShape::sphere(0.012)), 0, kExact);
    rim.at(Vec3(0.08, 0.003, 0.004));
    const Pose beside{.position = Vec3(0.05 + 0.010, 0.003, 0.004)};
    const Feel held = rim.at(beside);
    EXPECT_GT(held.force.x(), 0.05);
    expect_slope(rim, beside, 0.01);
  }
}

TEST(RigidContact, AClosedWayOfPlacesAndTurnsGivesBackExactlyWhatItTook) {
  PressedByTools pressed(Law::kNeoHookean, one(RigidShape::box(Vec3(0.03, 0.02, 0.02), 0.004), Vec3(0.01, 0, -0.05)));
  const auto handle = [](double t) {
    const double angle = 2 * std::numbers::pi * t;
    return Pose{.position = Vec3(0.003 * std::cos(angle), 0.003 * std::sin(angle), 0.106 + 0.001 * std::sin(2 * angle)),
                .turn = (Eigen::AngleAxisd(0.1 * std::sin(angle), Vec3::UnitZ()) *
                         Eigen::AngleAxisd(0.05 * std::cos(angle), Vec3::UnitY()))
                            .toRotationMatrix()};
  };
  const testing::RubbedWay way = testing::closed_way(pressed, handle, 120);
  EXPECT_GT(way.most, 1e-3);
  EXPECT_GT(way.turning, 0.05 * way.most);
  EXPECT_LT(std::abs(way.work), 2e-3 * way.most);
}

/// 3 mm down, 3 mm along an axis and up; as a share of the energy put in.
double lost_by_sliding(const BodyConfig& config, int axis, bool to_and_fro) {
  Body body(config);
  const Vec3 outside = body.touch_point() - lowest_of_tool(config, Mat3::Identity()) + Vec3(0, 0, 2e-4);
  const Vec3 deep = outside - Vec3(0, 0, 3.2e-3);
  const Vec3 aside = 3e-3 * Vec3::Unit(axis);
  std::vector<Vec3> corners{deep, deep + aside, outside + aside};
  if (to_and_fro) corners = {deep, deep + aside, deep, outside};
  Vec3 place = outside;
  Vec3 force = body.touch(place).force;
  double put_in = 0;
  double work = 0;
  for (const Vec3& corner : corners) {
    const Vec3 from = place;
    constexpr int kSteps = 16;
    for (int i = 1; i <= kSteps; ++i) {
      const Vec3 there = from + i * (corner - from) / kSteps;
      const Vec3 felt = body.touch(there).force;
      const double part = -(force + felt).dot(there - place) / 2;
      work += part;
      put_in += std::max(part, 0.0);
      place = there;
      force = felt;
    }
  }
  EXPECT_GT(put_in, 1e-4);
  return work / put_in;
}

TEST(RigidContact, AThinToolSlidesAlongEitherAxisAndGivesBackWhatItTook) {
  BodyConfig blade = testing::pressed_body(ModelKind::kNeoHookean, Element::kHex8Sri, 6);
  blade.model = NeoHookeanConfig{.newton = {.tolerance = 1e-3}};
  blade.tool = BoxTool{.size = Vec3(0.0026, 0.007, 0.03), .edge = 0.0013};
  BodyConfig capsule = blade;
  capsule.tool = CapsuleTool{.radius = 0.0013, .half_length = 0.003, .axis = Vec3::UnitY()};
  BodyConfig sphere = blade;
  sphere.tool = SphereTool{0.008};
  for (const BodyConfig& config : {blade, capsule, sphere}) {
    for (const int axis : {0, 1}) {
      for (const bool to_and_fro : {false, true}) {
        EXPECT_LT(std::abs(lost_by_sliding(config, axis, to_and_fro)), 0.01)
            << config.tool.index() << ' ' << axis << ' ' << to_and_fro;
      }
    }
  }
}

TEST(RigidContact, OnlyABodyInWhichNothingTakesEnergyIsElastic) {
  const BodyConfig plain = testing::pressed_body(ModelKind::kNeoHookean, Element::kHex8Sri, 4);
  EXPECT_TRUE(is_elastic(plain));
  BodyConfig heavy = plain;
  heavy.effects.gravity = Vec3(0, 0, -9.81);
  EXPECT_TRUE(is_elastic(heavy));
  BodyConfig rough = plain;
  rough.friction = 0.1;
  EXPECT_FALSE(is_elastic(rough));
  BodyConfig swinging = plain;
  swinging.effects = {.density = 1000, .step = 1e-3, .inertia = true};
  EXPECT_FALSE(is_elastic(swinging));
}

TEST(RigidContact, AFastToolDoesNotComeOutOnTheOtherSide) {
  const Vec3 deep(0.002, 0, 0.058);
  PressedByTools slow(Law::kNeoHookean, one(RigidShape::sphere(0.015)));
  for (double z = 0.07; z > deep.z(); z -= 0.001) slow.at(Vec3(deep.x(), 0, z));
  const Feel expected = slow.at(deep);
  EXPECT_GT(expected.force.z(), 0.5);
  PressedByTools fast(Law::kNeoHookean, one(RigidShape::sphere(0.015)));
  fast.at(Vec3(0.002, 0, 0.09));
  EXPECT_LT((fast.at(deep).force - expected.force).norm(), 1e-4 * expected.force.norm());
  // Without a previous pose, the tool is assumed to come from the touched side.
  PressedByTools first(Law::kNeoHookean, one(RigidShape::sphere(0.015)));
  EXPECT_LT((first.at(deep).force - expected.force).norm(), 1e-4 * expected.force.norm());
  fast.at(Vec3(0, 0, 1000));
  EXPECT_LT((fast.at(deep).force - expected.force).norm(), 1e-4 * expected.force.norm());
  EXPECT_EQ(fast.model.displacements().allFinite(), true);
  EXPECT_EQ(slow.solid.inverted(fast.model.displacements()), 0);
}

TEST(RigidContact, APoseThatIsNotFiniteChangesNoBit) {
  PressedByTools pressed(Law::kCorotational, one(RigidShape::sphere(0.015)));
  const Vec3 place(0.002, 0.001, 0.061);
  pressed.at(place);
  const VectorXd before = pressed.model.displacements();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(pressed.at(Vec3(bad, 0, 0)).force, Vec3::Zero());
    EXPECT_EQ(pressed.at(Pose{.position = place, .turn = Mat3::Constant(bad)}).force, Vec3::Zero());
  }
  EXPECT_EQ(pressed.model.displacements(), before);
}

TEST(RigidContact, OutsideNothingIsFeltAndTheGapIsTheWayToTheLayer) {
  PressedByTools pressed(Law::kCorotational, one(RigidShape::sphere(0.015)));
  const Feel above = pressed.at(Vec3(0, 0, 0.07));
  EXPECT_EQ(above.force, Vec3::Zero());
  EXPECT_FALSE(above.touching);
  EXPECT_NEAR(above.gap, 0.0049, 2e-4);  // the nearest point is not below the center
  EXPECT_NEAR(above.valid_radius, above.gap, 1e-12);
  EXPECT_GT(above.normal->z(), 0.99);
  pressed.at(Vec3(0.08, 0, 0.07));
  pressed.at(Vec3(0.08, 0, 0.03));
  const Feel beside = pressed.at(Vec3(0.064, 0, 0.03));
  EXPECT_LT(beside.gap, 0);
  EXPECT_GT(beside.force.x(), 0.05);
  EXPECT_GT(beside.normal->x(), 0.9);
  pressed.at(Vec3(0, 0, 0.2));
  EXPECT_LT(pressed.model.displacements().lpNorm<Eigen::Infinity>(), 1e-7);
}

TEST(RigidContact, PressesByMoreThanItsRadiusWhereAPatchHasALimitLoad) {
  PressedByTools pressed(Law::kNeoHookean, one(RigidShape::sphere(0.012)));
  double before = 0;
  for (double depth = 0.002; depth < 0.0145; depth += 0.002) {
    const Feel feel = pressed.at(Vec3(0, 0, 0.05 + 0.012 - depth));
    EXPECT_GT(feel.force.z(), before) << depth;
    EXPECT_GT(feel.stiffness(2, 2), 0) << depth;
    EXPECT_LT(feel.error, 1e-4 * feel.force.z()) << depth;
    before = feel.force.z();
  }
  EXPECT_EQ(pressed.solid.inverted(pressed.model.displacements()), 0);
}

TEST(RigidContact, FrictionDragsTheShapeAndEveryPointLosesEnergy) {
  constexpr double kFriction = 0.4;
  PressedByTools pressed(Law::kNeoHookean, one(RigidShape::sphere(0.015)), kFriction);
  PressedByTools smooth(Law::kNeoHookean, one(RigidShape::sphere(0.015)));
  const auto below = [](const PressedByTools& body) {  // largest displacement of the surface along x, m
    double most = 0;
    for (const int node : body.top.nodes()) most = std::max(most, body.model.displacements()[3 * node]);
    return most;
  };
  Vec3 place(0, 0, 0.061);
  pressed.at(Vec3(0, 0, 0.0625));
  pressed.at(place);
  smooth.at(place);
  const double shape_before = below(pressed);
  double lost = 0;
  int slid = 0;
  double stuck = 0;  // stiffness of the first small step along the motion, N/m
  Feel feel;
  for (int i = 0; i < 40; ++i) {
    place.x() += 0.00025;
    feel = pressed.at(place);
    if (i == 0) stuck = -feel.force.x() / 0.00025;
    const Layer::Dissipated& here = pressed.contact.dissipated();
    EXPECT_GE(here.least, 0) << i;
    lost += here.sum;
    slid += here.slid;
  }
  const Feel without = smooth.at(place);
  EXPECT_GT(stuck, 100);
  EXPECT_GT(slid, 100);
  EXPECT_GT(lost, 1e-4);
  // µ times the force, and slightly more because material piles up in front of the tool.
  EXPECT_NEAR((feel.force.x() - without.force.x()) / feel.force.z(), -kFriction, 0.25 * kFriction);
  EXPECT_GT(below(pressed), shape_before + 0.0003);
  EXPECT_GT(below(pressed), below(smooth) + 0.0003);
  EXPECT_LT(feel.error, 1e-3 * feel.force.norm());
}

TEST(RigidContact, FrictionGivesNothingOnAClosedWay) {
  PressedByTools pressed(Law::kCorotational, one(RigidShape::sphere(0.015)), 0.5);
  const auto place = [](double t) {
    const double angle = 2 * std::numbers::pi * t;
    return Pose{.position =
                    Vec3(0.003 * std::sin(angle), 0.002 * std::sin(2 * angle), 0.062 + 0.004 * std::cos(angle))};
  };
  const testing::RubbedWay way = testing::closed_way(pressed, place, 120);
  EXPECT_GT(way.work, 1e-5);
  EXPECT_GE(way.least, 0);
  // friction loss equals the work of the hand; the loss of points that let go is not counted
  EXPECT_NEAR(way.lost / way.work, 1, 0.1);
}

TEST(RigidContact, FrictionIsBoundedByThePressureOfItsOwnAnswer) {
  constexpr double kFriction = 0.4;
  PressedByTools rough(Law::kNeoHookean, one(RigidShape::sphere(0.015)), kFriction);
  PressedByTools smooth(Law::kNeoHookean, one(RigidShape::sphere(0.015)));
  for (double z = 0.064; z > 0.0599; z -= 0.0005) rough.at(Vec3(0, 0, z));
  const Vec3 light(0.002, 0, 0.0635);
  const Feel feel = rough.at(light);
  EXPECT_GT(feel.force.z(), 0.01);
  const double drag = smooth.at(light).force.x() - feel.force.x();
  EXPECT_GT(drag, 0.1 * kFriction * feel.force.z());
  EXPECT_LT(drag, 1.2 * kFriction * feel.force.z());
}

TEST(RigidContact, TwoHandsAreHeldByTheSupportTogether) {
  const HeldTool sphere{RigidShape::sphere(0.012)};
  PressedByTools pressed(Law::kNeoHookean, {sphere, sphere}, 0, kExact);
  const std::vector<std::optional<Pose>> hands{Pose{.position = Vec3(-0.02, 0.002, 0.058)},
                                               Pose{.position = Vec3(0.021, -0.003, 0.057)}};
  std::vector<Feel> feels;
  feels = pressed.contact.press(hands);
  const Vec3 sum = feels[0].force + feels[1].force;
  EXPECT_GT(feels[0].force.z(), 0.3);
  EXPECT_GT(feels[1].force.z(), feels[0].force.z());
  EXPECT_LT((sum - support(pressed)).norm(), 1e-9 * sum.norm());
}

TEST(RigidContact, FarApartEachHandFeelsWhatItFeelsAlone) {
  const HeldTool sphere{RigidShape::sphere(0.008)};
  const std::vector<std::optional<Pose>> hands{Pose{.position = Vec3(-0.036, 0.036, 0.0565)},
                                               Pose{.position = Vec3(0.036, -0.036, 0.056)}};
  PressedByTools both(Law::kNeoHookean, {sphere, sphere});
  const std::vector<Feel> feels = both.contact.press(hands);
  for (std::size_t i = 0; i < 2; ++i) {
    PressedByTools alone(Law::kNeoHookean, {sphere});
    const Feel feel = alone.at(*hands[i]);
    EXPECT_GT(feel.force.z(), 0.02);
    EXPECT_LT((feels[i].force - feel.force).norm(), 0.005 * feel.force.norm()) << i;
    EXPECT_LT((feels[i].stiffness - feel.stiffness).norm(), 0.005 * feel.stiffness.norm()) << i;
  }
  const std::vector<Feel> one_left = both.contact.press(std::vector{hands[0], std::optional<Pose>()});
  EXPECT_EQ(one_left[1].force, Vec3::Zero());
  PressedByTools alone(Law::kNeoHookean, {sphere});
  EXPECT_LT((one_left[0].force - alone.at(*hands[0]).force).norm(), 1e-4 * one_left[0].force.norm());
}

TEST(RigidContact, AClosedWayOfTwoHandsGivesNothingThoughThatOfOneDoes) {
  const HeldTool sphere{RigidShape::sphere(0.012)};
  PressedByTools pressed(Law::kCorotational, {sphere, sphere});
  const auto places = [](double t) {
    const double angle = 2 * std::numbers::pi * t;
    return std::array{Vec3(-0.012 + 0.002 * std::sin(angle), 0, 0.058 + 0.002 * std::cos(angle)),
                      Vec3(0.013, 0.003 * std::cos(angle), 0.058 + 0.002 * std::sin(angle))};
  };
  std::array<double, 2> work{};
  double most = 0;
  constexpr int kSteps = 100;
  for (int i = 0; i < kSteps; ++i) {
    const auto middle = places((i + 0.5) / kSteps);
    const auto from = places(static_cast<double>(i) / kSteps);
    const auto to = places((i + 1.0) / kSteps);
    const std::vector<Feel> feels = pressed.contact.press(
        std::vector{std::optional(Pose{.position = middle[0]}), std::optional(Pose{.position = middle[1]})});
    for (std::size_t k = 0; k < 2; ++k) work[k] -= feels[k].force.dot(to[k] - from[k]);
    most = std::max(most, std::abs(work[0] + work[1]));
  }
  EXPECT_GT(most, 1e-4);
  EXPECT_GT(std::abs(work[0]), 0.02 * most);  // energy passes from one hand to the other
  EXPECT_LT(std::abs(work[0] + work[1]), 2e-3 * most);
}

TEST(Grasp, LiftingBetweenTwoRoughSpheresMovesTheLiverUp) {
  const BodyConfig scene = read_scene(TENDON_SCENES "/grasp.toml").body;
  const auto lifted = [&](double friction, double& pull) {  // upward displacement of the side below a sphere, m
    Mesh mesh = read_gmsh(std::get<FileShape>(scene.shape).file, std::get<FileShape>(scene.shape).scale).mesh;
    const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
    const Solid solid(std::move(mesh), scene.element, scene.material, Law::kNeoHookean, fixed);
    const TouchSurface top(solid.mesh(), scene.towards_tool, scene.patch_radius);
    QuasiStaticModel model(solid, top, {});
    RigidContact contact(model, solid, top, std::vector<HeldTool>(2, {shape_of(scene.tool, scene.layer)}),
                         config_of(scene.material, friction, newton_of(scene.model)->tolerance));
    const Vec3 grasped(-0.04, 0.066, 0.02);
    int node = 0;
    for (int i = 1; i < solid.size() / 3; ++i) {
      if ((solid.mesh().nodes[at(i)] - grasped).norm() < (solid.mesh().nodes[at(node)] - grasped).norm()) node = i;
    }
    const auto hands = [](double y, double z) {
      return std::vector{std::optional(Pose{.position = Vec3(-0.04, -y, z)}),
                         std::optional(Pose{.position = Vec3(-0.04, y, z)})};
    };
    for (double y = 0.077; y > 0.0679; y -= 0.001) contact.press(hands(y, 0.018));
    const double before = model.displacements()[3 * node + 2];
    std::vector<Feel> feels;
    for (double z = 0.019; z < 0.0221; z += 0.001) feels = contact.press(hands(0.068, z));
    pull = -feels[0].force.z() - feels[1].force.z();
    EXPECT_NEAR(feels[0].force.y() / feels[1].force.y(), -1, 0.01);  // the liver is symmetric
    return model.displacements()[3 * node + 2] - before;
  };
  double pull = 0;
  EXPECT_GT(lifted(*scene.friction, pull), 0.004);
  EXPECT_GT(pull, 1.5);  // N; the liver is held
  double slipping = 0;
  EXPECT_LT(lifted(0, slipping), 0.001);
  EXPECT_LT(slipping, 0);
}

TEST(Grasp, ItsSceneIsTwoHandsAtTwoDevices) {
  const Scene scene = read_scene(TENDON_SCENES "/grasp.toml");
  ASSERT_EQ(scene.hands.size(), 2);
  EXPECT_EQ(scene.body.hands, 2);
  EXPECT_EQ(scene.hands[1].device, "right");
  Body body(scene.body);
  const Vec3 place(-0.04, 0.071, 0.018);
  const std::vector<Feel> feels = body.touch(
      std::vector{std::optional(Pose{.position = Vec3(-0.04, -0.071, 0.018)}), std::optional(Pose{.position = place})});
  EXPECT_LT(feels[0].force.y(), -0.5);
  EXPECT_GT(feels[1].force.y(), 0.5);
}

TEST(RigidScene, ItsKeysAreItsOwnAndItRefusesWhatItCannotDo) {
  using testing::listing;
  const std::string nonlinear = R"(["contact", "geometric-nonlinearity"])";
  const auto scene = [&](const std::string& touch, const std::string& more = "") {
    std::string text = listing("corotational", nonlinear, more);
    text.insert(text.find("patch_radius_mm"), touch + "\n");
    return parse_scene(text, "s.toml", ".");
  };
  const std::string box = "tool = \"box\"\ntool_size_mm = [20, 30, 12]\n";
  const BodyConfig config = scene(box + "tool_edge_mm = 2\nlayer_mm = 0.2").body;
  EXPECT_LT((std::get<BoxTool>(config.tool).size - Vec3(0.02, 0.03, 0.012)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(std::get<BoxTool>(config.tool).edge, 0.002);
  EXPECT_DOUBLE_EQ(config.layer, 0.0002);
  EXPECT_TRUE(turns_the_hand(config));
  EXPECT_NEAR(lowest_of_tool(config, Mat3::Identity()).z(), -0.006, 1e-15);
  EXPECT_GT(Body(config).touch(Pose{.position = Vec3(0.002, 0, 0.054)}).force.z(), 0.1);
  for (const std::string& wrong :
       {box, box + "tool_edge_mm = 0", box + "tool_edge_mm = 6.1", std::string("tool = \"box\"\ntool_edge_mm = 2"),
        std::string("tool = \"box\"\ntool_size_mm = [20, 0, 12]\ntool_edge_mm = 2"), std::string("layer_mm = 1")}) {
    EXPECT_THROW(scene(wrong), SceneError) << wrong;
  }
  const std::string mesh = "tool = \"mesh\"\ntool_file = \"spoon.off\"\ntool_units_per_m = 1000\n";
  const BodyConfig spoon = scene(mesh + "tool_cell_mm = 0.8").body;
  const MeshTool tool = std::get<MeshTool>(spoon.tool);
  EXPECT_EQ(tool.file, std::filesystem::path(".") / "spoon.off");
  EXPECT_DOUBLE_EQ(tool.scale, 0.001);
  EXPECT_DOUBLE_EQ(tool.cell, 0.0008);
  EXPECT_TRUE(turns_the_hand(spoon));
  EXPECT_THROW(Body{spoon}, std::invalid_argument);
  for (const std::string& wrong : {mesh, mesh + "tool_cell_mm = 0", mesh + "tool_cell_mm = 1\ntool_edge_mm = 1",
                                   std::string("tool = \"mesh\"\ntool_cell_mm = 1\ntool_units_per_m = 1000"),
                                   std::string("tool = \"mesh\"\ntool_file = \"spoon.off\"\ntool_cell_mm = 1"),
                                   std::string("tool = \"sphere\"\ntool_file = \"spoon.off\"")}) {
    EXPECT_THROW(scene(wrong), SceneError) << wrong;
  }
  const std::string left = "[[hands]]\ndevice = \"left\"\nat_mm = [0, 0, 0]\n";
  for (const std::string& wrong : {left, left + left, left + "[[hands]]\ndevice = \"\"\nat_mm = [0, 0, 0]\n",
                                   left + "[[hands]]\ndevice = \"right\"\n"}) {
    EXPECT_THROW(scene(box + "tool_edge_mm = 2", wrong), SceneError) << wrong;
  }
  expect_refusals(config, Makes<Body>(),
                  {
                      {"a box requires the model", [](auto& c) { c.model = CondensedConfig{}; }},
                      {"several hands require a rigid tool",
                       [](auto& c) {
                         c.tool = PatchTool{};
                         c.hands = 2;
                       }},
                      {"a box cannot press a body with inertia",
                       [](auto& c) { c.effects = {.density = 1000, .step = 1e-3, .inertia = true}; }},
                      {"a box cannot press a body with self-collision",
                       [](auto& c) { c.model = CorotationalConfig{.self_collision = 1e-4}; }},
                      {"stiffen",
                       [](auto& c) {
                         c.stiffening = StiffnessOverTime{.at = {0, 1}, .factor = {1, 2}};
                       }},
                  });
  BodyConfig other = spoon;
  other.model = CondensedConfig{};
  EXPECT_THROW(Body{other}, std::invalid_argument);
}

TEST(RigidScene, APatchThatPressesFarIsToldOfRigidTools) {
  BodyConfig config = testing::pressed_body(ModelKind::kNeoHookean, Element::kHex8Sri, 4);
  EXPECT_NEAR(patch_up_to(config), 0.3 * testing::kB1PatchRadius, 1e-15);
  EXPECT_PRED2(says, beyond_the_patch(config), "tool = \"sphere\"");
  config.tool = SphereTool{0.01};
  EXPECT_TRUE(std::isinf(patch_up_to(config)));
  config = testing::pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4);  // this model has no limit load
  EXPECT_TRUE(std::isinf(patch_up_to(config)));
}

}  // namespace
}  // namespace tendon::softbody::rigid_contact_test

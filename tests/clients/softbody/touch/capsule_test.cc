// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/capsule.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "clients/softbody/models/linear.h"
#include "clients/softbody/touch/sphere.h"
#include "tests/clients/softbody/touch/contact_integral.h"
#include "tests/clients/softbody/touch/ways.h"

namespace tendon::softbody::capsule_test {
namespace {

using testing::ContactIntegral;
using testing::FineBlock;

constexpr double kRadius = 0.01;       // m
constexpr double kHalfLength = 0.012;  // m
constexpr double kStiff = 1e9;         // Pa/m: compresses by 0.2 to 0.4 % of the depths here

struct Pressed {
  Pressed(double cell, double reach, double poisson = 0.45)
      : block(cell, reach, reach, poisson),
        top(block.solid.mesh(), Vec3::UnitZ(), 0.003),
        capsule(block.solid, top, fine(reach), kRadius, kHalfLength) {}

  std::vector<int> fine(double reach) const {
    std::vector<int> nodes;
    for (const int node : top.nodes()) {
      if (top.place(node).lpNorm<Eigen::Infinity>() < reach + 1e-9) nodes.push_back(node);
    }
    return nodes;
  }
  Feel at(const ContactIntegral::Tool& tool, const Vec3& about) { return capsule.at(tool.middle, tool.axis, about); }

  FineBlock block;
  TouchSurface top;
  CapsuleContact capsule;
};

/// Cells of 2 mm: the contact is four to six nodes wide.
Pressed& coarse() {
  static Pressed pressed(0.002, 0.012);
  return pressed;
}

/// Tilted by `tilt` (rad) and rotated by `aside` (rad) from the x axis. The center of its lower end is above (x, y),
/// `deep` (m) below first contact.
ContactIntegral::Tool oblique(double tilt, double aside, double deep, double x, double y) {
  const Vec3 axis(std::cos(tilt) * std::cos(aside), std::cos(tilt) * std::sin(aside), std::sin(tilt));
  return {Vec3(x, y, 0.05 + kRadius - deep) + kHalfLength * axis, axis, kRadius, kHalfLength};
}

const Vec3 kLever(0.02, 0.01, 0.05);  // m, from the capsule's middle to the handle

TEST(Capsule, PressedObliquelyIsWithin2PercentOfAContactIntegral) {
  Pressed pressed(0.0012, 0.0096);
  const ContactIntegral::Tool tool = oblique(0.26, 0.44, 0.0025, 0.001, -0.002);
  const Feel feel = pressed.at(tool, tool.middle + kLever);
  const ContactIntegral::Sum truth =
      ContactIntegral(pressed.block, kStiff, ContactIntegral::Rule::kGauss).press(tool, tool.middle + kLever);
  EXPECT_GT(truth.force.z(), 0.2);
  EXPECT_GT(truth.torque.norm(), 0.005);
  EXPECT_LT((feel.force - truth.force).norm(), 0.02 * truth.force.norm());
  EXPECT_LT((feel.torque->torque - truth.torque).norm(), 0.02 * truth.torque.norm());
  EXPECT_LT(feel.error, 1e-5 * feel.force.norm());
  EXPECT_LT((truth.support - truth.force).norm(), 1e-6 * truth.force.norm());
  EXPECT_LT((truth.support_torque - feel.torque->torque).norm(), 0.02 * truth.torque.norm());
}

TEST(Capsule, PushesAsACushionOnTheSameNodesThatHardens) {
  const auto compare = [](Pressed& pressed, const ContactIntegral::Tool& tool) {
    const Vec3 about = tool.middle + kLever;
    const Feel feel = pressed.at(tool, about);
    const ContactIntegral::Sum truth =
        ContactIntegral(pressed.block, kStiff, ContactIntegral::Rule::kNodes).press(tool, about);
    EXPECT_GT(truth.force.z(), 0.05);
    EXPECT_LT((feel.force - truth.force).norm(), 0.005 * truth.force.norm());
    EXPECT_LT((feel.torque->torque - truth.torque).norm(), 0.005 * truth.torque.norm());
  };
  compare(coarse(), oblique(0.7, 2.5, 0.003, 0.002, -0.001));
  Pressed compressible(0.002, 0.012, 0.2);  // compressible, so the body also yields sideways
  compare(compressible, oblique(0.25, -0.8, 0.0025, -0.002, 0.002));
}

TEST(Capsule, ItsTorqueAboutAnotherPointDiffersByTheForcesMoment) {
  const ContactIntegral::Tool tool = oblique(0.3, 0.4, 0.002, 0.001, -0.002);
  const Feel here = coarse().at(tool, tool.middle);
  const Feel there = coarse().at(tool, tool.middle + kLever);
  EXPECT_EQ(here.force, there.force);
  EXPECT_GT(here.torque->torque.norm(), 1e-3);  // the lower end is pressed
  EXPECT_LT((there.torque->torque - here.torque->torque + kLever.cross(here.force)).norm(),
            1e-9 * there.torque->torque.norm());
}

TEST(Capsule, AMirroredPressGivesTheMirroredForceAndTorque) {
  const Vec3 mirror(-1, 1, 1);  // across the plane x = 0
  ContactIntegral::Tool tool = oblique(0.3, 0.4, 0.002, 0.001, -0.002);
  const Vec3 about = tool.middle + kLever;
  const Feel feel = coarse().at(tool, about);
  tool.middle = mirror.cwiseProduct(tool.middle);
  tool.axis = -mirror.cwiseProduct(tool.axis);  // the opposite axis is the same capsule
  const Feel mirrored = coarse().at(tool, mirror.cwiseProduct(about));
  EXPECT_GT(std::abs(feel.torque->torque.y()), 1e-3);
  EXPECT_LT((mirrored.force - mirror.cwiseProduct(feel.force)).norm(), 1e-5 * feel.force.norm());
  EXPECT_LT((mirrored.torque->torque + mirror.cwiseProduct(feel.torque->torque)).norm(),
            1e-5 * feel.torque->torque.norm());
}

TEST(Capsule, AClosedWayOfPlacesAndTurnsGivesBackExactlyWhatItTook) {
  const auto handle = [](double t) {
    const double angle = 2 * std::numbers::pi * t;
    return Pose{.position = Vec3(0.002 * std::cos(angle) - 0.023, 0.002 * std::sin(angle),
                                 0.0986 + 0.0005 * std::sin(2 * angle)),
                .turn = (Eigen::AngleAxisd(0.1 * std::sin(angle), Vec3::UnitZ()) *
                         Eigen::AngleAxisd(-0.3 - 0.05 * std::cos(angle), Vec3::UnitY()))
                            .toRotationMatrix()};
  };
  const Vec3 to_middle(0.02, 0, -0.045);  // m, handle frame
  const testing::ClosedWay way = testing::closed_way(handle, 400, [&](const Pose& at) {
    return coarse().capsule.at(at.position + at.turn * to_middle, at.turn * Vec3::UnitX(), at.position);
  });
  EXPECT_GT(way.most, 1e-4);
  EXPECT_GT(way.turning, 0.05 * way.most);
  EXPECT_LT(std::abs(way.work), 2e-3 * way.most);
}

/// −∂force/∂position and −∂torque/∂θ about `about`.
std::pair<Mat3, Mat3> slopes(const ContactIntegral::Tool& tool, const Vec3& about) {
  Mat3 moved;
  Mat3 turned;
  constexpr double kStep = 2e-6;  // small enough that the set of touching nodes stays the same
  for (int c = 0; c < 3; ++c) {
    const auto beside = [&](double way) {
      return coarse().capsule.at(tool.middle + way * Vec3::Unit(c), tool.axis, about + way * Vec3::Unit(c));
    };
    moved.col(c) = (beside(-kStep).force - beside(kStep).force) / (2 * kStep);
    const auto around = [&](double angle) {
      const Mat3 turn = Eigen::AngleAxisd(angle, Vec3::Unit(c)).toRotationMatrix();
      return coarse().capsule.at(about + turn * (tool.middle - about), turn * tool.axis, about);
    };
    turned.col(c) = (around(-kStep).torque->torque - around(kStep).torque->torque) / (2 * kStep);
  }
  return {moved, (turned + turned.transpose()) / 2};
}

TEST(Capsule, ItsStiffnessesAreTheSlopesOfForceAndTorque) {
  for (const double tilt : {0.2, 0.7, 1.5}) {
    const ContactIntegral::Tool tool = oblique(tilt, 0.4, 0.002, -0.003, -0.001);
    const Vec3 about = tool.middle + Vec3(0.05, 0.02, 0);
    const Feel feel = coarse().at(tool, about);
    const auto [moved, turned] = slopes(tool, about);
    EXPECT_LT((feel.stiffness - not_negative(moved)).norm(), 0.01 * moved.norm()) << tilt;
    EXPECT_LT((feel.torque->stiffness - not_negative(turned)).norm(), 0.02 * turned.norm()) << tilt;
    for (const Mat3& k : {feel.stiffness, feel.torque->stiffness}) {
      EXPECT_LT((k - k.transpose()).norm(), 1e-9 * k.norm());
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat3>(k).eigenvalues().minCoeff(), -1e-9 * k.norm());
    }
  }
}

TEST(Capsule, WhereAHandleWouldFallOverItsAngularStiffnessIsZero) {
  const ContactIntegral::Tool tool = oblique(std::numbers::pi / 2, 0, 0.002, -0.003, 0);
  const Vec3 about = tool.middle + Vec3(0, 0, 0.03);
  const Eigen::SelfAdjointEigenSolver<Mat3> parts(slopes(tool, about).second);
  EXPECT_LT(parts.eigenvalues()[0], -1e-3);  // N·m/rad
  const Vec3 falls = parts.eigenvectors().col(0);
  EXPECT_LT(falls.dot(coarse().at(tool, about).torque->stiffness * falls), 1e-5);
}

TEST(Capsule, WithoutLengthItIsNearlyTheSphere) {
  const Pressed& pressed = coarse();
  const CondensedModel body(pressed.block.solid, pressed.top, pressed.fine(0.012));
  SphereContact sphere(body, pressed.top, kRadius);
  CapsuleContact capsule(pressed.block.solid, pressed.top, pressed.fine(0.012), kRadius, 0);
  const Vec3 q(0.002, -0.001, 0.05 + kRadius - 0.0015);
  const Feel round = sphere.at(q);
  for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitZ())}) {
    const Feel feel = capsule.at(q, axis, q);
    EXPECT_NEAR(feel.force.z() / round.force.z(), 1, 0.04);
    EXPECT_NEAR(feel.gap, round.gap, 1e-12);
    EXPECT_LT(feel.torque->torque.norm(), 1e-6 * kRadius * feel.force.norm());  // a ball feels no torque
  }
}

TEST(Capsule, OutsideOrNowhereNothingIsFeltAndBeyondTheTableItSaysSo) {
  ContactIntegral::Tool tool = oblique(0.3, 0.4, -0.001, 0, 0);
  const Feel outside = coarse().at(tool, tool.middle);
  EXPECT_EQ(outside.force, Vec3::Zero());
  EXPECT_EQ(outside.torque->torque, Vec3::Zero());
  EXPECT_FALSE(outside.touching);
  EXPECT_NEAR(outside.gap, 0.001, 1e-12);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3& lost : {Vec3(nan, 0, 0), Vec3(0, 0, std::numeric_limits<double>::infinity())}) {
    EXPECT_EQ(coarse().capsule.at(lost, Vec3::UnitX(), lost).force, Vec3::Zero());
    EXPECT_EQ(coarse().capsule.at(Vec3::Zero(), lost, Vec3::Zero()).force, Vec3::Zero());
  }
  EXPECT_THROW(coarse().capsule.at(Vec3(0.02, 0, 0.058), Vec3::UnitX(), Vec3::Zero()), std::out_of_range);
  const Pressed& pressed = coarse();
  EXPECT_THROW(CapsuleContact(pressed.block.solid, pressed.top, {}, 0, 0.01), std::invalid_argument);
  EXPECT_THROW(CapsuleContact(pressed.block.solid, pressed.top, {}, 0.01, -1), std::invalid_argument);
}

TEST(Capsule, ADeepPressPushesDownWhatIsAboveItsAxis) {
  const ContactIntegral::Tool tool{Vec3(0, 0, 0.048), Vec3::UnitX(), 0.01, 0.002};
  CapsuleContact capsule(coarse().block.solid, coarse().top, coarse().fine(0.012), 0.01, 0.002);
  const Feel feel = capsule.at(tool.middle, tool.axis, tool.middle);
  EXPECT_GT(feel.force.z(), 1);
  EXPECT_LT(feel.force.head<2>().norm(), 1e-3 * feel.force.z());
  EXPECT_LT(feel.error, 1e-4 * feel.force.z());
}

}  // namespace
}  // namespace tendon::softbody::capsule_test

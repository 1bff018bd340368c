// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/joint_friction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "devices/simulated/simulated_device.h"
#include "tests/devices/device_bench.h"
#include "tests/support/refusal.h"

namespace tendon::joint_friction_test {
namespace {

using namespace std::chrono_literals;

constexpr Mechanism::Arm kPhantom{.upper_arm = 0.14, .forearm = 0.14};

std::vector<Mechanism::Kind> all_kinds() { return {Mechanism::Falcon{}, kPhantom}; }

SimulatedDevice::Config rubbing(const Mechanism::Kind& kind, const Vec3& coulomb, const Vec3& viscous = Vec3::Zero()) {
  SimulatedDevice::Config config;
  config.mass = 0.1;
  config.joint_friction = {.mechanism = kind, .coulomb = coulomb, .viscous = viscous};
  return config;
}

/// Returns the motion of the handle (m/rad) if only one joint rotates.
Vec3 way_of(const Mechanism::Kind& kind, const Vec3& at, Eigen::Index joint) {
  return Mechanism(kind).jacobian(at).inverse().col(joint);
}

TEST(JointFriction, OfOneTurningJointIsItsTorqueOverItsLever) {
  // The torque is just below or just above the static friction of that joint.
  const Vec3 torques(0.02, 0.03, 0.04);
  for (const Mechanism::Kind& kind : all_kinds()) {
    double least = std::numeric_limits<double>::infinity();
    double most = 0;
    for (const Vec3& at : {Vec3(0, 0, 0), Vec3(0.02, 0.01, -0.02), Vec3(-0.03, 0, 0.03), Vec3(0, -0.04, 0)}) {
      for (Eigen::Index joint = 0; joint < 3; ++joint) {
        const Mat3 jacobian = Mechanism(kind).jacobian(at);
        const Vec3 force = jacobian.row(joint).transpose() * torques[joint];  // torque on this joint only
        auto config = rubbing(kind, torques);
        config.start_position = at;
        Bench held(config);
        held.push(0.999 * force, 50ms);
        EXPECT_EQ(held.truth().position, at);
        EXPECT_EQ(held.truth().velocity, Vec3::Zero());
        Bench slides(config);
        slides.push(1.01 * force, 5ms);
        EXPECT_GT((slides.truth().position - at).norm(), 1e-8);
        least = std::min(least, force.norm());
        most = std::max(most, force.norm());
      }
    }
    EXPECT_GT(most, 1.5 * least) << "friction that depends on the pose is what it is about";
  }
}

TEST(JointFriction, AStuckJointLetsTheHandleGiveWayAside) {
  for (const Mechanism::Kind& kind : all_kinds()) {
    auto config = rubbing(kind, Vec3(1e-4, 1, 1));
    Bench bench(config);
    const Vec3 force(0.3, 0.1, -0.2);
    bench.push(force, 20ms);
    const Vec3 way = way_of(kind, Vec3::Zero(), 0).normalized();
    const Vec3 moved = bench.truth().position;
    EXPECT_GT(moved.norm(), 1e-4);
    EXPECT_GT(std::abs(moved.normalized().dot(way)), 0.999);
    EXPECT_LT(moved.normalized().dot(force.normalized()), 0.99) << "not along the force";
  }
}

TEST(JointFriction, BrakesAHandleThatTurnsOneJointAsTheClosedFormSays) {
  // The distance is so short that J is constant, so m a = −Jᵀτ. The joints at rest carry the lateral part. Along the
  // motion, a = τ / (m ‖way‖).
  const Vec3 torques(0.02, 0.02, 0.02);
  for (const Mechanism::Kind& kind : all_kinds()) {
    for (Eigen::Index joint = 0; joint < 3; ++joint) {
      auto config = rubbing(kind, torques);
      const Vec3 way = way_of(kind, Vec3::Zero(), joint);
      config.start_velocity = 0.01 * way.normalized();
      Bench bench(config);
      bench.wait(2ms);
      const double slowed = 0.01 - torques[joint] / way.norm() / config.mass * 2e-3;
      EXPECT_NEAR(bench.truth().velocity.dot(way.normalized()), slowed, 2e-5);
      EXPECT_LT(bench.truth().velocity.cross(way.normalized()).norm(), 2e-5);
      bench.wait(50ms);
      const Vec3 rest = bench.truth().position;
      EXPECT_EQ(bench.truth().velocity, Vec3::Zero());
      EXPECT_NEAR(rest.norm(), 0.01 * 0.01 * config.mass * way.norm() / (2 * torques[joint]), 1e-7);
      bench.wait(100ms);
      EXPECT_EQ(bench.truth().position, rest);
    }
  }
}

TEST(JointFriction, TurnsRoundWithoutAPauseUnderAForceThatItCannotHold) {
  // The joint is stopped by friction, and then its motion is reversed by the force. For the rest of the 50 µs substep
  // in which this happens, friction may have the wrong sign. If the joint stopped for that long, this would cost 2.5
  // mm/s.
  const Vec3 torques(0.02, 0.02, 0.02);
  for (const Mechanism::Kind& kind : all_kinds()) {
    for (Eigen::Index joint = 0; joint < 3; ++joint) {
      for (const double v0 : {0.05, 0.0503, 0.0511, 0.0517, 0.0526}) {
        auto config = rubbing(kind, torques);
        const Vec3 way = way_of(kind, Vec3::Zero(), joint);
        const double friction = torques[joint] / way.norm();
        config.start_velocity = v0 * way.normalized();
        Bench bench(config);
        // The handle moves along this direction, unless the other joints rotate. Their friction holds the rest.
        bench.push(-5 * way.normalized(), 2ms);
        const double back = 2e-3 - config.mass * v0 / (5 + friction);
        EXPECT_NEAR(bench.truth().velocity.dot(way.normalized()), -(5 - friction) / config.mass * back,
                    2 * friction / config.mass * 50e-6 + 1e-4)
            << joint << ", " << v0;
      }
    }
  }
}

TEST(JointFriction, ViscousInTheJointsLetsASpeedFallAsTheExponential) {
  // At the center of the Phantom's workspace J is diagonal with entries 1/l, up to the order of the axes.
  const Vec3 viscous(0.002, 0.004, 0.008);
  auto config = rubbing(kPhantom, Vec3::Zero(), viscous);
  config.mass = 0.1;
  for (Eigen::Index joint = 0; joint < 3; ++joint) {
    const Vec3 way = way_of(kPhantom, Vec3::Zero(), joint);
    EXPECT_NEAR(way.norm(), 0.14, 1e-12);
    config.start_velocity = 1e-5 * way.normalized();
    Bench bench(config);
    bench.wait(500ms);
    const double b = viscous[joint] / (0.14 * 0.14);
    EXPECT_NEAR(bench.truth().velocity.norm() / 1e-5, std::exp(-b * 5), 1e-3);
  }
}

TEST(JointFriction, ItsLawHoldsExactlyWithTheMeanVelocityOfEachSubstep) {
  // The change of momentum is the impulse of hand and motors minus friction: τ = J⁻ᵀ (momentum − resistance v̄) /
  // (h/2). It must be at its maximum and opposite to q̇, or q̇ must be zero.
  for (const Mechanism::Kind& kind : all_kinds()) {
    Dice dice(5);
    int stood = 0;
    for (int i = 0; i < 5000; ++i) {
      const Vec3 coulomb = (random_vector(dice, 0.05) + Vec3::Constant(0.05)).cwiseAbs();
      const JointFriction friction({.mechanism = kind, .coulomb = coulomb});
      const double h = 50e-6;
      const double mass = dice.within(0.02, 0.5);
      const Vec3 at = random_vector(dice, 0.025);
      const Vec3 v0 = random_vector(dice, dice.chance(0.5) ? 1e-4 : 0.1);
      const Vec3 push = random_vector(dice, dice.chance(0.5) ? 0.5 : 5);
      const JointFriction::Impetus impetus{mass * v0 + h / 2 * push, mass * dice.within(1, 1.1), mass, push};
      const auto slide = friction.step(at, v0, impetus, h);
      const Mat3 jacobian = Mechanism(kind).jacobian(at);
      const Vec3 lost = impetus.momentum - impetus.resistance * slide.mean;
      const Vec3 torque = jacobian.transpose().inverse() * lost / (h / 2);
      const Vec3 turning = jacobian * slide.mean;
      for (Eigen::Index joint = 0; joint < 3; ++joint) {
        ASSERT_LE(std::abs(torque[joint]), coulomb[joint] * (1 + 1e-8));
        if (std::abs(turning[joint]) < 1e-12) {
          ++stood;
          continue;
        }
        ASSERT_NEAR(torque[joint], std::copysign(coulomb[joint], turning[joint]), 1e-8) << "seed " << i;
      }
    }
    EXPECT_GT(stood, 500);
    EXPECT_LT(stood, 14'500);
  }
}

TEST(JointFriction, IsNowhereAndInNoDirectionLessThanItsLowerBound) {
  for (const Mechanism::Kind& kind : all_kinds()) {
    const JointFriction::Config config{
        .mechanism = kind, .coulomb = Vec3(0.02, 0.03, 0.025), .viscous = Vec3(1e-3, 2e-3, 3e-3)};
    const JointFriction friction(config);
    const Friction least = friction.least();
    EXPECT_GT(least.coulomb, 0);
    EXPECT_GT(least.viscous, 0);
    const Mechanism mechanism(kind);
    double closest = std::numeric_limits<double>::infinity();
    Dice dice(6);
    for (int i = 0; i < 20'000; ++i) {
      const Vec3 at = random_vector(dice, 1.2 * mechanism.reach());
      const Mat3 jacobian = mechanism.jacobian(at);
      const Vec3 v =
          i % 4 == 3 ? random_vector(dice, 1).normalized() : Vec3(jacobian.inverse().col(i % 4).normalized());
      const Vec3 turning = jacobian * v;
      const double coulomb = config.coulomb.dot(turning.cwiseAbs());
      const double viscous = config.viscous.dot(turning.cwiseAbs2());
      const Friction here = friction.least_at(at);
      ASSERT_GE(coulomb, here.coulomb * (1 - 1e-12));
      ASSERT_GE(here.coulomb, least.coulomb * (1 - 1e-12));
      ASSERT_GE(viscous, here.viscous * (1 - 1e-9));
      ASSERT_GE(here.viscous, least.viscous * (1 - 1e-9));
      closest = std::min(closest, coulomb / least.coulomb);
    }
    EXPECT_LT(closest, 1.05) << "the bound is not even approached";
  }
}

TEST(JointFriction, OfWhichOneJointHasNoneTheHandleHasNoneInThatDirection) {
  const JointFriction friction({.mechanism = kPhantom, .coulomb = Vec3(0, 1, 1), .viscous = Vec3(1, 0, 1)});
  EXPECT_EQ(friction.least().coulomb, 0);
  EXPECT_EQ(friction.least().viscous, 0);
  EXPECT_NEAR(friction.least_at(Vec3::Zero()).viscous, 0, 1e-9);
}

TEST(JointFriction, TorquesForAHandlesFrictionMakeThatTheLeastAnywhere) {
  for (const Mechanism::Kind& kind : all_kinds()) {
    const JointFriction friction({.mechanism = kind, .coulomb = JointFriction::torques(kind, 0.4)});
    EXPECT_NEAR(friction.least().coulomb, 0.4, 1e-15);
    EXPECT_GE(friction.least().coulomb, 0.4) << "what a limiter counts on is there";
  }
  // The levers of a Falcon are longest at the edge of the workspace, but two levers of an arm are constant.
  EXPECT_GT(
      JointFriction({.mechanism = Mechanism::Falcon{}, .coulomb = JointFriction::torques(Mechanism::Falcon{}, 0.4)})
          .least_at(Vec3::Zero())
          .coulomb,
      0.5);
}

TEST(JointFriction, OfADeviceTheLeastFrictionAddsUp) {
  SimulatedDevice::Config config;
  config.viscous_friction = 0.5;
  config.coulomb_friction = 0.1;
  EXPECT_EQ(least_friction(config).coulomb, 0.1);
  EXPECT_EQ(least_friction_at(config, Vec3(1, 2, 3)).viscous, 0.5);
  config.coulomb_friction.reset();
  const Mechanism::Kind falcon = Mechanism::Falcon{};
  config.joint_friction = {
      .mechanism = falcon, .coulomb = JointFriction::torques(falcon, 0.2), .viscous = Vec3(1e-3, 1e-3, 1e-3)};
  const Friction joints = JointFriction(*config.joint_friction).least();
  EXPECT_NEAR(least_friction(config).coulomb, 0.2, 1e-15);
  EXPECT_EQ(least_friction(config).viscous, 0.5 + joints.viscous);
  EXPECT_GT(least_friction_at(config, Vec3::Zero()).coulomb, 0.2);
  EXPECT_GT(least_friction_at(config, Vec3::Zero()).viscous, least_friction(config).viscous);
}

TEST(JointFriction, RefusesWhatIsNoFriction) {
  expect_refusals(JointFriction::Config{.mechanism = kPhantom, .coulomb = Vec3(1, 1, 1), .viscous = Vec3(1, 1, 1)},
                  Makes<JointFriction>(),
                  {
                      {"joint_friction.coulomb = 0: expected friction in at least one joint",
                       [](auto& c) { c = {.mechanism = kPhantom}; }},
                      {"joint_friction.coulomb[1] = -1: expected", [](auto& c) { c.coulomb[1] = -1; }},
                      {"joint_friction.viscous[2] = nan: expected", [](auto& c) { c.viscous[2] = NAN; }},
                      {"joint_friction.centre.y = nan", [](auto& c) { c.centre.y() = NAN; }},
                      {"forearm = 0: expected 0.01 to 10 m",
                       [](auto& c) {
                         c.mechanism = Mechanism::Arm{0.1, 0};
                       }},
                  });
}

}  // namespace
}  // namespace tendon::joint_friction_test

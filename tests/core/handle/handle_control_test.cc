// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "core/base/rotation.h"
#include "core/haptic_controller.h"
#include "core/remote/answer.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::handle_control_test {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr Duration kPeriod = std::chrono::milliseconds(1);

HapticController::Config config_of_a_stylus() {
  HapticController::Config config;
  config.limiter.law = Law::kAol;
  config.limiter.friction = {0.02, 0.26};
  config.limiter.longest_hold = kPeriod;
  config.max_force = 4;
  config.max_slew = kInf;
  config.hold.ramp_in = Duration::zero();
  config.rotation = {.friction = {1e-4, 1e-3}, .max_torque = 0.1, .max_slew = kInf};
  config.grip = {.friction = {0.02, 0.26}, .arm = 0.05, .max_force = 5};
  return config;
}

class Stylus {
 public:
  explicit Stylus(const HapticController::Config& config = config_of_a_stylus()) : controller(config) {}

  RemoteForce answer() {
    RemoteForce answer;
    answer.sequence = ++sequence_;
    answer.received = now_;
    answer.valid_for = std::chrono::seconds(1);
    return answer;
  }
  void ask(const Vec3& torque) {
    RemoteForce asked = answer();
    asked.torque = RemoteTorque{.torque = torque};
    controller.observe(asked);
  }
  Step step(const Quat& q, double opening = 0) {
    now_ += kPeriod;
    const HandleSample handle{.turning = Turning{.orientation = q},
                              .grip = Grip{.opening = opening},
                              .torque = held_.torque,
                              .grip_force = held_.grip};
    const Step step = controller.step({now_, Vec3::Zero(), Vec3::Zero()}, held_.force, {}, &handle);
    held_ = {step.force};
    if (step.turn()) held_.torque = step.turn()->torque;
    if (step.grip()) held_.grip = step.grip()->force;
    return step;
  }
  void earn(int steps = 500) {
    for (int i = 0; i < steps; ++i) {
      step(rotation_by({0, 0, i % 2 == 0 ? 0.01 : 0.0}), i % 2 == 0 ? 0.02 : 0.0);
    }
  }
  HapticController controller;

 private:
  LocalTime now_{};
  Effort held_;
  std::uint64_t sequence_ = 0;
};

TEST(HandleControl, ATorqueIsGivenWhenTheAccountPaysForIt) {
  Stylus stylus;
  stylus.ask({0, 0, 0.05});
  EXPECT_LT(stylus.step({}).turn()->torque.norm(), 0.001) << "only what friction allows: nothing has been earned";
  stylus.earn();
  stylus.ask({0, 0, 0.05});
  const Step step = stylus.step({});
  EXPECT_EQ(step.turn()->torque, Vec3(0, 0, 0.05));
  EXPECT_EQ(step.turn()->wanted, Vec3(0, 0, 0.05));
  EXPECT_TRUE(step.reasons.empty()) << to_string(step.reasons);
}

TEST(HandleControl, AWrenchKeepsItsDirectionUnderEveryLimit) {
  Dice dice(20);
  for (int i = 0; i < 1000; ++i) {
    const Vec<6> wanted = wrench_of(dice.direction() * dice.decades(-2, 2), dice.direction() * dice.decades(-3, 1));
    const LimitedWrench saturated = saturate(wanted, 4, 0.1);
    EXPECT_LE(saturated.wrench.head<3>().norm(), 4 * (1 + 1e-12));
    EXPECT_LE(saturated.wrench.tail<3>().norm(), 0.1 * (1 + 1e-12));
    EXPECT_NEAR(saturated.wrench.normalized().dot(wanted.normalized()), 1, 1e-12);
    EXPECT_EQ(saturated.reasons.has(Reason::kMaxForce), saturated.wrench != wanted);

    const Vec<6> before = wrench_of(dice.direction(), dice.direction() * 0.05);
    const LimitedWrench slewed = limit_slew(wanted, before, 1000, 20, kPeriod);
    const Vec<6> change = slewed.wrench - before;
    EXPECT_LE(change.head<3>().norm(), 1 + 1e-12);
    EXPECT_LE(change.tail<3>().norm(), 0.02 + 1e-12);
    EXPECT_NEAR(change.normalized().dot((wanted - before).normalized()), 1, 1e-12);

    WrenchPort port(
        {.law = Law::kAol, .friction = {Friction{0.02, 0.26}, Friction{1e-4, 1e-3}}, .longest_hold = kPeriod});
    const Vec<6> limited = port.limit({.force = wanted}).force;
    if (limited.norm() > 0) {
      EXPECT_NEAR(limited.normalized().dot(wanted.normalized()), 1, 1e-12);
    }
  }
}

TEST(HandleControl, ForceAndTorqueShareOneAccount) {
  Stylus stylus;
  stylus.earn();
  const double before = stylus.step({}).energy;
  stylus.ask({0, 0, 0.05});
  stylus.step({});
  // 0.1 rad spends 5 mJ minus 0.1 mJ of friction, from the account shared with forces.
  const Step after = stylus.step(rotation_by({0, 0, 0.1}));
  EXPECT_NEAR(after.energy - before, -0.05 * 0.1 + 1e-4 * 0.1 + 1e-3 * 0.01 / 1e-3, 1e-12);
}

TEST(HandleControl, AModelOfRotationIsFollowedBetweenTwoAnswers) {
  Stylus stylus;
  stylus.earn(2000);
  RemoteForce answer = stylus.answer();
  const Quat at = rotation_by({0.3, 0, 0});
  answer.torque = RemoteTorque{.torque = {0, 0.01, 0}, .model = RotationModel{at, Mat3::Identity() * 0.1}};
  ASSERT_TRUE(stylus.controller.observe(answer));
  for (const double angle : {0.0, 0.1, -0.2}) {
    const Quat q = product(rotation_by({0, 0, angle}), at);
    const Vec3 wanted = stylus.step(q).turn()->wanted;
    EXPECT_LT((wanted - Vec3(0, 0.01, -0.1 * std::sin(angle))).norm(), 1e-12) << angle;
  }
}

TEST(HandleControl, NothingJumpsWhereAQuaternionChangesItsSign) {
  const Mat3 stiffness = Vec3(0.1, 0.2, 0.3).asDiagonal();
  const RemoteTorque torque{.torque = {0, 0.01, 0}, .model = RotationModel{rotation_by({1, 2, 0.5}), stiffness}};
  Dice dice(20);
  for (int i = 0; i < 1000; ++i) {
    const Quat q = rotation_by(dice.direction() * dice.within(0, 3));
    EXPECT_EQ(reconstruct(torque, {-q.w, -q.x, -q.y, -q.z}), reconstruct(torque, q));
  }
}

TEST(HandleControl, BeyondAHundredAndFiftyDegreesNoTorqueIsBelieved) {
  const RemoteTorque torque{.torque = {0, 0.01, 0}, .model = RotationModel{Quat{}, Mat3::Identity() * 0.1}};
  constexpr double kDegree = 0.017453292519943295;
  EXPECT_GT(reconstruct(torque, rotation_by({0, 0, 149.9 * kDegree})).norm(), 0.01);
  EXPECT_EQ(reconstruct(torque, rotation_by({0, 0, 150.1 * kDegree})), Vec3(0, 0, 0));
}

TEST(HandleControl, StiffnessThatMakesEnergyIsNotBelieved) {
  Mat3 stiffness;
  stiffness << 1, 2, 0, -2, 1, 0, 0, 0, -5;
  const RemoteTorque torque = believed({.model = RotationModel{Quat{}, stiffness}}, 0.5);
  EXPECT_LT((torque.model->stiffness - Mat3(Vec3(0.5, 0.5, 0).asDiagonal())).norm(), 1e-12);
}

TEST(HandleControl, TorqueAndGripAreRampedInFadeAndStopWithTheForce) {
  HapticController::Config config = config_of_a_stylus();
  config.hold.ramp_in = std::chrono::milliseconds(10);
  Stylus stylus(config);
  RemoteForce answer = stylus.answer();
  answer.valid_for = std::chrono::milliseconds(20);
  answer.torque = RemoteTorque{.torque = {0, 0, 0.05}};
  answer.grip_force = 2;
  ASSERT_TRUE(stylus.controller.observe(answer));
  const auto wanted_after = [&stylus](int steps) {
    Step last;
    for (int i = 0; i < steps; ++i) last = stylus.step({});
    return last;
  };
  const Step ramp = wanted_after(5);
  EXPECT_NEAR(ramp.turn()->wanted.z(), 0.025, 1e-12);
  EXPECT_NEAR(ramp.grip()->wanted, 1, 1e-12);
  const Step whole = wanted_after(15);
  EXPECT_EQ(whole.turn()->wanted.z(), 0.05);
  EXPECT_EQ(whole.grip()->wanted, 2);
  const Step fading = wanted_after(40);  // 20 ms of hold, then 20 ms of decay with a time constant of 50 ms
  EXPECT_EQ(fading.mode, Mode::kDecaying);
  EXPECT_NEAR(fading.turn()->wanted.z(), 0.05 * std::exp(-0.4), 1e-12);
  EXPECT_NEAR(fading.grip()->wanted, 2 * std::exp(-0.4), 1e-12);
  const Step stopped = wanted_after(250);
  EXPECT_EQ(stopped.mode, Mode::kSafeStop);
  EXPECT_EQ(stopped.turn()->wanted, Vec3(0, 0, 0));
  EXPECT_EQ(stopped.grip()->wanted, 0);
}

TEST(HandleControl, AnAnswerWithoutATorqueEndsTheOneBefore) {
  Stylus stylus;
  stylus.ask({0, 0, 0.05});
  EXPECT_EQ(stylus.step({}).turn()->wanted.z(), 0.05);
  stylus.controller.observe(stylus.answer());
  EXPECT_EQ(stylus.step({}).turn()->wanted.z(), 0);
}

TEST(HandleControl, AGripperSpendsItsOwnAccountOnly) {
  Stylus stylus;
  for (int i = 0; i < 500; ++i) stylus.step({}, i % 2 == 0 ? 0.02 : 0.0);
  const Step earned = stylus.step({}, 0);
  EXPECT_GT(earned.grip()->energy, 1e-3);
  EXPECT_EQ(earned.energy, 0) << "opening and closing pays for no torque";
  RemoteForce answer = stylus.answer();
  answer.grip_force = 100;
  answer.torque = RemoteTorque{.torque = {0, 0, 0.05}};
  stylus.controller.observe(answer);
  const Step step = stylus.step({}, 0);
  EXPECT_EQ(step.grip()->force, 5) << "the largest that the gripper may";
  EXPECT_LT(step.turn()->torque.norm(), 0.001);
  // N times m/rad: the force does work over the travel of the fingers.
  const Step opened = stylus.step({}, 0.01);
  const double travel = 0.05 * 0.01;
  EXPECT_NEAR(opened.grip()->energy - step.grip()->energy, -5 * travel + 0.02 * travel + 0.26 * travel * travel / 1e-3,
              1e-12);
}

TEST(HandleControl, DisarmAndFaultsEndTorqueAndGrip) {
  Stylus stylus;
  stylus.earn();
  RemoteForce answer = stylus.answer();
  answer.torque = RemoteTorque{.torque = {0, 0, 0.05}};
  answer.grip_force = 2;
  stylus.controller.observe(answer);
  ASSERT_GT(stylus.step({}).turn()->torque.norm(), 0);
  stylus.controller.disarm();
  const Step disarmed = stylus.step({});
  EXPECT_EQ(disarmed.turn()->torque, Vec3(0, 0, 0));
  EXPECT_EQ(disarmed.grip()->force, 0);
  stylus.controller.rearm();
  stylus.controller.observe(answer);
  ASSERT_GT(stylus.step({}).turn()->torque.norm(), 0);
  const Step broken = stylus.step({2, 0, 0, 0});  // not a unit quaternion
  EXPECT_EQ(stylus.controller.fault(), HapticController::Fault::kPositionNotFinite);
  EXPECT_TRUE(broken.reasons.has(Reason::kNotFinite));
  EXPECT_EQ(broken.turn()->torque, Vec3(0, 0, 0));
  EXPECT_EQ(stylus.step({}).turn()->torque, Vec3(0, 0, 0)) << "until it is rearmed";
}

TEST(HandleControl, ATorqueThatNoMotorCanGiveIsToldAsMaxForce) {
  HapticController::Config config = config_of_a_stylus();
  config.rotation.reset();
  Stylus stylus(config);
  stylus.ask({0, 0, 0.05});
  const Step step = stylus.step({});
  EXPECT_TRUE(step.reasons.has(Reason::kMaxForce));
  EXPECT_EQ(step.turn()->torque, Vec3(0, 0, 0));
}

TEST(HandleControl, ALawThatKnowsAPointOnlyIsRefused) {
  HapticController::Config config = config_of_a_stylus();
  config.limiter.law = Law::kForceBounding;
  EXPECT_NE(thrown_by([&] { HapticController{config}; }).find("expected aol+, aol or none"), std::string::npos);
}

TEST(HandleControl, ALateHoldRaisesTheBoundOfAWrenchToo) {
  WrenchPort port(
      {.law = Law::kAol, .friction = {Friction{0.02, 0.26}, Friction{1e-4, 1e-3}}, .longest_hold = kPeriod});
  port.observe({.applied = Vec<6>::Zero(), .dx = wrench_of({0.01, 0, 0}, Vec3::Zero()), .held = kPeriod});
  const Vec<6> wanted = wrench_of(Vec3::Zero(), {0, 0, 100});
  const double before = port.limit({.force = wanted}).force.norm();
  port.observe({.applied = Vec<6>::Zero(), .dx = Vec<6>::Zero(), .held = 2 * kPeriod});
  EXPECT_EQ(port.longest_hold(), std::chrono::microseconds(2500));
  EXPECT_NEAR(port.limit({.force = wanted}).force.norm() - 1e-4, (before - 1e-4) / std::sqrt(2.5), 1e-9);
}

}  // namespace
}  // namespace tendon::handle_control_test

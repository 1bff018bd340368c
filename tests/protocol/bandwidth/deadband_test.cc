// SPDX-License-Identifier: Apache-2.0
#include "protocol/bandwidth/deadband.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace tendon::deadband_test {
namespace {

using std::chrono::milliseconds;

constexpr LocalTime kStart{std::chrono::seconds(1)};

TEST(Deadband, PassesWhatDiffersByMoreThanATenthAndHoldsBackTheRest) {
  Deadband deadband(Deadband::force());
  EXPECT_TRUE(deadband.passes(kStart, {2, 0, 0}));
  EXPECT_FALSE(deadband.passes(kStart + milliseconds(1), {2.19, 0, 0}));
  EXPECT_FALSE(deadband.passes(kStart + milliseconds(2), {2, 0.19, 0}));
  EXPECT_TRUE(deadband.passes(kStart + milliseconds(3), {2.21, 0, 0}));
  // The reference is the last value that has been sent, so that slow changes accumulate.
  EXPECT_FALSE(deadband.passes(kStart + milliseconds(4), {2.42, 0, 0}));
  EXPECT_TRUE(deadband.passes(kStart + milliseconds(5), {2.44, 0, 0}));
}

TEST(Deadband, NearZeroTheFloorCounts) {
  Deadband deadband(Deadband::force());
  EXPECT_TRUE(deadband.passes(kStart, {0, 0, 0}));
  EXPECT_FALSE(deadband.passes(kStart + milliseconds(1), {0.049, 0, 0}));
  EXPECT_TRUE(deadband.passes(kStart + milliseconds(2), {0.051, 0, 0}));
}

TEST(Deadband, IsNeverSilentForLongerThanPromised) {
  Deadband deadband({.longest_silence = milliseconds(20)});
  EXPECT_TRUE(deadband.passes(kStart, {1, 0, 0}));
  int sent = 0;
  for (int i = 1; i <= 100; ++i) sent += deadband.passes(kStart + milliseconds(i), {1, 0, 0}) ? 1 : 0;
  EXPECT_EQ(sent, 5);
}

TEST(Deadband, LeavesOutMostOfASlowTouchAndNeverMissesByMoreThanWebersShare) {
  Deadband deadband(Deadband::force());
  Vec3 held = Vec3::Zero();
  int sent = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Vec3 force(2 + std::sin(2 * std::numbers::pi * i / 1000), 0, 0);
    if (deadband.passes(kStart + milliseconds(i), force)) {
      held = force;
      ++sent;
    }
    EXPECT_LE((force - held).norm(), 0.1 * held.norm() + 1e-12);
  }
  EXPECT_LT(sent, 1000);
}

TEST(Deadband, WhatIsNotANumberIsNotHeldBackItIsForTheReceiverToRefuse) {
  Deadband deadband(Deadband::force());
  EXPECT_TRUE(deadband.passes(kStart, {1, 0, 0}));
  EXPECT_TRUE(deadband.passes(kStart + milliseconds(1), {std::nan(""), 0, 0}));
}

TEST(Deadband, RefusesWhatIsImpossible) {
  EXPECT_THROW(Deadband({.share = 1.1}), std::invalid_argument);
  EXPECT_THROW(Deadband({.floor = -1}), std::invalid_argument);
  EXPECT_THROW(Deadband({.longest_silence = Duration(0)}), std::invalid_argument);
}

constexpr SetStateDeadband kAsked{.share = 0.10, .floor = 1e-3, .max_silence = milliseconds(20)};

const Vec3 kRest = Vec3::Zero();

DeviceState state(int ms, const Vec3& position, const Vec3& velocity, Mode mode = Mode::kActive) {
  return {.tick = static_cast<std::uint64_t>(ms),
          .sampled = PeerTime(milliseconds(ms)),
          .position = position,
          .velocity = velocity,
          .mode = mode};
}

TEST(Predict, GoesOnAlongTheLineInWholeHapticPeriods) {
  const DeviceState sent = state(100, {1, 2, 3}, {0.5, 0, -1});
  const DeviceState later = predict(sent, milliseconds(3) + Duration(999'999), milliseconds(1));
  EXPECT_EQ(later.tick, 103U);
  EXPECT_EQ(later.sampled, PeerTime(milliseconds(103)));
  EXPECT_LT((later.position - Vec3(1.0015, 2, 2.997)).norm(), 1e-12);
  EXPECT_EQ(later.velocity, sent.velocity);
  EXPECT_EQ(predict(sent, Duration(-1), milliseconds(1)).tick, 100U);
}

TEST(StateDeadband, LeavesOutAHandThatGoesStraightOnAndSendsWhenItTurns) {
  StateDeadband deadband(kAsked);
  EXPECT_TRUE(deadband.passes(state(1, kRest, {0.1, 0, 0})));
  EXPECT_FALSE(deadband.passes(state(2, kRest, {0.109, 0, 0})));
  EXPECT_FALSE(deadband.passes(state(3, kRest, {0.1, 0.009, 0})));
  EXPECT_TRUE(deadband.passes(state(4, kRest, {0.1, 0.011, 0})));
}

TEST(StateDeadband, SendsEachChangeOfModeAtOnceAndCountsTheSilenceFromThere) {
  StateDeadband deadband(kAsked);
  EXPECT_TRUE(deadband.passes(state(1, kRest, kRest)));
  EXPECT_TRUE(deadband.passes(state(11, kRest, kRest, Mode::kHolding)));
  EXPECT_FALSE(deadband.passes(state(30, kRest, kRest, Mode::kHolding)));
  EXPECT_TRUE(deadband.passes(state(31, kRest, kRest, Mode::kHolding)));
  EXPECT_TRUE(deadband.passes(state(32, kRest, kRest, Mode::kFault)));
}

DeviceState turning(int ms, const Vec3& angular_velocity, double grip_velocity = 0) {
  DeviceState turning = state(ms, kRest, kRest);
  turning.turning = Turning{.orientation = {.w = 0.6, .x = 0, .y = 0.8, .z = 0}, .angular_velocity = angular_velocity};
  turning.grip = Grip{.opening = 0.5, .velocity = grip_velocity};
  return turning;
}

TEST(Predict, TurnsAndGripsOnWithTheVelocitiesOfBoth) {
  DeviceState sent = turning(100, {0, 0, 2}, -3);
  sent.turning->orientation = {.w = 1.0009, .x = 0, .y = 0, .z = 0};
  const DeviceState later = predict(sent, milliseconds(10), milliseconds(1));
  EXPECT_NEAR(later.turning->orientation.w, std::cos(0.01), 1e-12);
  EXPECT_NEAR(later.turning->orientation.z, std::sin(0.01), 1e-12);
  EXPECT_EQ(later.turning->angular_velocity, sent.turning->angular_velocity);
  EXPECT_NEAR(later.grip->opening, 0.47, 1e-12);
  EXPECT_EQ(predict(sent, Duration(0), milliseconds(1)).turning, sent.turning) << "to the last bit";
}

TEST(StateDeadband, SendsAHandThatTurnsOrGripsAnotherWayThanPredicted) {
  StateDeadband deadband(kAsked);  // 1 mm/s corresponds to 20 mrad/s at 50 mm
  EXPECT_TRUE(deadband.passes(turning(1, {0, 0, 0.5}, -0.5)));
  EXPECT_FALSE(deadband.passes(turning(2, {0, 0, 0.54}, -0.46)));
  EXPECT_TRUE(deadband.passes(turning(3, {0.06, 0, 0.5}, -0.5)));
  EXPECT_FALSE(deadband.passes(turning(4, {0.06, 0, 0.5}, -0.5)));
  EXPECT_TRUE(deadband.passes(turning(5, {0.06, 0, 0.5}, -0.44)));
  EXPECT_TRUE(deadband.passes(turning(6, kRest, 0)));
  EXPECT_FALSE(deadband.passes(turning(7, {0.019, 0, 0}, 0.019)));
  EXPECT_TRUE(deadband.passes(turning(8, {0.021, 0, 0}, 0)));
  EXPECT_TRUE(deadband.passes(state(9, kRest, kRest))) << "its orientation is not measured any more";
  EXPECT_FALSE(deadband.passes(state(10, kRest, kRest)));
}

TEST(HandleDeadband, LeavesOutNoTorqueOrGripForceThatAHandCanTell) {
  HandleDeadband deadband = HandleDeadband::of_forces(Deadband::force());
  auto passes = [&, ms = 0](const Vec3& force, std::optional<Vec3> torque, std::optional<double> grip) mutable {
    return deadband.passes(kStart + milliseconds(++ms), {.vector = force, .turning = torque, .grip = grip});
  };
  EXPECT_TRUE(passes({1, 0, 0}, {}, {}));
  EXPECT_TRUE(passes({1, 0, 0}, Vec3(0, 0.001, 0), {})) << "a torque, however small";
  EXPECT_FALSE(passes({1.09, 0, 0}, Vec3(0, 0.003, 0), {}));
  EXPECT_TRUE(passes({1, 0, 0}, Vec3(0, 0.004, 0), {})) << "3 mN·m are 60 mN at 50 mm";
  EXPECT_TRUE(passes({1, 0, 0}, Vec3(0, 0.004, 0), 0));
  EXPECT_FALSE(passes({1, 0, 0}, Vec3(0, 0.004, 0), 0.04));
  EXPECT_TRUE(passes({1, 0, 0}, Vec3(0, 0.004, 0), 0.06));
  EXPECT_TRUE(passes({1, 0, 0}, {}, 0.06)) << "the torque has gone";
  EXPECT_FALSE(passes({1, 0, 0}, {}, 0.06));
}

/// If the hand is at `position(t)`, the prediction error must be at most the velocity band times the silence.
TEST(StateDeadband, WhatIsPredictedIsOffByAtMostTheBandTimesTheSilence) {
  StateDeadband deadband(kAsked);
  DeviceState believed;
  int sent = 0;
  for (int ms = 1; ms <= 10'000; ++ms) {
    const double w = 2 * std::numbers::pi * 0.5;
    const double t = ms * 1e-3;
    const DeviceState now = state(ms, {0.02 * std::sin(w * t), 0, 0}, {0.02 * w * std::cos(w * t), 0, 0});
    if (deadband.passes(now)) {
      believed = now;
      ++sent;
    }
    const DeviceState predicted = predict(believed, now.sampled - believed.sampled, milliseconds(1));
    ASSERT_EQ(predicted.tick, now.tick);
    const double band = std::max(0.1 * believed.velocity.norm(), 1e-3);
    EXPECT_LE((predicted.position - now.position).norm(), band * 20e-3);
  }
  EXPECT_LT(sent, 1000);
  EXPECT_GE(sent, 500);
}

TEST(StateDeadband, GrantsWhatIsWithinItsBoundsAndSaysWhatIsNot) {
  const auto objection = [](double share, double floor, Duration silence) {
    return StateDeadband::objection({.share = share, .floor = floor, .max_silence = silence});
  };
  EXPECT_EQ(objection(0.1, 1e-3, milliseconds(20)), "");
  EXPECT_EQ(objection(0, 0, milliseconds(1)), "");
  EXPECT_EQ(objection(0.5, 0.1, milliseconds(20)), "");
  EXPECT_EQ(objection(9, 9, Duration(0)), "");  // off
  EXPECT_EQ(objection(0.51, 0, milliseconds(20)), "share: expected 0 to 0.5");
  EXPECT_EQ(objection(std::nan(""), 0, milliseconds(20)), "share: expected 0 to 0.5");
  EXPECT_EQ(objection(0, -1e-9, milliseconds(20)), "floor_mps: expected 0 to 0.1");
  EXPECT_EQ(objection(0, 0, milliseconds(21)), "max_silence_us: expected 0, or 1000 to 20000");
  EXPECT_EQ(objection(0, 0, Duration(-1)), "max_silence_us: expected 0, or 1000 to 20000");
}

}  // namespace
}  // namespace tendon::deadband_test

// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/position_position.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/core/control/adversary.h"
#include "tests/support/refusal.h"

namespace tendon::position_position_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

PositionPosition<3>::Config config_of(double stiffness = 400, double own_damping = 4) {
  return {.stiffness = stiffness, .damping = 1, .own_damping = own_damping, .period = milliseconds(1)};
}

TEST(PositionPosition, TheForceIsASpringAndTwoDampers) {
  PositionPosition<3> end(config_of());
  end.receive({.sequence = 1, .position = Vec3(0.01, 0, -0.02), .velocity = Vec3(0.1, 0.2, 0)});
  const Vec3 x(0.004, 0.001, 0);
  const Vec3 v(0, 0.1, 0.3);
  const Demand<3> demand = end.command(x, v);
  const Vec3 expected = 400 * (Vec3(0.01, 0, -0.02) - x) + 1 * (Vec3(0.1, 0.2, 0) - v) - 4 * v;
  EXPECT_LT((demand.force - expected).norm(), 1e-12);
  EXPECT_EQ(demand.stiffness, (400 * Mat<3>::Identity()).eval());
}

TEST(PositionPosition, IsStretchedAsFarAsTheAccountPays) {
  EXPECT_EQ(paid_stretch<3>(Vec3(0.03, 0, 0.04), 400, 0.5), Vec3(0.03, 0, 0.04)) << "½ K x² is 0.5 J";
  const Vec3 paid = paid_stretch<3>(Vec3(0.03, 0, 0.04), 400, 0.125);
  EXPECT_LT((paid - Vec3(0.015, 0, 0.02)).norm(), 1e-15);
  EXPECT_EQ(paid_stretch<3>(Vec3(1, 0, 0), 400, -1), Vec3(Vec3::Zero()));
}

TEST(PositionPosition, BeforeTheFirstMessageThereIsOnlyDamping) {
  PositionPosition<3> end(config_of());
  EXPECT_EQ(end.command(Vec3(1, 2, 3), Vec3(0.1, 0, 0)).force, Vec3(-0.4, 0, 0));
}

/// The peer answers at once to the message of `delay` periods ago.
void talk(PositionPosition<3>& end, int delay, int periods) {
  static constexpr int kOffset = 1'000'000;  // the peer uses a different clock
  for (int n = 0; n < periods; ++n) {
    const std::uint64_t now = end.message().sequence + 1;
    const auto then = static_cast<std::int64_t>(now) - delay;
    if (then > 0) {
      end.receive({.sequence = static_cast<std::uint64_t>(then) + kOffset,
                   .answers_epoch = 1,
                   .answers = static_cast<std::uint64_t>(then),
                   .time = milliseconds(then + kOffset)});
    }
    end.command(Vec3::Zero(), Vec3::Zero());
  }
}

TEST(PositionPosition, StiffnessFallsSoonWithTheRoundTripAndRisesLater) {
  PositionPosition<3> end(config_of());
  talk(end, 10, 100);
  EXPECT_EQ(end.round_trip(), milliseconds(10));
  EXPECT_EQ(end.stiffness(), 400) << "2B/T_loop is 800";
  talk(end, 300, 301);
  EXPECT_EQ(end.round_trip(), milliseconds(300));
  EXPECT_LT(end.stiffness(), 200) << "on its way";
  talk(end, 300, 1000);
  EXPECT_NEAR(end.stiffness(), 2 * 4 / 0.3, 3);
  talk(end, 10, 450);
  EXPECT_EQ(end.round_trip(), milliseconds(300));
  EXPECT_NEAR(end.stiffness(), 2 * 4 / 0.3, 0.1);
  talk(end, 10, 1950);
  EXPECT_EQ(end.round_trip(), milliseconds(10));
  EXPECT_NEAR(end.stiffness(), 400, 1);
}

TEST(PositionPosition, StiffnessHasNoStep) {
  PositionPosition<3> end(config_of());
  talk(end, 10, 100);
  double before = end.stiffness();
  for (int n = 0; n < 400; ++n) {
    talk(end, 300, 1);
    ASSERT_LE(std::abs(end.stiffness() - before), 2.1);  // 400 N/m · 1 ms/200 ms
    before = end.stiffness();
  }
}

TEST(PositionPosition, WithoutAdaptingTheStiffnessStays) {
  auto config = config_of(400, 0);
  config.adapt_to_delay = false;
  PositionPosition<3> end(config);
  talk(end, 300, 1000);
  EXPECT_EQ(end.stiffness(), 400);
}

TEST(PositionPosition, BothEndsTakeTheLongerRoundTrip) {
  PositionPosition<3> end(config_of());
  end.command(Vec3::Zero(), Vec3::Zero());
  end.receive(
      {.sequence = 1, .answers_epoch = 1, .answers = 1, .round_trip = milliseconds(100), .position = Vec3(0.01, 0, 0)});
  EXPECT_DOUBLE_EQ(end.command(Vec3::Zero(), Vec3::Zero()).force.x(), 2 * 4 / 0.1 * 0.01);
  EXPECT_EQ(end.message().round_trip, milliseconds(1)) << "what it tells is its own: else neither would ever fall";
}

TEST(PositionPosition, SilenceLowersTheStiffnessAndEndsTheFeedForward) {
  auto config = config_of();
  config.damping = 0;
  PositionPosition<3> end(config);
  end.command(Vec3::Zero(), Vec3::Zero());
  end.receive(
      {.sequence = 1, .answers_epoch = 1, .answers = 1, .position = Vec3(0.01, 0, 0), .velocity = Vec3(0.1, 0, 0)});
  double force = 0;
  for (int n = 0; n < 999; ++n) force = end.command(Vec3::Zero(), Vec3::Zero()).force.x();
  EXPECT_LT(end.stiffness(), 2 * 4 / 0.5);
  EXPECT_GT(end.stiffness(), 2 * 4 / 0.999);
  EXPECT_NEAR(force, end.stiffness() * (0.01 + 0.1 * 0.02), 1e-3) << "20 ms ahead, and no further";
}

TEST(PositionPosition, ALateMessageIsCarriedOnWithItsVelocity) {
  // Steady motion of 0.1 m/s, received with a delay of 5 to 10 ms: y moves as if every delay were 5 ms.
  auto config = config_of(100, 0);
  config.damping = 0;
  config.adapt_to_delay = false;
  PositionPosition<3> end(config);
  Dice dice(4);
  for (int n = 1; n < 2000; ++n) {
    const int sent = n - 5 - static_cast<int>(dice.within(0, 6));
    if (sent > 0) {
      end.receive({.sequence = static_cast<std::uint64_t>(sent),
                   .time = milliseconds(sent),
                   .position = Vec3(1e-4 * sent, 0, 0),
                   .velocity = Vec3(0.1, 0, 0)});
    }
    const double force = end.command(Vec3::Zero(), Vec3::Zero()).force.x();
    if (n > 200) {
      ASSERT_NEAR(force, 100 * 1e-4 * (n - 5), 100 * 1e-4 * 0.1) << n;
    }
  }
}

TEST(PositionPosition, AnEndThatStartsAnewIsHeardAndItsFormerMessagesAreNot) {
  PositionPosition<3> end(config_of());
  talk(end, 300, 400);
  end.receive({.epoch = 2, .sequence = 1, .position = Vec3(0.01, 0, 0)});
  EXPECT_DOUBLE_EQ(end.command(Vec3::Zero(), Vec3::Zero()).force.x(), 4) << "the round trip begins anew, too";
  end.receive({.epoch = 1, .sequence = 5'000'000, .position = Vec3(0.05, 0, 0)});
  EXPECT_DOUBLE_EQ(end.command(Vec3::Zero(), Vec3::Zero()).force.x(), 4);
  // Answers a different epoch of ours, so it does not measure the round trip.
  end.receive({.epoch = 2, .sequence = 2, .answers_epoch = 9, .answers = 1, .position = Vec3(0.02, 0, 0)});
  EXPECT_DOUBLE_EQ(end.command(Vec3::Zero(), Vec3::Zero()).force.x(), 8);
  EXPECT_EQ(end.round_trip(), Duration::zero());
  EXPECT_EQ(end.refused(), 0U);
}

TEST(PositionPosition, ItsForceIsBounded) {
  auto config = config_of();
  config.max_force = 5;
  PositionPosition<3> end(config);
  end.receive({.sequence = 1, .position = Vec3(3, 4, 0)});
  const Vec3 force = end.command(Vec3::Zero(), Vec3::Zero()).force;
  EXPECT_NEAR((force - Vec3(3, 4, 0)).norm(), 0, 1e-12);
}

TEST(PositionPosition, WhatIsWrongOrOldIsPassedOver) {
  PositionPosition<3> end(config_of());
  end.receive({.sequence = 2, .position = Vec3(0.01, 0, 0)});
  end.receive({.sequence = 1, .position = Vec3(0.05, 0, 0)});
  EXPECT_EQ(end.refused(), 0U) << "late is not wrong";
  end.receive({.sequence = 3, .position = Vec3(kNan, 0, 0)});
  end.receive({.sequence = 3, .velocity = Vec3(0, kNan, 0)});
  end.receive({.sequence = 3, .answers_epoch = 1, .answers = 1});  // this number has not been sent yet
  end.receive({.sequence = 3, .round_trip = milliseconds(-1)});
  end.receive({.sequence = 3, .time = std::chrono::hours(1'000'000)});
  end.receive({.epoch = 0, .sequence = 3});
  EXPECT_EQ(end.refused(), 6U);
  EXPECT_DOUBLE_EQ(end.command(Vec3::Zero(), Vec3::Zero()).force.x(), 4);
  EXPECT_FALSE(end.command(Vec3(kNan, 0, 0), Vec3::Zero()).force.allFinite()) << "the limiter turns it to zero";
}

TEST(PositionPosition, RefusesImpossibleConfigurations) {
  expect_refusals(config_of(), Makes<PositionPosition<3>>(),
                  {
                      {"stiffness", [](auto& c) { c.stiffness = 0; }},
                      {"damping", [](auto& c) { c.damping = -1; }},
                      {"own_damping", [](auto& c) { c.own_damping = kNan; }},
                      {"own_damping = 0: expected a number above 0 N·s/m, because adapt_to_delay limits the stiffness "
                       "to 2 B divided by the round-trip time",
                       [](auto& c) { c.own_damping = 0; }},
                      {"period", [](auto& c) { c.period = {}; }},
                      {"recovery", [](auto& c) { c.recovery = {}; }},
                      {"max_force", [](auto& c) { c.max_force = 0; }},
                  });
}

}  // namespace
}  // namespace tendon::position_position_test

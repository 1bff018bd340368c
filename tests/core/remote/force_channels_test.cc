// SPDX-License-Identifier: Apache-2.0
#include "core/remote/force_channels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/haptic_controller.h"

namespace tendon::force_channels_test {
namespace {

using std::chrono::milliseconds;
using enum ChannelRule;

Motion at(Duration t, const Vec3& x = Vec3::Zero()) { return {LocalTime(t), x, Vec3::Zero()}; }

RemoteForce force_at(Duration received, const Vec3& force, std::uint32_t source = 1) {
  RemoteForce remote;
  remote.sequence = 1;
  remote.received = LocalTime(received);
  remote.force = force;
  remote.valid_for = milliseconds(30);
  remote.source = source;
  return remote;
}

ForceChannels channels(std::vector<ChannelRule> rules, Duration ramp_in = Duration::zero()) {
  ForceChannels::Config config;
  config.hold.ramp_in = ramp_in;
  config.rules = std::move(rules);
  return ForceChannels(config);
}

TEST(ForceChannels, ADeviceWithoutAChannelIsRefused) { EXPECT_THROW(channels({}), std::invalid_argument); }

TEST(ForceChannels, TheSumIsThatOfTheFreshForcesAndTheirStiffness) {
  ForceChannels two = channels({kSum, kSum});
  RemoteForce stiff = force_at({}, Vec3(1, 0, 0));
  stiff.model = LocalModel{.at = Vec3::Zero(), .stiffness = 100 * Mat3::Identity()};
  two.observe(0, stiff);
  two.observe(1, force_at({}, Vec3(0, 2, 0)));
  const auto both = two.wanted(at(milliseconds(1), Vec3(0.01, 0, 0)));
  EXPECT_TRUE(both.force.isApprox(Vec3(1 - 100 * 0.01, 2, 0), 1e-12));
  EXPECT_EQ(both.stiffness(0, 0), 100);
  // Only the first engine continues to send. The sum must not contain the old force, and the device must not stop.
  RemoteForce later = stiff;
  later.received = LocalTime(milliseconds(400));
  two.observe(0, later);
  const auto one = two.wanted(at(milliseconds(401)));
  EXPECT_TRUE(one.force.isApprox(Vec3(1, 0, 0), 1e-12));
  EXPECT_EQ(one.mode, Mode::kActive);
  EXPECT_FALSE(one.reasons.has(Reason::kSafeStop));
}

TEST(ForceChannels, ThePriorityOfAFreshForceFadesOverInTheTimeOfTheRamp) {
  ForceChannels two = channels({kPriority, kPriority}, milliseconds(100));
  Duration t{};
  const auto step = [&](bool first_sends) {
    t += milliseconds(1);
    if (first_sends) two.observe(0, force_at(t, Vec3(1, 0, 0)));
    two.observe(1, force_at(t, Vec3(0, 1, 0)));
    return two.wanted(at(t));
  };
  for (int i = 0; i < 200; ++i) step(false);
  EXPECT_TRUE(step(false).force.isApprox(Vec3(0, 1, 0), 1e-9)) << "nobody else is there";
  EXPECT_EQ(step(false).channel, 1U);
  for (int i = 0; i < 200; ++i) step(true);
  EXPECT_TRUE(step(true).force.isApprox(Vec3(1, 0, 0), 1e-9));
  EXPECT_EQ(step(true).channel, 0U);
  Vec3 before = step(true).force;
  for (int i = 0; i < 400; ++i) {  // the first stops sending, and the second returns without a jump
    const Vec3 now = step(false).force;
    EXPECT_LE((now - before).norm(), 0.03) << i;
    before = now;
  }
  EXPECT_TRUE(before.isApprox(Vec3(0, 1, 0), 1e-9));
}

TEST(ForceChannels, TheForceOfAnotherEngineIsRampedInFromWhatIsRendered) {
  ForceChannels one = channels({kSum}, milliseconds(100));
  for (int t = 0; t < 200; ++t) {
    one.observe(0, force_at(milliseconds(t), Vec3(2, 0, 0), 1));
    one.wanted(at(milliseconds(t)));
  }
  Vec3 before = one.wanted(at(milliseconds(200))).force;
  EXPECT_EQ(before.x(), 2);
  one.release(0, 1, LocalTime(milliseconds(200)));
  for (int t = 201; t < 400; ++t) {
    one.observe(0, force_at(milliseconds(t), Vec3(-2, 0, 0), 2));
    const Vec3 now = one.wanted(at(milliseconds(t))).force;
    EXPECT_LE(std::abs(now.x() - before.x()), 0.05) << t;
    before = now;
  }
  EXPECT_EQ(before.x(), -2);
}

TEST(ForceChannels, TheReleaseOfAnEngineThatIsNoLongerHeardChangesNothing) {
  ForceChannels one = channels({kSum});
  one.observe(0, force_at({}, Vec3(2, 0, 0), 2));
  one.release(0, 1, LocalTime(milliseconds(1)));
  EXPECT_EQ(one.wanted(at(milliseconds(2))).mode, Mode::kActive);
}

// Two engines push against each other, one sends NaN, one stops sending, and one is replaced during contact. The force
// must change within the slew limit unless the limiter reduces it, and the ledger must not become negative.
TEST(ForceChannels, NoEngineAndNoHandoverOverdrawsTheLedgerOrJumps) {
  HapticController::Config config;
  config.limiter.law = Law::kAol;
  config.limiter.friction = {.coulomb = 0.1, .viscous = 1};
  config.limiter.longest_hold = milliseconds(1);
  config.max_force = 8;
  config.max_slew = 1000;
  config.channels = {kSum, kPriority, kPriority};
  HapticController controller(config);
  Vec3 applied = Vec3::Zero();
  bool limited = false;
  double most_force = 0;
  for (int t = 0; t < 8000; ++t) {
    const double phase = 2 * 3.14159265358979 * t / 700.0;
    const Motion hand{LocalTime(milliseconds(t)), Vec3(0.02 * std::sin(phase), 0, 0), Vec3::Zero()};
    const double x = hand.position.x();
    controller.observe(force_at(milliseconds(t), Vec3(-4000 * (x - 0.005), 0, 0), 1), 0);
    // This engine pushes against the first one, is replaced every 400 ms during contact, and pauses for a while.
    if (t % 2000 < 1500)
      controller.observe(force_at(milliseconds(t), Vec3(3000 * x, 1, 0), 2 + static_cast<std::uint32_t>(t) / 400), 1);
    if (t % 3 == 0) {
      const double nan = std::numeric_limits<double>::quiet_NaN();
      EXPECT_FALSE(controller.observe(force_at(milliseconds(t), Vec3(nan, 0, 0), 9), 2));
    } else {
      controller.observe(force_at(milliseconds(t), Vec3(-5, 2000 * x, 0), 9), 2);
    }
    const Step step = controller.step(hand, applied);
    ASSERT_GE(step.energy, -1e-9) << t;
    ASSERT_TRUE(step.force.allFinite()) << t;
    if (!step.reasons.has(Reason::kEnergy)) {
      ASSERT_LE((step.force - applied).norm(), 1 + 1e-9) << t;  // max_slew · 1 ms
    }
    limited = limited || step.reasons.has(Reason::kEnergy);
    applied = step.force;
    most_force = std::max(most_force, applied.norm());
  }
  EXPECT_TRUE(limited) << "the case must be one that the limiter has to stop";
  EXPECT_GT(most_force, 1);
}

}  // namespace
}  // namespace tendon::force_channels_test

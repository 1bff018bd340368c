// SPDX-License-Identifier: Apache-2.0
#include "core/remote/held_force.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/refusal.h"

namespace tendon::held_force_test {
namespace {

using std::chrono::milliseconds;

Motion at(Duration t, const Vec3& x = Vec3::Zero()) { return {LocalTime(t), x, Vec3::Zero()}; }

RemoteForce force_at(Duration received, const Vec3& force, Duration valid_for = milliseconds(30)) {
  RemoteForce remote;
  remote.sequence = 1;
  remote.received = LocalTime(received);
  remote.force = force;
  remote.valid_for = valid_for;
  return remote;
}

HeldForce::Config without_ramp() {
  HeldForce::Config config;
  config.ramp_in = Duration::zero();
  return config;
}

TEST(HeldForce, WantsNothingBeforeTheFirstForce) {
  HeldForce held({});
  EXPECT_EQ(held.wanted(at(milliseconds(5))).mode, Mode::kIdle);
  EXPECT_EQ(held.wanted(at(milliseconds(5))).force, Vec3::Zero());
}

TEST(HeldForce, GoesFromValidToHeldToFadingToSafeStop) {
  HeldForce held(without_ramp());
  held.observe(force_at(Duration::zero(), Vec3(2, 0, 0)));
  EXPECT_EQ(held.wanted(at(milliseconds(30))).mode, Mode::kActive);
  EXPECT_EQ(held.wanted(at(milliseconds(30))).force.x(), 2);
  EXPECT_EQ(held.wanted(at(milliseconds(50))).mode, Mode::kHolding);
  EXPECT_EQ(held.wanted(at(milliseconds(50))).force.x(), 2);
  EXPECT_EQ(held.wanted(at(milliseconds(100))).mode, Mode::kDecaying);
  EXPECT_NEAR(held.wanted(at(milliseconds(100))).force.x(), 2 * std::exp(-1.0), 1e-12);
  EXPECT_EQ(held.wanted(at(milliseconds(280))).mode, Mode::kSafeStop);
  EXPECT_EQ(held.wanted(at(milliseconds(280))).force, Vec3::Zero());
}

TEST(HeldForce, AForceThatCameAfterTheSampleWasTakenIsNewAndNotYounger) {
  HeldForce held(without_ramp());
  held.observe(force_at(milliseconds(10), Vec3(2, 0, 0)));
  const auto wanted = held.wanted(at(milliseconds(8)));
  EXPECT_EQ(wanted.age, Duration::zero());
  EXPECT_EQ(wanted.mode, Mode::kActive);
  EXPECT_EQ(wanted.force.x(), 2);
  EXPECT_EQ(held.wanted(at(milliseconds(11))).age, milliseconds(1));
}

TEST(HeldForce, SafeStopIsLeftOnlyByAFreshForceAndThatIsRampedIn) {
  HeldForce held({});
  held.observe(force_at(Duration::zero(), Vec3(2, 0, 0)));
  EXPECT_EQ(held.wanted(at(milliseconds(600))).mode, Mode::kSafeStop);
  EXPECT_EQ(held.wanted(at(milliseconds(5))).mode, Mode::kSafeStop);  // even if the clock steps back
  held.observe(force_at(milliseconds(1000), Vec3(2, 0, 0), milliseconds(400)));
  const auto half = held.wanted(at(milliseconds(1050)));
  EXPECT_EQ(half.mode, Mode::kActive);
  EXPECT_NEAR(half.force.x(), 1, 1e-12);
  EXPECT_TRUE(half.reasons.has(Reason::kRampIn));
  EXPECT_EQ(held.wanted(at(milliseconds(1100))).force.x(), 2);
}

TEST(HeldForce, AFreshForceWhileFadingIsRampedInOverTheShareThatWasLost) {
  HeldForce held({});
  held.observe(force_at(Duration::zero(), Vec3(2, 0, 0)));
  // 100 ms after the hold has ended, e⁻² = 13.5 % is left. The rest returns in 86.5 % of the ramp's 100 ms.
  const double left = held.wanted(at(milliseconds(150))).force.x();
  EXPECT_NEAR(left, 2 * std::exp(-2.0), 1e-12);
  held.observe(force_at(milliseconds(150), Vec3(2, 0, 0), milliseconds(400)));
  const auto first = held.wanted(at(milliseconds(150)));
  EXPECT_EQ(first.mode, Mode::kActive);
  EXPECT_TRUE(first.reasons.has(Reason::kRampIn));
  EXPECT_NEAR(first.force.x(), left, 1e-12);
  EXPECT_NEAR(held.wanted(at(milliseconds(160))).force.x(), left + 2 * 0.1, 1e-6);
  EXPECT_EQ(held.wanted(at(milliseconds(237))).force.x(), 2);
}

TEST(HeldForce, AnEngineThatStuttersNeverKicksTheHand) {
  for (const int silence : {40, 51, 60, 90, 120, 200, 279, 290, 400}) {
    HeldForce held({});
    double before = 0;
    double most = 0;
    Duration next = milliseconds(0);
    for (int ms = 0; ms < 3000; ++ms) {
      if (milliseconds(ms) >= next) {
        held.observe(force_at(milliseconds(ms), Vec3(8, 0, 0)));
        next += milliseconds(silence);
      }
      const double force = held.wanted(at(milliseconds(ms))).force.x();
      most = std::max(most, force - before);
      before = force;
    }
    EXPECT_LE(most, 8 / 100.0 + 1e-6) << "N in a millisecond, silent for " << silence << " ms";
  }
}

TEST(HeldForce, AFreshForceBeforeItFadesIsRenderedAtOnce) {
  HeldForce held(without_ramp());
  held.observe(force_at(Duration::zero(), Vec3(2, 0, 0)));
  ASSERT_EQ(held.wanted(at(milliseconds(45))).mode, Mode::kHolding);
  held.observe(force_at(milliseconds(46), Vec3(3, 0, 0)));
  EXPECT_EQ(held.wanted(at(milliseconds(46))).force.x(), 3);
}

TEST(HeldForce, FollowsTheHandWithTheLocalModel) {
  HeldForce held(without_ramp());
  RemoteForce remote = force_at(Duration::zero(), Vec3(-1, 0, 0));
  remote.model = LocalModel{Vec3(0.01, 0, 0), Vec3(100, 0, 0).asDiagonal()};
  held.observe(remote);
  // The position is 10 mm deeper than in the model. If the stiffness is 100 N/m, this is an additional 1 N along −x.
  EXPECT_NEAR((held.wanted(at(milliseconds(1), Vec3(0.02, 0.5, 0))).force - Vec3(-2, 0, 0)).norm(), 0, 1e-12);
}

RemoteForce spring_at(Duration answers, Duration received, double x, double stiffness) {
  RemoteForce remote = force_at(received, Vec3(-stiffness * x, 0, 0), milliseconds(400));
  remote.answers = LocalTime(answers);
  remote.model = LocalModel{Vec3(x, 0, 0), Mat3(Vec3(stiffness, 0, 0).asDiagonal())};
  return remote;
}

RemoteForce on_a_table(Duration received) {
  RemoteForce remote = force_at(received, Vec3(-1, 0, 0));
  remote.model = LocalModel{Vec3(0.01, 0, 0), Vec3(100, 0, 0).asDiagonal()};
  remote.model->contact = Contact{.normal = -Vec3::UnitX(),
                                  .gap = -0.01,
                                  .table = ForceTable{.first = -0.01, .step = 0.01, .size = 3, .force = {0, 1, 4}}};
  return remote;
}

TEST(HeldForce, FollowsTheHandAlongTheEnginesTable) {
  HeldForce held(without_ramp());
  ASSERT_TRUE(held.observe(on_a_table(Duration::zero())));
  EXPECT_NEAR(held.wanted(at(milliseconds(1), Vec3(0.015, 0, 0))).force.x(), -2.5, 1e-12);
  EXPECT_NEAR(held.wanted(at(milliseconds(1), Vec3(0.015, 0, 0))).stiffness(0, 0), 300, 1e-9);
  EXPECT_NEAR(held.wanted(at(milliseconds(1), Vec3(-0.005, 0, 0))).force.x(), 0, 1e-12);
}

TEST(HeldForce, OfABodyThatHasBeenCutTheForceAloneIsHeld) {
  HeldForce held(without_ramp());
  held.observe(on_a_table(Duration::zero()));
  RemoteForce cut = on_a_table(milliseconds(5));
  cut.topology_changed = true;
  ASSERT_TRUE(held.observe(cut));
  EXPECT_EQ(held.wanted(at(milliseconds(6), Vec3(0.02, 0, 0))).force, cut.force);
  EXPECT_EQ(held.wanted(at(milliseconds(6), Vec3(0.02, 0, 0))).stiffness, Mat3::Zero());
  held.observe(on_a_table(milliseconds(10)));
  EXPECT_NEAR(held.wanted(at(milliseconds(11), Vec3(0.02, 0, 0))).force.x(), -4, 1e-12);
}

TEST(HeldForce, BlendsNoModelOfABodyThatHasBeenCut) {
  HeldForce::Config config = without_ramp();
  config.adaptive_local_model.emplace();
  HeldForce held(config);
  RemoteForce cut = on_a_table(Duration::zero());
  cut.topology_changed = true;
  held.observe(cut);
  EXPECT_EQ(held.wanted(at(milliseconds(1), Vec3(0.02, 0, 0))).force, cut.force);
}

TEST(HeldForce, StiffnessAndTableAreFollowedUpToTheStiffestBelieved) {
  HeldForce::Config config = without_ramp();
  config.max_stiffness = 50;
  HeldForce held(config);
  held.observe(on_a_table(Duration::zero()));
  EXPECT_NEAR(held.wanted(at(milliseconds(1), Vec3(0.02, 0, 0))).force.x(), -1.5, 1e-12);
  RemoteForce spring = force_at(milliseconds(2), Vec3(-1, 0, 0));
  spring.model = LocalModel{Vec3(0.01, 0, 0), Vec3(100, -100, 0).asDiagonal()};
  held.observe(spring);
  EXPECT_NEAR((held.wanted(at(milliseconds(3), Vec3(0.02, 1, 0))).force - Vec3(-1.5, 0, 0)).norm(), 0, 1e-9);
}

TEST(HeldForce, TellsTheLimiterHowStiffTheEnvironmentIsAndFadesThatToo) {
  HeldForce held(without_ramp());
  held.observe(force_at(Duration::zero(), Vec3(-1, 0, 0)));
  EXPECT_EQ(held.wanted(at(milliseconds(1))).stiffness, Mat3::Zero());
  held.observe(spring_at(Duration::zero(), Duration::zero(), 0.001, 800));
  EXPECT_EQ(held.wanted(at(milliseconds(1))).stiffness(0, 0), 800);
  const HeldForce::Wanted fading = held.wanted(at(milliseconds(470)));
  EXPECT_EQ(fading.mode, Mode::kDecaying);
  EXPECT_NEAR(fading.stiffness(0, 0), 800 * std::exp(-1.0), 1e-9);
}

TEST(HeldForce, BlendsInANewStiffnessExceptTheFirstAfterASafeStop) {
  HeldForce::Config config = without_ramp();
  config.adaptive_local_model.emplace();
  HeldForce held(config);
  const Vec3 hand(0.01, 0, 0);
  held.observe(spring_at(Duration::zero(), milliseconds(5), 0, 100));
  EXPECT_DOUBLE_EQ(held.wanted(at(milliseconds(5), hand)).force.x(), -1);
  held.observe(spring_at(milliseconds(40), milliseconds(45), 0, 300));
  EXPECT_DOUBLE_EQ(held.wanted(at(milliseconds(45), hand)).force.x(), -1);
  EXPECT_DOUBLE_EQ(held.wanted(at(milliseconds(65), hand)).force.x(), -2);
  EXPECT_DOUBLE_EQ(held.wanted(at(milliseconds(85), hand)).force.x(), -3);
  EXPECT_EQ(held.wanted(at(std::chrono::seconds(2), hand)).mode, Mode::kSafeStop);
  held.observe(spring_at(milliseconds(2040), milliseconds(2045), 0, 500));
  EXPECT_DOUBLE_EQ(held.wanted(at(milliseconds(2045), hand)).force.x(), -5);
}

TEST(HeldForce, TheEstimatorFollowsASlowEnginesSpringAtTheLoopsRate) {
  const auto error = [](bool estimate) {
    HeldForce::Config config = without_ramp();
    if (estimate) config.output_estimator.emplace();
    HeldForce held(config);
    double square = 0;
    for (int n = 0; n < 4000; ++n) {  // 25 Hz, delay of 40 ms
      const auto position = [](int step) { return 0.01 * std::sin(0.006 * step); };
      if (n >= 40 && n % 40 == 0) {
        RemoteForce remote = force_at(milliseconds(n), Vec3(-700 * position(n - 40), 0, 0), milliseconds(100));
        remote.answers = LocalTime(milliseconds(n - 40));
        held.observe(remote);
      }
      const double wanted = held.wanted(at(milliseconds(n), Vec3(position(n), 0, 0))).force.x();
      if (n >= 1000) square += std::pow(wanted + 700 * position(n), 2) / 3000;
    }
    return std::sqrt(square);
  };
  EXPECT_GT(error(false), 1);
  EXPECT_LT(error(true), 0.02);
}

TEST(HeldForce, RefusesWhatIsNotSoundAndAgesTheForceBefore) {
  HeldForce held(without_ramp());
  held.observe(force_at(Duration::zero(), Vec3(2, 0, 0)));
  EXPECT_FALSE(held.observe(force_at(milliseconds(20), Vec3(std::nan(""), 0, 0))));
  RemoteForce bad_model = force_at(milliseconds(20), Vec3(1, 0, 0));
  bad_model.model = LocalModel{Vec3::Zero(), Mat3::Constant(std::numeric_limits<double>::infinity())};
  EXPECT_FALSE(held.observe(bad_model));
  RemoteForce bad_table = on_a_table(milliseconds(20));
  bad_table.model->contact->table->force[1] = std::nan("");
  EXPECT_FALSE(held.observe(bad_table));
  EXPECT_EQ(held.wanted(at(milliseconds(40))).mode, Mode::kHolding);
  EXPECT_EQ(held.wanted(at(milliseconds(40))).force.x(), 2);
}

TEST(HeldForce, NoEngineIsBelievedForLongerThanTheLimit) {
  HeldForce held(without_ramp());
  held.observe(force_at(Duration::zero(), Vec3(2, 0, 0), std::chrono::hours(1)));
  EXPECT_EQ(held.wanted(at(milliseconds(501))).mode, Mode::kHolding);
}

TEST(HeldForce, ReleaseEndsValidityAtOnce) {
  HeldForce held(without_ramp());
  held.observe(force_at(Duration::zero(), Vec3(2, 0, 0), milliseconds(400)));
  held.release(0, LocalTime(milliseconds(10)));
  EXPECT_EQ(held.wanted(at(milliseconds(11))).mode, Mode::kHolding);
  EXPECT_EQ(held.wanted(at(milliseconds(100))).mode, Mode::kDecaying);
}

TEST(HeldForce, RefusesWhatCannotBeMeant) {
  expect_refusals(HeldForce::Config(), Makes<HeldForce>(),
                  {
                      {"safe_stop = 0.01", [](auto& c) { c.safe_stop = milliseconds(10); }},
                      {"decay = 0", [](auto& c) { c.decay = Duration::zero(); }},
                      {"max_stiffness = 0", [](auto& c) { c.max_stiffness = 0; }},
                      {"adaptive_local_model",
                       [](auto& c) {
                         c.adaptive_local_model.emplace();
                         c.output_estimator.emplace();
                       }},
                  });
}

}  // namespace
}  // namespace tendon::held_force_test

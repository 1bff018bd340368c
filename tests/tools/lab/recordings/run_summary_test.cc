// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/run_summary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/rotation.h"
#include "protocol/wire/codec.h"
#include "tests/tools/lab/experiments/steps.h"

namespace tendon::lab::run_summary_test {
namespace {

using namespace std::chrono_literals;
using testing::spring_run;
using testing::step_at;
using testing::toy_run;

std::vector<StepRecord> with_energies(const std::vector<double>& energies) {
  std::vector<StepRecord> run;
  for (const double energy : energies) {
    run.push_back(step_at(run.size()));
    run.back().energy = energy;
  }
  return run;
}

TEST(RunSummary, EnergyGivenOutIsHowFarTheLedgerEverWasBelowZero) {
  const RunSummary run = summarise(with_energies({0, 0.2, -0.3, 0.1, -0.1}));
  EXPECT_DOUBLE_EQ(run.energy_given_out, 0.3);
  EXPECT_DOUBLE_EQ(run.least_energy, -0.3);
  EXPECT_FALSE(run.passive());
}

TEST(RunSummary, ALedgerThatNeverWasBelowZeroGaveNothingOut) {
  const RunSummary run = summarise(with_energies({0, 0.2, 0.1}));
  EXPECT_EQ(run.energy_given_out, 0);
  EXPECT_EQ(run.least_energy, 0);
  EXPECT_TRUE(run.passive());
}

TEST(RunSummary, WhatAHoldBeyondTheBoundDrewIsGivenOutAndToldApart) {
  for (const bool knows_its_bound : {false, true}) {
    auto steps = with_energies({0, 0.1, -0.5, -0.4, -0.2, 0.3});
    steps[2].reasons = Reason::kOverrun;
    if (knows_its_bound) {
      for (StepRecord& step : steps) {
        step.held = std::chrono::microseconds(1000);
        step.longest_hold = std::chrono::microseconds(2000);
      }
      steps[2].held = std::chrono::microseconds(2230);
      steps[2].longest_hold = std::chrono::microseconds(2788);
    }
    const RunSummary run = summarise(steps);
    EXPECT_DOUBLE_EQ(run.energy_given_out, 0.5);
    EXPECT_FALSE(run.passive()) << "it was below −1 nJ, whatever the reason";
    EXPECT_TRUE(run.kept_its_promise());
    EXPECT_EQ(run.holds_beyond_bound, 1U);
    EXPECT_EQ(run.least_energy, 0);
    EXPECT_EQ(run.overruns, 1U);
  }
}

TEST(RunSummary, AnOverrunWithinTheBoundInForceExcusesNothing) {
  auto steps = with_energies({0, 0.1, -0.5, 0.3});
  for (StepRecord& step : steps) step.longest_hold = std::chrono::microseconds(2788);
  steps[2].held = std::chrono::microseconds(2500);
  steps[2].reasons = Reason::kOverrun;
  const RunSummary run = summarise(steps);
  EXPECT_FALSE(run.kept_its_promise());
  EXPECT_EQ(run.holds_beyond_bound, 0U);
}

TEST(RunSummary, AnOverrunExcusesWhatItDrewItselfUntilTheLedgerHasRecovered) {
  struct Case {
    std::vector<double> energies;
    std::size_t overrun;
    double least;
  };
  for (const auto& [energies, overrun, least] :
       {Case{{0, -0.5, -0.4, -0.7}, 1, -0.2}, Case{{0, -1, -1.1, -1.2}, 2, -1.1},
        Case{{0, -0.5, 0.1, -0.2}, 1, -0.2}}) {
    auto steps = with_energies(energies);
    steps[overrun].reasons = Reason::kOverrun;
    EXPECT_NEAR(summarise(steps).least_energy, least, 1e-15) << least;
  }
}

TEST(RunSummary, WhatTorquesDoToTheHandIsToldByItself) {
  std::vector<StepRecord> steps;
  double angle = 0;
  const auto turn_on = [&](double by, double torque, Reasons reasons = {}) {
    steps.push_back(step_at(steps.size()));
    steps.back().reasons = reasons;
    TurnStep& turn = steps.back().handle.emplace().turn.emplace();
    if (!reasons.has(Reason::kUnseen)) angle += by;
    turn.hand.orientation = rotation_by(Vec3(0, 0, angle));
    turn.was_applied = Vec3(7, 7, torque);
  };
  turn_on(1.0, 0.5);  // the motion before the first step is unknown
  turn_on(0.1, 0.2);
  turn_on(0.2, 0.3);
  turn_on(0, 9, Reason::kUnseen);
  turn_on(-0.1, 0.5);
  EXPECT_NEAR(summarise(steps).torque_work.value(), 0.08, 1e-12);
  EXPECT_FALSE(summarise(with_energies({0, 1})).torque_work);
}

TEST(RunSummary, SharesAreOfAllStepsAndFactsAboutAStepAreNoLimits) {
  auto steps = with_energies(std::vector<double>(10, 0.0));
  steps[1].reasons = Reason::kEnergy;
  steps[2].reasons = Reason::kEnergy;
  steps[2].reasons |= Reason::kSlew;
  steps[3].reasons = Reason::kOverrun;
  steps[4].reasons = Reason::kWatchdog;
  const RunSummary run = summarise(steps);
  EXPECT_DOUBLE_EQ(run.share_limited(), 0.2);
  EXPECT_DOUBLE_EQ(run.share_limited(Reason::kEnergy), 0.2);
  EXPECT_DOUBLE_EQ(run.share_limited(Reason::kSlew), 0.1);
  EXPECT_DOUBLE_EQ(run.share_limited(Reason::kHeld), 0);
  EXPECT_EQ(run.watchdogs, 1U);
}

TEST(RunSummary, SharesAreOfTheTimeFromTheFirstFreshForceToTheLast) {
  auto steps = with_energies(std::vector<double>(10, 0.0));
  for (const std::size_t n : {0U, 1U, 2U, 8U, 9U}) {
    steps[n].mode = n < 3 ? Mode::kIdle : Mode::kSafeStop;
    steps[n].reasons = Reason::kSafeStop;
  }
  steps[4].mode = Mode::kSafeStop;
  steps[4].reasons = Reason::kSafeStop;
  for (const std::size_t n : {4U, 5U, 9U}) steps[n].wanted = Vec3(3, 0, 4);
  steps[5].applied = Vec3(3, 0, 2);
  steps[5].reasons = Reason::kDamped;
  const RunSummary run = summarise(steps);
  EXPECT_EQ(run.served_steps, 5U);
  EXPECT_DOUBLE_EQ(run.share_limited(), 0.4);
  EXPECT_DOUBLE_EQ(run.share_limited(Reason::kSafeStop), 0.2);
  ASSERT_TRUE(run.difference);
  EXPECT_DOUBLE_EQ(run.difference->p50, 2);
  EXPECT_DOUBLE_EQ(run.difference->p95, 5);
}

TEST(RunSummary, ARunWithoutAFreshForceHasNoShare) {
  auto steps = with_energies(std::vector<double>(10, 0.0));
  for (StepRecord& step : steps) {
    step.mode = Mode::kSafeStop;
    step.reasons = Reason::kSafeStop;
  }
  const RunSummary run = summarise(steps);
  EXPECT_EQ(run.served_steps, 0U);
  EXPECT_EQ(run.share_limited(), 0);
  EXPECT_FALSE(run.difference);
}

TEST(RunSummary, SaysForHowLongOverrunsMadeTheLimiterMoreCareful) {
  auto steps = with_energies(std::vector<double>(10, 0.0));
  for (std::size_t n = 0; n < steps.size(); ++n)
    steps[n].longest_hold = std::chrono::microseconds(n < 3 ? 2000 : n < 7 ? 8000 - static_cast<int>(n) : 2000);
  EXPECT_DOUBLE_EQ(summarise(steps).share_careful, 0.4);
  for (StepRecord& step : steps) step.longest_hold = {};  // old recordings do not contain this field
  EXPECT_EQ(summarise(steps).share_careful, 0);
}

TEST(RunSummary, TheGripperHasAnAccountOfItsOwn) {
  auto steps = with_energies({0, 0.2, 0.3});
  EXPECT_FALSE(summarise(steps).grip_energy_given_out);
  for (StepRecord& step : steps) step.handle.emplace().grip.emplace();
  steps[1].grip()->energy = -0.25;
  const RunSummary run = summarise(steps);
  EXPECT_DOUBLE_EQ(run.grip_energy_given_out.value_or(0), 0.25);
  EXPECT_EQ(run.energy_given_out, 0);
  EXPECT_FALSE(run.passive());
  EXPECT_FALSE(run.kept_its_promise());
}

TEST(RunSummary, ASpringIsFeltAsStiffAsItIs) {
  const RunSummary run = summarise(spring_run(2000, 700, 0.002, 0));
  ASSERT_TRUE(run.contact && run.contact->above);
  EXPECT_NEAR(*run.contact->above, 0.002, 1e-9);
  EXPECT_FALSE(run.contact->below);
  EXPECT_TRUE(run.stable);
  EXPECT_NEAR(run.operational_stiffness.value_or(0), 700, 0.03 * 700);
}

TEST(RunSummary, TheWallIsWhereItIsHoweverLateItsForcesCome) {
  for (const std::uint64_t delay : {0U, 40U, 100U}) {
    const RunSummary run = summarise(spring_run(4000, 700, 0.002, delay));
    ASSERT_TRUE(run.contact && run.contact->above);
    EXPECT_NEAR(*run.contact->above, 0.002, 1e-9) << delay;
  }
}

TEST(RunSummary, AWallThatIsNoSpringBeginsBetweenNoForceAndForce) {
  auto steps = spring_run(2000, 700, 0.002, 0);
  for (StepRecord& step : steps)
    if (step.wanted.x() < 0) step.wanted.x() = -5;
  const RunSummary run = summarise(steps);
  ASSERT_TRUE(run.contact && run.contact->above);
  EXPECT_NEAR(*run.contact->above, 0.002, 6.3e-4);  // tolerance: motion of the hand between two forces
}

TEST(RunSummary, AWallThatPushesUpTheAxisIsFeltTheSame) {
  auto steps = spring_run(2000, 700, 0.002, 0);
  for (StepRecord& step : steps) {
    step.hand.position *= -1;
    step.wanted *= -1;
    step.applied *= -1;
  }
  const RunSummary run = summarise(steps);
  ASSERT_TRUE(run.contact && run.contact->below);
  EXPECT_FALSE(run.contact->above);
  EXPECT_NEAR(run.operational_stiffness.value_or(0), 700, 0.03 * 700);
}

TEST(RunSummary, ASpringToACentrePushesOnBothSidesOfIt) {
  auto steps = spring_run(2000, 700, -1, 0);
  for (StepRecord& step : steps) {
    step.wanted.x() = step.applied.x() = -700 * step.hand.position.x();
    step.stiffness(0, 0) = 700;
  }
  EXPECT_NEAR(summarise(steps).operational_stiffness.value_or(0), 700, 0.03 * 700);
}

TEST(RunSummary, ForcesOfBothSignsAtTheSamePlacesAreNoContact) {
  auto steps = spring_run(2000, 700, 0, 0);
  for (StepRecord& step : steps) step.wanted.x() = step.tick % 20 < 10 ? 3 : -3;
  const RunSummary run = summarise(steps);
  EXPECT_FALSE(run.contact);
  EXPECT_FALSE(run.operational_stiffness);
}

TEST(RunSummary, StiffnessIsWhatWasAppliedNotWhatWasWanted) {
  auto steps = spring_run(2000, 2000, 0.002, 0);
  for (StepRecord& step : steps) step.applied = step.wanted / 4;
  EXPECT_NEAR(summarise(steps).operational_stiffness.value_or(0), 500, 0.03 * 500);
}

TEST(RunSummary, AHandThatIsNotTouchedByAForceHasNoContact) {
  const RunSummary run = summarise(spring_run(2000, 700, 1, 0));
  EXPECT_FALSE(run.contact);
  EXPECT_FALSE(run.operational_stiffness);
}

TEST(RunSummary, TheMainAxisIsTheOneAlongWhichTheHandMoves) {
  auto steps = spring_run(1000, 700, 0, 0);
  for (StepRecord& step : steps) step.hand.position = Vec3(1, -2, 0.001) + Vec3(0, -2, 2) * step.hand.position.x();
  const Vec3 axis = summarise(steps).axis;
  EXPECT_NEAR(std::abs(axis.dot(Vec3(0, -1, 1).normalized())), 1, 1e-9);
  EXPECT_GT(axis.cwiseAbs().maxCoeff(), 0.7);
}

TEST(RunSummary, AnAxisNearlyThatOfTheDeviceIsThatOfTheDevice) {
  auto steps = spring_run(1000, 700, 0, 0);
  for (StepRecord& step : steps) step.hand.position.y() = 0.05 * step.hand.position.x();
  EXPECT_EQ(summarise(steps).axis, Vec3(Vec3::UnitX()));
}

TEST(RunSummary, ARunIsNotStableWhenItIsBothActiveAndFasterThanAHandChooses) {
  const auto run = [](double frequency, double energy) {
    auto steps = spring_run(4000, 700, 0, 0, 0.01, frequency);
    for (StepRecord& step : steps) step.energy = energy;
    return summarise(steps).stable;
  };
  EXPECT_FALSE(run(6, -1));
  EXPECT_TRUE(run(6, 1));   // fast tapping on a passive wall
  EXPECT_TRUE(run(1, -1));  // an active wall held by a strong hand
  EXPECT_FALSE(run(3.3, -1));
  EXPECT_TRUE(run(2.7, -1));
}

TEST(RunSummary, LoopAgeIsTakenOncePerForceWhenItIsFirstUsed) {
  std::vector<StepRecord> steps;
  for (std::uint64_t n = 0; n < 1000; ++n) {
    steps.push_back(step_at(n));
    steps.back().force_sequence = n / 10 + 1;                  // 100 forces, 10 steps each
    const auto first = static_cast<std::int64_t>(n / 10 + 1);  // 1, 2, … 100 ms
    steps.back().loop_age = std::chrono::milliseconds(first + static_cast<std::int64_t>(n % 10));
  }
  const RunSummary run = summarise(steps);
  ASSERT_TRUE(run.loop_age);
  EXPECT_EQ(run.loop_age->p50, 50ms);
  EXPECT_EQ(run.loop_age->p99, 99ms);
  EXPECT_EQ(run.forces, 100U);
  EXPECT_DOUBLE_EQ(run.forces_per_s.value_or(0), 100);
}

TEST(RunSummary, ARunWithoutForcesHasNoLoopAgeAndNoRate) {
  const RunSummary run = summarise(with_energies({0, 0}));
  EXPECT_FALSE(run.loop_age);
  EXPECT_FALSE(run.forces_per_s);
  EXPECT_FALSE(run.round_trip);
}

DatagramRecord sent_at(LocalTime at, std::uint64_t number) {
  DatagramRecord datagram;
  datagram.at = at;
  datagram.direction = DatagramRecord::Direction::kOut;
  DataWriter writer;
  writer.begin(datagram.bytes, {.connection_id = 1, .packet_number = number}, at, std::nullopt);
  datagram.size = static_cast<std::uint32_t>(writer.size());
  return datagram;
}

/// Received at 145 ms. The peer received our datagram of `sent` at 7000.0 ms and answers at 7002.5 ms of its clock.
DatagramRecord force_of(std::uint64_t sequence, PeerTime sent, std::uint64_t number = 0) {
  DatagramRecord datagram;
  datagram.at = testing::at_ms(145);
  DataWriter writer;
  // Written with the peer's clock as local time.
  writer.begin(datagram.bytes, {.connection_id = 1}, LocalTime(7002500us),
               OutgoingEcho{.sent = sent, .received = LocalTime(7000ms), .packet_number = number, .received_mask = 0});
  EXPECT_TRUE(writer.add(
      ForceCommand{.sequence = sequence, .based_on_tick = 1, .force = Vec3(1, 0, 0), .model = {}, .valid_for = 50ms}));
  datagram.size = static_cast<std::uint32_t>(writer.size());
  return datagram;
}

TEST(RunSummary, TheRoundTripIsWhatTheEchoesOfTheControllerSay) {
  const DatagramRecord datagram = force_of(1, PeerTime(100ms));
  RunObserver observer;
  observer.observe(sent_at(testing::at_ms(100), 0));
  observer.observe(datagram);
  DatagramRecord garbage = datagram;
  garbage.bytes.fill(std::byte{0x54});
  observer.observe(garbage);
  const auto round_trip = observer.summary().round_trip;
  ASSERT_TRUE(round_trip);
  EXPECT_EQ(round_trip->p50, 42500us);
  EXPECT_EQ(round_trip->p99, 42500us);
}

TEST(RunSummary, AnEchoThatTheServerRefusedIsNoRoundTrip) {
  RunObserver observer;
  observer.observe(sent_at(testing::at_ms(100), 0));
  observer.observe(force_of(1, PeerTime(-66'965'755'690ms)));  // before the session began
  observer.observe(force_of(2, PeerTime(146ms)));              // in the future
  observer.observe(force_of(3, PeerTime(100ms), 7));           // the datagram has not been sent yet
  EXPECT_FALSE(observer.summary().round_trip);
}

TEST(RunSummary, OfSeveralDevicesTheRoundTripIsThatOfTheOwnForces) {
  for (const bool step_first : {false, true}) {
    RunObserver mine(true);
    RunObserver other(true);
    StepRecord step = step_at(0);
    step.hand.at = testing::at_ms(146);
    step.force_sequence = 5;
    step.force_age = 1ms;
    StepRecord other_step = step;
    other_step.force_sequence = 6;
    for (auto [observer, used] : {std::pair(&mine, &step), std::pair(&other, &other_step)}) {
      if (step_first) observer->observe(*used);
      observer->observe(sent_at(testing::at_ms(100), 0));
      observer->observe(force_of(5, PeerTime(100ms)));
      if (!step_first) observer->observe(*used);
    }
    EXPECT_TRUE(mine.summary().round_trip);
    EXPECT_FALSE(other.summary().round_trip);
  }
}

TEST(RunSummary, AStepWithoutAPositionSaysNothingAboutMotion) {
  auto steps = spring_run(1000, 700, 0.002, 0);
  const RunSummary before = summarise(steps);
  for (const std::size_t n : {250U, 251U, 700U}) {
    steps[n].reasons |= Reason::kUnseen;
    steps[n].hand.position = Vec3(0, 9, 0);
    steps[n].hand.velocity = Vec3(0, 9, 0);
  }
  const RunSummary after = summarise(steps);
  EXPECT_EQ(after.peak_speed, before.peak_speed);
  EXPECT_EQ(after.axis, before.axis);
  EXPECT_DOUBLE_EQ(after.share_limited(Reason::kUnseen), 0.003);
}

TEST(RunSummary, SpanIntervalAndPeaksAreThoseOfTheSteps) {
  auto steps = with_energies(std::vector<double>(101, 0.0));
  steps[7].held = 12ms;
  steps[8].hand.velocity = Vec3(0.3, 0, -0.4);
  steps[9].applied = Vec3(0, 3, 4);
  steps[9].wanted = Vec3(0, 30, 40);
  const RunSummary run = summarise(steps);
  EXPECT_EQ(run.steps, 101U);
  EXPECT_EQ(run.span, 100ms);
  EXPECT_EQ(run.longest_interval, 12ms);
  EXPECT_DOUBLE_EQ(run.peak_speed, 0.5);
  EXPECT_DOUBLE_EQ(run.peak_force, 5);
  EXPECT_FALSE(run.limiter_on);
}

TEST(RunSummary, ThePromiseIsKeptByTheRealLawAndBrokenWithoutALimiter) {
  const RunSummary on = summarise(toy_run(Law::kAol, 6000));
  EXPECT_TRUE(on.passive());
  EXPECT_TRUE(on.limiter_on);
  EXPECT_TRUE(on.stable);
  EXPECT_GT(on.share_limited(Reason::kEnergy), 0.05);
  const RunSummary off = summarise(toy_run(Law::kNone, 6000));
  EXPECT_GT(off.energy_given_out, 0.1);
  EXPECT_FALSE(off.passive());
  EXPECT_FALSE(off.limiter_on);
  EXPECT_FALSE(off.stable);
}

TEST(Percentile, IsTheLeastSampleThatEnoughDoNotExceed) {
  EXPECT_EQ(percentile<int>({}, 0.5), std::nullopt);
  EXPECT_EQ(percentile<int>({3}, 0.99), 3);
  EXPECT_EQ(percentile<int>({4, 1, 3, 2}, 0.5), 2);
  EXPECT_EQ(percentile<int>({4, 1, 3, 2}, 0.51), 3);
  EXPECT_EQ(percentile<int>({4, 1, 3, 2}, 1), 4);
}

TEST(Thinned, KeepsAllThatFitsAndThenEvenlySpacedOnes) {
  Thinned<int> samples(4);
  for (int i = 0; i < 4; ++i) samples.observe(i);
  EXPECT_EQ(samples.kept(), (std::vector{0, 1, 2, 3}));
  for (int i = 4; i < 16; ++i) samples.observe(i);
  EXPECT_EQ(samples.kept(), (std::vector{0, 4, 8, 12}));
  EXPECT_EQ(samples.seen(), 16U);
}

}  // namespace
}  // namespace tendon::lab::run_summary_test

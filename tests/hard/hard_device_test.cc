// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "devices/simulated/simulated_device.h"
#include "tests/hard/loop_case.h"
#include "tests/hard/row.h"
#include "tests/support/dice.h"
#include "tests/tools/worlds/adversary.h"

namespace tendon::hard::hard_device_test {
namespace {

/// Presses 12 mm deep until `since`, alternates between `shallow` and `deep` for `then`, and rests at 12 mm.
ScriptedMotion press(Case& set, Duration since, Duration then, double shallow, double deep) {
  ScriptedMotion::MinimumJerk reach;
  reach.back_and_forth = false;
  reach.points = {Vec3(-0.01 * set.into), Vec3(0.012 * set.into), Vec3(0.012 * set.into)};
  reach.durations = {milliseconds(800), since - milliseconds(800)};
  constexpr int kWays = 6;
  for (int i = 1; i < kWays; ++i) {
    reach.points.emplace_back((i % 2 == 1 ? shallow : deep) * set.into);
    reach.durations.emplace_back(then / kWays);
  }
  reach.points.emplace_back(0.012 * set.into);
  reach.durations.emplace_back(then / kWays);
  return ScriptedMotion(std::move(reach));
}

Observed estimator_blow_up(std::uint64_t seed, bool bounds, bool limiter) {
  Case set(seed);
  set.engine.rate_hz = 25;
  set.world.weather = Case::weather("delay=uniform(10ms,30ms)", "delay=uniform(10ms,30ms)");
  OutputEstimator::Config& estimator = set.control().hold.output_estimator.emplace();
  estimator.model = OutputEstimator::Model::kOutputError;
  if (!bounds) estimator.max_stiffness = estimator.max_force = 1e9;
  if (!limiter) set.let_all_through();
  // For two seconds, the environment does not fit any of the model structures. After that, it is the wall.
  set.physics = [wall = set.physics, n = set.into, dice = Dice(seed)](const DeviceState& hand) mutable -> Touch {
    if (hand.tick < 1000 || hand.tick > 3200) return wall(hand);
    return Vec3((dice.within(-8000, 8000) * hand.position.dot(n) + dice.within(-20, 20)) * n + dice.direction());
  };
  Bench bench(set);
  bench.expect_of_steps([&bench](const StepRecord& step) {
    bench.note(step.wanted.norm());
    return std::string();
  });
  bench.run(milliseconds(3200));
  bench.disturbance_is_over();
  bench.run(seconds(4));
  const double most = std::sqrt(3.0) * OutputEstimator::Config{}.max_force;
  if (!(bench.seen().figure <= most * (1 + 1e-9))) bench.blame(text_of(bench.seen().figure, "N wanted"));
  return bench.seen();
}

// Oracle: passive, bounded, quiet, and the requested force is at most 30 N on an axis, while the estimator learns from
// an environment whose stiffness and damping change every 40 ms.
TEST(HardLoop, AnEstimatorThatLearnsNonsenseDoesNotBlowUp) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return estimator_blow_up(seed, true, true); });
  report({.hard = "a model fitted to 25 Hz noise is often unstable at 1 kHz",
          .oracle = "the bounds; wanted ≤ 30 N per axis; quiet after 1 s",
          .result = result_of(seen) + ", wanted ≤ " + text_of(seen.figure, "N"),
          .margin = margin_of(seen, kWithin),
          .without = without("bounds of the estimator off", kWithin,
                             [](std::uint64_t seed) { return estimator_blow_up(seed, false, true); }) +
                     "; " + without("AOL off", kWithin, [](std::uint64_t seed) {
                       return estimator_blow_up(seed, true, false);
                     })});
}

Observed wind_up(std::uint64_t seed, double prior_variance) {
  constexpr double kMostError = 1;  // N
  Case set(seed);
  // The grip is stiff and has no static friction, so the noise moves the hand by micrometers.
  set.device.hand->stiffness = 20'000;
  set.device.hand->damping = 50;
  set.device.coulomb_friction.reset();
  set.control().limiter.friction.coulomb = set.port.friction.coulomb = 0;
  set.engine.rate_hz = 25;
  set.device.hand->motion = press(set, seconds(30), milliseconds(480), 0.006, 0.016);
  OutputEstimator::Config& estimator = set.control().hold.output_estimator.emplace();
  estimator.prior_variance = prior_variance;
  set.physics = [wall = set.physics, n = set.into, dice = Dice(seed)](const DeviceState& hand) mutable -> Touch {
    return Vec3(wall(hand).force + dice.within(-0.05, 0.05) * n);
  };
  const Vec3 n = set.into;
  const double k = set.stiffness;
  Bench bench(set);
  bench.run(seconds(29));
  bench.expect_of_steps([&bench, n, k](const StepRecord& step) {
    bench.note((step.wanted + k * std::max(0.0, step.hand.position.dot(n)) * n).norm());
    return std::string();
  });
  bench.run(seconds(3));
  bench.disturbance_is_over();
  bench.run(seconds(2));
  if (bench.seen().figure > kMostError) bench.blame(text_of(bench.seen().figure, "N beside the wall's force"));
  return bench.seen();
}

// Oracle: passive, bounded, quiet, and the force must be within 1 N of that of the wall. The hand is clamped for 30 s
// (750 answers with 0.05 N of noise, a forgetting half-life of 14 answers) and then moves 10 mm between two answers.
TEST(HardLoop, AnEstimatorThatHasLongSeenNothingNewDoesNotWindUp) {
  constexpr Duration kWithin = seconds(1);
  const double prior = OutputEstimator::Config{}.prior_variance;
  const Observed seen = kept(kWithin, [=](std::uint64_t seed) { return wind_up(seed, prior); });
  report({.hard = "without excitation, the covariance grows as 0.95^-n",
          .oracle = "the bounds; within 1 N of the wall's force; quiet after 1 s",
          .result = result_of(seen) + ", within " + text_of(seen.figure, "N"),
          .margin = 1 / seen.figure,
          .without =
              without("cap of 1e30 in place of 2e8", kWithin, [](std::uint64_t seed) { return wind_up(seed, 1e30); })});
}

/// J, of the account. The adversary moves along the force if it can gain energy from the controller.
double left_by_adversary(const Case& set, const Friction& friction) {
  AdversaryDevice device({.friction = friction}, set.world.seed);
  WatchedDevice port(device, {.friction = friction});
  World world(set.world, port);
  world.add_controller(set.engine, [dice = Dice(set.world.seed)](const DeviceState&) mutable -> Touch {
    return Vec3(dice.within(0, kMaxForce) * dice.direction());
  });
  double least = 0;
  world.watch_steps([&](const StepRecord&) { least = std::min(least, port.energy()); });
  world.run_for(seconds(4));
  return least;
}

Observed jitter(std::uint64_t seed, bool told) {
  Case set(seed);
  set.world.latest_wake = milliseconds(1);
  set.control().limiter.longest_hold = milliseconds(told ? 2 : 1);
  const double adversary = left_by_adversary(set, kFriction);

  Bench restless(set);
  restless.run(seconds(3));
  restless.disturbance_is_over();
  restless.run(seconds(3));

  set.device.watchdog = set.port.watchdog = set.control().watchdog = milliseconds(5);
  if (told) set.control().limiter.longest_hold = milliseconds(5);
  set.world.pause_probability = 5e-3;
  set.world.pause = set.dice.milliseconds(3, 60);
  Bench pauses(set);
  pauses.run(seconds(5));
  Observed seen = restless.seen();
  seen.add(pauses.seen());
  seen.least_energy = std::min(seen.least_energy, adversary);
  return seen;
}

// Oracle: passive, also against an adversary, and bounded, with periods of 1 to 2 ms, and additionally with one step in
// 200 late by 3 to 60 ms; quiet if only the periods vary (in a pause the device releases the force, and the hand sinks
// in). The limiter's longest hold is 2 ms, or with pauses the 5 ms after which the device itself releases the force.
TEST(HardLoop, PeriodsThatVaryAndPeriodsThatAreMissedStayPassive) {
  constexpr Duration kWithin = seconds(2);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return jitter(seed, true); });
  report({.hard = "a force that is held too long gives out more than the account has",
          .oracle = "the bounds, also with an adversary; quiet after 2 s",
          .result = result_of(seen),
          .margin = margin_of(seen, kWithin),
          .without =
              without("bound for the nominal 1 ms", kWithin, [](std::uint64_t seed) { return jitter(seed, false); })});
}

Observed wrap(std::uint64_t seed, bool guarded) {
  Case set(seed);
  set.into = Vec3::UnitX();
  set.physics = [k = set.stiffness](const DeviceState& hand) -> Touch {
    return Vec3(-k * std::max(0.0, hand.position.x()), 0, 0);
  };
  set.device.hand->motion = press(set, milliseconds(1500), milliseconds(1500), -0.01, 0.016);
  if (guarded) set.control().max_speed = 10;
  Bench bench(set);
  bench.run(milliseconds(1200));
  // The encoder wraps around at the position where the hand leaves the wall.
  bench.encoder.range = 0.2;
  bench.encoder.middle = Vec3(0.105, 0, 0);
  bench.run(milliseconds(2100));
  bench.encoder.range.reset();
  bench.run(milliseconds(50));
  bench.world.client(bench.engine).rearm();
  bench.disturbance_is_over();
  bench.run(seconds(2));
  if (bench.world.haptic().stats().fault != HapticController::Fault::kNone) bench.blame("still a fault");
  return bench.seen();
}

// Oracle: passive, bounded, quiet. The device must operate normally after it is armed again. A wrap by 0.2 m in 1 ms
// corresponds to 32 J of friction and 1.6 J of work.
TEST(HardLoop, AnEncoderThatWrapsIsAFaultAndNoIncome) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return wrap(seed, true); });
  report(
      {.hard = "0.2 m in 1 ms look like 32 J of friction, so the limiter has no effect",
       .oracle = "the bounds; no force until rearmed; quiet after 1 s",
       .result = result_of(seen),
       .margin = margin_of(seen, kWithin),
       .without = without("every position believed", kWithin, [](std::uint64_t seed) { return wrap(seed, false); })});
}

Observed stuck(std::uint64_t seed, bool limiter) {
  constexpr double kHidden = 0.008;  // m
  Case set(seed);
  auto& robust = set.control().limiter.parts.robust_ledger.emplace();
  robust.encoder_step = {1e-6};
  set.device.hand->motion = press(set, milliseconds(1500), milliseconds(2400), 0.012 - kHidden, 0.016);
  if (!limiter) set.let_all_through();
  Bench bench(set);
  bench.run(milliseconds(1480));
  bench.encoder.stuck = bench.owes = true;
  bench.run(milliseconds(400));
  bench.encoder.stuck = false;
  // The jump is then booked as viscous friction in one window of the ledger.
  const double never_paid = kFriction.viscous * kHidden * kHidden / (robust.window * 1e-3);
  const LocalTime paid = bench.world.now() + milliseconds(1500);
  bench.expect_of_steps([&bench, never_paid, paid](const StepRecord& step) -> std::string {
    bench.note(-1e3 * bench.energy());
    const double owed = step.hand.at < paid ? kMaxForce * kHidden : never_paid;
    return bench.energy() >= -owed ? "" : "account " + text_of(bench.energy(), "J");
  });
  bench.run(milliseconds(2020));
  bench.disturbance_is_over();
  bench.run(seconds(2));
  bench.expect_of_steps({});
  return bench.seen();
}

// Oracle: passive except for hidden motion. While the encoder is stuck, the hand can gain at most ‖F‖ · travel = 64 mJ.
// When the encoder moves again, the ledger books this as a debt. The debt must be recovered within 1.5 s, except for
// 5.1 mJ of the jump that are booked as viscous friction. Bounded, quiet.
TEST(HardLoop, AnEncoderThatSticksOwesWhatItHidAndPaysItBack) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return stuck(seed, true); });
  report({.hard = "a hand that is pushed out of a wall seems to rest",
          .oracle = "at most 8 N · 8 mm out of the account, and 5.1 mJ after 1.5 s; ≤ 8 N, ≤ 1000 N/s; quiet after 1 s",
          .result = "owed ≤ " + text_of(seen.figure, "mJ") + ", ≤ " + text_of(seen.most_force, "N") + ", ≤ " +
                    text_of(seen.most_rate, "N/s") + ", quiet after " + text_of(seen.noisy_for),
          .margin = std::min(margin_of(seen, kWithin), 1e3 * kMaxForce * 0.008 / seen.figure),
          .without = without("AOL off", kWithin, [](std::uint64_t seed) { return stuck(seed, false); })});
}

Observed overestimated(std::uint64_t seed, bool corrected) {
  Case set(seed);
  set.control().limiter.friction = {.coulomb = 2 * kFriction.coulomb, .viscous = 2 * kFriction.viscous};
  if (corrected) {
    set.control().limiter.parts.adaptive_friction.emplace();
    set.control().friction_map.emplace().places = {{.position = Vec3::Zero(), .friction = kFriction}};
  }
  const double adversary = left_by_adversary(set, kFriction);
  Bench bench(set);
  bench.run(seconds(3));
  bench.disturbance_is_over();
  bench.run(seconds(3));
  Observed seen = bench.seen();
  seen.least_energy = std::min(seen.least_energy, adversary);
  return seen;
}

// Oracle: passive with the true friction even if there is an adversary; bounded and quiet. The scene claims twice the
// friction, and an identification over the workspace reports the true value, which lowers the bounds immediately.
TEST(HardLoop, FrictionClaimedTwiceTooHighIsCorrectedByTheMapOfTheWorkspace) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return overestimated(seed, true); });
  report({.hard = "the account earns energy from friction that does not exist",
          .oracle = "the bounds with the true friction, also with an adversary; quiet after 1 s",
          .result = result_of(seen),
          .margin = margin_of(seen, kWithin),
          .without = without("no map", kWithin, [](std::uint64_t seed) { return overestimated(seed, false); })});
}

Observed clock_goes_back(std::uint64_t seed, bool decay) {
  Case set(seed);
  const Duration back = set.dice.milliseconds(50, 3000);
  set.clock = injector::DriftingClock({.offset = std::chrono::hours(7),
                                       .drift_ppb = 50'000,
                                       .steps = {{.at = seconds(3), .change = -back}}});  // 2 s from now
  if (!decay) set.control().hold.hold = set.control().hold.safe_stop = seconds(100);
  Bench bench(set);
  bench.run(milliseconds(1500));
  bench.encoder.behind = milliseconds(50);
  bench.run(milliseconds(300));
  bench.encoder.behind = Duration::zero();
  bench.run(milliseconds(200));
  const LocalTime silent = bench.world.now() + kSilence + milliseconds(20);
  const LocalTime again = bench.world.now() + back;
  bench.expect_of_steps([stopped = no_force_from(silent), again](const StepRecord& step) {
    return step.hand.at < again ? stopped(step) : std::string();
  });
  bench.run(std::max<Duration>(back, seconds(1)));
  bench.disturbance_is_over();
  bench.run(seconds(6));
  if (bench.world.client(bench.engine).phase() != ForceClient::Phase::kOpen) bench.blame("the engine is not back");
  return bench.seen();
}

// Oracle: passive, bounded, quiet. If the clock of an engine is set back, the engine waits until it has the same time
// again, while its force fades. It then returns immediately, or when it has detected the end of the session. The server
// has only one clock, CLOCK_MONOTONIC (server/machine/clock.cc; tests/rules/rooms forbids reading others), which cannot
// be set. If the time stamps of a device go back, this must not change any force.
TEST(HardLoop, AClockThatIsSetBackKicksNobody) {
  constexpr Duration kWithin = seconds(5);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return clock_goes_back(seed, true); });
  report({.hard = "intervals are negative, timers are seconds late, ages decrease",
          .oracle = "the bounds; zero after 0.78 s until the engine is back; quiet after 5 s",
          .result = result_of(seen),
          .margin = margin_of(seen, kWithin),
          .without = without("decay off", kWithin, [](std::uint64_t seed) { return clock_goes_back(seed, false); })});
}

/// Energy (J) that an active burst of 2 s extracts after a calm phase of dissipation.
double burst_after(Duration calm, bool capped, Observed& seen) {
  constexpr double kDrag = 2;  // N·s/m, of the environment
  Case set(1);
  set.device.max_substep = milliseconds(2);
  set.device.hand->motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.02, .frequency = 1.5});
  set.world.loop.period = milliseconds(2);
  if (!capped) set.control().limiter.parts.energy_cap.reset();
  SimulatedDevice device(set.device);
  WatchedDevice port(device, set.port);
  Mailboxes mail(set.world.mail);
  HapticLoop loop(set.world.loop, port, mail);
  std::uint64_t sequence = 0;
  double before = 0;
  double least = kInf;
  LocalTime now{seconds(1)};
  const LocalTime burst = now + calm;
  for (LocalTime end = burst + seconds(2); now < end; loop.step(now), now += set.world.loop.period) {
    // Runs at 100 Hz: drag, and in the burst a push along the direction of motion.
    if (const DeviceState* hand = mail.state.take(); hand != nullptr && hand->tick % 5 == 0) {
      RemoteForce force;
      force.sequence = ++sequence;
      force.answers_tick = hand->tick;
      force.answers = force.received = now;
      force.valid_for = milliseconds(30);
      force.force = now < burst ? Vec3(-kDrag * hand->velocity) : Vec3(kMaxForce * hand->velocity.normalized());
      mail.forces[0].put(force);
    }
    while (const StepRecord* step = mail.steps.front()) {
      seen.least_energy = std::min(seen.least_energy, port.energy());
      seen.most_force = std::max(seen.most_force, step->applied.norm());
      seen.felt = seen.felt || step->applied.norm() > 0.5;
      mail.steps.pop();
    }
    now < burst ? before = port.energy() : least = std::min(least, port.energy());
  }
  return before - least;
}

// Oracle: for an hour, a hand dissipates energy because it moves through drag. If it is then pushed by a burst, the
// burst can extract at most the 5 mJ of the energy cap, plus the energy that may have been stored by the last contact.
TEST(HardLoop, AnHourOfDissipationPaysForNoBurst) {
  constexpr double kMostOut = 0.025;  // J
  Observed seen;
  const double out = burst_after(std::chrono::hours(1), true, seen);
  EXPECT_EQ(broken(seen, {}), "");
  EXPECT_TRUE(seen.felt);
  EXPECT_LE(out, kMostOut);
  Observed uncapped;
  const double uncapped_out = burst_after(std::chrono::minutes(1), false, uncapped);
  EXPECT_GT(uncapped_out, kMostOut);
  report({.hard = "an hour of friction fills the account",
          .oracle = "at most 25 mJ out of the account in the burst; ≤ 8 N",
          .result = text_of(1e3 * out, "mJ") + ", ≤ " + text_of(seen.most_force, "N"),
          .margin = kMostOut / out,
          .without = "cap off: " + text_of(1e3 * uncapped_out, "mJ") + " after one minute"});
}

}  // namespace
}  // namespace tendon::hard::hard_device_test

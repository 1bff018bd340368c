// SPDX-License-Identifier: Apache-2.0
// Tests the parts of AOL+ that reduce vibration. aol_plus_test.cc tests whether they are passive.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/portable_math.h"
#include "core/control/aol_plus.h"
#include "core/control/preset.h"

namespace tendon::feel_parts_test {
namespace {

using std::chrono::milliseconds;

AolPlus<1>::Config device(Duration period, double viscous = 0.005, double coulomb = 0.04) {
  return {.friction = {Friction{coulomb, viscous}}, .longest_hold = period};
}

/// Returns the stiffness that is displayed when the hand moves 10 mm into a spring of `stiffness` at 20 mm/s.
double displayed(const AolPlus<1>::Config& config, double stiffness) {
  AolPlus<1> law(config);
  const double step = 0.02 * seconds(config.longest_hold);
  double applied = 0;
  double x = 0;
  while (x < 0.01) {
    law.observe({.applied = Vec<1>(applied), .dx = Vec<1>(step), .held = config.longest_hold});
    x += step;
    applied = law.limit({.force = Vec<1>(-stiffness * x)}).force[0];
  }
  return -applied / x;
}

TEST(Shaping, ShowsNoObjectStifferWhateverThePeriodIs) {
  for (const int us : {250, 500, 1000, 2000, 4000}) {
    auto config = device(std::chrono::microseconds(us));
    config.parts.bounded_acceleration = {{.most = {100}}};
    config.parts.shaping = {{.stiffness = {900}}};
    EXPECT_LE(displayed(config, 20000), 900 * 1.06) << "friction earns, too; " << us << " us";
    if (us > 1000) continue;  // this would cost more energy than the spring stores
    EXPECT_GE(displayed(config, 20000), 900 * 0.9) << us << " us";
  }
}

TEST(Shaping, LeavesASofterObjectAsItIs) {
  auto config = device(milliseconds(1));
  config.parts.bounded_acceleration = {{.most = {100}}};
  config.parts.shaping = {{.stiffness = {900}}};
  EXPECT_NEAR(displayed(config, 300), 300, 6);
}

TEST(Thrift, KeepsBackOnlyWhileTheHandIsLetOutAndTheTankIsLow) {
  const auto share = [](double dx, double earned) {
    auto config = device(milliseconds(1), 0.26, 0.02);
    config.parts.thrift = {{.share = 0.5, .energy = 0.004}};
    AolPlus<1> law(config);
    law.credit(earned);
    for (int n = 0; n < 50; ++n) law.observe({.applied = Vec<1>(0), .dx = Vec<1>(dx), .held = milliseconds(1)});
    const auto limited = law.limit({.force = Vec<1>(-1e3)});
    return -limited.force[0] / limited.permitted;
  };
  EXPECT_NEAR(share(2e-5, 0), 1, 1e-12) << "the hand presses";
  EXPECT_LT(share(-2e-5, 0), 0.7) << "the hand is let out";
  EXPECT_NEAR(share(-2e-5, 0.01), 1, 1e-12) << "there is plenty";
}

TEST(Thrift, AForceGrowsOnlyByWhatTheAccountCanPayTheCountsOf) {
  auto config = device(milliseconds(1), 0.26, 0.02);
  config.parts.robust_ledger = {{.encoder_step = {1e-4}}};
  config.parts.thrift.emplace();
  AolPlus<1> law(config);
  law.credit(1e-4);
  law.observe({.applied = Vec<1>(0), .dx = Vec<1>(0), .held = milliseconds(1)});
  const auto limited = law.limit({.force = Vec<1>(-1e3)});
  EXPECT_NEAR(-limited.force[0], 1e-4 / (4 * 1e-4), 1e-9);
  EXPECT_LT(-limited.force[0], 0.9 * limited.permitted) << "the bound itself is not what held it back";
}

TEST(Thrift, OneCountHardlyReducesTheForceOfACoupling) {
  const auto least_share = [](bool shared) {
    auto config = device(milliseconds(1), 0.26, 0.02);
    config.parts.robust_ledger = {{.encoder_step = {3e-5}}};
    config.parts.thrift.emplace();
    config.shared_account = shared;
    AolPlus<1> law(config);
    law.credit(1e-3);
    Vec<1> applied = Vec<1>::Zero();
    double least = 1;
    for (int n = 0; n < 40; ++n) {
      law.observe({.applied = applied, .dx = Vec<1>(n == 20 ? -3e-5 : 0.0), .held = milliseconds(1)});
      const auto limited = law.limit({.force = Vec<1>(-1e3)});
      applied = limited.force;
      if (n > 20) least = std::min(least, -applied[0] / limited.permitted);
    }
    return least;
  };
  EXPECT_GT(least_share(true), 0.98);
  EXPECT_LT(least_share(false), 0.9);
}

/// Returns the energy (J) during one second if the hand vibrates at 20 Hz with `amplitude` (m/s) in a contact of 2 N.
double damped(const AolPlus<1>::Config& config, double amplitude, double slow_speed = 0, double slow_hz = 0) {
  AolPlus<1> law(config);
  law.credit(0.05);
  double taken = 0;
  double x = 0;
  double seen = 0;
  const double count = config.parts.robust_ledger ? config.parts.robust_ledger->encoder_step[0] : 0;
  Vec<1> applied = Vec<1>::Zero();
  for (int n = 0; n < 1000; ++n) {
    const double t = n * 1e-3;
    x += 1e-3 * (amplitude * portable::sin(2 * std::numbers::pi * 20 * t) +
                 slow_speed * portable::sin(2 * std::numbers::pi * slow_hz * t));
    const double now = count > 0 ? std::round(x / count) * count : x;
    law.observe({.applied = applied, .dx = Vec<1>(now - seen), .held = milliseconds(1)});
    taken += (-2 - applied[0]) * (now - seen);
    seen = now;
    applied = law.limit({.force = Vec<1>(-2), .age = milliseconds(20)}).force;
  }
  return taken;
}

AolPlus<1>::Config with_damper(double count) {
  auto config = device(milliseconds(1), 0.26, 0.02);
  config.parts.damper = {{.viscous = {24}, .contact = {0.1}}};
  if (count > 0) config.parts.robust_ledger = {{.encoder_step = {count}}};
  return config;
}

TEST(Damper, TakesWorkFromAVibrationAndHardlyAnyFromASlowHand) {
  const double vibration = damped(with_damper(0), 0.02);
  EXPECT_GT(vibration, 0.3 * 24 * 0.02 * 0.02 / 2) << "of B v²/2, what a damper without filters would take in a second";
  EXPECT_LT(std::abs(damped(with_damper(0), 0, 0.02, 0.5)), 0.03 * vibration);
}

TEST(Damper, TakesMoreThanALateSpringGivesToAVibration) {
  const auto given = [](bool with) {  // J in the last half second, to a hand at 8 Hz on 400 N/m that are 15 ms late
    auto config = with_damper(0);
    if (!with) config.parts.damper.reset();
    AolPlus<1> law(config);
    law.credit(0.5);
    Vec<1> applied = Vec<1>::Zero();
    double sum = 0;
    const auto x = [](double t) { return 1e-3 * portable::sin(2 * std::numbers::pi * 8 * t); };
    for (int n = 0; n < 1000; ++n) {
      const double t = n * 1e-3;
      const Vec<1> dx(x(t) - x(t - 1e-3));
      if (n >= 500) sum += applied.dot(dx);
      law.observe({.applied = applied, .dx = dx, .held = milliseconds(1)});
      applied = law.limit({.force = Vec<1>(-2 - 400 * x(t - 15e-3)), .age = milliseconds(15)}).force;
    }
    return sum;
  };
  EXPECT_GT(given(false), 1e-3);
  EXPECT_LT(given(true), 0);
}

TEST(Damper, AHandThatNobodyDrivesIsDampedByTwiceTheContactForce) {
  AolPlus<1> law(with_damper(0));
  law.credit(0.05);
  Vec<1> applied = Vec<1>::Zero();
  double most = 0;
  for (int n = 0; n < 1000; ++n) {  // the hand is led with 100 mm/s at 5 Hz, and the force is always the same
    law.observe({.applied = applied,
                 .dx = Vec<1>(1e-4 * portable::sin(2 * std::numbers::pi * 5 * n * 1e-3)),
                 .held = milliseconds(1)});
    applied = law.limit({.force = Vec<1>(-2), .age = milliseconds(20)}).force;
    most = std::max(most, std::abs(applied[0] + 2));
  }
  EXPECT_GT(most, 0.5 * 2 * 0.1);
  EXPECT_LT(most, 2 * 0.1 + 1e-9);
}

TEST(Damper, AHandleThatIsLetGoIsHeldBackAndAHeavyHandIsNot) {
  const auto force_after_30_ms = [](double mass) {
    AolPlus<1> law(with_damper(0));
    law.credit(0.05);
    Vec<1> applied = Vec<1>::Zero();
    double v = 0;
    for (int n = 0; n < 530; ++n) {  // let go after half a second
      if (n >= 500) v += applied[0] / mass * 1e-3;
      law.observe({.applied = applied, .dx = Vec<1>(v * 1e-3), .held = milliseconds(1)});
      applied = law.limit({.force = Vec<1>(-2), .age = milliseconds(20)}).force;
    }
    return applied[0];
  };
  EXPECT_GT(force_after_30_ms(0.075), -1);
  EXPECT_LT(force_after_30_ms(1), -2 + 2 * 0.1 + 1e-9);
}

TEST(Damper, IsBlindToTheCountsOfASlowHand) {
  auto config = with_damper(3e-5);
  AolPlus<1> law(config);
  law.credit(0.05);
  Vec<1> applied = Vec<1>::Zero();
  for (int n = 0; n < 2000; ++n) {  // one count every 20 ms: 1.5 mm/s
    law.observe({.applied = applied, .dx = Vec<1>(n % 20 == 0 ? 3e-5 : 0.0), .held = milliseconds(1)});
    const auto limited = law.limit({.force = Vec<1>(-2), .age = milliseconds(20)});
    const double pulse = 24 * 3e-5 / (std::numbers::e * 2.2e-3);
    ASSERT_LT(std::abs(limited.force[0] + 2), n > 200 ? 0.4 * pulse : pulse) << n;
    applied = limited.force;
  }
}

TEST(Damper, StopsWhenItOwesMoreThanItHasEarned) {
  auto poor = with_damper(1e-4);
  poor.parts.damper->dead_zone = 0;
  poor.parts.damper->most_owed = 1e-6;
  auto rich = poor;
  rich.parts.damper->most_owed = 1;
  const auto spent = [](const AolPlus<1>::Config& config) {
    AolPlus<1> law(config);
    law.credit(0.05);
    Vec<1> applied = Vec<1>::Zero();
    for (int n = 0; n < 1000; ++n) {  // 10 mm/s: one count every 10 ms
      law.observe({.applied = applied, .dx = Vec<1>(n % 10 == 0 ? 1e-4 : 0.0), .held = milliseconds(1)});
      applied = law.limit({.force = Vec<1>(-2), .age = milliseconds(20)}).force;
    }
    return 0.05 + 2 * 0.01 - law.spendable();
  };
  EXPECT_LT(spent(poor), 0.3 * spent(rich));
}

TEST(Damper, IsOffInFreeSpaceAndWhereAFreshAnswerIsShownWell) {
  AolPlus<1> law(with_damper(0));
  law.credit(0.05);
  for (int n = 0; n < 30; ++n)
    law.observe({.applied = Vec<1>(0), .dx = Vec<1>(n % 10 < 5 ? 1e-5 : -1e-5), .held = milliseconds(1)});
  EXPECT_EQ(law.limit({.force = Vec<1>(0), .age = milliseconds(20)}).force[0], 0);
  const auto fresh = law.limit({.force = Vec<1>(-0.5)});
  EXPECT_EQ(fresh.force[0], -0.5);
  EXPECT_TRUE(fresh.reasons.empty());
  const auto old = law.limit({.force = Vec<1>(-0.5), .age = milliseconds(20)});
  EXPECT_NE(old.force[0], -0.5);
  EXPECT_TRUE(old.reasons.has(Reason::kDamped));
}

TEST(Damper, NeverTurnsAForceRoundNorMoreThanDoublesIt) {
  for (const double speed : {-0.4, 0.4}) {  // pulled out, pushed in
    AolPlus<1> law(with_damper(0));
    law.credit(0.05);
    Vec<1> applied = Vec<1>::Zero();
    double least = 0;
    double largest = -10;
    for (int n = 0; n < 60; ++n) {
      law.observe({.applied = applied, .dx = Vec<1>(n < 20 ? 0 : speed * 1e-3), .held = milliseconds(1)});
      applied = law.limit({.force = Vec<1>(-0.5), .age = milliseconds(20)}).force;
      least = std::min(least, applied[0]);
      largest = std::max(largest, applied[0]);
    }
    EXPECT_LE(largest, 1e-12) << speed;
    EXPECT_GE(least, -1 - 1e-12) << speed;
    if (speed < 0) EXPECT_NEAR(largest, 0, 1e-9) << "it would have taken more";
  }
}

TEST(Damper, ASoftLateSpringIsDampedLessThanAStiffOne) {
  const auto taken = [](double stiffness) {
    auto config = with_damper(0);
    config.parts.energy_cap = {{.energy = 1, .most_contact = 1}};
    config.parts.shaping = {{.stiffness = {1500}}};
    AolPlus<1> law(config);
    law.credit(0.05);
    Vec<1> applied = Vec<1>::Zero();
    double x = 0;
    for (int n = 0; n < 200; ++n) {  // 10 mm into the object, with a velocity step of 10 mm/s
      const double dx = n < 100 ? 1e-4 : 1e-5;
      law.observe({.applied = applied, .dx = Vec<1>(n == 101 ? 4e-5 : dx), .held = milliseconds(1)});
      x += dx;
      applied = law.limit({.force = Vec<1>(-stiffness * x), .age = milliseconds(10)}).force;
      if (n == 104) break;
    }
    return std::abs(applied[0] + stiffness * x) / (stiffness * x / (stiffness * x + 0.1));
  };
  EXPECT_LT(taken(45), 0.15 * taken(450)) << "a tenth of the stiffness from which on it is whole";
}

TEST(FadingContact, KeepsForAWhileWhatAContactHadPutIn) {
  const auto left_after = [](bool fading, int pause_ms) {
    auto config = device(milliseconds(1), 0.26, 0.02);
    config.parts.energy_cap = {{.energy = 1e-3}};
    if (fading) config.parts.fading_contact.emplace();
    AolPlus<1> law(config);
    law.credit(1e-3);
    Vec<1> applied = Vec<1>::Zero();
    double x = 0;
    const auto step = [&](double dx, double wanted) {
      law.observe({.applied = applied, .dx = Vec<1>(dx), .held = milliseconds(1)});
      x += dx;
      applied = law.limit({.force = Vec<1>(wanted)}).force;
    };
    for (int n = 0; n < 500; ++n) step(2e-5, -400 * x);
    for (int n = 0; n < pause_ms; ++n) step(0, 0);  // the object is removed
    return law.spendable();
  };
  EXPECT_NEAR(left_after(false, 1), 1e-3, 1e-9);
  const double soon = left_after(true, 1);
  EXPECT_GT(soon, 1e-2);
  EXPECT_NEAR(left_after(true, 300) - 1e-3, (soon - 1e-3) * std::exp(-1.0), 0.05 * soon);
  EXPECT_LT(left_after(true, 3000), 1.01e-3);
}

TEST(Preset, ListsWhatItsPromiseSaysAndNothingThatTheDeviceLacks) {
  for (const PresetInfo& preset : presets()) {
    const PresetDevice falcon{.friction = {0.02, 0.26}, .longest_hold = milliseconds(1), .encoder_step = 3e-5};
    const PresetParts chosen = preset_parts(preset.preset, falcon);
    const std::string promise = promise_of({.parts = chosen.parts});
    EXPECT_EQ(promise, preset.preset == Preset::kFeel ? "passive while the handle accelerates by less than 300 m/s²; a "
                                                        "step with a higher acceleration only relies on friction"
                                                      : "passive for every motion of the hand");
    EXPECT_TRUE(chosen.parts.robust_ledger && chosen.learned_model) << preset.name;
    AolPlus<1, 3>({.friction = {falcon.friction}, .longest_hold = falcon.longest_hold, .parts = chosen.parts});
    const PresetParts exact = preset_parts(preset.preset, {.friction = {0.02, 0.26}, .longest_hold = milliseconds(1)});
    EXPECT_FALSE(exact.parts.robust_ledger) << preset.name;
  }
}

TEST(Preset, IsNeverSofterThanTheFrictionAlone) {
  const PresetParts damped =
      preset_parts(Preset::kFeel, {.friction = {0.02, 2}, .longest_hold = milliseconds(1), .encoder_step = 3e-5});
  EXPECT_GE(damped.parts.shaping->stiffness[0], 2 * 2 / 1e-3);
}

}  // namespace
}  // namespace tendon::feel_parts_test

// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/energy_tank.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "core/control/limiter.h"
#include "core/ledger/energy_ledger.h"
#include "tests/core/control/adversary.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::energy_tank_test {
namespace {

using std::chrono::milliseconds;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

EnergyTankMessage from_peer(std::uint64_t sequence, double account, double need, double given = 0, double taken = 0) {
  return {.epoch = 7,
          .answers_epoch = 1,
          .sequence = sequence,
          .account = account,
          .need = need,
          .given = given,
          .taken = taken};
}

EnergyTank::Period period_of(double payable, double loss) {
  return {.payable = payable, .loss = loss, .elapsed = milliseconds(1)};
}

TEST(EnergyTank, GivesUntilBothHaveTheSameShareOfTheirNeed) {
  EnergyTank tank({});
  tank.receive(0, from_peer(1, 0.01, 0.03));
  const double need = 0.01 + 0.2e-3;
  const auto settlement = tank.settle(period_of(0.05, 0.01));
  EXPECT_DOUBLE_EQ(settlement.withdraw, (0.05 * 0.03 - 0.01 * need) / (need + 0.03));
  EXPECT_NEAR((0.05 - settlement.withdraw) / need, (0.01 + settlement.withdraw) / 0.03, 1e-12);
  EXPECT_EQ(tank.message(0).given, settlement.withdraw);
}

TEST(EnergyTank, CountsWhatIsUnderWay) {
  EnergyTank tank({});
  tank.receive(0, from_peer(1, 0.01, 0.03));
  const auto first = tank.settle(period_of(0.05, 0.01));
  tank.receive(0, from_peer(2, 0.01, 0.03));  // the gift has not been received yet
  EXPECT_NEAR(tank.settle(period_of(0.05 - first.withdraw, 0.01)).withdraw, 0, 1e-15);
  tank.receive(0, from_peer(3, 0.01, 0.03, 0, first.withdraw));  // the gift has arrived and was spent
  EXPECT_GT(tank.settle(period_of(0.05 - first.withdraw, 0.01)).withdraw, 1e-3);
}

TEST(EnergyTank, GivesNothingToOneThatWasNotHeardOrWhileItMayNot) {
  EnergyTank tank({});
  EXPECT_EQ(tank.settle(period_of(0.1, 0)).withdraw, 0);
  tank.receive(0, from_peer(1, 0, 0.03, 0.01));
  auto period = period_of(0.1, 0);
  period.giving = false;
  const auto settlement = tank.settle(period);
  EXPECT_EQ(settlement.withdraw, 0);
  EXPECT_DOUBLE_EQ(settlement.credit, 0.01) << "what comes is still added";
}

TEST(EnergyTank, NeverGivesMoreThanItHasHoweverManyAsk) {
  Dice dice(3);
  for (int n = 0; n < 20'000; ++n) {
    const auto peers = static_cast<std::size_t>(dice.within(1, 4));
    EnergyTank tank({.peers = peers});
    for (std::size_t j = 0; j < peers; ++j) {
      const double sign = dice.chance(0.3) ? -1 : 1;
      tank.receive(j, from_peer(1, sign * dice.decades(-6, 3), dice.decades(-6, 3)));
    }
    const double payable = (dice.chance(0.2) ? -1 : 1) * dice.decades(-9, -1);
    const auto settlement = tank.settle(period_of(payable, dice.chance(0.1) ? kInf : dice.decades(-6, 3)));
    ASSERT_GE(settlement.withdraw, 0);
    ASSERT_LE(settlement.withdraw, std::max(payable, 0.0));
  }
}

TEST(EnergyTank, WhenItHasTooLittleAllAreCutInProportion) {
  EnergyTank tank({.peers = 3});
  for (std::size_t j = 0; j < 3; ++j) tank.receive(j, from_peer(1, -10, 0.01));
  EXPECT_NEAR(tank.settle(period_of(0.03, 0.01)).withdraw, 0.03, 1e-12);
  for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(tank.given(j), 0.01, 1e-12) << j;
}

TEST(EnergyTank, ThreePeersAndItselfEndAtOneRatio) {
  EnergyTank tank({.peers = 3, .max_account = 1});
  const std::array<double, 3> accounts = {0.01, 0.02, 0.5};  // the last account already has more than its share
  const std::array<double, 3> needs = {0.05, 0.02, 0.1};
  for (std::size_t j = 0; j < 3; ++j) tank.receive(j, from_peer(1, accounts[j], needs[j]));
  const double left = 0.3 - tank.settle(period_of(0.3, 0.03 - 0.2e-3)).withdraw;
  EXPECT_NEAR((accounts[0] + tank.given(0)) / needs[0], left / 0.03, 1e-12);
  EXPECT_NEAR((accounts[1] + tank.given(1)) / needs[1], left / 0.03, 1e-12);
  EXPECT_EQ(tank.given(2), 0);
}

TEST(EnergyTank, AJouleOfThePeerIsWorthWhatTheScalesSay) {
  // s_x 0.2, s_f 5: a joule of the follower is 25 J at the leader.
  EnergyTank leader({.joule = {25}, .max_account = 10});
  leader.receive(0, from_peer(1, 0.0002, 0.001, 0.004));
  const auto settlement = leader.settle(period_of(0, 0.025 - 0.2e-3));
  EXPECT_DOUBLE_EQ(settlement.credit, 0.1);
  EXPECT_NEAR(settlement.withdraw, (0.1 - 0.005) / 2, 1e-12) << "both need the same, in the leader's joules";
  EXPECT_EQ(leader.message(0).taken, 0.004) << "totals are told as they were heard";
}

/// If this were not the case, a joule could be given at one worth and credited at another.
TEST(EnergyTank, AChangeOfWorthForgoesWhatIsUnderWay) {
  EnergyTank tank({.max_power = 100, .max_account = 100});
  tank.receive(0, from_peer(1, 1, 1, 2));
  tank.revalue(0, 10, 1e-3);
  EXPECT_EQ(tank.settle(period_of(0, 0)).credit, 0) << "given when it was worth 1 J";
  EXPECT_EQ(tank.need(), 1e-3);
  tank.receive(0, from_peer(2, 1, 1, 2.5));
  tank.forgo(0);
  EXPECT_EQ(tank.settle(period_of(0, 0)).credit, 0) << "the peer did not know yet";
  tank.receive(0, from_peer(3, 1, 1, 3));
  EXPECT_DOUBLE_EQ(tank.settle(period_of(0, 0)).credit, 5) << "half a joule of it";
}

TEST(EnergyTank, ATotalIsCountedOnceHoweverOftenItComes) {
  EnergyTank tank({});
  tank.receive(0, from_peer(2, 0, 0, 0.02));
  tank.receive(0, from_peer(2, 0, 0, 0.02));
  tank.receive(0, from_peer(1, 0, 0, 0.01));  // overtaken: late but valid
  EXPECT_DOUBLE_EQ(tank.settle(period_of(0, 0)).credit, 0.02);
  EXPECT_EQ(tank.settle(period_of(0, 0)).credit, 0);
  EXPECT_EQ(tank.refused(), 0U);
}

TEST(EnergyTank, WhatIsWrongIsRefusedAndCounted) {
  EnergyTank tank({});
  tank.receive(0, from_peer(5, 0, 0, 0.02));
  std::uint64_t refused = 0;
  const auto refuses = [&](const EnergyTankMessage& message, const char* why) {
    tank.receive(0, message);
    EXPECT_EQ(tank.refused(), ++refused) << why;
  };
  refuses(from_peer(6, 0, 0, 0.01), "a total that falls");
  refuses(from_peer(7, kNan, 0, 0.02), "account");
  refuses(from_peer(7, 2e3, 0, 0.02), "account");
  refuses(from_peer(7, 0, kNan, 0.02), "need");
  refuses(from_peer(7, 0, -1, 0.02), "need");
  refuses(from_peer(7, 0, 0, kInf), "given");
  refuses(from_peer(7, 0, 0, kNan), "given");
  refuses(from_peer(7, 0, 0, 2e6), "given");
  refuses(from_peer(7, 0, 0, 0.02, 0.5), "taken above what was given");
  refuses(from_peer(7, 0, 0, 0.02, kNan), "taken");
  refuses(from_peer(0, 0, 0, 0.02), "sequence");
  refuses(EnergyTankMessage{}, "epoch");
  tank.receive(1, from_peer(1, 0, 0, 0.02));  // no such peer
  EXPECT_EQ(tank.refused(), refused);
  EXPECT_DOUBLE_EQ(tank.settle(period_of(0, 0)).credit, 0.02);
}

TEST(EnergyTank, ANewEpochOfThePeerVoidsTheTotalsAndTheOldNeverCountsAgain) {
  EnergyTank tank({});
  tank.receive(0, from_peer(9, 0, 0.03, 0.02));
  EXPECT_GT(tank.settle(period_of(0.01, 0)).withdraw, 0);
  const std::uint64_t sent = tank.message(0).sequence;
  EnergyTankMessage restarted = from_peer(1, 0, 0.03);
  restarted.epoch = 8;
  restarted.answers_epoch = 0;
  tank.receive(0, restarted);
  EXPECT_EQ(tank.given(0), 0);
  EXPECT_EQ(tank.taken(0), 0);
  const EnergyTankMessage answer = tank.message(0);
  EXPECT_EQ(answer.answers_epoch, 8U);
  EXPECT_GT(answer.sequence, sent) << "the peer may have heard the former ones";
  tank.receive(0, from_peer(10, 0, 0.03, 0.05));  // late, of the previous epoch
  EXPECT_EQ(tank.settle(period_of(0, 0)).credit, 0);
  EXPECT_EQ(tank.refused(), 0U);
}

/// A new peer may have a lower epoch.
TEST(EnergyTank, ARenewedTankHearsAnyPeerAndCountsNoTotalTwice) {
  EnergyTank tank({.max_power = 100, .max_account = 100});
  tank.receive(0, from_peer(9, 1, 1, 2));
  EXPECT_EQ(tank.settle(period_of(0, 0)).credit, 2);
  tank.renew(2);
  tank.receive(0, from_peer(10, 1, 1, 2.5));
  EXPECT_EQ(tank.settle(period_of(0, 0)).credit, 0) << "it answers the epoch before";
  tank.renew(3);
  EnergyTankMessage other = from_peer(1, 1, 1, 0.5);
  other.epoch = 3;
  other.answers_epoch = 3;
  tank.receive(0, other);
  EXPECT_EQ(tank.settle(period_of(0, 0)).credit, 0.5) << "of a lower epoch than the one before";
  EXPECT_EQ(tank.message(0).epoch, 3U);
}

TEST(EnergyTank, TotalsThatAnswerAnEpochOfOursThatIsOverAreNotCounted) {
  EnergyTank restarted({.epoch = 2});
  restarted.receive(0, from_peer(50, 0, 0.03, 0.08));  // answers epoch 1, whose total is already spent
  EXPECT_EQ(restarted.settle(period_of(0, 0)).credit, 0);
  EnergyTankMessage anew = from_peer(51, 0, 0.03, 0.01);
  anew.answers_epoch = 2;
  restarted.receive(0, anew);
  EXPECT_DOUBLE_EQ(restarted.settle(period_of(0, 0)).credit, 0.01);
}

TEST(EnergyTank, AnAccountAboveTheMostIsDiscardedWhoeverEarnedIt) {
  EnergyTank tank({.max_account = 0.2});
  const auto settlement = tank.settle(period_of(0.5, 0));
  EXPECT_DOUBLE_EQ(settlement.withdraw, 0.3);
  EXPECT_DOUBLE_EQ(tank.discarded(), 0.3);
  EXPECT_DOUBLE_EQ(tank.account(), 0.2);
}

TEST(EnergyTank, AgainstAnyPeerItsOwnPortLosesNoMoreThanTheAllowance) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Dice dice(seed);
    const Friction friction{.coulomb = 0.02, .viscous = dice.decades(-1, 0)};
    const EnergyTank::Config config{.max_power = dice.decades(-1, 1), .max_account = dice.decades(-2, 0)};
    EnergyTank tank(config);
    Limiter limiter({.law = dice.chance(0.5) ? Law::kAol : Law::kAolPlus,
                     .friction = friction,
                     .longest_hold = milliseconds(1),
                     .shared_account = true});
    EnergyLedger ledger(friction);
    const double most_force = friction.coulomb + 2 * std::sqrt(friction.viscous * 1e3 * config.max_account);
    Vec3 force = Vec3::Zero();
    double total = 0;
    for (int n = 1; n <= 1000; ++n) {
      const Vec3 dx = worst_motion<3>(force, friction, milliseconds(1));
      limiter.observe({force, dx, milliseconds(1)});
      ledger.observe(force, dx, milliseconds(1));
      ASSERT_GE(ledger.energy(), -(config.max_account + config.max_power * n * 1e-3) - 1e-9) << "seed " << seed;
      EnergyTankMessage lie = from_peer(static_cast<std::uint64_t>(n), dice.within(-1e3, 1e3), dice.decades(-6, 3));
      switch (static_cast<int>(dice.within(0, 7))) {
        case 0:
          lie.given = 1e6;
          break;
        case 1:
          lie.given = kNan;
          break;
        case 2:
          lie.need = kNan;
          break;
        case 3:
          lie.given = total / 2;  // decreases
          break;
        case 4:  // restarts repeatedly
          lie.epoch = 7 + static_cast<std::uint64_t>(n);
          lie.sequence = 1;
          lie.given = 1e6;
          break;
        case 5:
          lie.taken = dice.decades(-6, 6);
          break;
        default:
          lie.given = total += dice.decades(-4, 2);
      }
      tank.receive(0, lie);
      const Vec3 wanted = dice.direction() * dice.decades(-1, 5);
      share<3>(tank, limiter, wanted, milliseconds(1));
      force = limiter.limit({wanted}).force;
      ASSERT_TRUE(force.allFinite());
      ASSERT_LE(force.norm(), most_force * (1 + 1e-9)) << "seed " << seed;
      ASSERT_GE(limiter.payable(), -1e-9) << "seed " << seed;
    }
  }
}

TEST(EnergyTank, AGreedyPeerGetsWhatThereIsAndNoMore) {
  EnergyTank tank({});
  tank.receive(0, from_peer(1, 0, 1e3));
  const auto settlement = tank.settle(period_of(0.1, 0.01));
  EXPECT_LE(settlement.withdraw, 0.1);
  EXPECT_GT(settlement.withdraw, 0.0999);
}

TEST(EnergyTank, APeriodThatIsNoNumberMovesNothing) {
  EnergyTank tank({});
  tank.receive(0, from_peer(1, 0, 0.03, 0.01));
  for (const auto& bad : {period_of(kNan, 0), period_of(kInf, 0), period_of(0.1, kNan)}) {
    const auto settlement = tank.settle(bad);
    EXPECT_EQ(settlement.credit, 0);
    EXPECT_EQ(settlement.withdraw, 0);
  }
  EXPECT_DOUBLE_EQ(tank.settle(period_of(0, 0)).credit, 0.01) << "it was kept";
}

TEST(EnergyTank, RefusesImpossibleConfigurations) {
  expect_refusals(EnergyTank::Config(), Makes<EnergyTank>(),
                  {
                      {"peers = 4: expected 1 to 3", [](auto& c) { c.peers = 4; }},
                      {"peers = 0: expected 1 to 3", [](auto& c) { c.peers = 0; }},
                      {"joule = 0: expected 1e-6 to 1e6", [](auto& c) { c.joule[0] = 0; }},
                      {"max_account = 2000: expected above 0 J, at most 1000 J", [](auto& c) { c.max_account = 2e3; }},
                      {"epoch = 0: expected a number above 0", [](auto& c) { c.epoch = 0; }},
                      {"start", [](auto& c) { c.start = 0; }},
                      {"max_power", [](auto& c) { c.max_power = kNan; }},
                  });
}

TEST(SharedAccount, OnlyTheAolFamilyHasOne) {
  for (const LawInfo& law : laws()) {
    const LimiterConfig config{.law = law.law,
                               .friction = {0.02, 0.26},
                               .longest_hold = milliseconds(1),
                               .max_force = 5,
                               .environment_stiffness = 500,
                               .shared_account = true};
    const std::string why = thrown_by([&] { Limiter limiter(config); });
    const bool shares = law.law == Law::kAol || law.law == Law::kAolBox || law.law == Law::kAolPlus;
    if (shares) {
      EXPECT_EQ(why, "") << law.name;
    } else {
      EXPECT_EQ(why, "law \"" + std::string(law.name) +
                         "\" has no energy account that an energy tank can share: expected aol, aol-box or aol+");
    }
  }
}

TEST(SharedAccount, ACreditRaisesTheBoundAndAWithdrawalLowersIt) {
  for (const Law law : {Law::kAol, Law::kAolBox, Law::kAolPlus}) {
    Limiter limiter({.law = law, .friction = {0.02, 0.26}, .longest_hold = milliseconds(1), .shared_account = true});
    const Vec3 wanted(3, 0, 0);
    const double loss = limiter.worst_loss(wanted);
    EXPECT_LT(limiter.limit({wanted}).force.norm(), 0.06);
    limiter.credit(loss * (1 + 1e-12));
    EXPECT_EQ(limiter.limit({wanted}).force, wanted) << info(law).name << ": what it needs lets it through whole";
    limiter.withdraw(loss / 2);
    EXPECT_LT(limiter.limit({wanted}).force.norm(), 2.9) << info(law).name;
    const double before = limiter.payable();
    for (const double bad : {kNan, kInf, -kInf, -1.0, 0.0}) {
      limiter.credit(bad);
      limiter.withdraw(bad);
    }
    EXPECT_EQ(limiter.payable(), before) << info(law).name;
    EXPECT_EQ(limiter.energy(), before) << info(law).name;
  }
}

TEST(SharedAccount, WhatAolPlusNeedsCountsItsPartsIn) {
  AolPlus<1, 3>::Config config{.friction = {{{0.02, 0.26}}}, .longest_hold = milliseconds(1), .shared_account = true};
  const Vec3 wanted(2, 0, 0);
  const double plain = AolPlus<1, 3>(config).worst_loss(wanted);
  config.parts.latency_reserve = {2};
  EXPECT_DOUBLE_EQ((AolPlus<1, 3>(config).worst_loss(wanted)), 3 * plain);
  config.parts.latency_reserve.reset();
  config.parts.knee = {0.5};
  AolPlus<1, 3> with_knee(config);
  with_knee.credit(with_knee.worst_loss(wanted) * (1 + 1e-12));
  EXPECT_EQ(with_knee.limit({wanted}).force, wanted);
  config.parts.knee.reset();
  config.parts.robust_ledger = {.encoder_step = {1e-5}, .window = 10};
  AolPlus<1, 3> robust(config);
  robust.credit(0.01);
  EXPECT_DOUBLE_EQ(robust.payable(), 0.01);
  EXPECT_DOUBLE_EQ(robust.energy(), 0.01);
  robust.withdraw(0.004);
  EXPECT_DOUBLE_EQ(robust.payable(), 0.006);
}

}  // namespace
}  // namespace tendon::energy_tank_test

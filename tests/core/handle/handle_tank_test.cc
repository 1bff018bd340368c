// SPDX-License-Identifier: Apache-2.0
// Tests the energy-sharing theorem of energy_tank.h for two ports that rotate or grip, over a network that delays,
// loses, repeats and reorders messages. The accounts and the sum of both ledgers are computed from the true motion.
// They must not be below −1 nJ, even on a closed loop in SO(3).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <optional>
#include <vector>

#include "core/base/rotation.h"
#include "core/control/stability_controller.h"
#include "core/handle/handle_port.h"
#include "core/teleoperation/energy_tank.h"
#include "tests/core/teleoperation/one_way.h"
#include "tests/support/dice.h"

namespace tendon::handle_tank_test {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
constexpr double kHandleTolerance = 1e-9;

static_assert(SharesAccount<WrenchPort, 6> && SharesAccount<GripPort, 1>);

template <class Limits>
struct HandleEnd {
  static constexpr int kSize = Limits::kSize;
  static constexpr int kBlock = kSize == 6 ? 3 : 1;
  static constexpr int kBlocks = kSize / kBlock;

  typename Limits::Config config;
  Duration period{};
  std::optional<Limits> port;
  std::optional<EnergyTank> tank;
  std::array<Friction, kBlocks> friction{};
  double truth = 0;                   ///< J
  Vec<kSize> x = Vec<kSize>::Zero();  ///< position; the orientation of a wrench is in `q`
  Quat q{};
  Quat loop_from{};
  Vec<kSize> force = Vec<kSize>::Zero();
  double stiffness = 0;
  double hostility = 0;
};

struct Balance {
  double least_account = kUnlimited;  ///< J
  double least_sum = kUnlimited;      ///< J, sum of the two ledgers
  double given = 0;                   ///< J
  bool finite = true;
  bool broken() const { return std::min(least_account, least_sum) < -kHandleTolerance; }
  void add(const Balance& other) {
    least_account = std::min(least_account, other.least_account);
    least_sum = std::min(least_sum, other.least_sum);
    given += other.given;
    finite = finite && other.finite;
  }
};

template <class Limits>
class HandlePair {
 public:
  using End = HandleEnd<Limits>;
  static constexpr int kSize = End::kSize;
  static constexpr int kBlock = End::kBlock;

  HandlePair(std::uint64_t seed, double bound, bool loops = false) : dice_(seed), bound_(bound), loops_(loops) {
    duplicates_ = dice_.uniform();
    for (End& end : ends_) {
      end.config.law = dice_.chance(0.6) ? Law::kAol : Law::kAolPlus;
      end.config.shared_account = true;
      end.period = from_seconds(dice_.chance(0.7) ? 1e-3 : dice_.decades(-3.3, -2.7));
      end.config.longest_hold = end.period;
      for (std::size_t i = 0; i < end.friction.size(); ++i) {
        const double scale = i == 0 ? 1 : 1e-2;  // N·m per N
        end.friction[i] = {scale * (dice_.chance(0.3) ? 0.0 : dice_.decades(-3, -0.3)), scale * dice_.decades(-2, 0.3)};
        end.config.friction[i] = end.friction[i];
      }
      if (end.config.law == Law::kAolPlus) {
        if (dice_.chance(0.6)) end.config.parts.energy_cap = {dice_.decades(-4, 0), dice_.decades(-3, 0)};
        if (dice_.chance(0.3)) end.config.parts.knee = {dice_.within(0.1, 0.9)};
      }
      end.stiffness = dice_.decades(0, 3.5);
      end.hostility = loops_ ? 0.2 * dice_.uniform() : dice_.uniform();
      end.port.emplace(end.config);
      EnergyTank::Config tank;
      tank.peers = 1;
      tank.max_power = 1e3;
      tank.max_account = dice_.decades(-2, 1);
      tank.epoch = 1;
      end.tank.emplace(tank);
    }
    for (int i = 0; i < 2; ++i) {
      links_.emplace_back(Network{.delay = static_cast<int>(dice_.chance(0.5) ? 0 : dice_.decades(0, 2.3)),
                                  .jitter = static_cast<int>(dice_.chance(0.3) ? 0 : dice_.decades(0, 2.3)),
                                  .loss = dice_.chance(0.3) ? 0 : dice_.uniform() * 0.9,
                                  .seed = dice_.bits()});
    }
  }

  Balance run(int periods) {
    for (now_ = 0; now_ < periods; ++now_) {
      for (std::size_t i = 0; i < 2; ++i) step(i);
      balance_.least_sum = std::min(balance_.least_sum, ends_[0].truth + ends_[1].truth);
    }
    return balance_;
  }

 private:
  static double scale_of(int block) { return block == 0 ? 1 : 1e-2; }

  Vec<kSize> wanted(End& end, const End& other) {
    const int kind = static_cast<int>(dice_.within(0, 6));
    if (kind == 1) return end.force * 1e3;
    if (kind == 2 && dice_.chance(0.1)) return Vec<kSize>::Constant(kUnlimited);
    Vec<kSize> out = Vec<kSize>::Zero();
    if (kind == 2) return out;
    for (int i = 0; i < End::kBlocks; ++i) {
      auto part = out.template segment<kBlock>(i * kBlock);
      if (kind == 0) {
        part = any(scale_of(i) * dice_.decades(-3, 3));
      } else if (i == 0) {
        part = end.stiffness * (other.x - end.x).template head<kBlock>();
      } else if constexpr (kSize == 6) {
        part = 1e-2 * end.stiffness * turn_between(end.q, other.q);
      }
    }
    return out;
  }

  Vec<kBlock> any(double size) {
    if constexpr (kBlock == 3) {
      return dice_.direction() * size;
    } else {
      return Vec<1>(dice_.chance(0.5) ? size : -size);
    }
  }

  Vec<kSize> motion(End& end, Duration held) {
    Vec<kSize> out = Vec<kSize>::Zero();
    const bool hostile = dice_.chance(end.hostility);
    const bool resting = dice_.chance(0.2);
    for (int i = 0; i < End::kBlocks; ++i) {
      auto part = out.template segment<kBlock>(i * kBlock);
      const Vec<kBlock> held_force = end.force.template segment<kBlock>(i * kBlock);
      const Friction& friction = end.config.friction[static_cast<std::size_t>(i)];
      const double size = held_force.norm();
      if (hostile) {  // worst motion, eq. (7)
        if (size <= friction.coulomb) continue;
        part = held_force / size * (seconds(held) * (size - friction.coulomb) / (2 * friction.viscous));
        if (i > 0 && part.norm() > 3) part *= 3 / part.norm();  // this would be a different rotation
      } else if (!resting) {
        part = any(dice_.decades(-7, -3) * (i == 0 ? 1 : 30));
      }
    }
    if (loops_ && !hostile) {
      if constexpr (kSize == 6) {
        out.template tail<3>() =
            now_ % 4 == 3 ? turn_between(end.q, end.loop_from) : Vec3(Vec3::Unit(now_ % 4) * dice_.within(-0.02, 0.02));
      }
    }
    return out;
  }

  /// This is a single rotation about one axis. The limiter uses the difference of two samples.
  void move(End& end, const Vec<kSize>& way, Duration held) {
    Vec<kSize> seen = way;
    if constexpr (kSize == 6) {
      if (loops_ && now_ % 4 == 0) end.loop_from = end.q;
      const Quat to = unit(product(rotation_by(Vec3(way.template tail<3>())), end.q));
      const double sign = dice_.chance(0.5) ? 1 : -1;  // q and −q are the same rotation
      seen.template tail<3>() = turn_between(end.q, Quat{sign * to.w, sign * to.x, sign * to.y, sign * to.z});
      end.q = to;
    }
    end.x.template head<kBlock>() += way.template head<kBlock>();
    if (end.x.norm() > 0.1) end.x *= 0.5;  // resets the position scale without booking
    for (int i = 0; i < End::kBlocks; ++i) {
      const Vec<kBlock> part = way.template segment<kBlock>(i * kBlock);
      const Friction& friction = end.config.friction[static_cast<std::size_t>(i)];
      const double size = part.norm();
      end.truth += -end.force.template segment<kBlock>(i * kBlock).dot(part) + friction.coulomb * size +
                   friction.viscous * size * size / seconds(held);
    }
    end.port->observe({end.force, seen, held});
  }

  void look(const End& end) {
    balance_.least_account = std::min(balance_.least_account, end.port->payable());
    balance_.finite = balance_.finite && std::isfinite(end.port->energy()) && end.force.allFinite();
  }

  void step(std::size_t i) {
    End& end = ends_[i];
    Duration held = end.period;
    if (dice_.chance(0.5)) held = from_seconds(seconds(held) * dice_.within(0.25, 1));
    move(end, motion(end, held), held);
    look(end);
    links_[1 - i].deliver(now_, [&](const EnergyTankMessage& message) { end.tank->receive(0, message); });
    const Vec<kSize> force = wanted(end, ends_[1 - i]);
    const double loss = end.port->worst_loss(force.allFinite() ? force : Vec<kSize>(Vec<kSize>::Zero()));
    const auto settlement = end.tank->settle({end.port->payable(), loss, end.period, !dice_.chance(0.1)});
    end.port->credit(settlement.credit);
    end.port->withdraw(settlement.withdraw);
    balance_.given += settlement.withdraw;
    end.force = end.port->limit({force}).force * bound_;
    look(end);
    const EnergyTankMessage message = end.tank->message(0);
    links_[i].send(now_, message);
    if (dice_.chance(duplicates_)) links_[i].send(now_, message);
  }

  Dice dice_;
  double bound_;
  bool loops_;
  double duplicates_ = 0;
  std::array<End, 2> ends_;
  std::vector<OneWay<EnergyTankMessage>> links_;
  int now_ = 0;
  Balance balance_;
};

template <class Limits>
class HandleTank : public ::testing::Test {};
using HandlePorts = testing::Types<WrenchPort, GripPort>;
TYPED_TEST_SUITE(HandleTank, HandlePorts);

template <class Limits>
void expect_no_pair_gains(std::uint64_t pairs, bool loops) {
  Balance all;
  for (std::uint64_t seed = 1; seed <= pairs; ++seed) {
    const Balance balance = HandlePair<Limits>(seed, 1, loops).run(2000);
    EXPECT_FALSE(balance.broken()) << "seed " << seed << ": account " << balance.least_account << " J, sum "
                                   << balance.least_sum << " J";
    all.add(balance);
  }
  std::cout << pairs << " pairs: least account " << all.least_account << " J, least sum of ledgers " << all.least_sum
            << " J, given " << all.given << " J\n";
  EXPECT_TRUE(all.finite);
  EXPECT_GT(all.given, 0.01 * static_cast<double>(pairs)) << "nobody gave anything: nothing was tested";
}

TYPED_TEST(HandleTank, NoAccountAndNoSumOfLedgersIsEverNegative) { expect_no_pair_gains<TypeParam>(150, false); }

TYPED_TEST(HandleTank, ABoundOnePercentTooHighIsFound) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    found += HandlePair<TypeParam>(seed, 1.01).run(2000).broken() ? 1 : 0;
  }
  std::cout << "found in " << found << " of 100 pairs\n";
  EXPECT_GT(found, 0);
}

TEST(HandleTankLoops, ClosedLoopsOfTurnsGainNothing) { expect_no_pair_gains<WrenchPort>(100, true); }

TYPED_TEST(HandleTank, WhatIsPaidIsWhatTheForceMayLose) {
  typename TypeParam::Config config;
  config.law = Law::kAolPlus;
  config.friction.fill({0.02, 0.26});
  config.longest_hold = std::chrono::milliseconds(1);
  config.shared_account = true;
  TypeParam port(config);
  Vec<TypeParam::kSize> wanted = Vec<TypeParam::kSize>::Constant(1.5);
  EXPECT_LE(port.limit({wanted}).force.norm(), 0.06) << "without an account friction alone permits it";
  const double loss = port.worst_loss(wanted);
  port.credit(loss);
  EXPECT_DOUBLE_EQ(port.payable(), loss);
  EXPECT_NEAR((port.limit({wanted}).force - wanted).norm(), 0, 1e-9) << "paid in full";
  port.withdraw(0.5 * loss);
  EXPECT_LT(port.limit({wanted}).force.norm(), 0.9 * wanted.norm());
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    port.credit(bad);
    port.withdraw(bad);
  }
  EXPECT_DOUBLE_EQ(port.payable(), 0.5 * loss);
}

TYPED_TEST(HandleTank, TheEnergyCapKeepsWhatAPeerPaidForTheForce) {
  for (const bool shared : {true, false}) {
    typename TypeParam::Config config;
    config.law = Law::kAolPlus;
    config.friction.fill({0.02, 0.26});
    config.longest_hold = std::chrono::milliseconds(1);
    config.parts.energy_cap = {1e-5, 1};
    config.shared_account = shared;
    TypeParam port(config);
    const Vec<TypeParam::kSize> wanted = Vec<TypeParam::kSize>::Constant(3);
    port.credit(1);
    port.limit({wanted});
    EXPECT_NEAR(port.payable(), 1e-5 + (shared ? port.worst_loss(wanted) : 0), 1e-12);
  }
}

TYPED_TEST(HandleTank, ALawWithoutAnAccountIsRefused) {
  typename TypeParam::Config config;
  config.friction.fill({0.02, 0.26});
  config.longest_hold = std::chrono::milliseconds(1);
  config.law = Law::kNone;
  TypeParam port(config);
  port.credit(1);
  port.withdraw(2);
  EXPECT_EQ(port.payable(), 0);
  EXPECT_EQ(port.worst_loss(Vec<TypeParam::kSize>::Zero()), kUnlimited);
  config.shared_account = true;
  EXPECT_THROW(TypeParam{config}, std::invalid_argument);
}

TEST(HandleTankScene, AWrenchAndAGripShareWhereThePointDoes) {
  LimiterConfig point;
  point.law = Law::kAolPlus;
  point.friction = {0.02, 0.26};
  point.longest_hold = std::chrono::milliseconds(1);
  for (const bool shared : {true, false}) {
    point.shared_account = shared;
    EXPECT_EQ(wrench_config(point, {.friction = {1e-4, 1e-3}, .max_torque = 1}).shared_account, shared);
    EXPECT_EQ(grip_config(point, {.friction = {0.02, 0.26}, .arm = 0.1, .max_force = 1}).shared_account, shared);
  }
}

}  // namespace
}  // namespace tendon::handle_tank_test

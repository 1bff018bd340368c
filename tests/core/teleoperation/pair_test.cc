// SPDX-License-Identifier: Apache-2.0
#include "tests/core/teleoperation/pair.h"

#include <gtest/gtest.h>

#include <array>
#include <complex>
#include <iostream>
#include <numbers>

namespace tendon::pair_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNanojoule = 1e-9;
constexpr std::array kRoundTrips = {0, 10, 50, 200, 600};  // ms

constexpr AolPlus<1, 3>::Parts kCapped{.energy_cap = AolPlus<1, 3>::EnergyCap{}};

double ramp(double t, double far) {
  if (t <= 0) return 0;
  return t >= 0.5 ? far : far * (1 - std::cos(2 * kPi * t)) / 2;
}

/// The target of the hand is 30 mm. The wall of the follower is at 10 mm.
PairConfig pressing(double wall, double hand = 400, double depth = 0.03) {
  PairConfig config;
  config.leader.around = {.stiffness = hand, .damping = 2, .reference = [depth](double t) { return ramp(t, depth); }};
  config.follower.around = {.stiffness = wall, .reference = [](double) { return 0.01; }, .wall = true};
  return config;
}

/// A hand oscillates with 20 mm at 1 Hz and a free follower.
PairConfig waving() {
  PairConfig config;
  config.leader.around = {
      .stiffness = 400, .damping = 2, .reference = [](double t) { return 0.02 * std::sin(2 * kPi * t); }};
  return config;
}

void use_law(PairConfig& config, Law law) {
  for (EndConfig* end : {&config.leader, &config.follower}) {
    end->law = law;
    if (law == Law::kAolPlus) end->parts = kCapped;
  }
}

TEST(Pair, WithoutATankTheFollowerDoesNotFollow) {
  PairConfig config = waving();
  config.max_account = 1e-12;  // this is too small to receive or to give any energy
  Pair pair(config);
  double farthest = 0;
  pair.run(3, [&](double) { farthest = std::max(farthest, std::abs(pair.follower.body.x)); });
  EXPECT_LT(farthest, 1e-3);
  Pair shared(waving());
  shared.run(3, [&](double) { farthest = std::max(farthest, std::abs(shared.follower.body.x)); });
  EXPECT_GT(farthest, 0.012);
}

struct Limiters {
  double b_leader, b_follower;
  int t_leader, t_follower;  ///< tenths of a millisecond

  /// N/m, core/PROOFS.md, "Operational stiffness".
  double stiffness() const { return 1 / (t_leader * 1e-4 / (2 * b_leader) + t_follower * 1e-4 / (2 * b_follower)); }
};
constexpr Limiters kLimiters[] = {
    {0.26, 0.26, 10, 10}, {0.5, 0.5, 10, 10}, {0.26, 1.0, 10, 10}, {0.26, 0.5, 10, 20}, {1.0, 0.3, 20, 5}};

struct Pulled {
  double slope = 0;  ///< slope of the force at the leader, N/m
  double force = 0;  ///< force at the leader, N
  double there = 0;  ///< force at the follower, N
};

/// Moves the leader for 2 s. The follower does not move, and there is no delay.
Pulled pulled(const Limiters& c, double stiffness, double speed) {
  PairConfig config;
  config.leader.path = [speed](double t) { return speed * t; };
  config.follower.path = [](double) { return 0.0; };
  config.leader.friction = {0, c.b_leader};
  config.follower.friction = {0, c.b_follower};
  config.leader.period = c.t_leader;
  config.follower.period = c.t_follower;
  for (EndConfig* end : {&config.leader, &config.follower}) {
    end->spring = {.stiffness = stiffness, .adapt_to_delay = false};
  }
  Pair pair(config);
  pair.run(1);
  const double force = pair.leader.applied;
  pair.run(1);
  return {(force - pair.leader.applied) / (speed * 1), pair.leader.applied, pair.follower.applied};
}

TEST(Pair, ItsStiffnessIsThatOfTheTwoLimitersInSeries) {
  for (const Limiters& c : kLimiters) {
    const Pulled found = pulled(c, 1e4, 0.005);
    std::cout << "b " << c.b_leader << ", " << c.b_follower << "; T " << c.t_leader / 10.0 << ", "
              << c.t_follower / 10.0 << " ms: " << found.slope << " N/m, predicted " << c.stiffness() << "\n";
    EXPECT_NEAR(found.slope / c.stiffness(), 1, 0.03);
    EXPECT_NEAR(found.there / -found.force, 1, 0.03);
  }
}

TEST(Pair, ASpringOfThatStiffnessIsHeldAndOneTwoPercentStifferIsNot) {
  for (const Limiters& c : kLimiters) {
    const double most = c.stiffness();
    EXPECT_NEAR(pulled(c, most, 0.05).slope, most, 1e-3 * most) << c.b_leader << ' ' << c.b_follower;
    EXPECT_LT(pulled(c, 1.02 * most, 0.05).slope, 0.985 * 1.02 * most) << c.b_leader << ' ' << c.b_follower;
  }
}

TEST(Pair, FreeMotionDragsByStiffnessTimesRoundTripAndAllDamping) {
  struct Case {
    double stiffness;
    int one_way;  // tenths of a ms
    double own_damping;
  };
  for (const Case& c : {Case{400, 0, 0.5}, Case{400, 40, 2}, Case{100, 100, 2}, Case{200, 150, 4}}) {
    constexpr double kAmplitude = 0.05;
    constexpr double kHertz = 0.25;
    PairConfig config;
    config.leader.path = [](double t) { return kAmplitude * std::sin(2 * kPi * kHertz * t); };
    for (EndConfig* end : {&config.leader, &config.follower}) {
      end->spring = {.stiffness = c.stiffness, .own_damping = c.own_damping, .adapt_to_delay = false};
    }
    config.there.delay = config.back.delay = c.one_way;
    Pair pair(config);
    pair.run(4);
    const std::uint64_t cut = pair.leader.cut + pair.follower.cut;
    double work = 0;
    double squares = 0;
    pair.run(8, [&](double) {
      work -= pair.leader.applied * pair.leader.speed;
      squares += pair.leader.speed * pair.leader.speed;
    });
    // The leader steps first in a tick: the follower uses its state at once, and its answer is used one period later.
    const double loop = std::max(2 * c.one_way, 10) * 1e-4;
    EXPECT_NEAR(seconds(pair.leader.spring.round_trip()), loop, 1e-9);
    const double expected = c.stiffness * loop + 2 * c.own_damping + config.follower.friction.viscous +
                            4 * config.follower.friction.coulomb / (kPi * kAmplitude * 2 * kPi * kHertz);
    std::cout << "K " << c.stiffness << ", T_loop " << loop * 1e3 << " ms, B " << c.own_damping << ": "
              << work / squares << " N·s/m, predicted " << expected << "\n";
    EXPECT_NEAR(work / squares / expected, 1, 0.03);
    EXPECT_EQ(pair.leader.cut + pair.follower.cut, cut) << "a clipped force is not the spring's";
  }
}

/// Returns the force in a press against a hard wall (N) and the energy of both accounts before it (J), after
/// oscillating for `waves` s.
std::pair<double, double> felt_after(Law law, double waves) {
  PairConfig config = pressing(5000, 400, 0.05);
  const auto press = config.leader.around.reference;
  config.leader.around.reference = [press, waves](double t) {
    return t < waves ? 0.009 * std::sin(2 * kPi * t) : press(t - waves);
  };
  use_law(config, law);
  Pair pair(config);
  pair.run(waves);
  const double waved = pair.leader.limiter.payable() + pair.follower.limiter.payable();
  pair.run(4);
  return {-pair.leader.applied, waved};
}

TEST(Pair, AnEnergyCapCutsNothingOfAForceThatIsPaidFor) {
  // The cap limits the energy that is stored in free motion, but there must be enough energy for a held force.
  const auto [felt, none] = felt_after(Law::kAol, 0);
  const auto [felt_capped, waved_capped] = felt_after(Law::kAolPlus, 20);
  const auto [felt_waved, waved] = felt_after(Law::kAol, 20);
  std::cout << "AOL " << felt << " N; after 20 s of waving " << felt_waved << " N of " << 1e3 * waved
            << " mJ, with the cap " << felt_capped << " N of " << 1e3 * waved_capped << " mJ\n";
  EXPECT_GE(felt_capped, 0.99 * felt);
  EXPECT_GT(felt, 5);
  EXPECT_LT(waved_capped, 0.02);
  EXPECT_GT(waved, 0.1);
}

TEST(Pair, AHeldForceIsThatAtTheWallOverAnyNetwork) {
  for (const Law law : {Law::kAol, Law::kAolPlus}) {
    for (const double wall : {500.0, 5000.0}) {
      for (const int round_trip : kRoundTrips) {
        for (std::uint64_t hand = 0; hand < 4; ++hand) {  // hand 0 has 400 N/m, the others are random
          Dice dice(2000 + hand);
          PairConfig config = pressing(wall, hand == 0 ? 400 : dice.within(150, 600));
          use_law(config, law);
          make_bad(config, round_trip, 7 + hand);
          Pair pair(config);
          pair.run(6);
          double worst = 0;
          pair.run(2, [&](double) {
            const double felt = -pair.leader.applied;
            const double at_wall = -pair.follower.body.outside;
            worst = std::max(worst, std::abs(felt - at_wall) - 0.01 * at_wall);
          });
          const double at_wall = -pair.follower.body.outside;
          if (hand == 0) {
            std::cout << info(law).name << ", wall " << wall << " N/m, RTT " << round_trip << " ms: K "
                      << pair.leader.spring.stiffness() << " N/m, felt " << -pair.leader.applied << " N, at the wall "
                      << at_wall << " N, cut " << pair.leader.cut << "\n";
          }
          EXPECT_LE(worst, 2 * config.leader.friction.coulomb) << "RTT " << round_trip << ", hand " << hand;
          EXPECT_GT(at_wall, round_trip > 200 ? 0.1 : 0.5) << "nothing was held";
          EXPECT_GE(pair.least_account, -kNanojoule);
          EXPECT_GE(pair.least_sum, -kNanojoule);
        }
      }
    }
  }
}

TEST(Pair, ItIsQuietHeldAndFreeAtEveryRoundTrip) {
  for (const Law law : {Law::kAol, Law::kAolPlus}) {
    for (const int round_trip : kRoundTrips) {
      for (const bool held : {true, false}) {
        double ripple = 0;
        double buzz = 0;
        for (std::uint64_t seed = 3; seed < 7; ++seed) {
          PairConfig config = held ? pressing(500) : waving();
          use_law(config, law);
          make_bad(config, round_trip, seed);
          Pair pair(config);
          std::array force = {HighPass(50), HighPass(50)};
          std::array speed = {HighPass(20), HighPass(20)};
          pair.run(8, [&](double t) {
            const bool counts = t > 4;
            force[0].add(pair.leader.applied, counts);
            force[1].add(pair.follower.applied, counts);
            speed[0].add(pair.leader.body.v, counts);
            speed[1].add(pair.follower.body.v, counts);
          });
          ripple = std::max({ripple, force[0].rms(), force[1].rms()});
          buzz = std::max({buzz, speed[0].rms(), speed[1].rms()});
          EXPECT_GE(pair.least_account, -kNanojoule);
          EXPECT_GE(pair.least_sum, -kNanojoule);
        }
        std::cout << info(law).name << (held ? ", held" : ", free") << ", RTT " << round_trip << " ms: ripple "
                  << 1e3 * ripple << " mN, buzz " << 1e3 * buzz << " mm/s\n";
        EXPECT_LT(ripple, 0.02);
        EXPECT_LT(buzz, 2e-3);
      }
    }
  }
}

TEST(Pair, TheHandFeelsTheImpedanceThatLawrenceGives) {
  // In addition to B_l, the hand feels C (Z_f + Z_e)/(C + Z_f + Z_e).
  using Complex = std::complex<double>;
  for (const double stiffness_around : {0.0, 500.0}) {
    for (const double hertz : {0.1, 0.3, 1.0, 3.0, 10.0}) {
      PairConfig config;
      const double w = 2 * kPi * hertz;
      config.leader.path = [w](double t) { return 0.005 * std::sin(w * t); };
      config.follower.around = {.stiffness = stiffness_around};
      for (EndConfig* end : {&config.leader, &config.follower}) {
        end->friction.coulomb = 0;
        end->spring = {.stiffness = 400, .damping = 1, .own_damping = 4, .adapt_to_delay = false};
        end->period = 1;
      }
      Pair pair(config);
      const double settle = std::ceil(hertz) / hertz;
      pair.run(settle + 1 / hertz);
      Complex force = 0;
      Complex speed = 0;
      const double from = pair.time();
      pair.run(2 / hertz, [&](double t) {
        const Complex turn = std::polar(1.0, -w * (t - from));
        force -= pair.leader.applied * turn;
        speed += w * 0.005 * std::cos(w * t) * turn;
      });
      const Complex s(0, w);
      const Complex c = config.leader.spring.stiffness / s + config.leader.spring.damping;
      const Complex z = config.follower.mass * s + config.follower.friction.viscous +
                        config.follower.spring.own_damping + stiffness_around / s;
      const Complex expected = c * z / (c + z);
      const Complex felt = force / speed - config.leader.spring.own_damping;
      std::cout << (stiffness_around > 0 ? "spring, " : "free, ") << hertz << " Hz: felt " << felt << ", expected "
                << expected << "\n";
      EXPECT_LT(std::abs(felt - expected) / std::abs(expected), 0.05);
    }
  }
}

}  // namespace
}  // namespace tendon::pair_test

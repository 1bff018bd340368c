// SPDX-License-Identifier: Apache-2.0
//
// The hard cases of teleoperation with the coupling that the server runs, by each method, with its limiters and without.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <string>

#include "tests/core/teleoperation/ports.h"
#include "tests/core/teleoperation/pressing.h"

namespace tendon {
namespace {

struct HardCase {
  const char* name;
  void (*make)(PortSetup& leader, PortSetup& follower);
  bool breaks_springs = true;  ///< springs without limiters give out energy
};

/// The hand goes to and fro beyond both ends.
void between_stops(PortSetup& /*leader*/, PortSetup& follower) {
  // The follower's workspace ends 5 mm to one side.
  follower.around[0] = {.stiffness = 20000, .damping = 5, .reference = [](double) { return 0.005; }, .wall = true};
}

constexpr HardCase kCases[] = {
    {"a wall of 500 N/m", [](PortSetup&, PortSetup&) {}},
    {"the follower's motor gives 0.8 N", [](PortSetup&, PortSetup& follower) { follower.motor = 0.8; }},
    {"the leader's motor gives 0.5 N", [](PortSetup& leader, PortSetup&) { leader.motor = 0.5; }},
    {"the follower's workspace ends", between_stops},
    {"a follower ten times heavier", [](PortSetup&, PortSetup& follower) { follower.mass *= 10; }, false},
    {"a follower at 500 Hz",
     [](PortSetup& leader, PortSetup& follower) {
       follower.every = 2;
       leader.coupling.peer_period = std::chrono::milliseconds(2);
     }},
    {"the hand lets go while it presses", [](PortSetup& leader, PortSetup&) { leader.around[0].until = 6; }},
    {"a wall that is cut while it is pressed", [](PortSetup&, PortSetup& follower) { follower.around[0].until = 6; }},
    {"a robot that holds its place", [](PortSetup&, PortSetup& follower) { follower.coupling.holds_place = true; }},
    {"a leader with next to no friction", [](PortSetup& leader, PortSetup&) { leader.friction.viscous = 0.02; }},
};

struct Outcome {
  double sum = 0;      // J
  double account = 0;  // J
  double most = 0;     // N, at the leader
  double unrest = 0;   // m/s, the fastest handle in the last second
};

Outcome run(const HardCase& hard, CouplingMethod method, int one_way, bool limited) {
  Pressing with{.method = method, .one_way = one_way};
  if (method == CouplingMethod::kSurface || method == CouplingMethod::kPositionForce) with.stiffness = 1000;
  const Ports made = press(with);
  PortSetup leader = made.leader.setup;
  PortSetup follower = made.follower.setup;
  hard.make(leader, follower);
  leader.limited = follower.limited = limited;
  for (PortSetup* const end : {&leader, &follower}) {
    if (limited) continue;
    end->coupling.spring.adapt_to_delay = false;
    end->coupling.spring.stiffness = 1000;
    end->coupling.spring.own_damping = 0.5;
  }
  Ports ports(leader, follower, bad_way(one_way, 5), bad_way(one_way, 6));
  ports.run(1200);
  EXPECT_TRUE(ports.engage()) << hard.name;
  Outcome outcome;
  Vec3 leader_was = ports.leader.x();
  Vec3 follower_was = ports.follower.x();
  const int end = 3000 + 3 * kPressMs;
  ports.run(end - ports.now, [&](int now) {
    outcome.most = std::max(outcome.most, ports.leader.applied.norm());
    if (now > end - 1000) {
      outcome.unrest = std::max({outcome.unrest, (ports.leader.x() - leader_was).norm() * 1e3,
                                 (ports.follower.x() - follower_was).norm() * 1e3});
    }
    leader_was = ports.leader.x();
    follower_was = ports.follower.x();
  });
  outcome.sum = ports.least_sum;
  outcome.account = ports.least_account();
  return outcome;
}

TEST(CouplingHardCases, WithLimitersNoPairGivesOutEnergyAndEachComesToRest) {
  for (const HardCase& hard : kCases) {
    for (const CouplingMethod method : kCouplingMethods) {
      const Outcome outcome = run(hard, method, 25, true);
      const std::string which = std::string(hard.name) + ", " + std::string(to_string(method));
      std::cout << which << ": at most " << outcome.most << " N, in the end " << outcome.unrest * 1e3 << " mm/s\n";
      EXPECT_GE(outcome.sum, kRounding) << which;
      EXPECT_GE(outcome.account, kRounding) << which;
      EXPECT_LE(outcome.most, 8 * (1 + 1e-9)) << which;
      EXPECT_LT(outcome.unrest, 0.12) << which;
    }
  }
}

TEST(CouplingHardCases, SpringsWithoutLimitersGiveOutEnergyInAllButOne) {
  for (const HardCase& hard : kCases) {
    const Outcome outcome = run(hard, CouplingMethod::kPositionPosition, 25, false);
    std::cout << hard.name << ": pair " << outcome.sum << " J\n";
    if (hard.breaks_springs) {
      EXPECT_LT(outcome.sum, -0.1) << hard.name;
    }
  }
}

TEST(CouplingHardCases, AMotorThatCannotHoldTheForceOfWavesLosesNoPlace) {
  for (const double motor : {0.3, 0.8}) {
    Pressing with{.impedance = 10, .one_way = 10};
    const Ports made = press(with);
    PortSetup follower = made.follower.setup;
    follower.motor = motor;
    Ports ports(made.leader.setup, follower, bad_way(10, 5), bad_way(10, 6));
    ports.run(1200);
    ASSERT_TRUE(ports.engage());
    ports.run(3000 + 2 * kPressMs - 200 - ports.now);  // the press is over, and the hand is back
    EXPECT_GE(ports.least_sum, kRounding);
    const double apart = std::abs(ports.leader.x().x() - ports.follower.x().x());
    const double friction = 2 * 0.02 / ports.leader.coupling->stiffness();
    std::cout << motor << " N: " << apart * 1e3 << " mm apart, friction holds " << friction * 1e3 << " mm\n";
    EXPECT_LE(apart, friction + 2 * 20e-6);
  }
}

}  // namespace
}  // namespace tendon

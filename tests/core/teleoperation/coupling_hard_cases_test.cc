// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <string>

#include "tests/core/teleoperation/ports.h"
#include "tests/core/teleoperation/pressing.h"

namespace tendon::coupling_hard_cases_test {
namespace {

struct Draft {
  PortSetup leader, follower;
  Network there, back;
};

struct HardCase {
  const char* name;
  void (*make)(Draft& draft);
  bool breaks_springs = true;  ///< springs without limiters generate energy
  double bounces = 0;          ///< m/s, speed of a follower that keeps bouncing on its wall (position–force and
};

constexpr HardCase kCases[] = {
    {"a wall of 500 N/m", [](Draft&) {}},
    {"the follower's motor gives 0.8 N", [](Draft& d) { d.follower.motor = 0.8; }},
    {"the leader's motor gives 0.5 N", [](Draft& d) { d.leader.motor = 0.5; }},
    {"the follower's workspace ends",  // 5 mm to one side; the hand moves farther
     [](Draft& d) {
       d.follower.around[0] = {
           .stiffness = 20000, .damping = 5, .reference = [](double) { return 0.005; }, .wall = true};
     }},
    {"a follower ten times heavier", [](Draft& d) { d.follower.mass *= 10; }, false, 0.1},
    {"a follower at 500 Hz",
     [](Draft& d) {
       d.follower.every = 2;
       d.leader.coupling.peer_period = std::chrono::milliseconds(2);
     }},
    {"the hand lets go while it presses", [](Draft& d) { d.leader.around[0].until = 6; }},
    {"a wall that is cut while it is pressed", [](Draft& d) { d.follower.around[0].until = 6; }},
    {"a robot that holds its place", [](Draft& d) { d.follower.coupling.holds_place = true; }},
    {"a wall that is stiff at every second press",
     [](Draft& d) {
       d.follower.around[0].stiffer = [](double t) {
         return std::fmod(t - 2, 4e-3 * kPressMs) > 2e-3 * kPressMs ? 20. : 1.;
       };
     }},
    {"a leader with next to no friction", [](Draft& d) { d.leader.friction.viscous = 0.02; }},
    {"a round trip that grows to 300 ms while it presses",
     [](Draft& d) {
       for (Network* const way : {&d.there, &d.back}) {
         way->longer_from = 5000;
         way->longer_by = 125;
       }
     }},
    {"one way 5 ms, the other 200 ms",
     [](Draft& d) {
       d.there.delay = 5;
       d.back.delay = 200;
     }},
    {"half of the states come twice, the second time late", [](Draft& d) { d.there.repeated = d.back.repeated = 0.5; }},
    {"150 ms without a state at the impact",
     [](Draft& d) {
       for (Network* const way : {&d.there, &d.back}) {
         way->cut_from = 3200;
         way->cut_until = 3350;
       }
     }},
    {"0.5 m/s into 20 kN/m",
     [](Draft& d) {
       d.follower.around[0].stiffness = 20000;
       d.leader.around[0].reference = [](double t) { return std::clamp(0.5 * (t - 3), 0.0, 0.03); };
     },
     false},
    {"hands at both ends against each other",
     [](Draft& d) {
       d.follower.around[0] = {.stiffness = 300, .damping = 2, .reference = [](double t) {
                                 return t < 15 ? -0.02 * std::sin(9 * t) : 0.0;
                               }};
     }},
    {"a wall that comes at 20 mm/s and is removed",
     [](Draft& d) {
       d.follower.around[0].reference = [](double t) { return 0.01 - 0.02 * std::clamp(t - 4, 0.0, 1.0); };
       d.follower.around[0].until = 6;
     }},
};

struct Outcome {
  double sum = 0;      // J
  double account = 0;  // J
  double most = 0;     // N at the leader
  double unrest = 0;   // m/s, largest handle speed in the last second
};

Outcome run(const HardCase& hard, CouplingMethod method, int one_way, bool limited) {
  Pressing with{.method = method, .one_way = one_way};
  if (method == CouplingMethod::kSurface || method == CouplingMethod::kPositionForce) with.stiffness = 1000;
  const Ports made = press(with);
  Draft draft{made.leader.setup, made.follower.setup, bad_way(one_way, 5), bad_way(one_way, 6)};
  hard.make(draft);
  for (PortSetup* const end : {&draft.leader, &draft.follower}) {
    end->limited = limited;
    if (limited) continue;
    end->coupling.spring.adapt_to_delay = false;
    end->coupling.spring.stiffness = 1000;
    end->coupling.spring.own_damping = 0.5;
  }
  Ports ports(draft.leader, draft.follower, draft.there, draft.back);
  ports.run(1200);
  EXPECT_TRUE(ports.engage()) << hard.name;
  Outcome outcome;
  Vec3 leader_was = ports.leader.x();
  Vec3 follower_was = ports.follower.x();
  const int end = 3000 + 5 * kPressMs;  // this is in the third press
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

TEST(CouplingHardCases, NoPairGivesOutEnergyAndAllButTheHeavyFollowerRest) {
  for (const HardCase& hard : kCases) {
    for (const CouplingMethod method : kCouplingMethods) {
      const Outcome outcome = run(hard, method, 25, true);
      const std::string which = std::string(hard.name) + ", " + std::string(to_string(method));
      std::cout << which << ": at most " << outcome.most << " N, in the end " << outcome.unrest * 1e3 << " mm/s\n";
      EXPECT_GE(outcome.sum, kRounding) << which;
      EXPECT_GE(outcome.account, kRounding) << which;
      EXPECT_LE(outcome.most, 8 * (1 + 1e-9)) << which;
      const bool felt_late = method == CouplingMethod::kPositionForce || method == CouplingMethod::kPassivity;
      const double bounces = felt_late ? hard.bounces : 0;
      // In rate control the handle is not released, so the follower continues to move if there is no wall.
      const double asked = method == CouplingMethod::kRate ? 0.06 : 0;
      EXPECT_LT(outcome.unrest, std::max({bounces, asked, 0.025})) << which;
    }
  }
}

TEST(CouplingHardCases, SpringsWithoutLimitersGiveOutEnergyInAllButTwo) {
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
    ports.run(3000 + 2 * kPressMs - 200 - ports.now);  // the hand has returned from the press
    EXPECT_GE(ports.least_sum, kRounding);
    const double apart = std::abs(ports.leader.x().x() - ports.follower.x().x());
    const double friction = 2 * 0.02 / ports.leader.coupling->stiffness();
    std::cout << motor << " N: " << apart * 1e3 << " mm apart, friction holds " << friction * 1e3 << " mm\n";
    EXPECT_LE(apart, friction + 2 * 20e-6);
  }
}

TEST(CouplingHardCases, ANewActForgetsTheWavesThatTheLastOneLeftUnsent) {
  const Ports made = press({.impedance = 10, .one_way = 10});
  PortSetup leader = made.leader.setup;
  leader.motor = 0.3;
  Ports ports(leader, made.follower.setup, bad_way(10, 5), bad_way(10, 6));
  ports.run(1200);
  ASSERT_TRUE(ports.engage());
  ports.run(5000 - ports.now);
  ports.leader.coupling->disengage();
  ports.run(9500 - ports.now);  // the hand has returned and rests
  const Vec3 before = ports.follower.x();
  ASSERT_TRUE(ports.engage());
  double most = 0;
  ports.run(1000, [&](int) { most = std::max(most, (ports.follower.x() - before).norm()); });
  EXPECT_GE(ports.least_sum, kRounding);
  EXPECT_LT(most, 40e-6);
}

TEST(CouplingHardCases, AFollowerForgetsThemToo) {
  auto config = coupling_of(PortRole::kFollower);
  config.method = CouplingMethod::kWaves;
  config.spring.max_force = 5;
  config.tank.reset();
  Played played(config);
  const auto period = [&](PortPhase leader, std::uint64_t act, const Vec3& dx, double payable) {
    played.receive(played.state(leader, act));
    played.port.observe({Vec3::Zero(), dx, std::chrono::milliseconds(1)}, payable);
    played.step();
  };
  for (int i = 0; i < 3; ++i) period(PortPhase::kCoupled, 0, Vec3::Zero(), 0);
  for (int i = 0; i < 10; ++i) period(PortPhase::kEngaged, 1, Vec3(1e-3, 0, 0), 0);  // no energy for the wave line
  EXPECT_TRUE(played.port.live());
  EXPECT_TRUE(played.told.wave_integral.isZero(0));
  for (int i = 0; i < 500; ++i) period(PortPhase::kCoupled, 1, Vec3::Zero(), 0);  // the ramp has ended
  for (int i = 0; i < 100; ++i) period(PortPhase::kEngaged, 2, Vec3::Zero(), i == 0 ? 0 : 1);
  EXPECT_TRUE(played.port.live());
  EXPECT_TRUE(played.told.wave_integral.isZero(0)) << played.told.wave_integral;
}

}  // namespace
}  // namespace tendon::coupling_hard_cases_test

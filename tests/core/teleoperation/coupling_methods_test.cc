// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include "tests/core/teleoperation/expect_felt.h"
#include "tests/core/teleoperation/expect_ports.h"
#include "tests/core/teleoperation/ports.h"
#include "tests/core/teleoperation/pressing.h"
#include "tests/core/teleoperation/recorded_rig.h"

namespace tendon::coupling_methods_test {
namespace {

double median(std::vector<double> of) {
  std::sort(of.begin(), of.end());
  return of[of.size() / 2];
}

/// Force in the second press relative to a rigid link. Hands of 150 to 600 N/m, each with a different bad network.
std::vector<double> shares(Pressing with, std::uint64_t first_seed, double& buzz) {
  std::vector<double> all;
  for (std::uint64_t seed = first_seed; seed < first_seed + 21; ++seed) {
    with.seed = seed;
    with.hand = 150 + 450 * static_cast<double>(seed * 7919 % 1000) / 1000;
    const Felt felt = feel(with);
    expect_passive(felt, std::to_string(seed));
    all.push_back(felt.second / rigid(with));
    buzz = std::max(buzz, felt.buzz);
  }
  return all;
}

TEST(CouplingMethods, WavesAreFeltAlikeAtBothEndsAndThePairIsPassive) {
  for (const int one_way : {0, 5, 25, 100, 300, 350, 400}) {
    const Felt felt = feel({.one_way = one_way});
    print("waves, round trip " + std::to_string(2 * one_way) + " ms", felt);
    expect_passive(felt, std::to_string(one_way));
    // If the delay is 600 ms or more, the force does not settle within a press of 4 s.
    if (one_way <= 100) {
      EXPECT_NEAR(felt.second, felt.wall, 0.04 + 0.02 * felt.wall) << one_way;
    }
    const double line = felt.stiffness;
    const double ideal = (kPressingDepth - kPressingWallAt) / (1 / kPressingHand + 1 / line + 1.0 / 500);
    EXPECT_GT(felt.second, 0.8 * ideal) << one_way;
    EXPECT_LT(felt.buzz, 2e-3) << one_way;
  }
}

TEST(CouplingMethods, WavesNeedNoTank) {
  for (const int one_way : {5, 100}) {
    const double with = feel({.one_way = one_way}).second;
    const double without = feel({.tank = false, .one_way = one_way}).second;
    EXPECT_NEAR(without, with, 0.05 * with) << one_way;
  }
}

TEST(CouplingMethods, WavesAt200MsGiveAQuarterOfARigidLinksForce) {
  double buzz = 0;
  const auto all = shares({.impedance = 10, .tank = false, .one_way = 100}, 3001, buzz);
  std::cout << "waves of 10 N·s/m, round trip 200 ms, n = 21 from seed 3001: share " << median(all) << ", least "
            << *std::min_element(all.begin(), all.end()) << ", buzz " << buzz * 1e3 << " mm/s\n";
  EXPECT_GE(median(all), 0.23);
  EXPECT_LT(buzz, 2e-3);
}

TEST(CouplingMethods, ASurfaceAt600MsIsFeltOnTheSecondPressAsByARigidLink) {
  double buzz = 0;
  const Pressing robot{.method = CouplingMethod::kSurface, .stiffness = 1000, .one_way = 300};
  const auto all = shares(robot, 3001, buzz);
  std::cout << "surface, round trip 600 ms, n = 21 from seed 3001: share " << median(all) << ", least "
            << *std::min_element(all.begin(), all.end()) << ", buzz " << buzz * 1e3 << " mm/s\n";
  EXPECT_GE(median(all), 0.93);
  EXPECT_LT(buzz, 2e-3);
}

TEST(CouplingMethods, SevenSecondsOfRoundTripAreStableByEachMethod) {
  for (const CouplingMethod method : kCouplingMethods) {
    Ports ports = press({.method = method, .one_way = 3500});
    ports.run(9000);
    ASSERT_TRUE(ports.leader.coupling->engage());
    ports.run(12'000);
    ASSERT_TRUE(ports.leader.coupling->live()) << to_string(method);
    double most = 0;
    double fastest = 0;
    Vec3 before = ports.leader.x();
    ports.run(60'000, [&](int) {
      most = std::max(most, ports.leader.applied.norm());
      fastest = std::max(fastest, (ports.leader.x() - before).norm() * 1e3);
      before = ports.leader.x();
    });
    std::cout << to_string(method) << ", round trip 7 s: at most " << most << " N, " << fastest << " m/s\n";
    expect_passive(ports, to_string(method));
    EXPECT_LT(fastest, 0.5) << to_string(method);
    EXPECT_TRUE(ports.leader.coupling->live()) << to_string(method);
  }
}

TEST(CouplingMethods, RecordedMotionOfBothPortsOfARigGetsNoEnergyOut) {
  const char* const data = std::getenv("TENDON_DATA");  // NOLINT(concurrency-mt-unsafe): one thread
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: no recorded rig";
  for (const char* const name : {"m2_question1d_foam.csv", "m2_question1d_rigid.csv"}) {
    const auto file = std::filesystem::path(data) / "tue-1dof-teleop" / name;
    for (const CouplingMethod method : kCouplingMethods) {
      for (const int one_way : {0, 25, 100, 350}) {
        Ports made = press({.method = method, .one_way = one_way, .seed = 17});
        PortSetup leader = made.leader.setup;
        PortSetup follower = made.follower.setup;
        const auto along = [&](PortSetup& setup, const char* column) {
          setup.path = [x = recorded(file, column)](double t) { return Vec3(x(std::max(0.0, t - 1.5)), 0, 0); };
        };
        along(leader, "master_pos_rad");
        along(follower, "slave_pos_rad");
        Ports ports(leader, follower, bad_way(one_way, 17), bad_way(one_way, 18));
        ports.run(800);
        ASSERT_TRUE(ports.engage());
        double largest = 0;
        ports.run(5000, [&](int) { largest = std::max(largest, ports.leader.applied.norm()); });
        const std::string which =
            std::string(name) + " " + std::string(to_string(method)) + " " + std::to_string(one_way);
        expect_passive(ports, which);
        if (method == CouplingMethod::kPositionPosition || method == CouplingMethod::kWaves) {
          EXPECT_GT(largest, 0.05) << which << ": nothing was rendered";
        }
      }
    }
  }
}

TEST(CouplingMethods, WavesAndASurfaceKeepTheScalesOfTheMap) {
  const PoseMap::Config maps[] = {{.position_scale = 0.2, .force_scale = 5}, {.position_scale = 2, .force_scale = 0.5}};
  for (const PoseMap::Config& map : maps) {
    // The leader feels s_f s_x times the stiffness of the wall.
    Pressing with{.wall = 500 / (map.position_scale * map.force_scale), .map = map, .one_way = 10};
    const Felt waves = feel(with);
    expect_passive(waves, "waves");
    EXPECT_NEAR(waves.second, map.force_scale * waves.wall, 0.02 * (1 + map.force_scale) + 0.02 * waves.second);
    EXPECT_GT(waves.second, 1);
    with.method = CouplingMethod::kSurface;
    with.stiffness = 2000;
    const Felt surface = feel(with);
    expect_passive(surface, "surface");
    EXPECT_NEAR(surface.stiffness, 500, 10);
    EXPECT_NEAR(surface.second, rigid({}), 0.15 * rigid({}));
  }
}

TEST(CouplingMethods, AfterAHundredClutchesWavesHaveNotShiftedTheTwoPlaces) {
  Pressing with{.impedance = 10, .one_way = 10};
  Ports ports = press(with);
  ports.leader.setup.around[0].stiffness = 0;
  PortSetup leader = ports.leader.setup;
  leader.around[0] = {.stiffness = 400, .damping = 3, .reference = [](double t) {
                        return t < 60 ? 0.005 * std::sin(2 * std::numbers::pi * 0.7 * t) : 0.0;
                      }};
  Ports waving(leader, ports.follower.setup, bad_way(10, 5), bad_way(10, 6));
  ASSERT_TRUE(waving.engage());
  const double began = waving.follower.x().x();
  double led = 0;
  double before = waving.leader.x().x();
  bool live = true;
  waving.run(63'000, [&](int now) {
    waving.leader.buttons = now < 60'000 && now % 600 > 300 ? 1 : 0;
    const bool lives = waving.leader.coupling->live();
    const double x = waving.leader.x().x();
    if (live && lives) led += x - before;
    before = x;
    live = lives;
  });
  EXPECT_TRUE(live);
  EXPECT_GE(waving.least_sum, kRounding);
  const double drift = std::abs(waving.follower.x().x() - began - led);
  const double bound = 2 * 0.02 / waving.leader.coupling->stiffness() + 2 * 20e-6;
  std::cout << "waves, 100 clutches: " << drift * 1e3 << " of " << bound * 1e3 << " mm\n";
  EXPECT_LE(drift, bound);
}

TEST(CouplingMethods, AClutchedLeaderHoldsTheFollowerOnTheLine) {
  Ports ports = press({.impedance = 10, .one_way = 5});
  ports.run(50);
  ASSERT_TRUE(ports.engage());
  ports.run(14'000 - ports.now);  // during the second press
  const double pressed = ports.follower.outside().x();
  ASSERT_LT(pressed, -1.5);
  ports.leader.buttons = 1;
  ports.run(1300);
  EXPECT_TRUE(ports.leader.applied.isZero());
  EXPECT_NEAR(ports.follower.outside().x(), pressed, 0.5) << "1 mm of the wall";
  EXPECT_GE(ports.least_sum, kRounding);
}

TEST(CouplingMethods, AWallThatIsGoneIsGoneForTheLeaderOnceTheToolPassed) {
  constexpr int kOneWay = 300;
  Ports ports = press(
      {.method = CouplingMethod::kSurface, .impedance = 2, .stiffness = 1000, .wall_until = 9, .one_way = kOneWay});
  ports.run(1200);
  ASSERT_TRUE(ports.engage());
  ports.run(11'500 - ports.now);  // start of the second press
  int passed = 0;
  int felt = 0;
  ports.run(3500, [&](int now) {
    if (passed == 0 && ports.follower.x().x() > kPressingWallAt + 1e-3) passed = now;
    if (-ports.leader.demand.force.x() > 0.5) felt = now;
  });
  ASSERT_GT(passed, 0);
  EXPECT_LE(felt - passed, 2 * kOneWay + 50);
  EXPECT_LT(-ports.leader.applied.x(), 0.1);
}

TEST(CouplingMethods, AWallThatComesNearerIsWhereItIsOnTheNextPress) {
  for (const int one_way : {0, 25, 100, 300}) {
    const Pressing with{.method = CouplingMethod::kSurface, .stiffness = 1000, .one_way = one_way};
    const Ports made = press(with);
    PortSetup follower = made.follower.setup;
    follower.around[0].reference = [](double t) { return kPressingWallAt - 0.02 * std::clamp(t - 6, 0.0, 0.4); };
    Ports ports(made.leader.setup, follower, bad_way(one_way, 1), bad_way(one_way, 1001));
    ports.run(1200);
    ASSERT_TRUE(ports.engage());
    ports.run(3000 + 3 * kPressMs - 100 - ports.now);  // end of the second press
    const double nearer = 1.4 * rigid(with);           // 8 of 20 mm closer
    EXPECT_NEAR(-ports.leader.applied.x(), nearer, 0.1 * nearer) << one_way;
    EXPECT_GE(ports.least_account(), kRounding) << one_way;
  }
}

TEST(CouplingMethods, APeerThatLiesAboutItsWavesGivesNoMoreThanTheyMayBe) {
  auto config = coupling_of(PortRole::kLeader);
  config.method = CouplingMethod::kWaves;
  config.spring.max_force = 5;
  config.tank.reset();
  Played played(config);
  played.receive(played.state(PortPhase::kCoupled));
  played.step();
  played.receive(played.state(PortPhase::kCoupled));
  played.step();
  ASSERT_TRUE(played.port.engage());
  played.step();
  double credited = 0;
  for (int i = 1; i <= 2000; ++i) {
    auto lie = played.state(PortPhase::kEngaged, 1);
    lie.wave_integral = Vec3(1e9 * i, 0, 0);
    lie.wave_energy = 1e6;
    played.receive(lie);
    played.port.observe({Vec3::Zero(), Vec3::Zero(), std::chrono::milliseconds(1)}, 1);
    EXPECT_LE(played.step().force.norm(), 5 * (1 + 1e-12));
    credited += played.port.settle(1, 0, std::chrono::milliseconds(1)).credit;
  }
  const double most = 5.0 * 5.0 / 4;  // max_force²/B, W
  EXPECT_LE(credited, 2 * most * (1 + 1e-9));
  EXPECT_GT(credited, most);
}

}  // namespace
}  // namespace tendon::coupling_methods_test

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <optional>

#include "tests/core/teleoperation/ports.h"

namespace tendon::wave_counts_test {
namespace {

constexpr double kCount = 30e-6;  // m, of a Phantom
constexpr std::optional<Preset> kBare;
constexpr Friction kPhantom{.coulomb = 0.03, .viscous = 0.005};
constexpr Friction kLight{.coulomb = 0.02, .viscous = 0.26};

/// Couples two devices with limiters over a network with a delay of 10 ms. The hand moves the leader.
Ports light_devices(double count, std::optional<Preset> preset, const Friction& friction, const Surroundings& hand,
                    const Surroundings& object) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  for (PortSetup* const end : {&leader, &follower}) {
    couple_by(CouplingMethod::kWaves, end->coupling);
    end->coupling.tank.reset();
    end->friction = friction;
    end->encoder_step = count;
    end->preset = preset;
  }
  leader.mass += 0.05;
  leader.around[0] = hand;
  follower.around[0] = object;
  return {leader, follower, {.delay = 10, .seed = 1}, {.delay = 10, .seed = 2}};
}

/// Returns the force that a hand feels after it has moved 20 mm at 5 mm/s, 16 mm of them against a wall.
double held(double count, std::optional<Preset> preset) {
  const Surroundings hand{
      .stiffness = 300, .damping = 5, .reference = [](double t) { return 0.02 * std::clamp((t - 1) / 4, 0.0, 1.0); }};
  const Surroundings wall{.stiffness = 2000, .damping = 3, .reference = [](double) { return 0.004; }, .wall = true};
  Ports pair = light_devices(count, preset, kPhantom, hand, wall);
  EXPECT_TRUE(pair.engage());
  pair.run(8000 - pair.now);
  double sum = 0;
  pair.run(1000, [&](int) { sum += pair.leader.applied.norm(); });
  EXPECT_GE(pair.least_sum, kRounding);
  return sum / 1000;
}

// Regression: displacements sent in whole counts emptied the account, and the force was 0.00 N.
TEST(WavesOnCounts, ALightDeviceFeelsTheWall) {
  for (const std::optional<Preset> preset : {kBare, std::optional(Preset::kFeel)}) {
    const double exact = held(0, preset);
    const double counts = held(kCount, preset);
    std::cout << (preset ? "feel" : "aol-plus") << ": " << counts << " N, with exact positions " << exact << " N\n";
    EXPECT_GT(counts, 0.85 * exact);
  }
}

TEST(WavesOnCounts, TheEndsDoNotDriftApart) {
  for (const std::optional<Preset> preset : {kBare, std::optional(Preset::kFeel)}) {
    for (const double count : {10e-6, 30e-6}) {
      for (const auto& [amplitude, frequency] : {std::pair(0.02, 1.0), std::pair(8e-4, 6.0)}) {
        const double w = 2 * std::numbers::pi * frequency;
        const double a = amplitude;
        const Surroundings hand{.stiffness = 600, .damping = 5, .reference = [a, w](double t) {
                                  return a * std::sin(w * std::max(0.0, t - 1));
                                }};
        Ports pair = light_devices(count, preset, kLight, hand, {});
        EXPECT_TRUE(pair.engage());
        const auto apart = [&] {  // the mean over two seconds
          double sum = 0;
          pair.run(2000, [&](int) { sum += pair.leader.x().x() - pair.follower.x().x(); });
          return sum / 2000;
        };
        pair.run(3000 - pair.now);
        const double before = apart();
        pair.run(58000);
        const double drift = apart() - before;
        EXPECT_LT(std::abs(drift), count) << amplitude << " m, " << (preset ? "feel" : "aol-plus");
      }
    }
  }
}

}  // namespace
}  // namespace tendon::wave_counts_test

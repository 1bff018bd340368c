// SPDX-License-Identifier: Apache-2.0
//
// Couplings by waves and by a surface that the follower finds: what is felt, where the two ends are, and that the pair
// gives out no energy.
#include <gtest/gtest.h>

#include <cmath>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <string>

#include "tests/core/teleoperation/ports.h"

namespace tendon {
namespace {

constexpr double kHand = 400;    // N/m
constexpr double kDepth = 0.03;  // m, that the hand wants to be
constexpr double kWallAt = 0.01;

Network bad(int one_way, std::uint64_t seed) {
  const int jitter = one_way > 0 ? std::max(5, one_way / 5) : 0;
  return {.delay = one_way, .jitter = jitter, .loss = one_way > 0 ? 0.1 : 0, .seed = seed};
}

/// A hand that goes to kDepth, holds it, leaves, and comes again; a wall in the follower's way.
struct Pressing {
  CouplingMethod method = CouplingMethod::kWaves;
  double wall = 500;       // N/m
  double impedance = 4;    // N·s/m
  double stiffness = 400;  // N/m
  bool purse = true;
  PoseMap::Config map{};
  double wall_until = 1e9;  // s
  int one_way = 0;          // ms
  std::uint64_t seed = 1;
  double hand = kHand;
};

constexpr int kPress = 4000;  // ms there, as long away

Ports press(const Pressing& with) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  for (PortSetup* const end : {&leader, &follower}) {
    end->coupling.method = with.method;
    end->coupling.map = with.map;
    end->coupling.spring.own_damping = with.impedance;
    end->coupling.spring.stiffness = with.stiffness;
    end->coupling.spring.max_force = 8;
    if (!with.purse) end->coupling.purse.reset();
  }
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  leader.around[0] = {.stiffness = with.hand, .damping = 3, .reference = [](double t) {
                        const double phase = std::fmod(t - 3, 2 * kPress * 1e-3);
                        if (t < 3 || phase > kPress * 1e-3 + 0.5) return 0.0;
                        return kDepth *
                               std::clamp(std::min(phase / 0.5, (kPress * 1e-3 + 0.5 - phase) / 0.5), 0.0, 1.0);
                      }};
  leader.around[1] = leader.around[2] = {.stiffness = 400, .damping = 3};
  follower.around[0] = {.stiffness = with.wall,
                        .damping = 1,
                        .reference = [&] { return [at = kWallAt * with.map.position_scale](double) { return at; }; }(),
                        .wall = true,
                        .until = with.wall_until};
  follower.measures_contact = with.method != CouplingMethod::kWaves;
  return {leader, follower, bad(with.one_way, with.seed), bad(with.one_way, with.seed + 1000)};
}

struct Felt {
  double first = 0;  // N, at the leader, mean of the press's last half second
  double second = 0;
  double wall = 0;    // N, at the follower on the second press
  double ripple = 0;  // N rms of what is faster than 50 Hz, at the leader while it presses
  double buzz = 0;    // m/s rms of what is faster than 20 Hz, at the leader away from the wall
  double sum = 0;     // J
  double account = 0;
  double stiffness = 0;
};

/// First-order high pass, rms.
class Fast {
 public:
  explicit Fast(double hz) : share_(1 - std::exp(-2 * std::numbers::pi * hz * 1e-3)) {}
  void add(double x) {
    if (n_ == 0) slow_ = x;
    slow_ += share_ * (x - slow_);
    sum_ += (x - slow_) * (x - slow_);
    ++n_;
  }
  double rms() const { return n_ > 0 ? std::sqrt(sum_ / n_) : 0; }

 private:
  double share_;
  double slow_ = 0;
  double sum_ = 0;
  int n_ = 0;
};

Felt feel(const Pressing& with) {
  Ports ports = press(with);
  ports.run(1200);
  EXPECT_TRUE(ports.engage());
  ports.run(3000 - ports.now);
  Felt felt;
  Fast ripple(50);
  Fast buzz(20);
  Vec3 before = ports.leader.x();
  for (double* const of : {&felt.first, &felt.second}) {
    ports.run(kPress, [&](int now) {
      const int into = (now - 3000) % (2 * kPress);
      if (into >= kPress - 500) *of -= ports.leader.applied.x() / 500;
      if (into >= kPress - 500) ripple.add(ports.leader.applied.x());
      if (of == &felt.second && into >= kPress - 500) felt.wall -= ports.follower.outside().x() / 500;
    });
    ports.run(kPress, [&](int now) {
      const double v = (ports.leader.x() - before).x() * 1e3;
      before = ports.leader.x();
      if ((now - 3000) % (2 * kPress) > kPress + 2500) buzz.add(v);
    });
  }
  felt.ripple = ripple.rms();
  felt.buzz = buzz.rms();
  felt.sum = ports.least_sum;
  felt.account = ports.least_account();
  felt.stiffness = ports.leader.coupling->stiffness();
  EXPECT_TRUE(ports.leader.coupling->live());
  return felt;
}

void print(const std::string& name, const Felt& felt) {
  std::cout << name << std::fixed << std::setprecision(3) << ": felt " << felt.first << ", " << felt.second
            << " N, wall " << felt.wall << " N, ripple " << felt.ripple * 1e3 << " mN, buzz " << felt.buzz * 1e3
            << " mm/s, least sum " << felt.sum * 1e3 << " mJ, account " << felt.account * 1e3 << " mJ, K "
            << felt.stiffness << "\n";
}

TEST(CouplingMethods, Explore) {
  for (const bool purse : {true, false}) {
    for (const int one_way : {0, 5, 25, 100, 300, 400}) {
      print("waves " + std::to_string(one_way) + (purse ? " purse" : ""), feel({.purse = purse, .one_way = one_way}));
    }
  }
  for (const int one_way : {0, 25, 100}) {
    print("waves B 10 " + std::to_string(one_way), feel({.impedance = 10, .purse = false, .one_way = one_way}));
  }
  for (const int one_way : {25, 300}) {
    print("surface " + std::to_string(one_way),
          feel({.method = CouplingMethod::kSurface, .stiffness = 1000, .one_way = one_way}));
    print("pos-force " + std::to_string(one_way),
          feel({.method = CouplingMethod::kPositionForce, .stiffness = 1000, .one_way = one_way}));
    print("pos-pos " + std::to_string(one_way),
          feel({.method = CouplingMethod::kPositionPosition, .one_way = one_way}));
  }
}

}  // namespace
}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "tests/core/teleoperation/ports.h"

namespace tendon {

inline constexpr double kPressingHand = 400;    // N/m
inline constexpr double kPressingDepth = 0.03;  // m, target of the hand
inline constexpr double kPressingWallAt = 0.01;

inline Network bad_way(int one_way, std::uint64_t seed) {
  const int jitter = one_way > 0 ? std::max(5, one_way / 5) : 0;
  return {.delay = one_way, .jitter = jitter, .loss = one_way > 0 ? 0.1 : 0, .seed = seed};
}

/// The hand moves to kPressingDepth, holds, retreats and repeats, with a wall in front of the follower.
struct Pressing {
  CouplingMethod method = CouplingMethod::kWaves;
  double wall = 500;       // N/m
  double impedance = 4;    // N·s/m
  double stiffness = 400;  // N/m
  bool tank = true;
  PoseMap::Config map{};
  double wall_until = 1e9;  // s
  int one_way = 0;          // ms
  std::uint64_t seed = 1;
  double hand = kPressingHand;
  int sent_each = 1;  // ms
  bool adapts = true;
};

inline constexpr int kPressMs = 4000;  // ms, for the contact and the following pause

inline Ports press(const Pressing& with) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  for (PortSetup* const end : {&leader, &follower}) {
    couple_by(with.method, end->coupling);
    end->coupling.map = with.map;
    end->coupling.spring.own_damping = with.impedance;
    end->coupling.spring.stiffness = with.stiffness;
    end->coupling.spring.max_force = 8;
    end->coupling.spring.adapt_to_delay = with.adapts;
    if (!with.tank) end->coupling.tank.reset();
  }
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  leader.around[0] = {.stiffness = with.hand, .damping = 3, .reference = [](double t) {
                        const double phase = std::fmod(t - 3, 2 * kPressMs * 1e-3);
                        if (t < 3 || phase > kPressMs * 1e-3 + 0.5) return 0.0;
                        return kPressingDepth *
                               std::clamp(std::min(phase / 0.5, (kPressMs * 1e-3 + 0.5 - phase) / 0.5), 0.0, 1.0);
                      }};
  leader.around[1] = leader.around[2] = {.stiffness = 400, .damping = 3};
  follower.around[0] = {
      .stiffness = with.wall,
      .damping = 1,
      .reference = [&] { return [at = kPressingWallAt * with.map.position_scale](double) { return at; }; }(),
      .wall = true,
      .until = with.wall_until};
  follower.measures_contact = with.method != CouplingMethod::kWaves;
  return {leader, follower, bad_way(with.one_way, with.seed), bad_way(with.one_way, with.seed + 1000)};
}

struct Felt {
  double first = 0;  // N at the leader, mean over the last half second of the press
  double second = 0;
  double wall = 0;    // N at the follower in the second press
  double ripple = 0;  // N rms above 50 Hz at the leader during the press
  double buzz = 0;    // m/s rms above 20 Hz, at the leader when it is not at the wall
  double sum = 0;     // J
  double account = 0;
  double stiffness = 0;  // N/m, reported by the leader
  bool live = false;     // at the end
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

inline Felt feel(const Pressing& with) {
  Ports ports = press(with);
  ports.sent_each = with.sent_each;
  ports.run(1200);
  if (!ports.engage()) return {};
  ports.run(3000 - ports.now);
  Felt felt;
  Fast ripple(50);
  Fast buzz(20);
  Vec3 before = ports.leader.x();
  for (double* const of : {&felt.first, &felt.second}) {
    ports.run(kPressMs, [&](int now) {
      const int into = (now - 3000) % (2 * kPressMs);
      if (into >= kPressMs - 500) *of -= ports.leader.applied.x() / 500;
      if (into >= kPressMs - 500) ripple.add(ports.leader.applied.x());
      if (of == &felt.second && into >= kPressMs - 500) felt.wall -= ports.follower.outside().x() / 500;
    });
    ports.run(kPressMs, [&](int now) {
      const double v = (ports.leader.x() - before).x() * 1e3;
      before = ports.leader.x();
      if ((now - 3000) % (2 * kPressMs) > kPressMs + 2500) buzz.add(v);
    });
  }
  felt.ripple = ripple.rms();
  felt.buzz = buzz.rms();
  felt.sum = ports.least_sum;
  felt.account = ports.least_account();
  felt.stiffness = ports.leader.coupling->stiffness();
  felt.live = ports.leader.coupling->live();
  return felt;
}

inline double rigid(const Pressing& with) {
  return (kPressingDepth - kPressingWallAt) / (1 / with.hand + 1 / with.wall);
}

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <utility>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"
#include "tests/support/dice.h"

namespace tendon {

template <int N>
Vec<N> random_direction(Dice& dice) {
  Vec<N> v;
  do {
    for (int i = 0; i < N; ++i) v[i] = dice.within(-1, 1);
  } while (v.squaredNorm() < 1e-3 || v.squaredNorm() > 1);
  return v.normalized();
}

/// Eq. (7): extracts the most energy while the force is held.
template <int N>
Vec<N> worst_motion(const Vec<N>& force, const Friction& friction, Duration held) {
  const double size = force.norm();
  if (size <= friction.coulomb) return Vec<N>::Zero();
  return force / size * (seconds(held) * (size - friction.coulomb) / (2 * friction.viscous));
}

/// Use one of these worlds to test laws that are only passive if the world is static.
template <int N>
using World = std::function<Demand<N>(const Vec<N>& position)>;

struct Walls {
  std::size_t count = 3;   ///< 1 … 3
  double bilateral = 0.4;  ///< share of walls that also pull
};

/// Returns the force −∇ of a convex potential with its minimum at the origin. The potential consists of springs to
/// random planes with random stiffness. The total stiffness is at most `stiffest`. The planes of springs that also pull
/// contain the origin.
template <int N>
World<N> static_world(Dice& dice, double stiffest, const Walls& of) {
  struct Wall {
    Vec<N> normal;
    double place = 0;
    double stiffness = 0;
    bool bilateral = false;
  };
  std::array<Wall, 3> walls;
  double left = stiffest;
  for (std::size_t i = 0; i < of.count; ++i) {
    const double stiffness = i + 1 < of.count ? left * dice.uniform() : left;
    const bool bilateral = dice.chance(of.bilateral);
    walls[i] = {random_direction<N>(dice), bilateral ? 0 : dice.within(0, 3e-3), stiffness, bilateral};
    left -= stiffness;
  }
  return [walls, count = of.count](const Vec<N>& x) {
    Demand<N> demand{Vec<N>::Zero(), Mat<N>::Zero()};
    for (std::size_t i = 0; i < count; ++i) {
      const Wall& wall = walls[i];
      const double depth = wall.normal.dot(x) - wall.place;
      if (depth < 0 && !wall.bilateral) continue;
      demand.force -= wall.stiffness * depth * wall.normal;
      demand.stiffness += wall.stiffness * wall.normal * wall.normal.transpose();
    }
    return demand;
  };
}

template <int N>
World<N> delayed(World<N> world, int periods) {
  return [world = std::move(world),
          past = std::deque<Vec<N>>(static_cast<std::size_t>(periods), Vec<N>::Zero())](const Vec<N>& x) mutable {
    past.push_back(x);
    const Demand<N> demand = world(past.front());
    past.pop_front();
    return demand;
  };
}

/// The demand is huge, tiny, zero or NaN, in any direction relative to the motion. Its stiffness changes.
template <int N>
World<N> hostile_world(Dice& dice) {
  return [&dice, last = Vec<N>(Vec<N>::Zero())](const Vec<N>& x) mutable {
    Demand<N> demand;
    const Vec<N> dx = x - last;
    last = x;
    switch (static_cast<int>(dice.within(0, 8))) {
      case 0:
        demand.force = random_direction<N>(dice) * dice.decades(-3, 6);
        break;
      case 1:
        demand.force.setZero();
        break;
      case 2:
        demand.force.setConstant(dice.chance(0.5) ? std::numeric_limits<double>::quiet_NaN()
                                                  : std::numeric_limits<double>::infinity());
        break;
      case 3:
        demand.force = dx * 1e9;
        break;
      case 4:
        demand.force = -dx * 1e9;
        break;
      case 5:
        demand.force = random_direction<N>(dice) * dice.decades(-3, 1);
        break;
      default: {
        const double stiffness = dice.decades(1, 5);
        demand.force = -stiffness * x;
        demand.stiffness = Mat<N>::Identity() * stiffness;
      }
    }
    return demand;
  };
}

/// This is an operator that uses its knowledge of the law and the force to extract energy. The motion is random and of
/// all sizes, or it is the worst motion of eq. (7), or it is a slow entry that is followed by a fast exit.
struct Adversary {
  Friction friction;  ///< true friction of the device
  Duration longest_hold = std::chrono::milliseconds(1);
  double hostility = 0.5;
  double largest_move = 1e-3;  ///< m, largest random motion
  int steps = 400;
  bool jitter = true;     ///< hold time of ¼ … 1 × longest_hold
  bool clamps = true;     ///< if true, the device sometimes applies less than the command
  bool overlooks = true;  ///< some intervals are not observed
};

struct Fate {
  double least_energy = 0;  ///< J, minimum of the true ledger, relative to the energy exchanged (at least 1 J)
  bool all_finite = true;
  bool within_permitted = true;
};

template <int N, class Law>
requires StabilityController<Law, N> Fate run_adversary(Law& law, const Adversary& adversary, World<N> world,
                                                        Dice& dice) {
  EnergyLedger truth(adversary.friction);
  double turnover = 1;
  Fate fate;
  Vec<N> x = Vec<N>::Zero();
  Vec<N> force = Vec<N>::Zero();
  int creeping = 0;
  Vec<N> creep = Vec<N>::Zero();
  for (int step = 0; step < adversary.steps; ++step) {
    if (step > 0) {
      const Duration held = adversary.jitter ? from_seconds(seconds(adversary.longest_hold) * dice.within(0.25, 1))
                                             : adversary.longest_hold;
      Vec<N> dx = Vec<N>::Zero();
      if (creeping > 0) {
        dx = --creeping > 0 ? creep : Vec<N>(force.normalized() * creep.norm() * 30);
      } else if (dice.chance(adversary.hostility)) {
        dx = worst_motion<N>(force, adversary.friction, held);
      } else if (dice.chance(0.1)) {
        creeping = 40;
        creep = random_direction<N>(dice) * adversary.largest_move * dice.decades(-3, -1);
      } else if (!dice.chance(0.1)) {
        dx = random_direction<N>(dice) * adversary.largest_move * dice.decades(-4, 0);
      }
      if (adversary.overlooks && dice.chance(0.02)) {
        truth.observe_unseen(force.norm(), held);
        law.observe_unseen(force, held);
      } else {
        truth.observe(force, dx, held);
        law.observe(Interval<N>{force, dx, held});
        turnover += std::abs(force.dot(dx));
      }
      x += dx;
      fate.least_energy = std::min(fate.least_energy, truth.energy() / turnover);
    }
    const LimitedForce<N> limited = law.limit(world(x));
    fate.all_finite = fate.all_finite && limited.force.allFinite() && std::isfinite(law.energy());
    fate.within_permitted = fate.within_permitted && limited.force.norm() <= limited.permitted * (1 + 1e-9) + 1e-9;
    force = limited.force;
    if (adversary.clamps && dice.chance(0.05)) force *= dice.uniform();
  }
  return fate;
}

inline Friction random_friction(Dice& dice) {
  return {dice.chance(0.3) ? 0.0 : dice.decades(-3, -0.3), dice.decades(-2, 0.3)};
}

/// Counts the seeds for which the port generated energy. `make(claimed friction, longest hold)` must return the law.
/// The law uses a viscous friction that is too large by the factor `overclaim`.
template <int N, class Make>
int broken_by_hostile_worlds(Make make, int seeds, double overclaim = 1) {
  int broken = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    Dice dice(static_cast<std::uint64_t>(seed));
    Adversary adversary;
    adversary.friction = random_friction(dice);
    adversary.hostility = dice.uniform();
    auto law =
        make(Friction{adversary.friction.coulomb, adversary.friction.viscous * overclaim}, adversary.longest_hold);
    const Fate fate = run_adversary<N>(law, adversary, hostile_world<N>(dice), dice);
    EXPECT_TRUE(fate.all_finite) << "seed " << seed;
    EXPECT_TRUE(fate.within_permitted) << "seed " << seed;
    if (fate.least_energy < -1e-12) ++broken;
  }
  return broken;
}

/// This test is for laws that are only passive in static, convex worlds. `make` is also called with the largest slope
/// For laws that are only passive in static, convex worlds. `make` also gets the largest slope of the world (N/m).
template <int N, class Make>
int broken_by_static_worlds(Make make, int seeds, const Walls& walls = {}, int periods_late = 0) {
  int broken = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    Dice dice(static_cast<std::uint64_t>(seed));
    Adversary adversary;
    adversary.friction = random_friction(dice);
    adversary.hostility = dice.uniform() / 2;
    adversary.jitter = periods_late == 0;
    adversary.clamps = false;
    adversary.overlooks = false;
    const double stiffest = dice.decades(1, 4.5);
    auto law = make(adversary.friction, adversary.longest_hold, stiffest);
    World<N> world = static_world<N>(dice, stiffest, walls);
    if (periods_late > 0) world = delayed<N>(std::move(world), periods_late);
    const Fate fate = run_adversary<N>(law, adversary, std::move(world), dice);
    EXPECT_TRUE(fate.all_finite) << "seed " << seed;
    if (fate.least_energy < -1e-12) ++broken;
  }
  return broken;
}

/// If a demand is not finite, it is replaced by zero and must not be booked. The energy is equal to the ledger.
template <int N, class Law>
requires StabilityController<Law, N>
void expect_the_common_promises(Law law, const Friction& friction) {
  const std::array<double, 3> bad = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                                     -std::numeric_limits<double>::infinity()};
  const auto held = std::chrono::milliseconds(1);
  EnergyLedger ledger(friction);
  const Vec<N> force = Vec<N>::Constant(-0.25);
  const Vec<N> dx = Vec<N>::Constant(1e-4);
  law.observe({force, dx, held});
  ledger.observe(force, dx, held);
  EXPECT_DOUBLE_EQ(law.energy(), ledger.energy());
  for (const double value : bad) {
    Demand<N> demand{Vec<N>::Constant(0.1), Mat<N>::Identity()};
    demand.force[N - 1] = value;
    const LimitedForce<N> of_force = law.limit(demand);
    EXPECT_EQ(of_force.force, Vec<N>::Zero().eval());
    EXPECT_TRUE(of_force.reasons.has(Reason::kNotFinite));
    law.observe({Vec<N>::Constant(value), dx, held});
    law.observe({force, Vec<N>::Constant(value), held});
    EXPECT_DOUBLE_EQ(law.energy(), ledger.energy());
    EXPECT_TRUE(law.limit({Vec<N>::Constant(0.1), Mat<N>::Zero()}).force.allFinite());
  }
  law.observe_unseen(force, held);
  ledger.observe_unseen(force.norm(), held);
  EXPECT_DOUBLE_EQ(law.energy(), ledger.energy());
  for (const double size : {1e6, 1e100, 1e300}) {
    law.observe({force, dx, held});
    EXPECT_TRUE(law.limit({Vec<N>::Constant(size), Mat<N>::Identity() * 1e3}).force.allFinite()) << size;
  }
}

}  // namespace tendon

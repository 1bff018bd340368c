// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "core/haptic_controller.h"
#include "core/ledger/energy_ledger.h"
#include "tests/core/teleoperation/one_way.h"
#include "tests/core/teleoperation/ports.h"

namespace tendon {

/// A complete haptic controller and three bodies, one for each axis.
class Node {
 public:
  Node(const PortSetup& with, const std::vector<CoupledLeader>& leaders, std::uint64_t epoch)
      : setup(with), truth(with.friction), leaders_(leaders) {
    for (std::size_t i = 0; i < 3; ++i) bodies_.emplace_back(Body(with.mass, with.friction, with.around[i]));
    begin(epoch);
    if (setup.path) put(setup.path(0));
  }

  void begin(std::uint64_t epoch) {
    HapticController::Config config;
    config.coupling = setup.coupling;
    config.coupling->spring.epoch = epoch;
    config.leaders = leaders_;
    config.limiter = {.law = setup.limited ? Law::kAolPlus : Law::kNone,
                      .friction = setup.friction,
                      .longest_hold = std::chrono::milliseconds(1)};
    config.limiter.shared_account = setup.limited;
    if (!setup.limited) config.coupling->tank.reset();
    config.max_force = 100;
    config.max_slew = 1000;
    controller.emplace(config);
    applied.setZero();
  }

  Vec3 x() const { return {bodies_[0].x, bodies_[1].x, bodies_[2].x}; }
  Vec3 outside() const { return {bodies_[0].outside, bodies_[1].outside, bodies_[2].outside}; }
  void put(const Vec3& x) {
    for (int i = 0; i < 3; ++i) bodies_[static_cast<std::size_t>(i)].x = x[i];
  }

  void step(int now) {
    constexpr double kPeriod = 1e-3;
    const Vec3 before = x();
    if (began_) {
      if (setup.path) put(setup.path(now * kPeriod));
      for (int i = 0; i < 3 && !setup.path; ++i) {
        bodies_[static_cast<std::size_t>(i)].advance(applied[i], (now - 1) * kPeriod, kPeriod);
      }
      truth.observe(applied, Vec3(x() - before), std::chrono::milliseconds(1));
    }
    const Vec3 speed = (x() - before) / kPeriod;
    began_ = true;
    was_applied = applied;
    taken = controller->step({Port::at(now), x(), speed}, applied);
    applied = taken.force;
    least_account = std::min(least_account, taken.energy);
  }
  PortState message(std::size_t which) {
    const auto contact = setup.measures_contact ? std::optional<Vec3>(outside()) : std::nullopt;
    Coupling& coupling = (*controller->couplings())[which];
    coupling.conclude(applied, contact);
    return coupling.message();
  }
  Coupling& coupling(std::size_t which = 0) { return (*controller->couplings())[which]; }
  const EnergyTank::Settlement& settled(std::size_t which) { return controller->couplings()->settled(which); }

  PortSetup setup;
  std::optional<HapticController> controller;
  EnergyLedger truth;
  Step taken;
  Vec3 applied = Vec3::Zero();
  Vec3 was_applied = Vec3::Zero();
  double least_account = std::numeric_limits<double>::infinity();  ///< J

 private:
  std::vector<CoupledLeader> leaders_;
  std::vector<Body> bodies_;
  bool began_ = false;
};

/// Each leader has a different bad network. Virtual time with ticks of 1 ms.
class Star {
 public:
  struct Leader {
    PortSetup setup;
    double share = 1;
    Network there{};
    Network back{};
  };
  /// With a single leader, the follower has no shares.
  Star(const PortSetup& follower_setup, const std::vector<Leader>& of) : follower(follower_setup, shares_of(of), 1) {
    for (const Leader& one : of) {
      leaders.emplace_back(one.setup, std::vector<CoupledLeader>{}, leaders.size() + 2);
      there_.emplace_back(one.there);
      back_.emplace_back(one.back);
      cut.push_back(false);
    }
  }

  template <class Look>
  void run(int ticks, Look look) {
    for (const int last = now + ticks; now < last; ++now) {
      for (std::size_t i = 0; i < leaders.size(); ++i) {
        back_[i].deliver(now, [&](const PortState& state) { leaders[i].coupling().receive(state, Port::at(now)); });
        leaders[i].step(now);
        const PortState told = leaders[i].message(0);
        if (!cut[i]) there_[i].send(now, told);
      }
      for (std::size_t i = 0; i < leaders.size(); ++i) {
        there_[i].deliver(now, [&](const PortState& state) { follower.coupling(i).receive(state, Port::at(now)); });
      }
      follower.step(now);
      for (std::size_t i = 0; i < leaders.size(); ++i) {
        const PortState told = follower.message(i);
        if (!cut[i]) back_[i].send(now, told);
      }
      double sum = follower.truth.energy();
      for (const Node& leader : leaders) sum += leader.truth.energy();
      least_sum = std::min(least_sum, sum);
      look(now);
    }
  }
  void run(int ticks) {
    run(ticks, [](int) {});
  }

  /// Returns false after one second without a new live engagement.
  bool engage(std::size_t which) {
    run(50);
    if (!leaders[which].coupling().engage()) return false;
    for (int i = 0; i < 1000 && !leaders[which].coupling().live(); ++i) run(1);
    return leaders[which].coupling().live() && follower.coupling(which).live();
  }
  double least_account() const {
    double least = follower.least_account;
    for (const Node& leader : leaders) least = std::min(least, leader.least_account);
    return least;
  }
  void set_share(std::size_t which, double share) { follower.controller->couplings()->set_share(which, share); }

  Node follower;
  std::deque<Node> leaders;  // a controller must not move in memory
  std::vector<bool> cut;     ///< per leader, both directions
  int now = 0;
  double least_sum = 0;  ///< J, sum of all ledgers

 private:
  static std::vector<CoupledLeader> shares_of(const std::vector<Leader>& leaders) {
    std::vector<CoupledLeader> shares;
    if (leaders.size() == 1) return shares;
    for (const Leader& one : leaders) {
      shares.push_back({.channel = static_cast<std::uint32_t>(shares.size()), .share = one.share});
    }
    return shares;
  }

  std::deque<OneWay<PortState>> there_;
  std::deque<OneWay<PortState>> back_;
};

}  // namespace tendon

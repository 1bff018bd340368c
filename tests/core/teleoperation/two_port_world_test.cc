// SPDX-License-Identifier: Apache-2.0
//
// Two places and a bad network between them, in virtual time: at the leader a hand on a simulated device with a limiter
// as the safety net, at the follower a tool of 0.3 kg that comes up against a wall. Each way of connecting them
// must leave the limiter less to do than forces that are sent as they are, and none can make the hand's port active.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>

#include "core/control/aol.h"
#include "core/teleoperation/model_mediated.h"
#include "core/teleoperation/passive_set_position.h"
#include "core/teleoperation/two_channel_passivity.h"
#include "core/teleoperation/wave_variables.h"
#include "devices/simulated/simulated_device.h"
#include "tests/core/teleoperation/link.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 1ms;
constexpr double kT = 1e-3;
constexpr Friction kFriction = {.coulomb = 0.02, .viscous = 0.26};

struct Sight {
  Vec3 position;
  Vec3 velocity;
};

// How the two places are connected. In each period: `deliver`, then at both ends the force of the period that begins,
// then what the period was.
class Connection {
 public:
  virtual ~Connection() = default;
  virtual void deliver(int now) = 0;
  /// N, on the hand; `energy` is the limiter's account.
  virtual Vec3 leader(const Sight& hand, double energy) = 0;
  virtual void leader_saw(int now, const Interval<3>& interval, const Sight& hand) = 0;
  /// N, on the tool.
  virtual Vec3 follower(const Sight& tool) = 0;
  /// `wall`: N, on the tool.
  virtual void follower_saw(int now, const Interval<3>& interval, const Sight& tool, const Vec3& wall) = 0;
};

Network other_way(Network network) {
  network.seed += 1000;
  return network;
}

Vec3 tool_controller(const Sight& wanted, const Sight& tool) {
  return 1000 * (wanted.position - tool.position) + 20 * (wanted.velocity - tool.velocity);
}

struct SequencedSight {
  std::uint64_t sequence = 0;
  Sight sight{Vec3::Zero(), Vec3::Zero()};
};

// The follower's controller follows the newest position of the hand: common to several connections.
class Following : public Connection {
 public:
  explicit Following(const Network& network) : there_(network) {}
  void deliver(int now) override {
    there_.deliver(now, [this](const SequencedSight& m) {
      if (m.sequence > newest_.sequence) newest_ = m;
    });
  }
  void leader_saw(int now, const Interval<3>&, const Sight& hand) override { there_.send(now, {++sequence_, hand}); }
  Vec3 follower(const Sight& tool) override { return tool_controller(newest_.sight, tool); }

 private:
  Link<SequencedSight> there_;
  SequencedSight newest_;
  std::uint64_t sequence_ = 0;
};

// What all are compared with: position there, force back, each as it comes.
class Direct final : public Following {
 public:
  explicit Direct(const Network& network) : Following(network), back_(other_way(network)) {}
  void deliver(int now) override {
    Following::deliver(now);
    back_.deliver(now, [this](const FollowerMessage<3>& m) {
      if (m.sequence > newest_.sequence) newest_ = m;
    });
  }
  Vec3 leader(const Sight&, double) override { return newest_.force; }
  void follower_saw(int now, const Interval<3>& interval, const Sight&, const Vec3&) override {
    back_.send(now, {++sequence_, -interval.applied, 0});
  }

 private:
  Link<FollowerMessage<3>> back_;
  FollowerMessage<3> newest_;
  std::uint64_t sequence_ = 0;
};

class Waves final : public Connection {
 public:
  explicit Waves(const Network& network) : there_(network), back_(other_way(network)) {}
  void deliver(int now) override {
    there_.deliver(now, [this](const WaveMessage<3>& m) { follower_.receive(m); });
    back_.deliver(now, [this](const WaveMessage<3>& m) { leader_.receive(m); });
  }
  Vec3 leader(const Sight& hand, double) override { return leader_.command(hand.velocity).force; }
  void leader_saw(int now, const Interval<3>& interval, const Sight&) override {
    there_.send(now, leader_.observe(interval));
  }
  Vec3 follower(const Sight& tool) override { return follower_.command(tool.velocity).force; }
  void follower_saw(int now, const Interval<3>& interval, const Sight&, const Vec3&) override {
    back_.send(now, follower_.observe(interval));
  }

 private:
  static constexpr WavePort<3>::Config kConfig = {.impedance = 4, .period = kPeriod};
  WavePort<3> leader_{kConfig};
  WavePort<3> follower_{kConfig};
  Link<WaveMessage<3>> there_;
  Link<WaveMessage<3>> back_;
};

class TwoChannel final : public Connection {
 public:
  explicit TwoChannel(const Network& network) : there_(network), back_(other_way(network)) {}
  void deliver(int now) override {
    there_.deliver(now, [this](const LeaderMessage<3>& m) { follower_.receive(m); });
    back_.deliver(now, [this](const FollowerMessage<3>& m) { leader_.receive(m); });
  }
  Vec3 leader(const Sight& hand, double) override { return leader_.command(hand.velocity).force; }
  void leader_saw(int now, const Interval<3>& interval, const Sight&) override {
    there_.send(now, leader_.observe(interval));
  }
  Vec3 follower(const Sight& tool) override {
    const Vec3 force = tool_controller(wanted_, tool);
    const auto step = follower_.step(force);
    message_ = step.message;
    wanted_ = {wanted_.position + kT * step.velocity, step.velocity};
    return force;
  }
  void follower_saw(int now, const Interval<3>&, const Sight&, const Vec3&) override { back_.send(now, message_); }

 private:
  PassivityLeader<3> leader_{{.max_damping = 20, .period = kPeriod}};
  PassivityFollower<3> follower_{{.drift_rate = 5, .period = kPeriod}};
  Sight wanted_{Vec3::Zero(), Vec3::Zero()};
  FollowerMessage<3> message_;
  Link<LeaderMessage<3>> there_;
  Link<FollowerMessage<3>> back_;
};

class SetPositions final : public Following {
 public:
  explicit SetPositions(const Network& network) : Following(network), back_(other_way(network)) {}
  void deliver(int now) override {
    Following::deliver(now);
    back_.deliver(now, [this](const SetPosition<3>& m) { spring_.receive(m); });
  }
  Vec3 leader(const Sight& hand, double) override { return spring_.command(hand.position).force; }
  void leader_saw(int now, const Interval<3>& interval, const Sight& hand) override {
    spring_.observe(interval);
    Following::leader_saw(now, interval, hand);
  }
  void follower_saw(int now, const Interval<3>&, const Sight& tool, const Vec3&) override {
    back_.send(now, {++sequence_, tool.position});
  }

 private:
  PassiveSetPosition<3> spring_{{.stiffness = 300, .friction = kFriction, .longest_hold = kPeriod}};
  Link<SetPosition<3>> back_;
  std::uint64_t sequence_ = 0;
};

class Surfaces final : public Following {
 public:
  explicit Surfaces(const Network& network) : Following(network), back_(other_way(network)) {}
  void deliver(int now) override {
    Following::deliver(now);
    back_.deliver(now, [this](const SurfaceModel<3>& m) { renderer_.receive(m); });
  }
  Vec3 leader(const Sight& hand, double energy) override {
    return renderer_.command(hand.position, energy - renderer_.energy(hand.position)).demand.force;
  }
  void follower_saw(int now, const Interval<3>&, const Sight& tool, const Vec3& wall) override {
    back_.send(now, estimator_.observe(tool.position, wall));
  }

 private:
  SurfaceEstimator<3> estimator_{
      {.contact_force = 0.05, .first_stiffness = 200, .max_stiffness = 2000, .least_travel = 5e-4, .memory = 300}};
  SurfaceRenderer<3> renderer_;
  Link<SurfaceModel<3>> back_;
};

struct Outcome {
  double limited_share = 0;
  double least_energy = 0;     // J, the limiter's account
  double least_hand_work = 0;  // J
  double farthest_tool = 0;    // m
  double felt = 0;             // N, the largest force against the hand in the direction of the wall
};

Outcome run(Connection& connection, bool with_limiter = true) {
  constexpr int kPeriods = 6000;
  constexpr double kWall = 500;  // N/m, from 8 mm on
  SimulatedDevice::Config leader;
  leader.name = "leader";
  leader.mass = 0.075;
  leader.viscous_friction = kFriction.viscous;
  leader.coulomb_friction = kFriction.coulomb;
  leader.hand =
      OperatorHand::Config{.stiffness = 300,
                           .damping = 2,
                           .mass = 0.05,
                           .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.02, .frequency = 0.5})};
  SimulatedDevice device(leader);
  Aol<1, 3> law({{kFriction}, kPeriod});
  Outcome outcome;
  Sight hand{Vec3::Zero(), Vec3::Zero()};
  Sight tool{Vec3::Zero(), Vec3::Zero()};
  Vec3 applied = Vec3::Zero();
  int limited = 0;
  for (int i = 0; i < kPeriods; ++i) {
    const Vec3 position = device.read(LocalTime(i * kPeriod))->position;
    const Interval<3> interval{applied, position - hand.position, kPeriod};
    hand = {position, interval.dx / kT};
    connection.deliver(i);
    if (i > 0) {
      law.observe(interval);
      connection.leader_saw(i, interval, hand);
    }
    const Demand<3> wanted{connection.leader(hand, law.energy())};
    const auto safe = law.limit(wanted);
    applied = device.apply(with_limiter ? safe.force : wanted.force);
    limited += safe.reasons.empty() ? 0 : 1;

    const Vec3 force = connection.follower(tool);
    const Vec3 before = tool.position;
    Vec3 wall = Vec3::Zero();
    constexpr int kSubsteps = 10;
    for (int k = 0; k < kSubsteps; ++k) {
      wall.x() = -kWall * std::max(tool.position.x() - 0.008, 0.0);
      tool.velocity += kT / kSubsteps / 0.3 * (force + wall - 2 * tool.velocity);
      tool.position += kT / kSubsteps * tool.velocity;
    }
    connection.follower_saw(i, {force, tool.position - before, kPeriod}, tool, wall);

    outcome.least_energy = std::min(outcome.least_energy, law.energy());
    outcome.least_hand_work = std::min(outcome.least_hand_work, device.truth().hand_work);
    outcome.farthest_tool = std::max(outcome.farthest_tool, tool.position.norm());
    outcome.felt = std::max(outcome.felt, -applied.x());
  }
  outcome.limited_share = static_cast<double>(limited) / kPeriods;
  return outcome;
}

template <class T>
std::unique_ptr<Connection> make(const Network& network) {
  return std::make_unique<T>(network);
}

struct Named {
  const char* name;
  std::unique_ptr<Connection> (*make)(const Network&);
};

constexpr Named kMethods[] = {{"wave variables", make<Waves>},
                              {"two-channel passivity", make<TwoChannel>},
                              {"passive set position", make<SetPositions>},
                              {"surface model", make<Surfaces>}};

constexpr Network kConstant = {.delay = 60};
constexpr Network kVariable = {.delay = 40, .jitter = 40, .loss = 0.1, .seed = 4};
constexpr Network kHostile = {.delay = 100, .jitter = 300, .loss = 0.6, .seed = 9};

TEST(TwoPortWorld, EveryMethodSparesTheLimiterWorkThatRawForcesMake) {
  for (const Network& network : {kConstant, kVariable}) {
    const Outcome direct = run(*make<Direct>(network));
    std::cout << "delay " << network.delay << " ms, jitter " << network.jitter << " ms, loss " << network.loss * 100
              << " %\n  forces as they are: limited " << 100 * direct.limited_share << " %, felt " << direct.felt
              << " N, tool " << direct.farthest_tool * 1e3 << " mm\n";
    for (const Named& method : kMethods) {
      const Outcome outcome = run(*method.make(network));
      std::cout << "  " << method.name << ": limited " << 100 * outcome.limited_share << " %, felt " << outcome.felt
                << " N, tool " << outcome.farthest_tool * 1e3 << " mm\n";
      EXPECT_LT(outcome.limited_share, direct.limited_share) << method.name;
      EXPECT_LT(outcome.farthest_tool, 0.03) << method.name;
      EXPECT_GT(outcome.felt, 0.5) << method.name << ": a wall that is not felt is no success";
    }
  }
}

TEST(TwoPortWorld, WithoutTheLimiterRawForcesMakeTheHandsPortActive) {
  EXPECT_LT(run(*make<Direct>(kConstant), false).least_hand_work, -1e-3);
}

TEST(TwoPortWorld, TheHandsPortStaysPassiveWhateverTheNetworkDoes) {
  for (const Network& network : {kConstant, kVariable, kHostile}) {
    const Outcome direct = run(*make<Direct>(network));
    EXPECT_GE(direct.least_energy, -1e-12);
    EXPECT_GE(direct.least_hand_work, -1e-12);
    for (const Named& method : kMethods) {
      const Outcome outcome = run(*method.make(network));
      EXPECT_GE(outcome.least_energy, -1e-12) << method.name;
      EXPECT_GE(outcome.least_hand_work, -1e-12) << method.name;
    }
  }
}

}  // namespace
}  // namespace tendon

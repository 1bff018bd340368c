// SPDX-License-Identifier: Apache-2.0
//
// Two places and a bad network between them, in virtual time: at the leader a hand on a simulated device with a limiter
// as the safety net, at the follower a tool of 0.3 kg that comes up against a wall. Each way of connecting them
// must leave the limiter less to do than forces that are sent as they are, and none can make the hand's port active.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <vector>

#include "core/control/aol.h"
#include "core/teleoperation/model_mediated.h"
#include "core/teleoperation/passive_set_position.h"
#include "core/teleoperation/two_channel_passivity.h"
#include "core/teleoperation/wave_variables.h"
#include "devices/simulated/simulated_device.h"
#include "tests/core/teleoperation/link.h"
#include "tests/core/teleoperation/pair.h"
#include "tests/support/dice.h"

namespace tendon::two_port_world_test {
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
  explicit Waves(const Network& network, double impedance = 4)
      : config_{.impedance = impedance, .period = kPeriod}, there_(network), back_(other_way(network)) {}
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
  WavePort<3>::Config config_;
  WavePort<3> leader_{config_};
  WavePort<3> follower_{config_};
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
  explicit SetPositions(const Network& network) : Following(network), back_(other_way(network)) {
    spring_.loop_delay((2 * (network.delay + network.jitter) + 1) * kPeriod);
  }
  void deliver(int now) override {
    Following::deliver(now);
    back_.deliver(now, [this](const SetPosition<3>& m) { spring_.receive(m); });
  }
  Vec3 leader(const Sight& hand, double) override { return spring_.command(hand.position, hand.velocity).force; }
  void leader_saw(int now, const Interval<3>& interval, const Sight& hand) override {
    spring_.observe(interval);
    Following::leader_saw(now, interval, hand);
  }
  void follower_saw(int now, const Interval<3>&, const Sight& tool, const Vec3&) override {
    back_.send(now, {++sequence_, tool.position});
  }

 private:
  PassiveSetPosition<3> spring_{{.stiffness = 300, .friction = kFriction, .longest_hold = kPeriod, .damping = 4}};
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

// ---- two presses -------------------------------------------------------------------------------------------------

constexpr double kHand = 400;  // N/m
constexpr double kWall = 500;  // N/m, from 10 mm on
// N, that a hand which wants to be 30 mm away feels of the wall through a rigid link.
constexpr double kRigid = 0.02 / (1 / kHand + 1 / kWall);

struct PressedTwice {
  double first = 0, second = 0;         // N, felt in the last half second of each
  double contact = 0;                   // N, of the wall on the tool, together with `second`
  double ripple = 0;                    // N rms above 50 Hz, held
  double unrest = 0;                    // m/s rms above 20 Hz, in free motion
  double gone = 0;                      // s, from when the tool is past a removed wall until nothing is felt
  double hand = 0, tool = 0, pair = 0;  // J, the least that each port, and both together, have taken in
};

double pressing(double t, double hold) {
  const auto ramp = [t](double from) { return std::clamp((t - from) / 0.3, 0.0, 1.0); };
  return 0.03 * (ramp(0.7) - ramp(1 + hold) + ramp(5.7 + hold));
}

struct Pressing {
  double hold;                                               // s, of each press
  double removed = std::numeric_limits<double>::infinity();  // s, when the wall is
  double wall_speed = 0;                                     // m/s, to the hand, for 0.4 s from hold on
  double hand = kHand;                                       // N/m
  double tool_mass = 0.3;                                    // kg
  Friction tool_friction = {.coulomb = 0, .viscous = 2};
};

PressedTwice press(Connection& connection, const Pressing& pressed) {
  const auto [hold, removed, wall_speed, stiffness, tool_mass, tool_friction] = pressed;
  const double end = 6 + 2 * hold;
  Body leader(0.075, kFriction, {.stiffness = stiffness, .damping = 2, .reference = [until = hold](double t) {
                                   return pressing(t, until);
                                 }});
  Body follower(tool_mass, tool_friction,
                {.stiffness = kWall,
                 .reference = [until = hold,
                               speed = wall_speed](double t) { return 0.01 - speed * std::clamp(t - until, 0.0, 0.4); },
                 .wall = true,
                 .until = removed});
  Aol<1, 3> law({{kFriction}, kPeriod});
  EnergyLedger hand_ledger(kFriction);
  EnergyLedger tool_ledger(tool_friction);
  HighPass ripple(50);
  HighPass unrest(20);
  Sight hand{Vec3::Zero(), Vec3::Zero()};
  Sight tool{Vec3::Zero(), Vec3::Zero()};
  Vec3 on_hand = Vec3::Zero();
  Vec3 on_tool = Vec3::Zero();
  PressedTwice found;
  double was_at = 0;
  double past = 0;
  const auto moved = [](Body& body, Sight& sight, const Vec3& force, double t) {
    const double before = body.x;
    body.advance(force.x(), t - kT, kT);
    sight = {Vec3(body.x, 0, 0), Vec3((body.x - before) / kT, 0, 0)};
    return Interval<3>{force, Vec3(body.x - before, 0, 0), kPeriod};
  };
  for (int i = 1; i <= static_cast<int>(end * 1e3); ++i) {
    const double t = i * kT;
    const auto by_hand = moved(leader, hand, on_hand, t);
    const auto by_tool = moved(follower, tool, on_tool, t);
    law.observe(by_hand);
    hand_ledger.observe(by_hand.applied, by_hand.dx, kPeriod);
    tool_ledger.observe(by_tool.applied, by_tool.dx, kPeriod);
    connection.leader_saw(i, by_hand, hand);
    connection.follower_saw(i, by_tool, tool, Vec3(follower.outside, 0, 0));
    connection.deliver(i);
    on_hand = law.limit({connection.leader(hand, law.energy())}).force;
    on_tool = connection.follower(tool);

    found.hand = std::min(found.hand, hand_ledger.energy());
    found.tool = std::min(found.tool, tool_ledger.energy());
    found.pair = std::min(found.pair, hand_ledger.energy() + tool_ledger.energy());
    if (t < removed) was_at = tool.position.x();
    if (t >= removed && past == 0 && tool.position.x() > was_at + 1e-3) past = t;
    if (past > 0 && -on_hand.x() > 0.2) found.gone = t - past;
    ripple.add(on_hand.x(), t >= end - 1);
    unrest.add(hand.velocity.x(), t >= hold + 3 && t < hold + 5.5);
    if (t >= hold + 0.5 && t < hold + 1) found.first -= on_hand.x() / 500;
    if (t >= end - 0.5) found.second -= on_hand.x() / 500;
    if (t >= end - 0.5) found.contact -= follower.outside / 500;
  }
  found.ripple = ripple.rms();
  found.unrest = unrest.rms();
  return found;
}

// The springs of 400, K, 1000 (the tool's controller) and 500 N/m, with K = 2B/T_loop and B = 4.
double by_set_position(const Network& network) {
  const double loop = (2 * (network.delay + network.jitter) + 1) * kT;
  const double k = std::min(300.0, 8 / loop);
  return k * 0.01 * 2 / 3 / (1 + k / 1200);
}

// d of WavePort with a playout of `playout` s, and B = 4.
double by_waves(const Network& network, double playout) {
  const double one_way = network.delay * kT + playout + 10.5e-3;
  return 0.02 / (1 / kHand + one_way / 4 + 1 / kWall);
}

Network round_trip_of(int periods, bool bad) {
  const int jitter = bad ? std::max(5, periods / 10) : 0;
  return {.delay = periods / 2, .jitter = jitter, .loss = bad ? 0.1 : 0, .seed = 3};
}

template <class Check>
void press_through(const Named& method, Check check) {
  for (const bool bad : {false, true}) {
    for (const int periods : {0, 1, 3, 10, 50, 200, 600}) {
      const Network network = round_trip_of(periods, bad);
      const PressedTwice found = press(*method.make(network), {.hold = 9 + 0.02 * periods});
      std::cout << method.name << (bad ? ", bad" : "") << ", " << periods << " ms: felt " << found.first << ", "
                << found.second << " N, wall " << found.contact << " N, ripple " << found.ripple * 1e3 << " mN, unrest "
                << found.unrest * 1e3 << " mm/s, tool " << found.tool * 1e3 << " mJ, pair " << found.pair * 1e3
                << " mJ\n";
      SCOPED_TRACE(testing::Message() << method.name << ' ' << periods << (bad ? " bad" : ""));
      EXPECT_GE(found.hand, -1e-12);
      EXPECT_LT(found.tool, 0) << "a tool that gives out nothing does not follow";
      EXPECT_LT(found.ripple, 0.02);
      EXPECT_LT(found.unrest, 2e-3);
      check(found, network, bad);
    }
  }
}

// At 600 ms 21 s are not enough for a line of waves to come to rest.
TEST(TwoPortWorld, WavesArePassiveAsAPairAndHoldTheForceOfTheirStiffness) {
  press_through(kMethods[0], [](const PressedTwice& found, const Network& network, bool bad) {
    EXPECT_GE(found.pair, -1e-12);
    if (network.delay > 100) return;
    EXPECT_NEAR(found.contact, found.second, 0.03 * found.second);
    EXPECT_GT(found.first, 0.97 * by_waves(network, bad ? (network.jitter + 2) * kT : 0));
    EXPECT_GT(found.second, 0.97 * by_waves(network, bad ? (network.jitter + 2) * kT : 0));
    EXPECT_LT(found.second, 1.03 * by_waves(network, 0));
  });
}

// The first press waits for the energy that a held force needs.
TEST(TwoPortWorld, TwoChannelsHoldAForceButNotAlwaysTheWalls) {
  press_through(kMethods[1], [](const PressedTwice& found, const Network& network, bool) {
    EXPECT_GT(found.second, network.delay > 100 ? 0.1 : 0.6);
    EXPECT_LE(found.second, found.contact + 0.04) << "2 f_c";
    EXPECT_GE(found.pair, -0.02) << "the follower's controller is not in its account";
  });
}

TEST(TwoPortWorld, SetPositionsHoldTheForceOfTheirSprings) {
  press_through(kMethods[2], [](const PressedTwice& found, const Network& network, bool) {
    EXPECT_NEAR(found.first, by_set_position(network), 0.03 * by_set_position(network));
    EXPECT_NEAR(found.second, by_set_position(network), 0.03 * by_set_position(network));
  });
}

TEST(TwoPortWorld, ASurfaceIsTrueFromTheSecondPressOnWhateverTheDelay) {
  press_through(kMethods[3], [](const PressedTwice& found, const Network& network, bool) {
    if (network.delay <= 5) {
      EXPECT_GT(found.first, 0.9 * kRigid);
    }
    EXPECT_NEAR(found.second, kRigid, 0.02 * kRigid);
  });
}

TEST(TwoPortWorld, ARemovedWallIsGoneSoonAfterTheToolIsPastIt) {
  for (const bool bad : {false, true}) {
    for (const int periods : {0, 10, 50, 200, 600}) {
      const Network network = round_trip_of(periods, bad);
      const double hold = 9 + 0.02 * periods;
      const PressedTwice found = press(*make<Surfaces>(network), {.hold = hold, .removed = 6 + 1.5 * hold});
      const double most = (periods + 2 * network.jitter) * kT + 0.05;
      std::cout << periods << (bad ? " ms, bad" : " ms") << ": gone " << found.gone * 1e3 << " ms after\n";
      EXPECT_LE(found.gone, most) << periods;
      EXPECT_NEAR(found.second, 0, 0.2) << periods;
    }
  }
}

TEST(TwoPortWorld, AWallThatComesNearerIsWhereItIsOnTheNextPress) {
  for (const bool bad : {false, true}) {
    for (const int periods : {0, 10, 50, 200, 600}) {
      const Network network = round_trip_of(periods, bad);
      const PressedTwice found = press(*make<Surfaces>(network), {.hold = 9 + 0.02 * periods, .wall_speed = 0.02});
      std::cout << periods << (bad ? " ms, bad" : " ms") << ": felt " << found.first << ", " << found.second << " N\n";
      EXPECT_NEAR(found.second, 1.4 * kRigid, 0.03 * 1.4 * kRigid) << periods << ": the wall is 8 mm nearer";
      EXPECT_GE(found.hand, -1e-12) << periods;
    }
  }
}

// ---- 21 drawn hands: felt force over that of a rigid link ---------------------------------------------------------

struct Shares {
  double least = 1, median = 0;
  double unrest = 0;  // m/s, the worst
  double pair = 0;    // J, the worst
};

template <class Make>
Shares over_hands(std::uint64_t first_seed, Pressing pressing, Make make_connection) {
  std::vector<double> shares;
  Shares found;
  for (std::uint64_t seed = first_seed; seed < first_seed + 21; ++seed) {
    Dice dice(seed);
    pressing.hand = dice.within(150, 600);
    const PressedTwice one = press(*make_connection(seed), pressing);
    EXPECT_GE(one.hand, -1e-12) << seed;
    shares.push_back(one.second * (1 / pressing.hand + 1 / kWall) / 0.02);
    found.unrest = std::max(found.unrest, one.unrest);
    found.pair = std::min(found.pair, one.pair);
  }
  std::sort(shares.begin(), shares.end());
  found.least = shares.front();
  found.median = shares[shares.size() / 2];
  std::cout << "seeds " << first_seed << " …: share " << found.median << ", least " << found.least << "; unrest "
            << found.unrest * 1e3 << " mm/s; pair " << found.pair * 1e3 << " mJ\n";
  return found;
}

TEST(TwoPortWorld, ASurfaceIsFeltByAnyHandOnTheSecondPressAt600Ms) {
  for (const std::uint64_t first_seed : {1001U, 1U, 5001U}) {
    const Shares found = over_hands(first_seed, {.hold = 3}, [](std::uint64_t seed) {
      return make<Surfaces>({.delay = 300, .jitter = 60, .loss = 0.1, .seed = seed});
    });
    EXPECT_GE(found.median, 0.93);
    EXPECT_GE(found.least, 0.9);
  }
}

TEST(TwoPortWorld, TwoDevicesOnWavesOf10At200MsFeelAQuarterAndAreQuiet) {
  for (const std::uint64_t first_seed : {1001U, 1U}) {
    const Shares found =
        over_hands(first_seed, {.hold = 5, .tool_mass = 0.075, .tool_friction = kFriction}, [](std::uint64_t seed) {
          return std::make_unique<Waves>(Network{.delay = 100, .jitter = 20, .loss = 0.1, .seed = seed}, 10.0);
        });
    EXPECT_GE(found.median, 0.23);
    EXPECT_LT(found.unrest, 2e-3);
    EXPECT_GE(found.pair, -1e-12);
  }
}

}  // namespace
}  // namespace tendon::two_port_world_test

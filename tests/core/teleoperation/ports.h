// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/control/limiter.h"
#include "core/control/preset.h"
#include "core/estimation/velocity_estimator.h"
#include "core/ledger/energy_ledger.h"
#include "core/teleoperation/coupling.h"
#include "tests/core/teleoperation/one_way.h"
#include "tests/core/teleoperation/pair.h"

namespace tendon {

/// One device with coupling and limiter: three bodies, one per axis of the base frame.
struct PortSetup {
  Coupling::Config coupling{};
  double mass = 0.075;
  Friction friction{.coulomb = 0.02, .viscous = 0.26};
  int every = 1;                         ///< ms
  std::array<Surroundings, 3> around{};  ///< external contact along each axis
  std::function<Vec3(double)> path{};    ///< t, s → m: prescribed motion, forces have no effect
  double encoder_step = 0;               ///< m; 0: exact
  std::optional<Preset> preset{};        ///< of the limiter, with the velocity estimator; empty: AOL+ without parts
  bool estimates = false;                ///< estimates the velocity as tendond does, also without a preset
  bool measures_contact = false;
  double motor = std::numeric_limits<double>::infinity();  ///< N, saturation
  bool limited = true;  ///< if false, the demand of the coupling is applied without a limiter
};

inline Coupling::Config coupling_of(PortRole role) {
  Coupling::Config config;
  config.role = role;
  config.spring = {.stiffness = 400, .own_damping = 4, .period = std::chrono::milliseconds(1)};
  config.tank = EnergyTank::Config{.max_power = 100, .max_account = 10};
  return config;
}

inline void couple_by(CouplingMethod method, Coupling::Config& config) {
  config.method = method;
  if (method != CouplingMethod::kRate) return;
  config.rate = RateControl{.dead_zone = 3e-3, .gain = 4, .max_speed = 0.05};
  if (config.role == PortRole::kLeader) config.centring = 200;
}

class Port {
 public:
  explicit Port(const PortSetup& with) : setup(with), truth(with.friction) {
    for (std::size_t i = 0; i < 3; ++i) bodies_.emplace_back(Body(with.mass, with.friction, with.around[i]));
    begin(1);
    if (setup.path) put(setup.path(0));
  }

  void begin(std::uint64_t epoch) {
    auto config = setup.coupling;
    config.spring.epoch = epoch;
    config.spring.period = setup.every * std::chrono::milliseconds(1);
    config.encoder_step = setup.encoder_step;
    coupling.emplace(config);
    LimiterConfig with{.law = Law::kAolPlus, .friction = setup.friction, .longest_hold = config.spring.period};
    with.shared_account = true;
    if (setup.preset) {
      with.parts = preset_parts(*setup.preset, {setup.friction, with.longest_hold, setup.encoder_step}).parts;
    }
    if (setup.preset || setup.estimates) estimator_.emplace(setup.encoder_step);
    limiter.emplace(with);
    applied.setZero();
    speed_.setZero();
  }

  Vec3 x() const { return {bodies_[0].x, bodies_[1].x, bodies_[2].x}; }
  Vec3 measured() const {
    const double step = setup.encoder_step;
    return step > 0 ? Vec3(step * (x() / step).array().round()) : x();
  }
  Vec3 outside() const { return {bodies_[0].outside, bodies_[1].outside, bodies_[2].outside}; }

  void put(const Vec3& x) {
    for (int i = 0; i < 3; ++i) bodies_[static_cast<std::size_t>(i)].x = x[i];
  }

  static LocalTime at(int now) { return LocalTime(std::chrono::seconds(100) + std::chrono::milliseconds(now)); }

  PortState step(int now) {
    const double length = setup.every * 1e-3;
    const Duration held = setup.every * std::chrono::milliseconds(1);
    if (began_) {
      const Vec3 before = measured();
      const Vec3 true_before = x();
      if (setup.path) {
        put(setup.path(now * 1e-3));
      } else {
        for (int i = 0; i < 3; ++i) {
          bodies_[static_cast<std::size_t>(i)].advance(applied[i], now * 1e-3 - length, length);
        }
      }
      const Vec3 dx = measured() - before;
      speed_ = dx / length;
      limiter->observe({applied, dx, held});
      if (seen) coupling->observe({applied, dx, held}, limiter->payable());
      truth.observe(applied, Vec3(x() - true_before), held);
    }
    began_ = true;
    least_account = std::min(least_account, limiter->payable());
    if (estimator_) speed_ = estimator_->observe(at(now), measured());
    if (seen) {
      demand = coupling->command({at(now), measured(), speed_}, buttons, ready);
    } else {
      coupling->command_unseen(at(now), ready);
      demand = {Vec3::Zero()};
    }
    const double loss = limiter->worst_loss(demand.force);
    const EnergyTank::Settlement settled = coupling->settle(limiter->payable(), loss, held);
    limiter->credit(settled.credit);
    limiter->withdraw(settled.withdraw);
    paid = settled.withdraw;
    const LimitedForce<3> limited = limiter->limit(demand);
    applied = ready && seen ? (setup.limited ? limited.force : demand.force) : Vec3(Vec3::Zero());
    if (applied.norm() > setup.motor) applied *= setup.motor / applied.norm();
    cut = !limited.reasons.empty();
    least_account = std::min(least_account, limiter->payable());
    coupling->conclude(applied, setup.measures_contact ? std::optional<Vec3>(outside()) : std::nullopt);
    return coupling->message();
  }

  PortSetup setup;
  std::optional<Coupling> coupling;
  std::optional<Limiter> limiter;
  EnergyLedger truth;
  std::uint32_t buttons = 0;
  bool ready = true;
  bool seen = true;
  Demand<3> demand{Vec3::Zero()};
  Vec3 applied = Vec3::Zero();
  bool cut = false;
  double paid = 0;  ///< J in this period
  double least_account = std::numeric_limits<double>::infinity();

 private:
  std::vector<Body> bodies_;
  std::optional<VelocityEstimator> estimator_;
  Vec3 speed_ = Vec3::Zero();
  bool began_ = false;
};

/// Two ports and their network in virtual time with ticks of 1 ms.
class Ports {
 public:
  Ports(const PortSetup& of_leader, const PortSetup& of_follower, const Network& network_there,
        const Network& network_back)
      : leader(of_leader), follower(of_follower), there(network_there), back(network_back) {}
  Ports(const PortSetup& of_leader, const PortSetup& of_follower)
      : Ports(of_leader, of_follower, {.delay = 0, .seed = 1}, {.delay = 0, .seed = 2}) {}

  template <class Look>
  void run(int ticks, Look look) {
    for (const int last = now + ticks; now < last; ++now) {
      if (now % leader.setup.every == 0) turn(leader, back, there, cut_there, told_there);
      if (now % follower.setup.every == 0) turn(follower, there, back, cut_back, told_back);
      const auto& map = leader.setup.coupling.map;
      const double joule = map.force_scale / map.position_scale;
      least_sum = std::min(least_sum, leader.truth.energy() + joule * follower.truth.energy());
      look(now);
    }
  }
  void run(int ticks) {
    run(ticks, [](int) {});
  }

  /// Returns false after one second without a new live engagement.
  bool engage() {
    run(50);
    if (!leader.coupling->engage()) return false;
    for (int i = 0; i < 1000 && !leader.coupling->live(); ++i) run(1);
    return leader.coupling->live() && follower.coupling->live();
  }

  double least_account() const { return std::min(leader.least_account, follower.least_account); }

  Port leader;
  Port follower;
  OneWay<PortState> there;  ///< leader → follower
  OneWay<PortState> back;
  bool cut_there = false;
  bool cut_back = false;
  PortState told_there{};  ///< newest sent state
  PortState told_back{};
  int copies = 1;     ///< of each sent state
  int sent_each = 1;  ///< ms: only every such period is sent
  int now = 0;
  double least_sum = 0;  ///< J, W_l + (s_f/s_x) W_f

 private:
  void turn(Port& port, OneWay<PortState>& in, OneWay<PortState>& out, bool cut, PortState& told) {
    in.deliver(now, [&](const PortState& state) { port.coupling->receive(state, Port::at(now)); });
    told = port.step(now);
    for (int i = 0; i < copies && !cut && now % sent_each == 0; ++i) out.send(now, told);
  }
};

inline PortSetup port_of(PortRole role) {
  PortSetup setup;
  setup.coupling = coupling_of(role);
  return setup;
}

inline Ports far_apart(int one_way) {
  return {port_of(PortRole::kLeader),
          port_of(PortRole::kFollower),
          {.delay = one_way, .seed = 1},
          {.delay = one_way, .seed = 2}};
}

inline PortPhase phase(const Port& port) { return port.coupling->phase(); }

class Played {
 public:
  explicit Played(Coupling::Config config) : port(config) {}

  PortState state(PortPhase phase, std::uint64_t engagement = 0) {
    PortState peer;
    peer.epoch = 5;
    peer.sequence = ++sequence;
    peer.answers_epoch = told.epoch;
    peer.answers = told.sequence;
    peer.time = std::chrono::milliseconds(sequence);
    peer.phase = phase;
    peer.engagement = engagement;
    return peer;
  }
  void receive(const PortState& peer) { port.receive(peer, Port::at(now)); }
  Demand<3> step(const Vec3& x = Vec3::Zero(), std::uint32_t buttons = 0, bool ready = true) {
    const Demand<3> demand = port.command({Port::at(now), x, Vec3::Zero()}, buttons, ready);
    port.conclude(Vec3::Zero(), std::nullopt);
    told = port.message();
    ++now;
    return demand;
  }

  Coupling port;
  PortState told;
  std::uint64_t sequence = 0;
  int now = 0;
};

/// J: tolerated rounding of accounts.
inline constexpr double kRounding = -1e-9;

}  // namespace tendon

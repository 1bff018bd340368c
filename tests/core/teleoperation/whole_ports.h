// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "core/base/rotation.h"
#include "core/haptic_controller.h"
#include "tests/core/teleoperation/one_way.h"
#include "tests/core/teleoperation/pair.h"

namespace tendon {

struct WholeSetup {
  Coupling::Config coupling{};
  Surroundings along_x{};
  /// s → target rotation vector (rad) of a hand of `turn_hand_stiffness`; empty: no hand.
  std::function<Vec3(double)> turn_hand{};
  double turn_hand_stiffness = 0.4;        ///< N·m/rad
  std::function<Quat(double)> turned{};    ///< s → prescribed rotation, torques have no effect
  Surroundings closing{};                  ///< closes or blocks the fingers, along −g
  std::function<double(double)> opened{};  ///< s → m: prescribed opening, forces have no effect
  double opening = 0.02;                   ///< m, initial
  bool flips = false;                      ///< every second orientation is reported as −q
  LimiterConfig limiter{.law = Law::kAolPlus, .friction = {0.02, 0.26}, .longest_hold = std::chrono::milliseconds(1)};
};

inline constexpr Friction kTurnFriction{1e-3, 1e-3};  // N·m, N·m·s/rad
inline constexpr Friction kGripFriction{0.05, 0.5};
inline constexpr double kFingerArm = 0.06;  // m/rad

inline WholeSetup whole_of(PortRole role) {
  WholeSetup setup;
  Coupling::Config& config = setup.coupling;
  config.role = role;
  config.spring = {.stiffness = 400, .own_damping = 4, .period = std::chrono::milliseconds(1)};
  config.tank = EnergyTank::Config{.max_power = 100, .max_account = 10};
  config.turn = TurnCoupling::Config{.stiffness = 0.5, .damping = 5e-3};
  config.grip = GripCoupling::Config{.stiffness = 400, .damping = 2, .arm = kFingerArm};
  return setup;
}

/// Rotating body J dω/dt = τ + τ_hand − b ω − c ω/‖ω‖, by the midpoint rule in substeps of 50 µs.
class Turner {
 public:
  void advance(const Vec3& torque, const WholeSetup& setup, double from) {
    constexpr double kInertia = 2e-5;
    constexpr double kHandDamping = 2e-3;
    constexpr double h = 50e-6;
    for (int k = 0; k < 20; ++k) {
      Vec3 push = torque;
      double damping = kTurnFriction.viscous;
      if (setup.turn_hand) {
        push += setup.turn_hand_stiffness * turn_between(q, rotation_by(setup.turn_hand(from + (k + 0.5) * h)));
        damping += kHandDamping;
      }
      const Vec3 p = kInertia * omega + h / 2 * push;
      const double left = std::max(0.0, 1 - h * kTurnFriction.coulomb / (2 * std::max(p.norm(), 1e-300)));
      const Vec3 mean = left * p / (kInertia + h / 2 * damping);
      omega = left > 0 ? Vec3(2 * mean - omega) : Vec3(Vec3::Zero());
      q = unit(product(rotation_by(Vec3(h * mean)), q));
    }
  }

  Quat q{};
  Vec3 omega = Vec3::Zero();
};

class WholePort {
 public:
  explicit WholePort(const WholeSetup& with)
      : setup(with), x_(0.075, with.limiter.friction, with.along_x), fingers_(0.02, kGripFriction, with.closing) {
    fingers_.x = with.opened ? -with.opened(0) : -with.opening;
    if (with.turned) turner.q = with.turned(0);
    begin(1);
  }

  void begin(std::uint64_t epoch) {
    controller.emplace(control(epoch));
    force.setZero();
    torque.setZero();
    grip_force = 0;
  }

  HapticController::Config control(std::uint64_t epoch) const {
    HapticController::Config config;
    config.limiter = setup.limiter;
    config.limiter.shared_account = setup.coupling.tank || setup.coupling.method == CouplingMethod::kWaves;
    config.rotation = {.friction = kTurnFriction, .max_torque = 1, .max_slew = std::numeric_limits<double>::infinity()};
    config.grip = {.friction = kGripFriction, .arm = kFingerArm, .max_force = 20};
    config.max_force = 20;
    config.max_slew = std::numeric_limits<double>::infinity();
    config.coupling = setup.coupling;
    config.coupling->spring.epoch = epoch;
    return config;
  }

  Coupling& coupling() { return (*controller->couplings())[0]; }
  double x() const { return x_.x; }
  double opening() const { return -fingers_.x; }
  void put(double x) { x_.x = x; }

  static LocalTime at(int now) { return LocalTime(std::chrono::seconds(100) + std::chrono::milliseconds(now)); }

  PortState step(int now) {
    move(now);
    const bool flip = setup.flips && now % 2 == 1;
    const double sign = flip ? -1 : 1;
    const Quat& q = turner.q;
    seen = {
        .turning = Turning{.orientation = {sign * q.w, sign * q.x, sign * q.y, sign * q.z}, .angular_velocity = spin_},
        .grip = Grip{.opening = opening() / kFingerArm, .velocity = finger_speed_ / kFingerArm},
        .torque = torque,
        .grip_force = grip_force};
    controller->notice(buttons, ready);
    last = controller->step({at(now), Vec3(x(), 0, 0), Vec3(speed_, 0, 0)}, force, {}, &seen);
    force = last.force;
    torque = last.turn()->torque;
    grip_force = last.grip()->force;
    least_account = std::min({least_account, last.energy, last.grip()->energy});
    coupling().conclude(force, std::nullopt, torque, grip_force);
    return coupling().message();
  }

  WholeSetup setup;
  std::optional<HapticController> controller;
  Turner turner;
  std::uint32_t buttons = 0;
  bool ready = true;
  Step last;
  HandleSample seen;  ///< last sample of the controller
  Vec3 force = Vec3::Zero();
  Vec3 torque = Vec3::Zero();
  double grip_force = 0;
  double ledger = 0;       ///< J, for force and torque; this is computed independently
  double grip_ledger = 0;  ///< J
  double least_account = std::numeric_limits<double>::infinity();

 private:
  void move(int now) {
    if (std::exchange(began_, true)) {
      const double from = (now - 1) * 1e-3;
      const double x_before = x();
      const double open_before = opening();
      const Quat q_before = turner.q;
      x_.advance(force.x(), from, 1e-3);
      if (setup.turned) {
        turner.q = setup.turned(now * 1e-3);
      } else {
        turner.advance(torque, setup, from);
      }
      if (setup.opened) {
        fingers_.x = -setup.opened(now * 1e-3);
      } else {
        fingers_.advance(-grip_force, from, 1e-3);
      }
      const Vec3 turn = turn_between(q_before, turner.q);
      const double dx = x() - x_before;
      const double dg = opening() - open_before;
      speed_ = dx / 1e-3;
      spin_ = turn / 1e-3;
      finger_speed_ = dg / 1e-3;
      ledger += -force.x() * dx - torque.dot(turn) + credit(setup.limiter.friction, std::abs(dx)) +
                credit(kTurnFriction, turn.norm());
      grip_ledger += -grip_force * dg + credit(kGripFriction, std::abs(dg));
    }
  }
  static double credit(const Friction& friction, double way) {
    return friction.coulomb * way + friction.viscous * way * way / 1e-3;
  }

  Body x_;
  Body fingers_;
  double speed_ = 0;
  Vec3 spin_ = Vec3::Zero();
  double finger_speed_ = 0;
  bool began_ = false;
};

/// Two whole handles and their network in virtual time with ticks of 1 ms.
class WholePorts {
 public:
  WholePorts(const WholeSetup& of_leader, const WholeSetup& of_follower, const Network& network_there,
             const Network& network_back)
      : leader(of_leader), follower(of_follower), there(network_there), back(network_back) {}
  WholePorts(const WholeSetup& of_leader, const WholeSetup& of_follower, int one_way = 0)
      : WholePorts(of_leader, of_follower, {.delay = one_way, .seed = 1}, {.delay = one_way, .seed = 2}) {}

  template <class Look>
  void run(int ticks, Look look) {
    for (const int last = now + ticks; now < last; ++now) {
      turn(leader, back, there);
      turn(follower, there, back);
      const auto& map = leader.setup.coupling.map;
      least_sum = std::min({least_sum, leader.ledger + map.force_scale / map.position_scale * follower.ledger,
                            leader.grip_ledger + map.force_scale * follower.grip_ledger});
      look();
    }
  }
  void run(int ticks) {
    run(ticks, [] {});
  }

  /// Returns false if there is no new engagement after two seconds.
  bool engage() {
    for (int i = 0; i < 1000 && !leader.coupling().engage(); ++i) run(1);
    for (int i = 0; i < 2000 && !(leader.coupling().live() && follower.coupling().live()); ++i) run(1);
    return leader.coupling().live() && follower.coupling().live();
  }

  double least_account() const { return std::min(leader.least_account, follower.least_account); }

  WholePort leader;
  WholePort follower;
  OneWay<PortState> there;  ///< leader → follower
  OneWay<PortState> back;
  bool cut = false;  ///< both directions
  int now = 0;
  double least_sum = 0;  ///< J, wrenches or grippers, in joules of the leader

 private:
  void turn(WholePort& port, OneWay<PortState>& in, OneWay<PortState>& out) {
    in.deliver(now, [&](const PortState& state) { port.coupling().receive(state, WholePort::at(now)); });
    const PortState told = port.step(now);
    if (!cut) out.send(now, told);
  }
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>

#include "core/control/limiter.h"
#include "core/ledger/energy_ledger.h"
#include "core/teleoperation/energy_tank.h"
#include "core/teleoperation/methods/position_position.h"
#include "tests/core/teleoperation/one_way.h"

namespace tendon {

/// External force along x: a spring with a damper, or a wall.
struct Surroundings {
  double stiffness = 0;                       ///< N/m
  double damping = 0;                         ///< N·s/m
  std::function<double(double)> reference{};  ///< t, s → m: rest position of the spring; empty: 0
  bool wall = false;                          ///< applies only if x is beyond `reference`
  /// s: hand released or wall removed.
  double until = std::numeric_limits<double>::infinity();
  std::function<double(double)> stiffer{};  ///< t, s → factor on `stiffness`; empty: 1
};

/// m dv/dt = F + F_surroundings − b v − f_c sgn(v) by the implicit midpoint rule with set-valued friction in substeps
/// of 50 µs, which neither generates nor loses energy.
class Body {
 public:
  Body(double mass, const Friction& friction, Surroundings around)
      : mass_(mass), friction_(friction), around_(std::move(around)) {}

  void advance(double force, double from, double length) {
    constexpr double kSubstep = 50e-6;
    const int count = std::max(1, static_cast<int>(std::lround(length / kSubstep)));
    const double h = length / count;
    for (int k = 0; k < count; ++k) substep(force, from + (k + 0.5) * h, h);
  }

  double x = 0;
  double v = 0;
  double outside = 0;  ///< N, external force in the last substep

 private:
  void substep(double force, double middle, double h) {
    const double rest = around_.reference ? around_.reference(middle) : 0;
    const double rest_speed = around_.reference && !around_.wall
                                  ? (around_.reference(middle + h) - around_.reference(middle - h)) / (2 * h)
                                  : 0;
    const bool touches = middle < around_.until && (!around_.wall || x > rest);
    const double k = touches ? around_.stiffness * (around_.stiffer ? around_.stiffer(middle) : 1) : 0;
    const double c = touches ? around_.damping : 0;
    const double push = force + k * (rest - x) + c * rest_speed;
    const double p = mass_ * v + h / 2 * push;
    const double left = std::max(0.0, 1 - h * friction_.coulomb / (2 * std::max(std::abs(p), 1e-300)));
    const double mean = left * p / (mass_ + h / 2 * (friction_.viscous + c + k * h / 2));
    const double end = 2 * mean - v;
    const bool stops = mean == 0 || (end * mean < 0 && std::abs(push) <= friction_.coulomb);
    outside = k * (rest - x - mean * h / 2) + c * (rest_speed - mean);
    x += h * mean;
    v = stops ? 0 : end;
  }

  double mass_;
  Friction friction_;
  Surroundings around_;
};

struct EndConfig {
  double mass = 0.075;
  Friction friction{.coulomb = 0.02, .viscous = 0.26};
  int period = 10;  ///< tenths of a millisecond
  Law law = Law::kAol;
  AolPlus<1, 3>::Parts parts{};
  PositionPosition<3>::Config spring{.stiffness = 400, .own_damping = 4};
  Surroundings around{};
  std::function<double(double)> path{};  ///< t, s → m: prescribed motion, forces have no effect
  double encoder_step = 0;               ///< m; 0: exact
};

struct PairConfig {
  EndConfig leader{};
  EndConfig follower{};
  double position_scale = 1;  ///< s_x
  double force_scale = 1;     ///< s_f; the caller scales the springs' K, D, B: K_l = s_x s_f K_f
  Network there{};            ///< tenths of a millisecond
  Network back{};
  bool limited = true;  ///< false: without limiter and tank
  double max_account = 10;
  double max_power = 100;
};

/// Two devices with springs, limiters and tanks over a bad network, in virtual time.
class Pair {
 public:
  struct End {
    End(const EndConfig& from, const EnergyTank::Config& tank_config)
        : config(from),
          body(from.mass, from.friction, from.around),
          limiter({.law = from.law,
                   .friction = from.friction,
                   .longest_hold = from.period * std::chrono::microseconds(100),
                   .parts = from.parts,
                   .shared_account = true}),
          tank(tank_config),
          spring([&from] {
            auto with_period = from.spring;
            with_period.period = from.period * std::chrono::microseconds(100);
            return with_period;
          }()),
          ledger(from.friction) {
      if (config.path) body.x = config.path(0);
    }

    EndConfig config;
    Body body;
    Limiter limiter;
    EnergyTank tank;
    PositionPosition<3> spring;
    EnergyLedger ledger;
    double wanted = 0;   ///< N
    double applied = 0;  ///< N
    double speed = 0;    ///< m/s, the mean over the last period
    std::uint64_t periods = 0;
    std::uint64_t cut = 0;  ///< of these, limited periods
  };

  explicit Pair(const PairConfig& config)
      : config_(config),
        leader(config.leader, tank_of(config, config.force_scale / config.position_scale)),
        follower(config.follower, tank_of(config, config.position_scale / config.force_scale)),
        there_(config.there),
        back_(config.back) {}

  /// Runs for `duration` s. The function `look(t)` is called every millisecond.
  template <class Look>
  void run(double duration, Look look) {
    const int last = now_ + static_cast<int>(std::lround(duration * 1e4));
    for (; now_ < last; ++now_) {
      if (now_ % config_.leader.period == 0) {
        step(leader, back_, there_, 1 / config_.position_scale);
      }
      if (now_ % config_.follower.period == 0) {
        step(follower, there_, back_, config_.position_scale);
      }
      const double sum =
          leader.ledger.energy() + config_.force_scale / config_.position_scale * follower.ledger.energy();
      least_sum = std::min(least_sum, sum);
      if (now_ % 10 == 0) look(time());
    }
  }
  void run(double duration) {
    run(duration, [](double) {});
  }

  double time() const { return now_ * 1e-4; }

 private:
  struct Message {
    EnergyTankMessage tank;
    PortMotion<3> motion;
  };

  static EnergyTank::Config tank_of(const PairConfig& config, double joule) {
    EnergyTank::Config tank;
    tank.joule[0] = joule;
    tank.max_account = config.max_account;
    tank.max_power = config.max_power;
    return tank;
  }

  void step(End& end, OneWay<Message>& in, OneWay<Message>& out, double scale) {
    const double length = end.config.period * 1e-4;
    const Duration held = end.config.period * std::chrono::microseconds(100);
    if (end.periods > 0) {
      const double before = measured(end);
      const double true_before = end.body.x;
      if (end.config.path) {
        end.body.x = end.config.path(time());
      } else {
        end.body.advance(end.applied, time() - length, length);
      }
      const Interval<3> interval{Vec3(end.applied, 0, 0), Vec3(measured(end) - before, 0, 0), held};
      end.speed = interval.dx.x() / length;
      end.limiter.observe(interval);
      end.ledger.observe(interval.applied, Vec3(end.body.x - true_before, 0, 0), held);
    }
    ++end.periods;
    least_account = std::min(least_account, end.limiter.payable());
    in.deliver(now_, [&](Message message) {
      message.motion.position *= scale;
      message.motion.velocity *= scale;
      end.spring.receive(message.motion);
      end.tank.receive(0, message.tank);
    });
    const Demand<3> wanted = end.spring.command(Vec3(measured(end), 0, 0), Vec3(end.speed, 0, 0));
    end.wanted = wanted.force.x();
    if (config_.limited) {
      share<3>(end.tank, end.limiter, wanted.force, held);
      const LimitedForce<3> limited = end.limiter.limit(wanted);
      end.applied = limited.force.x();
      end.cut += limited.reasons.empty() ? 0 : 1;
      least_account = std::min(least_account, end.limiter.payable());
    } else {
      end.applied = std::clamp(end.wanted, -100.0, 100.0);
    }
    out.send(now_, {end.tank.message(0), end.spring.message()});
  }

  static double measured(const End& end) {
    const double step = end.config.encoder_step;
    return step > 0 ? step * std::round(end.body.x / step) : end.body.x;
  }

  PairConfig config_;

 public:
  End leader;
  End follower;
  double least_account = std::numeric_limits<double>::infinity();  ///< J, both accounts
  double least_sum = 0;                                            ///< J, W_l + (s_f/s_x) W_f

 private:
  OneWay<Message> there_;
  OneWay<Message> back_;
  int now_ = 0;
};

/// Mean round trip of `round_trip` ms; each direction has jitter of max(5 ms, 20 %), reordering and 10 % loss.
inline void make_bad(PairConfig& config, int round_trip, std::uint64_t seed) {
  const int one_way = round_trip * 5;
  config.there = {.delay = one_way, .jitter = std::max(50, one_way / 5), .loss = 0.1, .seed = seed};
  config.back = config.there;
  config.back.seed = seed + 1000;
}

/// Computes the rms above a frequency of samples at 1 kHz, with a Butterworth filter of second order.
class HighPass {
 public:
  explicit HighPass(double hertz) {
    const double w = std::tan(3.14159265358979 * hertz * 1e-3);
    const double n = 1 / (1 + std::sqrt(2.0) * w + w * w);
    gain_ = n;
    a1_ = 2 * (w * w - 1) * n;
    a2_ = (1 - std::sqrt(2.0) * w + w * w) * n;
  }
  void add(double x, bool counts = true) {
    const double y = gain_ * (x - 2 * x1_ + x2_) - a1_ * y1_ - a2_ * y2_;
    x2_ = std::exchange(x1_, x);
    y2_ = std::exchange(y1_, y);
    if (!counts) return;
    squares_ += y * y;
    ++count_;
  }
  double rms() const { return count_ > 0 ? std::sqrt(squares_ / count_) : 0; }

 private:
  double gain_, a1_, a2_;
  double x1_ = 0, x2_ = 0, y1_ = 0, y2_ = 0;
  double squares_ = 0;
  int count_ = 0;
};

}  // namespace tendon

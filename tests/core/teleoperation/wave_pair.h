// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>

#include "core/teleoperation/methods/wave_variables.h"
#include "tests/core/teleoperation/one_way.h"
#include "tests/core/teleoperation/pair.h"

namespace tendon {

/// Two devices with a wave line between them, periods of 1 ms, exact positions, and no limiter.
class WavePair {
 public:
  struct Config {
    WavePort<1>::Config port{.impedance = 4, .period = std::chrono::milliseconds(1)};
    double mass = 0.075;
    double tool_mass = 0.075;
    Friction friction{.coulomb = 0, .viscous = 0.26};
    Surroundings hand{};
    Surroundings tool{};
    std::function<double(double)> path{};  ///< t, s → m: prescribed motion of the leader, forces have no effect
    Network there{};                       ///< periods
    Network back{};
    double tool_encoder_step = 0;  ///< m; 0: exact
  };

  explicit WavePair(const Config& config)
      : leader(config, config.mass, config.hand, config.path, 0),
        follower(config, config.tool_mass, config.tool, {}, config.tool_encoder_step),
        there_(config.there),
        back_(config.back) {}

  /// Runs for `duration` s. The function `look(t)` is called after every period.
  template <class Look>
  void run(double duration, Look look) {
    const int last = now_ + static_cast<int>(std::lround(duration * 1e3));
    for (; now_ < last; ++now_) {
      if (now_ > 0) {
        const auto out = leader.advance(now_);
        const auto home = follower.advance(now_);
        there_.send(now_, out);
        back_.send(now_, home);
      }
      there_.deliver(now_, [&](const WaveMessage<1>& message) { follower.port.receive(message); });
      back_.deliver(now_, [&](const WaveMessage<1>& message) { leader.port.receive(message); });
      leader.force = leader.port.command(Vec<1>(leader.speed)).force[0];
      follower.force = follower.port.command(Vec<1>(follower.speed)).force[0];
      least_sum = std::min(least_sum, leader.taken + follower.taken);
      look(now_ * 1e-3);
    }
  }

  struct End {
    End(const Config& config, double mass, const Surroundings& around, std::function<double(double)> led, double step)
        : port(config.port), body(mass, config.friction, around), path(std::move(led)), encoder_step(step) {}

    WaveMessage<1> advance(int now) {
      const double before = body.x;
      const double seen_before = seen();
      if (path) {
        body.x = path(now * 1e-3);
      } else {
        body.advance(force, (now - 1) * 1e-3, 1e-3);
      }
      const double moved = seen() - seen_before;
      speed = moved / 1e-3;
      taken -= force * (body.x - before);
      return port.observe({Vec<1>(force), Vec<1>(moved), std::chrono::milliseconds(1)});
    }

    double seen() const { return encoder_step > 0 ? encoder_step * std::round(body.x / encoder_step) : body.x; }

    WavePort<1> port;
    Body body;
    std::function<double(double)> path;
    double encoder_step;
    double force = 0;  ///< N, on the handle
    double speed = 0;  ///< m/s, the mean over the last period
    double taken = 0;  ///< J, absorbed by the port
  };

  End leader;
  End follower;
  double least_sum = 0;  ///< J, absorbed by both ports

 private:
  OneWay<WaveMessage<1>> there_;
  OneWay<WaveMessage<1>> back_;
  int now_ = 0;
};

/// Hand's target, m: 30 mm deep for `hold` s, from 1 s and from hold + 6 s on.
inline double two_presses(double t, double hold) {
  const auto ramp = [t](double from) { return std::clamp((t - from) / 0.3, 0.0, 1.0); };
  return 0.03 * (ramp(0.7) - ramp(1 + hold) + ramp(5.7 + hold));
}

struct Presses {
  double first = 0, second = 0;  ///< N at the leader, mean over the last half second
  double contact = 0;            ///< N at the wall during `second`
  double ripple = 0;             ///< N rms above 50 Hz during the hold
  double least_sum = 0;          ///< J
};

/// `hand` and `wall` in N/m, the wall at 10 mm. A round trip of 600 ms needs a minute to settle.
inline Presses press(WavePair::Config config, double hand = 400, double wall = 500, double hold = 9) {
  config.hand = {.stiffness = hand, .damping = 2, .reference = [hold](double t) { return two_presses(t, hold); }};
  config.tool = {.stiffness = wall, .reference = [](double) { return 0.01; }, .wall = true};
  WavePair pair(config);
  Presses found;
  HighPass high(50);
  const double end = 6 + 2 * hold;
  pair.run(end, [&](double t) {
    high.add(pair.leader.force, t >= end - 1);
    if (t >= hold + 0.5 && t < hold + 1) found.first -= pair.leader.force / 500;
    if (t >= end - 0.5) found.second -= pair.leader.force / 500;
    if (t >= end - 0.5) found.contact -= pair.follower.body.outside / 500;
  });
  found.ripple = high.rms();
  found.least_sum = pair.least_sum;
  return found;
}

}  // namespace tendon

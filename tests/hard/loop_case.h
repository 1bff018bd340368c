// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cases that break the loop of hand, device, network and engine: the whole server with AOL+, a real client, a virtual
// clock, a hand that moves in contact and then rests, and a disturbance. An observer at the device's port keeps its own
// energy account. For every case and seed:
//
// passive   E ≥ −1e-9 J at every step, E = Σ [−F·Δx + f_c ‖Δx‖ + b ‖Δx‖²/T] with the actual force and motion,
//           and the hand never receives more energy than it gave (∫ F_hand·dx ≥ 0)
// bounded   ‖F‖ ≤ 8 N; the force grows by at most 1000 N/s · T per step (the limiter may cut faster)
// quiet     ‖v‖ ≤ 5 mm/s permanently, from a stated time after the end of the disturbance
//
// The same run without the protection under test must violate at least one of these.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "devices/simulated/simulated_device.h"
#include "tests/support/dice.h"
#include "tests/tools/worlds/adversary.h"
#include "tests/tools/worlds/watched_device.h"
#include "tests/tools/worlds/world.h"

namespace tendon::hard {

using simulation::AdversaryDevice;
using simulation::WatchedDevice;
using simulation::World;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Friction kFriction{.coulomb = 0.3, .viscous = 0.8};  // for the device and the limiter's configuration
constexpr double kMaxForce = 8;                                // N
constexpr double kMaxSlew = 1000;                              // N/s
constexpr double kQuiet = 0.005;                               // m/s
constexpr double kRounding = 1e-9;                             // J
constexpr double kInf = std::numeric_limits<double>::infinity();

inline std::string text_of(double value, const char* unit) {
  std::array<char, 48> buffer{};
  std::snprintf(buffer.data(), buffer.size(), std::abs(value) < 1000 ? "%.3g %s" : "%.0f %s", value, unit);
  return buffer.data();
}
inline std::string text_of(Duration duration) { return text_of(tendon::seconds(duration), "s"); }

constexpr std::uint64_t kSeeds = 4;

/// Number of seeds for each case; sweep.sh sets it.
inline std::uint64_t seeds() {
  const char* count = std::getenv("TENDON_HARD_SEEDS");  // NOLINT(concurrency-mt-unsafe): nothing here sets it
  return count == nullptr ? kSeeds : std::strtoull(count, nullptr, 10);
}

class Encoder final : public Device {
 public:
  explicit Encoder(Device& truth) : truth_(truth) {}
  const DeviceInfo& info() const noexcept override { return truth_.info(); }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    auto sample = truth_.read(now);
    if (!sample) return sample;
    sample->at -= behind;
    if (range) {
      const auto turns = ((sample->position - middle).array() / *range + 0.5).floor();
      sample->position -= *range * turns.matrix();
    }
    if (stuck) sample->position = last_;
    last_ = sample->position;
    return sample;
  }
  Vec3 apply(const Vec3& force) noexcept override { return truth_.apply(force); }

  std::optional<double> range;  ///< m, range of the counter on each axis about `middle`, where it wraps around
  Vec3 middle = Vec3::Zero();   ///< m
  bool stuck = false;
  Duration behind{};  ///< delay of its time stamps

 private:
  Device& truth_;
  Vec3 last_ = Vec3::Zero();
};

/// The values that were observed at the port. If there are several runs, each value is the worst one.
struct Observed {
  double least_energy = 0;  ///< J
  double least_work = 0;    ///< J, of the hand
  double most_force = 0;    ///< N
  double most_rate = 0;     ///< N/s
  Duration noisy_for{};     ///< after the end of the disturbance
  bool felt = false;
  double figure = 0;   ///< measured value of the case, in its own unit
  std::string also{};  ///< a violated additional promise of the case

  void add(const Observed& other) {
    least_energy = std::min(least_energy, other.least_energy);
    least_work = std::min(least_work, other.least_work);
    most_force = std::max(most_force, other.most_force);
    most_rate = std::max(most_rate, other.most_rate);
    noisy_for = std::max(noisy_for, other.noisy_for);
    felt = felt || other.felt;
    figure = std::max(figure, other.figure);
    if (also.empty()) also = other.also;
  }
};

/// Names the first exceeded bound, or is empty.
inline std::string broken(const Observed& seen, Duration quiet_within) {
  std::string text;
  const auto say = [&text](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  if (seen.least_energy < -kRounding) say("account " + text_of(seen.least_energy, "J"));
  if (seen.least_work < -kRounding) say("hand " + text_of(seen.least_work, "J"));
  if (seen.most_force > kMaxForce * (1 + 1e-9)) say(text_of(seen.most_force, "N"));
  if (seen.most_rate > kMaxSlew * (1 + 1e-9)) say(text_of(seen.most_rate, "N/s"));
  if (seen.noisy_for > quiet_within) say("not quiet after " + text_of(quiet_within));
  if (!seen.also.empty()) say(seen.also);
  return text;
}

inline std::string result_of(const Observed& seen) {
  return "least energy " + text_of(1e3 * seen.least_energy, "mJ") + ", ≤ " + text_of(seen.most_force, "N") + ", ≤ " +
         text_of(seen.most_rate, "N/s") + ", quiet after " + text_of(seen.noisy_for);
}
/// Only time and force have margins, because the slew limit is reached exactly whenever the engine requests more.
inline double margin_of(const Observed& seen, Duration quiet_within) {
  const double time = tendon::seconds(quiet_within) / tendon::seconds(std::max<Duration>(seen.noisy_for, Duration(1)));
  return std::min(time, kMaxForce / seen.most_force);
}

/// Runs a case for every seed. All promises must hold, and the hand must feel a force.
template <class Run>
inline Observed kept(Duration quiet_within, Run run) {
  Observed worst;
  for (std::uint64_t seed = 1; seed <= seeds(); ++seed) {
    const Observed seen = run(seed);
    EXPECT_EQ(broken(seen, quiet_within), "") << "seed " << seed;
    EXPECT_TRUE(seen.felt) << "seed " << seed;
    worst.add(seen);
  }
  return worst;
}

/// Runs a case without the protection. Returns the promise that is violated. It is an error if there is none.
template <class Run>
inline std::string without(const std::string& what, Duration quiet_within, Run run) {
  Observed worst;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) worst.add(run(seed));
  const std::string text = broken(worst, quiet_within);
  EXPECT_NE(text, "") << what;
  return what + ": " + text;
}

struct Case {
  explicit Case(std::uint64_t seed) : dice(seed), into(dice.direction()), stiffness(dice.within(1000, 2500)) {
    across = into.cross(dice.direction()).normalized();
    device.name = "device";
    device.mass = 0.15;
    device.viscous_friction = kFriction.viscous;
    device.coulomb_friction = kFriction.coulomb;
    device.hand = OperatorHand::Config{
        .stiffness = dice.within(200, 400), .damping = 3, .mass = 0.05, .motion = restless(seconds(3))};
    device.max_substep = std::chrono::microseconds(100);
    port.friction = kFriction;
    world.seed = seed;
    world.mail = {.steps = 16, .flight = 1, .datagrams = 1};
    world.weather = fair();
    HapticController::Config& control = world.loop.control;
    control.limiter.friction = kFriction;
    control.limiter.longest_hold = milliseconds(2);
    control.limiter.parts.energy_cap.emplace();
    control.limiter.parts.knee.emplace();
    control.max_force = kMaxForce;
    control.max_slew = kMaxSlew;
    engine.name = "Z";
    engine.rate_hz = 500;
    physics = [n = into, k = stiffness](const DeviceState& hand) -> Touch {
      return Vec3(-k * std::max(0.0, hand.position.dot(n)) * n);
    };
  }

  static simulation::Network::Weather weather(const char* up, const char* down) {
    return {.up = injector::parse_profile(up), .down = injector::parse_profile(down)};
  }
  static simulation::Network::Weather fair() { return weather("delay=uniform(1ms,3ms)", "delay=uniform(1ms,3ms)"); }

  /// The hand is moved in and out of the wall and along it. After this time, it is at rest 12 mm deep in the wall.
  ScriptedMotion restless(Duration time) {
    ScriptedMotion::MinimumJerk reach;
    reach.back_and_forth = false;
    reach.points = {-0.01 * into};
    for (bool deep = true; time > milliseconds(900); deep = !deep) {
      const double depth = deep ? dice.within(0.01, 0.02) : dice.within(0.002, 0.008);
      reach.points.emplace_back(depth * into + dice.within(-0.005, 0.005) * across);
      reach.durations.push_back(dice.milliseconds(200, 500));
      time -= reach.durations.back();
    }
    reach.points.emplace_back(0.012 * into);
    reach.durations.push_back(time);
    return ScriptedMotion(std::move(reach));
  }

  HapticController::Config& control() { return world.loop.control; }
  void let_all_through() { control().limiter.law = Law::kNone; }

  Dice dice;
  Vec3 into;
  Vec3 across;
  double stiffness;  ///< N/m, of the wall
  SimulatedDevice::Config device;
  WatchedDevice::Config port;
  World::Config world;
  ForceClient::Config engine;
  Physics physics;
  injector::DriftingClock clock;
};

class Bench {
 public:
  explicit Bench(const Case& set)
      : device_(set.device),
        port_(device_, set.port),
        encoder(port_),
        world(set.world, encoder),
        longest_hold_(set.world.loop.control.limiter.longest_hold) {
    engine = world.add_controller(set.engine, set.physics, set.clock);
    world.watch_steps([this](const StepRecord& step) { see(step); });
  }

  void run(Duration duration) { world.run_for(duration); }
  void disturbance_is_over() { over_ = world.now(); }
  /// Adds a check that is called in every step. It returns the violation, or an empty string if there is none.
  void expect_of_steps(std::function<std::string(const StepRecord&)> promise) { promise_ = std::move(promise); }
  const Observed& seen() const { return seen_; }
  void note(double figure) { seen_.figure = std::max(seen_.figure, figure); }
  void blame(const std::string& what) {
    if (seen_.also.empty()) seen_.also = what;
  }
  double energy() const { return port_.energy(); }

 private:
  SimulatedDevice device_;
  WatchedDevice port_;

 public:
  Encoder encoder;
  World world;
  std::size_t engine = 0;
  bool owes = false;  ///< the account may be negative while this is set

 private:
  void see(const StepRecord& step) {
    if (!owes) seen_.least_energy = std::min(seen_.least_energy, port_.energy());
    if (!owes) seen_.least_work = std::min(seen_.least_work, device_.truth().hand_work);
    seen_.most_force = std::max(seen_.most_force, step.applied.norm());
    if (last_ && world.now() > *last_) {
      const bool cut = step.reasons.has(Reason::kEnergy) || step.reasons.has(Reason::kUnseen);
      const double change =
          cut ? step.applied.norm() - step.was_applied.norm() : (step.applied - step.was_applied).norm();
      // During a pause, or when the time of the device jumps ahead, the force may only grow for the longest hold.
      const Duration held = std::min(std::max<Duration>(world.now() - *last_, step.held), longest_hold_);
      seen_.most_rate = std::max(seen_.most_rate, change / tendon::seconds(held));
    }
    last_ = world.now();
    if (over_ && device_.truth().velocity.norm() > kQuiet) seen_.noisy_for = world.now() - *over_;
    if (step.mode == Mode::kActive && step.applied.norm() > 1) seen_.felt = true;
    if (promise_) blame(promise_(step));
  }

  Duration longest_hold_;
  Observed seen_;
  std::optional<LocalTime> last_;
  std::optional<LocalTime> over_;
  std::function<std::string(const StepRecord&)> promise_;
};

/// If an engine has been silent for this time, there must not be any force. The force is valid for 500 ms, the safe
/// stop is 250 ms later, and the slew limit needs 8 ms.
constexpr Duration kSilence = milliseconds(500 + 250 + 10);

inline std::function<std::string(const StepRecord&)> no_force_from(LocalTime when) {
  return [when](const StepRecord& step) -> std::string {
    if (step.hand.at < when || step.applied.isZero(0)) return {};
    return text_of(step.applied.norm(), "N when the engine has long been silent");
  };
}

}  // namespace tendon::hard

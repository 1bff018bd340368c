// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/invariant_checker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

namespace tendon::simulation {

namespace {

constexpr double kRounding = 1e-9;  ///< tolerance: J for energies, N for forces
/// Drift of 200 ppm over an echo hold of 50 ms is 10 µs; three times that.
constexpr Duration kRoundTripError = std::chrono::microseconds(30);
/// Each clock reading is truncated to whole nanoseconds.
constexpr Duration kClockRounding{4};
/// If a client is served, both ends send and receive at least once in this time.
constexpr Duration kServed = std::chrono::milliseconds(400);

constexpr std::array kOracles = {
    OracleInfo{Oracle::kLedger, "ledger",
               "the device gives out no energy that it did not receive, except 1 nJ for rounding, and in a hold longer "
               "than the bound of the law, at most the amount of the law"},
    OracleInfo{Oracle::kTruth, "truth", "the hand has done at least the work in the account of the port"},
    OracleInfo{Oracle::kBound, "bound", "no force, torque or grip exceeds the bound of the scene or of the law"},
    OracleInfo{Oracle::kFinite, "finite", "only finite numbers reach the device"},
    OracleInfo{Oracle::kFresh, "fresh", "a force counts as fresh only during its validity"},
    OracleInfo{Oracle::kStopped, "stopped",
               "there is no force long after the last one arrived, and none during a fault"},
    OracleInfo{Oracle::kNewest, "newest",
               "the motion that the rendered force answers is never older than the previous one"},
    OracleInfo{Oracle::kDrained, "drained", "after its turn, a server or client has no unread datagram"},
    OracleInfo{Oracle::kCounters, "counters", "sent = received + lost + in flight; every datagram is counted once"},
    OracleInfo{Oracle::kRoundTrip, "round-trip",
               "the measured round trip is that of the network, whatever the clocks show"},
    OracleInfo{Oracle::kClock, "clock", "the error of a controller's clock offset is within its published bound"},
    OracleInfo{Oracle::kRecovery, "recovery",
               "after the network has recovered, all clients are served again within the guaranteed time"},
    OracleInfo{Oracle::kCalm, "calm", "no loop asks to be called again without end"},
    OracleInfo{Oracle::kPress, "press", "an observer receives every press of a button"},
};

std::string number(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.6g", value);
  return buffer.data();
}
std::string words(const Effort& effort) {
  return number(effort.force.norm()) + " N, " + number(effort.torque.norm()) + " N·m and " + number(effort.grip) +
         " N of grip";
}
std::string ms(Duration duration) { return number(seconds(duration) * 1e3) + " ms"; }

Duration longest_validity(const DrawnWorld& world) {
  const Duration most = world.config.loop.control.hold.max_valid_for;
  if (world.believes_damage() || world.rogue()) return most;
  Duration longest{};
  for (const DrawnClient& client : world.clients) {
    if (client.kind != DrawnClient::Kind::kController) continue;
    // By default a client's validity is 3 × max(100 ms, its period).
    longest = std::max(longest, client.config.valid_for > Duration::zero() ? client.config.valid_for : most);
  }
  // On the wire in whole microseconds, rounded up.
  return std::min(longest + std::chrono::microseconds(1), most);
}

std::uint64_t counted(const ForceClient::Stats& stats) {
  const LinkStats& link = stats.link;
  return link.datagrams_received + link.duplicated + link.malformed + link.forged + link.old_key + stats.foreign;
}

}  // namespace

std::span<const OracleInfo> oracles() noexcept { return kOracles; }
const OracleInfo& info(Oracle oracle) noexcept { return kOracles[static_cast<std::size_t>(oracle)]; }

Duration recovery_promise(const DrawnWorld& world) {
  Duration retry{};
  for (const DrawnClient& client : world.clients) retry = std::max(retry, client.config.retry_max);
  return Session::Config{}.timeout + retry + std::chrono::milliseconds(600);
}

InvariantChecker::InvariantChecker(const DrawnWorld& drawn, World& world, const WatchedDevice& port,
                                   const SimulatedDevice* simulated)
    : drawn_(drawn),
      world_(world),
      port_(port),
      simulated_(simulated),
      aol_([&] {
        const Law law = drawn.config.loop.control.limiter.law;
        return law == Law::kAol || law == Law::kAolPlus || law == Law::kAolPerAxis || law == Law::kAolBox;
      }()),
      valid_(longest_validity(drawn)),
      safe_stop_(drawn.config.loop.control.hold.safe_stop),
      slew_time_([&] {
        const HapticController::Config& control = drawn.config.loop.control;
        double slowest = control.max_force / control.max_slew;
        if (control.rotation) slowest = std::max(slowest, control.rotation->max_torque / control.rotation->max_slew);
        if (control.grip) slowest = std::max(slowest, control.grip->max_force / control.grip->max_slew);
        return from_seconds(2 * slowest) + 2 * control.limiter.longest_hold;
      }()),
      may_replay_ticks_(drawn.rogue() || drawn.believes_damage()),
      clocks_step_(std::ranges::any_of(drawn.clients, [](const DrawnClient& c) { return !c.clock.steps.empty(); })),
      began_(world.now()),
      seen_(drawn.clients.size()) {}

void InvariantChecker::report(Oracle oracle, std::string what) {
  if (!breach_) breach_ = Breach{oracle, world_.now(), std::move(what)};
}

double InvariantChecker::account() const {
  switch (drawn_.config.loop.control.limiter.law) {
    case Law::kAolPerAxis:
      return port_.least_of_axes();
    case Law::kAolBox:
      return port_.sum_of_axes();
    default:
      return port_.energy();
  }
}

void InvariantChecker::see(const StepRecord& step) {
  if (breach_) return;
  const Effort& told = port_.told();
  const Effort& held = port_.held();
  const bool numbers = told.force.allFinite() && told.torque.allFinite() && std::isfinite(told.grip) &&
                       held.force.allFinite() && held.torque.allFinite() && std::isfinite(held.grip);
  if (!numbers || !step.hand.velocity.allFinite() || !std::isfinite(step.energy)) {
    report(Oracle::kFinite, "force " + number(told.force.norm()) + " N, torque " + number(told.torque.norm()) +
                                " N·m, grip " + number(told.grip) + " N, energy " + number(step.energy) + " J");
  }
  see_bounds(step);
  see_energy(step);
  see_age(step);
  if (step.mode == Mode::kActive) felt_ = true;
  if (step.reasons.has(Reason::kEnergy)) limited_ = true;
  turned_ = turned_ || !held.torque.isZero(0);
  gripped_ = gripped_ || held.grip != 0;
}

void InvariantChecker::see_bounds(const StepRecord& step) {
  const HapticController::Config& control = drawn_.config.loop.control;
  const Effort& told = port_.told();
  const auto within = [&](double size, double bound, const char* unit) {
    if (size > bound * (1 + 1e-12) + 1e-12) {
      report(Oracle::kBound, number(size) + " " + unit + " exceed the bound of " + number(bound) + " " + unit);
    }
  };
  const double by_law = control.limiter.law == Law::kAolPerAxis ? told.force.cwiseAbs().maxCoeff() : told.force.norm();
  within(told.force.norm(), control.max_force, "N");
  within(by_law, step.permitted, "N");
  within(told.torque.norm(), control.rotation ? control.rotation->max_torque : 0, "N·m");
  within(std::abs(told.grip), control.grip ? control.grip->max_force : 0, "N of grip");
  if (const GripStep* const grip = step.grip(); grip != nullptr && control.grip) {
    within(std::abs(told.grip), grip->permitted, "N of grip");
  }
}

/// Must not fall below min(`last`, 0) − `may_take`, where `may_take` (J) is the most that a hold beyond the bound can
/// take. Without such a hold, it must not decrease while it is below zero.
void InvariantChecker::see_account(const char* whose, double& last, double now, double may_take) {
  const double before = std::exchange(last, now);
  const double may_leave = std::min(before, 0.0) - may_take;
  if (now < may_leave - kRounding) {
    report(Oracle::kLedger, whose + number(now) + " J, expected at least " + number(may_leave) + " J after the hold");
  }
  if (before >= 0 && may_take == 0) least_energy_ = std::min(least_energy_, now);
}

void InvariantChecker::see_energy(const StepRecord& step) {
  const Duration held = drawn_.port.watchdog > Duration::zero() ? std::min(step.held, drawn_.port.watchdog) : step.held;
  const double beyond = std::max(0.0, seconds(held - std::exchange(bound_, step.longest_hold)));
  // (T_act − T)(‖F‖ − f_c)₊²/(4b)
  const auto takes = [&](double effort, const Friction& friction) {
    const double excess = std::max(0.0, effort - friction.coulomb);
    return beyond * excess * excess / (4 * friction.viscous);
  };
  double may_take = takes(step.was_applied.norm(), drawn_.config.loop.control.limiter.friction);
  if (const TurnStep* const turn = step.turn(); turn != nullptr && drawn_.port.rotation) {
    may_take += takes(turn->was_applied.norm(), *drawn_.port.rotation);
  }
  see_account("", last_account_, account(), may_take);
  if (!drawn_.port.grip) return;
  const GripStep* const grip = step.grip();
  see_account("of the gripper, ", last_grip_, port_.grip_energy(),
              grip != nullptr ? takes(std::abs(grip->was_applied), *drawn_.port.grip) : 0);
}

void InvariantChecker::see_age(const StepRecord& step) {
  const LocalTime now = step.hand.at;
  if (step.mode == Mode::kActive && (!last_force_ || now - *last_force_ > valid_)) {
    report(Oracle::kFresh, last_force_ ? "the last force arrived " + ms(now - *last_force_) +
                                             " ago, but is only valid for " + ms(valid_)
                                       : "no force has arrived yet");
  }
  const bool over = !last_force_ || now - *last_force_ > valid_ + safe_stop_;
  const bool wants = !step.wanted.isZero(0) || (step.turn() != nullptr && !step.turn()->wanted.isZero(0)) ||
                     (step.grip() != nullptr && step.grip()->wanted != 0);
  if (over && wants) {
    report(Oracle::kStopped, number(step.wanted.norm()) + " N requested" +
                                 (last_force_ ? ", " + ms(now - *last_force_) + " after the last force" : ""));
  }
  if (step.reasons.has(Reason::kUnseen)) {
    if (port_.told() != Effort{}) report(Oracle::kStopped, words(port_.told()) + " without a position of the hand");
    return;
  }
  // Even in a pause, the slew limit removes at most the amount for the longest hold. (Other laws may release a spring.)
  if (!over && step.mode != Mode::kFault) {
    silent_for_.reset();
  } else if (!silent_for_) {
    silent_for_ = Duration::zero();
  } else {
    *silent_for_ += std::min(step.held, drawn_.config.loop.control.limiter.longest_hold);
  }
  if (aol_ && silent_for_ && *silent_for_ > slew_time_ && port_.told() != Effort{}) {
    report(Oracle::kStopped,
           words(port_.told()) + " rendered, " + ms(*silent_for_) + " after the end of all forces, without pauses");
  }
  if (may_replay_ticks_ || step.force_sequence == 0) return;
  const LocalTime answered = now - step.loop_age;
  if (answered < answered_) {
    report(Oracle::kNewest,
           "a force for a motion that is " + ms(answered_ - answered) + " older than the previous one");
  }
  answered_ = answered;
}

void InvariantChecker::see(const World::Turn& turn) {
  if (!turn.client) {
    const std::uint64_t arrived = world_.network().arrived_at_server();
    const bool more = std::exchange(server_wants_more_, turn.wants_more);
    if (std::exchange(arrived_, arrived) != arrived || more) see_server();
    if (!turn.wants_more && world_.network().unread_by_server() > 0) {
      report(Oracle::kDrained,
             "unread datagrams at the server: " + std::to_string(world_.network().unread_by_server()));
    }
  } else if (const auto link = static_cast<std::uint32_t>(*turn.client);
             world_.alive(link) && !turn.wants_more && world_.network().unread_by(link) > 0) {
    report(Oracle::kDrained,
           "client " + std::to_string(link) + " has left " + std::to_string(world_.network().unread_by(link)));
  }
}

void InvariantChecker::see_server() {
  const NetworkLoop::Stats server = world_.server().stats();
  if (std::exchange(forces_, server.forces) != server.forces) last_force_ = world_.now();
  if (!clocks_step_ && !drawn_.believes_damage()) see_clock(server);
}

void InvariantChecker::see_clock(const NetworkLoop::Stats& server) {
  if (!server.controller_clock) return;
  const std::string& holder = server.channels.front().holder;
  for (std::size_t i = 0; i < drawn_.clients.size(); ++i) {
    if (drawn_.clients[i].kind != DrawnClient::Kind::kController || drawn_.clients[i].config.name != holder) continue;
    const Duration truth = world_.clock(i).reading(world_.now()) - world_.now();
    const Duration error = std::chrono::abs(server.controller_clock->offset - truth);
    if (error > server.controller_clock->error_bound + kClockRounding) {
      report(Oracle::kClock, "the clock of " + holder + " is " + ms(truth) + " ahead, but the server has " +
                                 ms(server.controller_clock->offset) + " ± " +
                                 ms(server.controller_clock->error_bound));
    }
  }
}

void InvariantChecker::weather_clears(LocalTime last_arrival) {
  recovered_by_ = std::max(world_.now(), last_arrival) + recovery_promise(drawn_);
}

void InvariantChecker::see_recovered() {
  marks_.assign(drawn_.clients.size(), {});
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    if (!world_.alive(i)) continue;
    const ForceClient::Stats stats = world_.client(i).stats();
    marks_[i] = {.sessions = stats.sessions,
                 .states = stats.states,
                 .arrived = world_.network().arrived_at(static_cast<std::uint32_t>(i)),
                 .accounted = counted(stats)};
  }
  forces_then_ = forces_;
  checked_recovery_ = true;
}

void InvariantChecker::see_served() {
  std::size_t controllers = 0;
  std::size_t open_controllers = 0;
  std::string others;  // the reason why other clients are not served
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    if (!world_.alive(i)) continue;
    const DrawnClient& drawn = drawn_.clients[i];
    const ForceClient::Stats stats = world_.client(i).stats();
    const bool controller = drawn.kind == DrawnClient::Kind::kController;
    controllers += controller ? 1 : 0;
    if (stats.phase != ForceClient::Phase::kOpen) {
      if (!controller) {
        report(Oracle::kRecovery, "observer " + drawn.config.name + " has no session: " + stats.reason);
      } else {
        others += "; " + drawn.config.name + ": " + stats.reason;
      }
      continue;
    }
    open_controllers += controller ? 1 : 0;
    if (stats.sessions != marks_[i].sessions) {
      report(Oracle::kRecovery, drawn.config.name + " started a new session on a good network, after: " + stats.reason);
    } else if (stats.states <= marks_[i].states) {
      report(Oracle::kRecovery, drawn.config.name + " has a session, but receives no states");
    }
    const double least_rate = drawn.bad_days > 0 ? 100 : 10;
    const bool sends = drawn.config.rate_hz == 0 || drawn.config.rate_hz >= least_rate;
    if (controller && sends && forces_ <= forces_then_) {
      report(Oracle::kRecovery, drawn.config.name + " has a session, but its forces do not arrive");
    }
  }
  if (controllers > 0 && open_controllers != 1) {
    report(Oracle::kRecovery, std::to_string(controllers) + " controllers exist, " + std::to_string(open_controllers) +
                                  " of them have a session" + others);
  }
  if (open_controllers == 1 && world_.haptic().stats().fault != HapticController::Fault::kNone) {
    report(Oracle::kRecovery, "the fault persists, although a controller has requested to clear it");
  }
}

void InvariantChecker::see_round_trip(const char* whose, Duration round_trip) {
  const Duration expected = drawn_.one_way_up + drawn_.one_way_down;
  if (std::chrono::abs(round_trip - expected) > kRoundTripError) {
    report(Oracle::kRoundTrip, std::string(whose) + " measures " + ms(round_trip) + ", expected " + ms(expected));
  }
}

void InvariantChecker::see_counters() {
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    if (!world_.alive(i) || world_.client(i).phase() != ForceClient::Phase::kOpen) continue;
    const ForceClient::Stats stats = world_.client(i).stats();
    const auto link = static_cast<std::uint32_t>(i);
    const std::uint64_t accounted = counted(stats);
    if (world_.network().arrived_at(link) - marks_[i].arrived != accounted - marks_[i].accounted) {
      report(Oracle::kCounters, drawn_.clients[i].config.name + " received " +
                                    std::to_string(world_.network().arrived_at(link) - marks_[i].arrived) +
                                    " datagrams, but counted " + std::to_string(accounted - marks_[i].accounted));
    }
    see_round_trip("a client", stats.link.round_trip);
    if (drawn_.clients[i].kind != DrawnClient::Kind::kController) continue;
    const LinkStats& server = world_.server().stats().controller;
    const std::size_t flying = world_.network().on_their_way_up(link);
    if (stats.link.datagrams_sent != server.datagrams_received + server.lost + flying) {
      report(Oracle::kCounters, std::to_string(stats.link.datagrams_sent) + " sent by " +
                                    drawn_.clients[i].config.name + ", " + std::to_string(server.datagrams_received) +
                                    " received, " + std::to_string(server.lost) + " lost, " + std::to_string(flying) +
                                    " in flight");
    }
    see_round_trip("the server", server.round_trip);
  }
}

void InvariantChecker::see_end() {
  const Network::Counts& counts = world_.network().counts();
  const std::uint64_t in = counts.sent + counts.copies;
  const std::uint64_t out = counts.delivered + counts.lost + counts.nowhere + world_.network().in_flight();
  if (in != out) {
    report(Oracle::kCounters,
           "the network: " + std::to_string(in) + " entered, " + std::to_string(out) + " are accounted for");
  }
  if (simulated_ != nullptr && drawn_.exact()) {
    double work = simulated_->truth().hand_work;
    if (drawn_.port.rotation) work += simulated_->rotation()->truth().hand_work;
    const auto judge = [&](const char* whose, double done, double account) {
      if (done < account - kRounding) {
        report(Oracle::kTruth,
               std::string("work of the ") + whose + " " + number(done) + " J, account " + number(account) + " J");
      }
    };
    judge("hand", work, port_.energy());
    if (drawn_.port.grip) judge("fingers", simulated_->gripper()->truth().hand_work, port_.grip_energy());
  }
  // A bit flip that passes the UDP checksum can be a packet number far ahead, which makes all genuine ones late. If
  // there is no authentication, only safety is required in this case.
  const bool long_enough = recovered_by_ && world_.now() - *recovered_by_ >= kServed;
  if (!long_enough || drawn_.believes_damage()) return;
  see_served();
  see_counters();
  see_presses();
}

/// Each press uses a different button. Not if addresses change, because a state to the old address can have a press.
void InvariantChecker::see_presses() {
  const auto* const device = std::get_if<SimulatedDevice::Config>(&drawn_.device);
  const bool roams = drawn_.changes.back().weather.up.rebind > Duration::zero();
  if (device == nullptr || roams) return;
  for (const SimulatedDevice::Config::Press& press : device->presses) {
    const LocalTime from = began_ + press.from;
    if (from < *recovered_by_ || from + press.length + kServed > world_.now()) continue;
    for (std::size_t i = 0; i < drawn_.clients.size(); ++i) {
      if (!world_.alive(i) || drawn_.clients[i].kind != DrawnClient::Kind::kObserver) continue;
      if ((seen_[i] >> press.button & 1) == 0) {
        report(Oracle::kPress, "observer " + drawn_.clients[i].config.name + " did not receive a press of " +
                                   ms(press.length) + " at " + ms(press.from));
      } else {
        ++presses_;
      }
    }
  }
}

}  // namespace tendon::simulation

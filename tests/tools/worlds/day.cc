// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/day.h"

#include <malloc.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <deque>
#include <utility>

#include "tests/support/dice.h"
#include "tests/tools/worlds/drawn_world.h"
#include "tests/tools/worlds/receipts.h"

namespace tendon::simulation {

namespace {

using std::chrono::milliseconds;

constexpr std::int64_t kDriftPpb = 200'000;
/// A client is served if it receives half of the data sent during this time.
constexpr Duration kLook = milliseconds(400);
constexpr std::uint32_t kHzX = 20;
/// Each clock reading is truncated to whole nanoseconds.
constexpr Duration kClockRounding{4};
/// A session can end because of its age after this fraction of the maximum age, because a day is 17 s shorter for a
/// fast clock. kAgeSlack is the additional time by which one end can see the other end leave.
constexpr double kWholeLife = 1 - 1e-9 * kDriftPpb;
constexpr Duration kAgeSlack = std::chrono::seconds(1);

constexpr std::size_t kZ = 0;
constexpr std::size_t kY = 1;
constexpr std::size_t kX = 2;
constexpr std::size_t kZElsewhere = 3;  ///< Z's key at another address
constexpr std::size_t kHandles = 4;

constexpr const char* kLinkOfX =
    "delay=uniform(5ms,45ms) order=free loss=30% duplicate=5% replay(2%,64) rebind(every=600s)";

class StillDevice final : public Device {
 public:
  StillDevice() {
    info_.name = "still";
    info_.max_force = 1;
  }
  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override { return PositionSample{now}; }
  Vec3 apply(const Vec3& force) noexcept override { return force; }

 private:
  DeviceInfo info_;
};

class Day {
 public:
  explicit Day(const DayConfig& config)
      : config_(config), dice_(config.seed), keys_(draw_keys()), world_(world_config(), device_), began_(world_.now()) {
    const auto clock = [&] {
      return injector::DriftingClock({.offset = from_seconds(dice_.within(-1e5, 1e5)),
                                      .drift_ppb = dice_.chance(0.5) ? kDriftPpb : -kDriftPpb,
                                      .steps = {}},
                                     began_);
    };
    world_.add_controller(client_config(kZ), physics(), clock());
    world_.add_observer(client_config(kY), watch(), clock());
    world_.add_observer(client_config(kX), watch(), clock());
    world_.add_controller(client_config(kZElsewhere), physics(), clock());
    world_.kill(kZElsewhere);
    world_.watch_turns([this](const World::Turn& turn) { turn.client ? see_client(*turn.client) : see_server(); });
    world_.network().watch_arrivals([this](const Network::Arrival& arrival) {
      const bool up = arrival.direction == injector::Direction::kUp;
      (up ? up_ : down_)[arrival.link].see(world_.now(), arrival.datagram, arrival.whole);
    });
  }

  DayReport run() {
    see_fair_weather();
    while (!report_.broken && world_.now() - began_ < config_.length) {
      ++report_.troubles;
      cause_trouble();
      if (!report_.broken) see_fair_weather();
      look_at_the_heap();
    }
    const NetworkLoop::Stats server = world_.server().stats();
    for (const auto* receipts : {&up_, &down_}) {
      for (const Receipts& one : *receipts) report_.rekeys += one.new_keys();
    }
    report_.roamed = server.roamed;
    report_.steps = world_.haptic().stats().steps;
    report_.forces = server.forces;
    report_.network = world_.network().counts();
    report_.forged = server.dropped.forged;
    return report_;
  }

 private:
  struct Known {
    bool open = false;
    std::uint64_t sessions = 0;  ///< sessions begun
    std::uint64_t expired = 0;   ///< sessions ended by their age
    LocalTime expired_at{};      ///< last of these
    LocalTime began{};           ///< current session
    std::uint64_t asked = 0;     ///< requests in the current session
  };

  std::vector<ClientKey> draw_keys() {
    Ratchet secrets(dice_.bits());
    const auto key = [&](const char* name, Role role) {
      return ClientKey{.name = name, .role = role, .key = secrets.next()};
    };
    return {key("Z", Role::kController), key("Y", Role::kObserver), key("X", Role::kObserver)};
  }

  World::Config world_config() {
    World::Config world;
    world.seed = config_.seed;
    world.loop.period = from_seconds(1.0 / config_.loop_hz);
    world.loop.control.limiter.friction = {0.1, 0.1};
    world.loop.control.limiter.longest_hold = world.loop.period;
    world.loop.control.max_force = device_.info().max_force;
    world.loop.control.max_slew = 1000;
    world.weather = fair();
    world.players = [this](injector::Direction direction, std::uint32_t link) -> std::unique_ptr<injector::Decider> {
      if (link != kX) return nullptr;
      return std::make_unique<injector::Injector>(injector::parse_profile(kLinkOfX), config_.seed, link, direction);
    };
    world.mail = {.steps = 16, .flight = 1, .datagrams = 1};
    world.keys = keys_;
    world.rekey = config_.rekey;
    world.session_life = config_.session_life;
    return world;
  }

  ForceClient::Config client_config(std::size_t handle) {
    ForceClient::Config config;
    const ClientKey& key = keys_[handle == kZElsewhere ? kZ : handle];
    config.name = key.name;
    config.key = key.key;
    config.seed = dice_.bits();
    if (handle == kY) config.state_hz = config_.loop_hz / 10;
    if (handle == kX) config.state_hz = kHzX;
    return config;
  }
  static Physics physics() {
    return [](const DeviceState&) -> Touch { return Vec3(0.1 * Vec3::UnitX()); };
  }
  static Watch watch() {
    return [](const DeviceState&, const LinkStats&) {};
  }

  Network::Weather fair() {
    Network::Weather weather;
    weather.up.delay = injector::ConstantDelay{milliseconds(static_cast<int>(dice_.within(1, 30)))};
    weather.down.delay = injector::ConstantDelay{milliseconds(static_cast<int>(dice_.within(1, 30)))};
    if (dice_.chance(0.3)) weather.up.rebind = dice_.milliseconds(1000, 20'000);
    return weather;
  }

  Network::Weather bad() {
    Network::Weather weather{draw_bad_weather(dice_), draw_bad_weather(dice_)};
    if (dice_.chance(0.5)) weather.up.rebind = dice_.milliseconds(1000, 20'000);
    if (dice_.chance(0.3)) (dice_.chance(0.5) ? weather.up : weather.down).flip = dice_.decades(-4, -1);
    return weather;
  }

  void broken(const std::string& what) {
    if (report_.broken) return;
    std::array<char, 32> at{};
    std::snprintf(at.data(), at.size(), "%.3f s: ", seconds(world_.now() - began_));
    report_.broken = at.data() + what;
  }
  std::string name(std::size_t handle) const { return keys_[handle == kZElsewhere ? kZ : handle].name; }

  void see_client(std::size_t handle) {
    if (!world_.alive(handle)) return;
    see_phase(handle, world_.client(handle).phase() == ForceClient::Phase::kOpen);
    if (handle == kX) see_x_served();
  }

  void see_phase(std::size_t handle, bool open) {
    Known& known = known_[handle];
    if (std::exchange(known.open, open) == open) return;
    if (!open) {
      const Duration age = world_.now() - known.began;
      report_.longest_session = std::max(report_.longest_session, age);
      if (seconds(age + kAgeSlack) < kWholeLife * seconds(config_.session_life)) return;
      ++report_.expired;
      ++known.expired;
      known.expired_at = world_.now();
      return;
    }
    ++report_.sessions;
    ++known.sessions;
    known.began = world_.now();
    known.asked = 0;
    if (handle == kX) {  // requests open at the old session are void
      asked_by_x_.clear();
      denied_ = world_.server().stats().denied;
    }
  }

  void see_x_served() {
    const std::uint64_t states = world_.client(kX).stats().states;
    if (std::exchange(states_of_x_, states) != states) x_served_ = world_.now();
    const Known& x = known_[kX];
    if (world_.now() - x_served_ > DayConfig::kPromise) broken("X is no longer served");
    if (x.sessions > x.expired + 1) broken("a session of X ended before its maximum age");
  }

  void see_server() {
    for (const NetworkLoop::Notice& notice : world_.server().take_notices()) {
      if (notice.text.starts_with("welcomed controller")) rearmed_ = 0;
      if (!notice.text.starts_with("rearmed by")) continue;
      ++report_.carried_out;
      ++rearmed_;
    }
    if (std::exchange(look_at_clock_, false)) see_clock();
  }

  void see_clock() {
    const NetworkLoop::Stats server = world_.server().stats();
    if (!server.controller_clock || server.channels.front().holder.empty()) return;
    const Duration truth = world_.clock(z_).reading(world_.now()) - world_.now();
    const Duration error = std::chrono::abs(server.controller_clock->offset - truth);
    report_.clock_error = std::max(report_.clock_error, error);
    report_.clock_bound = std::max(report_.clock_bound, server.controller_clock->error_bound);
    if (error > server.controller_clock->error_bound + kClockRounding) {
      broken("the error of Z's clock is " + us(error) + ", and " + us(server.controller_clock->error_bound) +
             " is the limit");
    }
  }
  static std::string us(Duration duration) { return std::to_string(duration.count() / 1000) + " µs"; }

  void see_receipts() {
    const auto compare = [&](const std::string& who, std::uint64_t expected, const LinkStats& counted) {
      if (expected == counted.datagrams_received) return;
      broken(who + " accepted " + std::to_string(counted.datagrams_received) + " datagrams of " +
             std::to_string(expected) + " genuine datagrams");
    };
    compare("A", up_[z_].accepted(up_[z_].newest()), world_.server().stats().controller);
    for (const std::size_t handle : {z_, kY, kX}) {
      if (!known_[handle].open) continue;
      compare(name(handle), down_[handle].accepted(up_[handle].newest()), world_.client(handle).stats().link);
    }
  }

  void ask() {
    for (const std::size_t handle : {z_, kX}) {
      if (!world_.alive(handle) || !world_.client(handle).rearm()) continue;
      ++known_[handle].asked;
      ++report_.requests;
      if (handle == kX) asked_by_x_.push_back(world_.now());
    }
    see_requests_of_x();
  }

  std::string requests_of_z() const {
    return std::to_string(known_[z_].asked) + " requests of Z in this session, " + std::to_string(rearmed_) +
           " executed";
  }

  /// An observer is not allowed to rearm, so a denial counts as an execution.
  void see_requests_of_x() {
    const std::uint64_t denied = world_.server().stats().denied;
    for (; denied_ < denied; ++denied_, ++report_.carried_out) {
      if (asked_by_x_.empty()) return broken("a request of X was executed twice");
      asked_by_x_.pop_front();
    }
    if (!asked_by_x_.empty() && world_.now() - asked_by_x_.front() > DayConfig::kPatience) {
      broken("a request of X was not executed");
    }
  }

  void cause_trouble() {
    const double which = dice_.uniform();
    if (which < 0.55) return bad_weather();
    if (which < 0.75) return absence(z_);
    if (which < 0.85) return take_over();
    absence(kY);
  }

  void bad_weather() {
    world_.network().change(bad(), world_.now());
    const LocalTime clears = world_.now() + dice_.milliseconds(10'000, 60'000);
    std::optional<LocalTime> death;
    if (dice_.chance(0.2)) death = world_.now() + dice_.milliseconds(0, 10'000);
    while (world_.now() < clears) {
      ask();
      world_.run_for(std::min<Duration>(dice_.milliseconds(50, 5000), clears - world_.now()));
      if (!death || world_.now() < *death) continue;
      death.reset();
      die(z_);
      world_.run_for(dice_.milliseconds(0, 3000));
      come_back(z_);
    }
    world_.network().change(fair(), world_.now());
    recover(std::max(world_.now(), world_.network().latest_arrival()));
  }

  void die(std::size_t handle) {
    world_.kill(handle);
    see_phase(handle, false);
    ++report_.deaths;
  }

  void come_back(std::size_t handle) {
    if (handle == kY) {
      world_.restart_observer(handle, client_config(handle), watch());
    } else {
      world_.restart_controller(handle, client_config(handle), physics());
    }
  }

  /// Z may return from another address.
  void absence(std::size_t handle) {
    if (dice_.chance(0.5)) {
      world_.stop(handle);
      see_phase(handle, false);
      ++report_.byes;
    } else {
      die(handle);
    }
    world_.run_for(dice_.milliseconds(0, 5000));
    if (handle == z_ && dice_.chance(0.5)) handle = z_ = kZ + kZElsewhere - z_;
    come_back(handle);
    recover(world_.now());
  }

  /// A client with the key of Z joins from another address. The first one is notified and does not return. (Hence no
  /// address changes here: a lost notification would let it return after its timeout and take the session back.)
  void take_over() {
    Network::Weather calm = fair();
    calm.up.rebind = {};
    world_.network().change(calm, world_.now());
    world_.run_for(kLook);
    const std::size_t before = std::exchange(z_, kZ + kZElsewhere - z_);
    ++report_.takeovers;
    come_back(z_);
    recover(world_.now());
    const ForceClient::Stats stats = world_.client(before).stats();
    if (stats.phase != ForceClient::Phase::kStopped || stats.code != Code::kReplaced) {
      broken("a controller was replaced without a message: " + stats.reason);
    }
    world_.kill(before);
  }

  struct Marks {
    std::uint64_t z = 0;
    std::uint64_t y = 0;
    std::uint64_t forces = 0;
    std::array<std::uint64_t, kHandles> sessions{};
  };
  Marks marks() {
    Marks marks{world_.client(z_).stats().states, world_.client(kY).stats().states, world_.server().stats().forces, {}};
    for (std::size_t i = 0; i < kHandles; ++i) marks.sessions[i] = known_[i].sessions;
    return marks;
  }

  bool served_since(const Marks& before, Duration lasted) {
    const Marks now = marks();
    const auto half = static_cast<std::uint64_t>(seconds(lasted) * config_.loop_hz / 2);
    return known_[z_].open && known_[kY].open && now.sessions[z_] == before.sessions[z_] &&
           now.sessions[kY] == before.sessions[kY] && now.z - before.z >= half && now.y - before.y >= half / 10 &&
           now.forces - before.forces >= half;
  }

  void recover(LocalTime from) {
    for (;;) {
      const Marks before = marks();
      world_.run_for(kLook);
      if (rearmed_ == known_[z_].asked && served_since(before, kLook)) break;
      from = std::max({from, known_[z_].expired_at, known_[kY].expired_at});
      if (world_.now() <= from + DayConfig::kPromise + kLook) continue;
      const auto tell = [&](std::size_t handle) {
        const ForceClient::Stats stats = world_.client(handle).stats();
        return name(handle) + " is in phase " + std::to_string(static_cast<int>(stats.phase)) +
               " after: " + stats.reason;
      };
      return broken("not served again: " + tell(z_) + "; " + tell(kY) + "; " + requests_of_z());
    }
    report_.slowest_recovery = std::max<Duration>(report_.slowest_recovery, world_.now() - kLook - from);
  }

  void see_fair_weather() {
    if (report_.troubles == 0) recover(world_.now());
    const LocalTime end = world_.now() + dice_.milliseconds(10'000, 40'000);
    while (world_.now() < end && !report_.broken) {
      const Marks before = marks();
      ask();
      look_at_clock_ = true;
      world_.run_for(std::chrono::seconds(1));
      if (std::max(known_[z_].expired_at, known_[kY].expired_at) >= world_.now() - std::chrono::seconds(1)) {
        recover(world_.now());
      } else if (!served_since(before, std::chrono::seconds(1))) {
        broken("no longer served on a good network: " + world_.client(z_).stats().reason + "; " +
               world_.client(kY).stats().reason);
      } else if (rearmed_ != known_[z_].asked) {
        broken("on a good network: " + requests_of_z());
      }
      see_receipts();
    }
  }

  void look_at_the_heap() {
    const bool second_half = world_.now() - began_ > config_.length / 2;
    std::size_t& most = second_half ? report_.heap_second_half : report_.heap_first_half;
    most = std::max(most, mallinfo2().uordblks);
    if (second_half && report_.heap_second_half > report_.heap_first_half + DayConfig::kGrowth) {
      broken("the heap grows: " + std::to_string(report_.heap_first_half) + " bytes at most in the first half, now " +
             std::to_string(report_.heap_second_half));
    }
  }

  DayConfig config_;
  Dice dice_;
  std::vector<ClientKey> keys_;
  StillDevice device_;
  World world_;
  LocalTime began_;
  std::vector<Receipts> up_ = std::vector(kHandles, Receipts(config_.rekey.overlap));
  std::vector<Receipts> down_ = std::vector(kHandles, Receipts(Rekey{}.overlap));
  std::array<Known, kHandles> known_{};
  std::size_t z_ = kZ;                ///< handle of the current Z
  std::uint64_t rearmed_ = 0;         ///< by Z in its current session, as counted by A
  std::uint64_t denied_ = 0;          ///< number of denials that have been counted for X
  std::deque<LocalTime> asked_by_x_;  ///< open requests of X, oldest first
  std::uint64_t states_of_x_ = 0;
  LocalTime x_served_ = began_;
  bool look_at_clock_ = false;
  DayReport report_;
};

}  // namespace

DayReport run_day(const DayConfig& config) { return Day(config).run(); }

}  // namespace tendon::simulation

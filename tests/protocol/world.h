// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <vector>

#include "protocol/session.h"

namespace tendon {

struct Weather {
  Duration delay = std::chrono::milliseconds(20);
  Duration jitter = std::chrono::milliseconds(10);  ///< uniform in [0, jitter), so datagrams overtake each other
  double loss = 0.05;
  double duplicate = 0.05;
};
inline Weather perfect(Duration delay) { return {.delay = delay, .jitter = {}, .loss = 0, .duplicate = 0}; }

class BadNetwork {
 public:
  BadNetwork(const Weather& weather, std::uint64_t seed) : weather_(weather), random_(seed) {}

  void send(LocalTime now, std::span<const std::byte> datagram) {
    const int copies = uniform() < weather_.loss ? 0 : uniform() < weather_.duplicate ? 2 : 1;
    for (int i = 0; i < copies; ++i) {
      const auto extra = static_cast<Duration::rep>(uniform() * static_cast<double>(weather_.jitter.count()));
      in_flight_.emplace(now + weather_.delay + Duration{extra},
                         std::vector<std::byte>(datagram.begin(), datagram.end()));
    }
  }
  LocalTime next_arrival() const { return in_flight_.empty() ? LocalTime::max() : in_flight_.begin()->first; }
  std::optional<std::vector<std::byte>> receive(LocalTime now) {
    if (next_arrival() > now) return {};
    auto first = in_flight_.extract(in_flight_.begin());
    return std::move(first.mapped());
  }

  Weather& weather() { return weather_; }

 private:
  double uniform() { return static_cast<double>(random_() >> 11U) * 0x1p-53; }

  Weather weather_;
  std::mt19937_64 random_;
  std::multimap<LocalTime, std::vector<std::byte>> in_flight_;
};

/// A is the client and Z is the server, which uses a different clock. Virtual time jumps to the next event that is due.
class World {
 public:
  /// The difference between the clocks of Z and A. The results must not depend on it.
  static constexpr Duration kClockOffset = std::chrono::hours(1234) + Duration{56789};

  explicit World(const Weather& weather, std::uint64_t seed = 1, const Session::Config& config = {})
      : World(weather, weather, seed, config) {}
  World(const Weather& there, const Weather& back, std::uint64_t seed, const Session::Config& config)
      : a(config, at_a()), z(config, at_z()), a_to_z(there, 2 * seed), z_to_a(back, 2 * seed + 1) {}
  World(const Weather& there, const Weather& back, std::uint64_t seed, const Session::Config& config,
        const SessionKeys& keys)
      : a(config, keys, at_a()),
        z(config, {.send = keys.receive, .receive = keys.send}, at_z()),
        a_to_z(there, 2 * seed),
        z_to_a(back, 2 * seed + 1) {}

  /// Calls `each_turn` before sending.
  void run(
      Duration length, const std::function<void()>& each_turn = [] {}) {
    const LocalTime end = now + length;
    for (turn(each_turn); next() <= end; turn(each_turn)) now = std::max(now, next());
    now = end;
  }

  LocalTime at_a() const { return now; }
  LocalTime at_z() const { return now + kClockOffset; }

  LocalTime now{std::chrono::seconds(100)};
  std::function<void(const Session::Event&)> on_a = [](const Session::Event&) {};
  std::function<void(const Session::Event&)> on_z = [](const Session::Event&) {};
  /// The next event of the owners, in addition to those of the sessions. If there is none, this is LocalTime::max().
  LocalTime wake = LocalTime::max();
  Session a;
  Session z;
  BadNetwork a_to_z;
  BadNetwork z_to_a;

 private:
  LocalTime next() const {
    const LocalTime z_tick = z.next_tick() == LocalTime::max() ? LocalTime::max() : z.next_tick() - kClockOffset;
    return std::min({wake, a.next_tick(), z_tick, a_to_z.next_arrival(), z_to_a.next_arrival()});
  }

  void turn(const std::function<void()>& each_turn) {
    while (const auto datagram = z_to_a.receive(now)) a.receive(at_a(), *datagram);
    while (const auto datagram = a_to_z.receive(now)) z.receive(at_z(), *datagram);
    a.tick(at_a());
    z.tick(at_z());
    while (const auto* event = a.next_event()) on_a(*event);
    while (const auto* event = z.next_event()) on_z(*event);
    each_turn();
    pull(a, at_a(), a_to_z);
    pull(z, at_z(), z_to_a);
  }

  void pull(Session& from, LocalTime its_now, BadNetwork& into) const {
    std::array<std::byte, kMaxDatagram> buffer;
    while (const std::size_t size = from.next_datagram(its_now, buffer)) into.send(now, std::span(buffer).first(size));
  }
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "clients/cpp/force_client.h"
#include "devices/simulated/simulated_device.h"
#include "tests/support/dice.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/traces/peer_clock.h"
#include "tests/tools/worlds/adversary.h"
#include "tests/tools/worlds/network.h"
#include "tests/tools/worlds/rogue.h"
#include "tests/tools/worlds/watched_device.h"
#include "tests/tools/worlds/world.h"

namespace tendon::simulation {

enum class Engine : std::uint8_t {
  kSpring,
  kWall,
  kMillion,      ///< 10⁶ N
  kSteps,        ///< force steps
  kNegative,     ///< spring and damper of the wrong sign
  kPushesAlong,  ///< along the force already applied to the hand
};

struct DrawnClient {
  enum class Kind : std::uint8_t { kController, kObserver, kRogue };
  Kind kind = Kind::kController;
  ForceClient::Config config;
  Engine engine = Engine::kSpring;
  double stiffness = 0;  ///< N/m
  double bad_days = 0;   ///< probability of an answer of NaN or infinity
  std::uint64_t seed = 0;
  Rogue::Config rogue;  ///< for a rogue; `quits` counts from the beginning
  injector::DriftingClock::Config clock;
  Duration joins{};
  std::optional<Duration> killed;     ///< without a Bye
  std::optional<Duration> restarted;  ///< restarted at the same address
};

/// Everything a seed determines except the fate of single datagrams, which the network draws from the same seed. The
/// network is first bad, then good until the end.
struct DrawnWorld {
  static constexpr Duration kLength = std::chrono::seconds(10);

  std::uint64_t seed = 0;
  World::Config config;  ///< with the initial network conditions
  struct Change {
    Duration at{};
    Network::Weather weather;
  };
  std::vector<Change> changes;  ///< changes of the network conditions. They are good after the last change.
  Duration clears{};            ///< time of the last change
  Duration one_way_up{};        ///< after that
  Duration one_way_down{};

  std::variant<SimulatedDevice::Config, AdversaryDevice::Config> device;
  WatchedDevice::Config port;
  std::vector<DrawnClient> clients;  ///< in order of joining, which is the order of their handles
  double garbage_hz = 0;             ///< rate of random datagrams until the network clears

  bool damages = false;  ///< the network flips bits
  bool sealed() const { return !config.keys.empty(); }
  /// In suite 0 a bit flip that passes the UDP checksum is accepted.
  bool believes_damage() const { return damages && !sealed(); }
  bool pauses() const { return config.pause_probability > 0; }
  bool rogue() const;
  bool exact() const;  ///< true if the port's account must match the simulated device's exactly
};

/// Smaller seeds draw the same world as before suite 2 existed.
inline constexpr std::uint64_t kFirstSeedOfSuite2 = 1'000'000'000;

/// With sabotage the device is an AdversaryDevice. If the seed is at least kFirstSeedOfSuite2, the world can require a
/// processor with AES.
DrawnWorld draw_world(std::uint64_t seed, const Sabotage& sabotage = {});

/// Draws one direction of a bad network: any injector model except address changes and bit flips.
injector::Profile draw_bad_weather(Dice& dice);

std::string describe(const DrawnWorld& world);

Physics make_physics(const DrawnClient& client);

}  // namespace tendon::simulation

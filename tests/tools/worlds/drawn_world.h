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

/// What a remote physics engine answers.
enum class Engine : std::uint8_t {
  kSpring,
  kWall,         ///< with a local model
  kMillion,      ///< newton
  kSteps,        ///< in force
  kNegative,     ///< spring and damper that push
  kPushesAlong,  ///< in the direction in which the hand is already pushed
};

struct DrawnClient {
  enum class Kind : std::uint8_t { kController, kObserver, kRogue };
  Kind kind = Kind::kController;
  ForceClient::Config config;
  Engine engine = Engine::kSpring;
  double stiffness = 0;  ///< N/m, of the engine
  double bad_days = 0;   ///< probability that it answers NaN or infinity
  std::uint64_t seed = 0;
  Rogue::Config rogue;  ///< of a rogue; `quits` counts from the beginning
  injector::DriftingClock::Config clock;
  Duration joins{};
  std::optional<Duration> killed;     ///< without a word
  std::optional<Duration> restarted;  ///< … and started again at the same address
};

/// A world as its seed draws it: everything that happens in it but for what the network does to single datagrams, which
/// the network draws from the same seed. Bad weather first, then it clears and stays fair.
struct DrawnWorld {
  static constexpr Duration kLength = std::chrono::seconds(10);

  std::uint64_t seed = 0;
  World::Config config;  ///< with the weather of the beginning
  struct Change {
    Duration at{};
    Network::Weather weather;
  };
  std::vector<Change> changes;  ///< of the weather; the last is the fair one
  Duration clears{};            ///< when that comes
  Duration one_way_up{};        ///< then
  Duration one_way_down{};

  std::variant<SimulatedDevice::Config, AdversaryDevice::Config> device;
  WatchedDevice::Config port;
  std::vector<DrawnClient> clients;  ///< in the order in which they join: their handles in the world
  double garbage_hz = 0;             ///< datagrams of random bytes, until it clears

  bool damages = false;  ///< bits are flipped
  bool sealed() const { return !config.keys.empty(); }
  /// In suite 0 a flipped bit that gets past the checksum of UDP is believed.
  bool believes_damage() const { return damages && !sealed(); }
  bool pauses() const { return config.pause_probability > 0; }
  bool rogue() const;
  bool exact() const;  ///< a simulated device whose truth the account of the port must match
};

/// A seed below this one draws the world that it drew before there was suite 2.
inline constexpr std::uint64_t kFirstSeedOfSuite2 = 1'000'000'000;

/// With sabotage the device is an adversary's. From kFirstSeedOfSuite2 on, some worlds take a processor with AES.
DrawnWorld draw_world(std::uint64_t seed, const Sabotage& sabotage = {});

/// One direction of a bad network: any model of the injector but changes of address and flipped bits.
injector::Profile draw_bad_weather(Dice& dice);

/// All of it, for people.
std::string describe(const DrawnWorld& world);

/// The physics of a drawn client.
Physics make_physics(const DrawnClient& client);

}  // namespace tendon::simulation

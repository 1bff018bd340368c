// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "protocol/handshake.h"
#include "server/clients/served_client.h"

namespace tendon {

struct Refusal {
  Code code;
  std::string reason;
};

/// Determines whether a client is admitted, and which slots it gets (SESSION.md, "Opening"). Does not change state.
/// Thread-safe: no. Realtime-safe: no.
class Admission {
 public:
  struct Config {
    std::size_t keys = 0;                                          ///< number of keys; if 0, all clients are admitted
    bool (*needs_no_key)(const Address& from) noexcept = nullptr;  ///< see NetworkLoop::Config
    std::size_t max_observers = 8;  ///< with several keys, one of them can use at most half, rounded up
  };

  explicit Admission(const Config& config) : config_(config) {}

  /// Returns the slots that a Hello claims. Refuses unknown devices or channels, duplicates, devices in different
  /// banks, and a role that is not the highest role of the claims.
  static std::variant<std::vector<Slot>, Refusal> slots_of(const Hello& hello,
                                                           const std::vector<ServedDevice::Config>& devices);

  /// Returns nothing if a client with this address and key can have these slots. `key` is null if there is none.
  std::optional<Refusal> reason_to_refuse(const Address& from, const ClientKey* key, const std::vector<Slot>& slots,
                                          const std::vector<ServedDevice>& devices,
                                          const std::vector<ServedClient>& clients) const;

  /// Returns true if the new client is considered a restart of `present`: the address and the key are the same, or the
  /// key is the same and `present` is a controller of the same channel.
  static bool replaces(const ServedClient& present, const Address& from, const ClientKey* key,
                       const std::vector<Slot>& slots);

  static Welcome welcome_for(const ServerHandshake::Client& client, const Address& from, const std::vector<Slot>& slots,
                             const std::vector<ServedDevice>& devices, const std::vector<ServedClient>& clients);

  static std::vector<Subscription> subscriptions_of(const std::vector<Slot>& slots);

 private:
  Config config_;
};

}  // namespace tendon

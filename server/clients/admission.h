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

/// Determines whether a client is admitted, and which slots it gets (SESSION.md, "Opening"). It does not change state.
///
/// Thread-safe: no. Realtime-safe: no.
class Admission {
 public:
  struct Config {
    std::size_t keys = 0;                                          ///< number of keys; if 0, all clients are admitted
    bool (*needs_no_key)(const Address& from) noexcept = nullptr;  ///< see NetworkLoop::Config
    /// If there are several keys, a single key can use at most half of these places, rounded up.
    std::size_t max_observers = 8;
  };

  explicit Admission(const Config& config) : config_(config) {}

  /// Returns the slots that are claimed by a Hello. This is refused if a device or channel does not exist, if there are
  /// duplicates, if the devices are in different banks, or if the role is not the highest role of the claims.
  static std::variant<std::vector<Slot>, Refusal> slots_of(const Hello& hello,
                                                           const std::vector<ServedDevice::Config>& devices);

  /// Returns nothing if a client with this address and key can have these slots. `key` is null if there is none.
  std::optional<Refusal> reason_to_refuse(const Address& from, const ClientKey* key, const std::vector<Slot>& slots,
                                          const std::vector<ServedDevice>& devices,
                                          const std::vector<ServedClient>& clients) const;

  /// Returns true if the new client is considered to be a restart of `present`. This is the case if the address and the
  /// key are the same, or if the key is the same and `present` is a controller of the same channel.
  static bool replaces(const ServedClient& present, const Address& from, const ClientKey* key,
                       const std::vector<Slot>& slots);

  static Welcome welcome_for(const ServerHandshake::Client& client, const Address& from, const std::vector<Slot>& slots,
                             const std::vector<ServedDevice>& devices, const std::vector<ServedClient>& clients);

  static std::vector<Subscription> subscriptions_of(const std::vector<Slot>& slots);

 private:
  Config config_;
};

}  // namespace tendon

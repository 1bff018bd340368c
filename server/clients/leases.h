// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/time.h"
#include "server/clients/served_client.h"

namespace tendon {

/// Manages the holders of channels. One client at a time holds a channel, and another one can take it if the lease has
/// expired (SESSION.md, "Channels and leases"). The caller must notify a client that loses a channel.
/// Thread-safe: no. Realtime-safe: no.
class Leases {
 public:
  explicit Leases(std::vector<ServedDevice>& devices) : devices_(devices) {}

  std::uint32_t holder(std::uint32_t device, std::uint32_t channel) const {
    return devices_[device].channels[channel].holder;
  }

  void hold(LocalTime now, std::uint32_t device, std::uint32_t channel, const ServedClient& client);

  void renew(LocalTime now, std::uint32_t device, std::uint32_t channel) {
    devices_[device].channels[channel].renewed = now;
  }

  /// Releases the channel if the client holds it, and turns off the outputs that were set by the client.
  void give(std::uint32_t device, std::uint32_t channel, std::uint32_t client);
  void give_all(std::uint32_t client);

  struct Taken {
    bool granted = false;
    std::uint32_t loser = 0;   ///< the previous holder, or 0
    std::uint32_t holder = 0;  ///< the current holder if not granted
    Duration wait{};           ///< time until the lease can expire; 0 if unknown
  };
  /// Grants the channel if it is free, already held by the client, or if the lease has expired. With `may_take_over`,
  /// the lease does not need to have expired, but the channel must have one.
  Taken take(LocalTime now, std::uint32_t device, std::uint32_t channel, const ServedClient& client,
             bool may_take_over);

 private:
  std::vector<ServedDevice>& devices_;
};

}  // namespace tendon

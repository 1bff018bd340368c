// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/time.h"
#include "server/guests/guest.h"

namespace tendon {

/// Manages the holders of channels. A channel can only be held by one client at a time. It can be taken by another
/// client if the lease has expired (SESSION.md, "Channels and leases"). Holders are identified by their connection ids.
/// The caller must notify a client that loses a channel.
///
/// Thread-safe: no. Realtime-safe: no.
class Leases {
 public:
  /// `devices` must outlive this object.
  explicit Leases(std::vector<ServedDevice>& devices) : devices_(devices) {}

  /// Returns the connection id of the holder, or 0 if the channel is free.
  std::uint32_t holder(std::uint32_t device, std::uint32_t channel) const {
    return devices_[device].channels[channel].holder;
  }

  /// Gives a free channel to the guest.
  void hold(LocalTime now, std::uint32_t device, std::uint32_t channel, const Guest& guest);

  /// Renews the lease. This is called for each valid force of the holder.
  void renew(LocalTime now, std::uint32_t device, std::uint32_t channel) {
    devices_[device].channels[channel].renewed = now;
  }

  /// Releases the channel if it is held by the guest. The force is no longer fresh, and the outputs that were set by
  /// the guest are turned off.
  void give(std::uint32_t device, std::uint32_t channel, std::uint32_t guest);
  /// Releases all channels of the guest.
  void give_all(std::uint32_t guest);

  struct Taken {
    bool granted = false;
    std::uint32_t loser = 0;   ///< the previous holder, or 0
    std::uint32_t holder = 0;  ///< the current holder if the channel was not granted
    Duration wait{};           ///< time until the lease can expire; 0 if unknown
  };
  /// Requests a channel for the guest. It is granted if the channel is free or is already held by the guest. If it is
  /// held by another guest, it is granted if the lease has expired. With `may_take_over`, the lease does not need to
  /// have expired, but the channel must have one.
  Taken take(LocalTime now, std::uint32_t device, std::uint32_t channel, const Guest& guest, bool may_take_over);

 private:
  std::vector<ServedDevice>& devices_;
};

}  // namespace tendon

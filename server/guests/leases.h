// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/time.h"
#include "server/guests/guest.h"

namespace tendon {

/// Who holds which channel: one guest at a time, for as long as the channel's lease says (SESSION.md, "Channels and
/// leases"). It knows holders by their connection ids; who loses a channel is told so by others.
///
/// Thread-safe: no. Realtime-safe: no.
class Leases {
 public:
  /// `devices` must outlive this.
  explicit Leases(std::vector<ServedDevice>& devices) : devices_(devices) {}

  /// Connection id; 0 = nobody.
  std::uint32_t holder(std::uint32_t device, std::uint32_t channel) const {
    return devices_[device].channels[channel].holder;
  }

  /// The channel is the guest's from now on. It was free.
  void hold(LocalTime now, std::uint32_t device, std::uint32_t channel, const Guest& guest);

  /// The holder has sent a force that the hand can feel.
  void renew(LocalTime now, std::uint32_t device, std::uint32_t channel) {
    devices_[device].channels[channel].renewed = now;
  }

  /// The channel is nobody's when it was the guest's, its force is fresh no longer, and the outputs of the device that
  /// it has set are off.
  void give(std::uint32_t device, std::uint32_t channel, std::uint32_t guest);
  /// … all channels of the guest.
  void give_all(std::uint32_t guest);

  struct Taken {
    bool granted = false;
    std::uint32_t loser = 0;   ///< granted: who held it before; 0 = nobody else
    std::uint32_t holder = 0;  ///< not granted: who holds it
    Duration wait{};           ///< not granted: when the lease may be over; 0 = nobody knows
  };
  /// The guest wants the channel. It gets one that is free or its own already, and another one's when the lease is over
  /// or, where there is a lease, `may_take_over`.
  Taken take(LocalTime now, std::uint32_t device, std::uint32_t channel, const Guest& guest, bool may_take_over);

 private:
  std::vector<ServedDevice>& devices_;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/guests/guest.h"

namespace tendon {

/// Keeps who holds which channel (SESSION.md, "Channels and leases"). A guest that loses a channel is returned: to tell
/// it, and to end its session, is NetworkLoop's.
///
/// Thread-safe: no. Realtime-safe: no.
class Leases {
 public:
  /// `takeover`: names of clients that need not wait for the end of a lease: of their keys, without keys their own.
  /// `devices` must outlive it.
  Leases(std::vector<ServedDevice>& devices, std::vector<std::string> takeover);

  /// `guest` holds the channel, which is free, from now on.
  void hold(LocalTime now, const Guest& guest, std::uint32_t device, std::uint32_t channel);

  /// Nobody holds the channel any more; the haptic thread lets its last force go (HapticOrder::kRelease).
  void free(std::uint32_t device, std::uint32_t channel);

  /// Frees each channel that `guest` holds.
  void free_all(const Guest& guest);

  struct Answer {
    Code code = Code::kOk;
    std::string reason;
    Duration wait{};          ///< kBusy: until the lease is over; zero: not known
    std::uint32_t loser = 0;  ///< connection id of the guest that has lost the channel by this; 0: nobody has
  };
  /// `guest` wants the channel, whose holder is `holder` (null: nobody). It gets it when the channel is free, the
  /// holder's lease is over, or `guest` may take over; else the answer is kBusy and nothing changes.
  Answer take(LocalTime now, const Guest& guest, const Guest* holder, const TakeLease& wanted);

 private:
  bool may_take_over(const Guest& guest) const;

  std::vector<ServedDevice>& devices_;
  std::vector<std::string> takeover_;
};

}  // namespace tendon

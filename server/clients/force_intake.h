// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/time.h"
#include "protocol/messages.h"
#include "server/clients/lateness.h"
#include "server/clients/leases.h"
#include "server/clients/served_client.h"
#include "server/network_stats.h"

namespace tendon {

/// Passes the forces of engines to the haptic threads. Thread-safe: no. Realtime-safe: no.
class ForceIntake {
 public:
  /// The references must outlive the object.
  ForceIntake(std::vector<ServedDevice>& devices, Leases& leases, NetworkStats& stats)
      : devices_(devices), leases_(leases), stats_(stats) {}

  void take(LocalTime now, ServedClient& client, const ForceCommand& command);
  /// Counts the forces that the session has refused for all channels of the client, because their channel is not known.
  void take_refused(ServedClient& client);

 private:
  std::uint8_t note(const ForceCommand& command, const ServedClient& client, ServedDevice& device);
  void blame(const ServedClient& client, Lateness::Cause cause, std::uint64_t count);

  std::vector<ServedDevice>& devices_;
  Leases& leases_;
  NetworkStats& stats_;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "protocol/messages.h"
#include "server/clients/leases.h"
#include "server/clients/served_client.h"

namespace tendon {

class FieldIntake;

struct Asker {
  ServedClient& client;
  bool may_take_over = false;  ///< it does not need to wait until the lease expires
  std::vector<ServedDevice>& devices;
  const std::vector<ServedClient>& clients;
  Leases& leases;
  FieldIntake* fields = nullptr;  ///< null if no device has fields
};

struct Outcome {
  Code code = Code::kOk;
  std::string detail{};
  Duration wait{};  ///< for kBusy and TakeLease; 0 if unknown
  std::optional<DeviceDescription> device{};
  std::optional<HandleDescription> handle{};
  std::string warning{};
  std::uint32_t loser = 0;  ///< connection id of the previous holder, which must be notified
};

/// Processes a request and returns the reply (kRequests in requests.cc). Thread-safe: no. Realtime-safe: no.
Outcome answer(LocalTime now, const Asker& asker, const Request& request);

}  // namespace tendon

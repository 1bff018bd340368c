// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "protocol/messages.h"
#include "server/guests/guest.h"
#include "server/guests/leases.h"

namespace tendon {

/// Who asks, and what may be changed for it.
struct Asker {
  Guest& guest;
  bool may_take_over = false;  ///< it need not wait for the end of a lease
  std::vector<ServedDevice>& devices;
  const std::vector<Guest>& guests;
  Leases& leases;
};

/// What becomes of a request.
struct Outcome {
  Code code = Code::kOk;
  std::string detail{};
  Duration wait{};                            ///< with kBusy of a TakeLease; 0 = nobody knows
  std::optional<DeviceDescription> device{};  ///< with kOk of a Describe
  std::optional<HandleDescription> handle{};  ///< … that asks for the handle
  std::string warning{};                      ///< for the operator; empty: nothing to say
  std::uint32_t loser = 0;                    ///< of a lease: its connection id; it has not been told yet
};

/// Carries out what a guest asks for, and says what it is to be told. The table kRequests (requests.cc) has one row for
/// each request: its name, who may ask for it, and its handler.
///
/// Thread-safe: no. Realtime-safe: no.
Outcome answer(LocalTime now, const Asker& asker, const Request& request);

}  // namespace tendon

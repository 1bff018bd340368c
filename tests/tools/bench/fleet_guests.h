// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/handshake.h"
#include "protocol/session.h"
#include "tests/tools/bench/fleet.h"
#include "tests/tools/injector/proxy/duration_histogram.h"

namespace tendon::bench {

// The guests of a fleet: who comes, and the process in which they answer.

inline constexpr Duration kPeriod = std::chrono::milliseconds(1);

std::string device_name(std::size_t i);
std::string channel_name(std::size_t i);

/// Who comes, and what for.
struct Plan {
  std::size_t server = 0;
  std::vector<Claim> claims;
  bool controls = true;
  std::optional<Key> key{};
};

std::vector<Plan> plans_of(const Fleet& fleet, Ratchet& secrets);

/// What both processes see.
struct Shared {
  enum Phase : int { kOpening, kMeasuring, kReporting, kQuit };
  std::atomic<int> phase{kOpening};
  std::atomic<int> at_work{kOpening};  ///< what the guests do
  std::atomic<std::size_t> open{0};    ///< sessions
  // Written by the guests before they are at kReporting.
  injector::DurationHistogram state_age;
  std::atomic<std::uint64_t> states{0};
  std::uint64_t lost = 0;
};

/// Opens a session for each plan at the server that it names, and answers states until `shared` says kQuit.
void serve_guests(const std::vector<Plan>& plans, const std::vector<Address>& servers, const Fleet& fleet,
                  Shared& shared);

}  // namespace tendon::bench

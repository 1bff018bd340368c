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

inline constexpr Duration kPeriod = std::chrono::milliseconds(1);

inline constexpr const char* kFleetName = "d";
std::string device_name(const Fleet& fleet, std::size_t i);
std::string channel_name(std::size_t i);

struct Plan {
  std::vector<Claim> claims;
  bool controls = true;
  std::optional<Key> key{};
};

std::vector<Plan> plans_of(const Fleet& fleet, Ratchet& secrets);

struct Shared {
  enum Phase : int { kOpening, kMeasuring, kReporting, kQuit };
  std::atomic<int> phase{kOpening};
  std::atomic<int> at_work{kOpening};  ///< phase that the clients have reached
  std::atomic<std::size_t> open{0};
  // Valid after the clients have set kReporting.
  injector::DurationHistogram state_age;
  injector::DurationHistogram loop_age;
  LocalTime from{};  ///< measured interval, by the clients' clock
  LocalTime until{};
  std::atomic<std::uint64_t> states{0};
  std::uint64_t answered_in_time = 0;
  std::uint64_t lost = 0;
  std::uint64_t out_datagrams = 0;
  std::uint64_t out_bytes = 0;
  std::uint64_t in_datagrams = 0;
  std::uint64_t in_bytes = 0;
  std::uint64_t forces_sent = 0;  ///< since the first force, including after the measurement
};

void serve_guests(const std::vector<Plan>& plans, const Address& server, const Fleet& fleet, Shared& shared);

}  // namespace tendon::bench

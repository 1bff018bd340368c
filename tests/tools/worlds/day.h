// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "protocol/session.h"
#include "tests/tools/worlds/world.h"

namespace tendon::simulation {

/// A day of server A (suite 1) and three clients, whose clocks run up to 200 ppm fast or slow:
///
///     Z  controller: receives a state per haptic step and answers each with a force. Leaves with a Bye or is killed.
///        Returns from the same address or from another one, sometimes while its previous session is still alive.
///     Y  observer at a tenth of the haptic rate. Leaves and returns in the same ways.
///     X  observer at 20 states/s. Its link loses 30 %, reorders, duplicates and replays, and its address changes
///        every ten minutes. The session ends at its maximum age.
///
/// For Z and Y, good conditions (10 to 40 s, address changes possible) alternate with faults: 10 to 60 s of any
/// injector model with bit flips and address changes, during which Z may be killed and restarted; or a client that
/// leaves.
///
///     served       Within kPromise after a fault, or after a session reached its maximum age, every client is in a
///                  session with states and forces. Under good conditions it remains the same session; X's always does.
///     requests     Each is executed once: within 1 s under good conditions, within kPromise after bad ones, within
///                  kPatience over X's link. If the session ends first, at most once.
///     receipts     Each end accepts each genuine datagram exactly once (SESSION.md, Receipts).
///     clock        A's estimate of Z's clock offset is within its published bound.
///     memory       The heap of the second half of the day exceeds that of the first by at most kGrowth. It includes
///                  the simulated network's buffers, sized for the largest burst so far.
struct DayConfig {
  std::uint64_t seed = 1;
  Duration length = std::chrono::hours(25);  ///< exceeds the maximum age of a session
  std::uint32_t loop_hz = 1000;
  /// At 1 kHz, Z's keys change by datagram count (after 4 min), those of the observers by age.
  Rekey rekey{.datagrams = std::uint64_t{1} << 18};
  Duration session_life = Session::Config{}.life;

  /// The client's timeout, plus the longest wait before its next attempt, plus one or two round trips.
  static constexpr Duration kPromise = std::chrono::milliseconds(2000 + 2000 + 600);
  /// At least 20 copies; at 30 % loss all of them are lost with probability below 10⁻¹⁰.
  static constexpr Duration kPatience = std::chrono::seconds(20);
  static constexpr std::size_t kGrowth = std::size_t{8} << 20;
};

struct DayReport {
  std::optional<std::string> broken;  ///< the violated invariant and the time
  std::uint64_t troubles = 0;
  std::uint64_t byes = 0;       ///< number of times that a client left with a Bye
  std::uint64_t deaths = 0;     ///< clients killed, including under bad conditions
  std::uint64_t takeovers = 0;  ///< number of takeovers from another address with the key of Z
  std::uint64_t sessions = 0;
  std::uint64_t expired = 0;  ///< sessions ended by age
  std::uint64_t rekeys = 0;
  std::uint64_t roamed = 0;  ///< address changes that the server followed
  std::uint64_t steps = 0;
  std::uint64_t forces = 0;  ///< forces that reached the haptic loop
  Network::Counts network;
  std::uint64_t forged = 0;       ///< datagrams that failed authentication at the server
  std::uint64_t requests = 0;     ///< requests of Z and X
  std::uint64_t carried_out = 0;  ///< all other requests were lost because their session ended
  Duration slowest_recovery{};
  Duration longest_session{};
  Duration clock_error{};           ///< maximum under good conditions
  Duration clock_bound{};           ///< maximum under good conditions
  std::size_t heap_first_half = 0;  ///< bytes, maximum of all samples; 0 if the allocator has no statistics
  std::size_t heap_second_half = 0;
};

DayReport run_day(const DayConfig& config);

}  // namespace tendon::simulation

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "protocol/session.h"
#include "tests/tools/worlds/world.h"

namespace tendon::simulation {

/// A day of A, a server of suite 1, and its guests, whose clocks are 200 ppm fast or slow:
///
///     Z  the controller: a state for each haptic step, a force for each state. It leaves by a Bye or without a word,
///     and
///        comes back at the same address or at another, there also while the one before is still at it
///     Y  an observer, a tenth of the states; leaves and comes back likewise
///     X  an observer with 20 states a second, whose link always loses 30 %, reorders, duplicates and replays, and
///        changes its address every ten minutes: its session lives until its age ends it
///
/// For Z and Y fair weather of 10 to 40 s (in which addresses may change) and trouble take turns: bad weather of 10 to
/// 60 s, any model of the injector with flipped bits and changes of address, in which Z may be killed and come back; or
/// somebody leaves.
///
/// What is promised, at any time:
///
///     served       within kPromise after the trouble is over, and after a session has reached its age, everybody is in
///                  a session in which states and forces come, and in fair weather it stays the same one; X's always
///                  does
///     requests     each is carried out once: in fair weather within a second, after bad weather within kPromise, over
///                  X's link within kPatience; when its session has ended meanwhile, at most once
///     receipts     each end believes each genuine datagram once, as SESSION.md says (Receipts): no window refuses one
///     clock        what A says of Z's clock is within the bound that it publishes
///     memory       the heap of the second half of the day is no larger than that of the first by more than kGrowth; it
///                  holds the buffers of the simulated network, which fit its worst burst so far
struct DayConfig {
  std::uint64_t seed = 1;
  Duration length = std::chrono::hours(25);  ///< longer than a session's life
  std::uint32_t loop_hz = 1000;
  /// Of A's datagrams: Z's by their number, after 4 min at 1 kHz, those of the others by age. The guests renew theirs
  /// as production does.
  Rekey rekey{.datagrams = std::uint64_t{1} << 18};
  Duration session_life = Session::Config{}.life;

  /// The longest silence of the server that a client bears, the longest wait before its next attempt, and a round trip
  /// or two.
  static constexpr Duration kPromise = std::chrono::milliseconds(2000 + 2000 + 600);
  /// Twenty copies, at least: all of them are lost once in 10¹⁰ requests.
  static constexpr Duration kPatience = std::chrono::seconds(20);
  static constexpr std::size_t kGrowth = std::size_t{8} << 20;
};

struct DayReport {
  std::optional<std::string> broken;  ///< what was not as promised, and when
  std::uint64_t troubles = 0;
  std::uint64_t byes = 0;       ///< of these, somebody left by a Bye,
  std::uint64_t deaths = 0;     ///< … without a word (in bad weather, too),
  std::uint64_t takeovers = 0;  ///< … the same key came from another address
  std::uint64_t sessions = 0;   ///< of all three
  std::uint64_t expired = 0;    ///< of these, ended by their age
  std::uint64_t rekeys = 0;     ///< both ways
  std::uint64_t roamed = 0;     ///< changes of address that the server followed
  std::uint64_t steps = 0;
  std::uint64_t forces = 0;  ///< that came to the haptic loop
  Network::Counts network;
  std::uint64_t forged = 0;       ///< datagrams that did not open, at the server
  std::uint64_t requests = 0;     ///< of Z and X
  std::uint64_t carried_out = 0;  ///< the others were in sessions that ended
  Duration slowest_recovery{};
  Duration longest_session{};
  Duration clock_error{};           ///< the largest, in fair weather
  Duration clock_bound{};           ///< likewise
  std::size_t heap_first_half = 0;  ///< bytes, the most at a look; 0 where the allocator does not say
  std::size_t heap_second_half = 0;
};

/// Until it is over, or the first promise is broken.
DayReport run_day(const DayConfig& config);

}  // namespace tendon::simulation

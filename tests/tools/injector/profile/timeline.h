// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"
#include "tests/tools/injector/models/draws.h"
#include "tests/tools/injector/models/quantile_table.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

/// Where a time lies among the repetitions of a window.
struct WindowState {
  bool open = false;
  std::uint64_t begun = 0;  ///< how many have begun so far, an open one included
  Duration until_end{};     ///< of the open one
};
WindowState state_of(const Window& window, Duration since) noexcept;

// What the events of a profile do to a datagram that arrives `since` the profile came into force.

/// Steps, ramps, spikes and the paths after handovers, added up. What the n-th handover draws depends on n, not on the
/// traffic.
Duration extra_delay(const Profile& profile, Duration since, const Draws& draws) noexcept;
bool in_outage(const Profile& profile, Duration since) noexcept;
bool in_handover(const Profile& profile, Duration since) noexcept;

/// When something that would leave at `since` leaves: at the end of the stall that it runs into, of the next one when
/// that is open by then, and so on, but at most a thousand.
Duration past_stalls(const Profile& profile, Duration since) noexcept;

/// Which regime holds: a Markov chain in continuous time that depends on the seed and on nothing that is sent.
///
/// Thread-safe: no.
class RegimeChain {
 public:
  /// Begins at `start` with the first of `profile.regimes`, which must outlive the chain. `first_visit` counts the
  /// draws.
  RegimeChain(const std::vector<Regime>& regimes, const Draws& draws, LocalTime start, std::uint64_t first_visit);

  /// The regime at `now`, as an index. Does not go back in time. Costs some 30 ns for each change since the last call.
  std::size_t at(LocalTime now);

  /// The number of the next visit.
  std::uint64_t next_visit() const { return visit_ + 1; }

 private:
  Duration dwell() const;

  std::vector<Duration> mean_dwell_;
  Draws draws_;
  std::uint64_t visit_;
  std::size_t regime_ = 0;
  LocalTime ends_;
};

}  // namespace tendon::injector

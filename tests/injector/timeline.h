// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/time.h"
#include "tests/injector/draws.h"
#include "tests/injector/profile.h"
#include "tests/injector/quantile_table.h"

namespace tendon::injector {

/// Inside a window, how often it has begun before: 0 in the first, 1 in the second. Before the first and between them
/// no window is open.
struct WindowState {
  bool open = false;
  std::uint64_t begun = 0;  ///< windows that have begun so far, this one included
  Duration until_end{};     ///< of the open one
};
WindowState state_of(const Window& window, Duration since) noexcept;

/// What the events of a profile do to a datagram that arrives at a time since the profile came into force. The draws of
/// handovers are counted by handover, so that all links of a seed do not change path alike, but each alike in every
/// run.
Duration extra_delay(const Profile& profile, Duration since, const Draws& draws) noexcept;
bool in_outage(const Profile& profile, Duration since) noexcept;
bool in_handover(const Profile& profile, Duration since) noexcept;

/// When something that would leave at `since` leaves past the stalls: at the end of the last one that it runs into.
Duration past_stalls(const Profile& profile, Duration since) noexcept;

/// Which regime holds: a Markov chain in continuous time that depends on the seed and on nothing that is sent.
///
/// Thread-safe: no.
class RegimeChain {
 public:
  /// Begins at `start` with the first of `profile.regimes`, which must outlive the chain. `first_visit` counts the
  /// draws.
  RegimeChain(const std::vector<Regime>& regimes, const Draws& draws, LocalTime start, std::uint64_t first_visit);

  /// The regime at `now`; times before that of the last call count as that.
  std::size_t at(LocalTime now);

  std::uint64_t visits() const { return visit_ + 1; }

 private:
  Duration dwell() const;

  std::vector<Duration> mean_dwell_;
  Draws draws_;
  std::uint64_t visit_;
  std::size_t regime_ = 0;
  LocalTime ends_;
};

}  // namespace tendon::injector

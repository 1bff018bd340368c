// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/injector/models/draws.h"
#include "tests/tools/injector/models/quantile_table.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

struct WindowState {
  bool open = false;
  std::uint64_t begun = 0;  ///< number of repetitions begun, including an open one
  Duration until_end{};
};
WindowState state_of(const Window& window, Duration since) noexcept;

// Effects of a profile's events on a datagram that arrives at `since` after the profile's activation.

/// Sum of steps, ramps, spikes and path changes after handovers. The n-th handover's draw depends only on n.
Duration extra_delay(const Profile& profile, Duration since, const Draws& draws) noexcept;
bool in_outage(const Profile& profile, Duration since) noexcept;
bool in_handover(const Profile& profile, Duration since) noexcept;

/// Delays a release at `since` to the end of its stall, repeatedly if that is within another one (at most 1000 times).
Duration past_stalls(const Profile& profile, Duration since) noexcept;

/// The outages of a RandomOutage. The n-th length depends only on n. Thread-safe: no.
class OutageChain {
 public:
  /// `number` distinguishes the chains of a profile.
  OutageChain(Duration clear, LocalTime start, std::size_t number)
      : clear_(clear), number_(number), begins_(start), ends_(start) {}

  /// Returns the end of the outage at `now`, or nullopt if there is none. `now` must not decrease. Costs about 30 ns
  /// for each outage since the last call.
  std::optional<LocalTime> end(LocalTime now, const QuantileTable& length, const Draws& draws);

 private:
  Duration clear_;
  std::size_t number_;
  std::uint64_t begun_ = 0;
  LocalTime begins_, ends_;  ///< of the newest outage
};

/// A continuous-time Markov chain that depends only on the seed. Thread-safe: no.
class RegimeChain {
 public:
  /// Starts with the first of `regimes`, which must outlive the chain. `first_visit`: index of the first draw.
  RegimeChain(const std::vector<Regime>& regimes, const Draws& draws, LocalTime start, std::uint64_t first_visit);

  /// `now` must not decrease. Costs about 30 ns for each change since the last call.
  std::size_t at(LocalTime now);

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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "core/time.h"
#include "tests/injector/profile.h"

namespace tendon::injector {

/// The fate of one datagram.
struct Fate {
  bool lost = false;
  Duration delay{};                   ///< from arrival to release; a lost datagram has one too, see below
  std::optional<Duration> duplicate;  ///< from arrival to the release of the second copy, when there is one
};

/// A replayable bad network in one direction: the same seed and the same arrivals give the same
/// fates, on every machine and compiler (integer arithmetic over std::mt19937_64, no libm).
///
/// FIFO: releaseₙ = max(releaseₙ₋₁, arrivalₙ + drawn delayₙ), because a route does not reorder. So
/// when datagrams follow each other more closely than their delays vary, some wait for the one
/// ahead, and their delays lie above the profile's.
///
/// The fields of a profile do not disturb each other. Every datagram takes the same four random
/// draws whatever happens to it, a lost one is lost at the end of the route (those behind it wait as
/// if it had come through), and nobody waits for a second copy: so adding loss or duplicates to a
/// profile leaves the delays of all others as they were. A second copy draws its own delay and is
/// never ahead of the first, but may come after newer datagrams: a stale duplicate, as on real routes.
///
/// Thread-safe: no.
class Injector {
 public:
  /// Throws std::invalid_argument as check(profile) does.
  Injector(const Profile& profile, std::uint64_t seed);

  /// `arrival` should not be earlier than that of the call before; if it is, FIFO still holds.
  Fate next(LocalTime arrival);

 private:
  /// An event of the given probability, decided by one draw of 64 bits.
  struct Chance {
    explicit Chance(double probability);
    bool happens(std::uint64_t draw) const { return certain || draw < below; }
    bool certain;
    std::uint64_t below = 0;
  };
  /// One straight piece of the inverse CDF of delays: draws in [`below` of the piece before, `below`)
  /// of 2⁶³ map to `lower` … `lower + width − 1 ns`.
  struct Piece {
    std::uint64_t below = 0;
    std::int64_t lower_ns = 0;
    std::uint64_t width_ns = 1;
  };
  static std::vector<Piece> inverse_cdf(const Profile& profile);

  Duration drawn_delay(std::uint64_t draw) const;

  Chance loss_;
  Chance duplicate_;
  std::vector<Piece> inverse_cdf_;
  std::mt19937_64 random_;
  LocalTime last_release_ = LocalTime::min();
};

}  // namespace tendon::injector

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace tendon::injector {

enum class Direction : std::uint8_t {
  kUp = 0,    ///< client to server
  kDown = 1,  ///< server to client
};

/// The decision that a random number makes. Recorded runs depend on the values: never reuse or renumber one.
enum class Purpose : std::uint32_t {
  kDelay = 1,
  kLoss = 2,
  kLossState = 3,
  kDuplicate = 4,
  kDuplicateDelay = 5,
  kReplay = 6,
  kReplayAge = 7,
  kFlip = 8,
  kFlipWhere = 9,
  kTruncate = 10,
  kTruncateWhere = 11,
  kJump = 12,
  kRegimeDwell = 13,
  kRegimeNext = 14,
  kRegimeDelay = 15,
  kRegimeLoss = 16,
  kRegimeLossState = 17,
  kHandover = 18,
  kOutage = 19,
  kRule = 256,  ///< this and larger values: one for each rule
};

/// Philox4x32-10 (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC'11): 128 random bits
/// for each counter and key, without state. The tests check the known answers of its authors (Random123).
std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                        std::array<std::uint32_t, 2> key) noexcept;

/// The random numbers of one direction of one link: 64 uniform bits for each (purpose, index). Draws by other models,
/// packets, directions or links cannot shift them, because there is no stream:
///
///     key     = seed
///     counter = (index low, index high, purpose · 2 + direction, link)
///     result  = word 0 + 2³² · word 1
///
/// Thread-safe: yes, it has no state.
class Draws {
 public:
  Draws(std::uint64_t seed, std::uint32_t link, Direction direction) noexcept;

  std::uint64_t operator()(Purpose purpose, std::uint64_t index) const noexcept;

 private:
  std::array<std::uint32_t, 2> key_;
  std::uint32_t link_;
  std::uint32_t direction_;
};

/// True if 64 uniform bits are below p · 2⁶⁴, for p in 0…1; a draw that succeeds at p therefore succeeds at every
/// larger p. p = 0 never succeeds and p = 1 always does.
class Chance {
 public:
  // Scaling by 2⁶⁴ is exact: only the exponent changes.
  explicit constexpr Chance(double probability) noexcept
      : certain_(probability >= 1), below_(certain_ ? 0 : static_cast<std::uint64_t>(probability * 0x1p64)) {}

  bool possible() const noexcept { return certain_ || below_ > 0; }
  bool happens(std::uint64_t draw) const noexcept { return certain_ || draw < below_; }

 private:
  bool certain_;
  std::uint64_t below_;
};

/// Maps 64 uniform bits to 0 … n − 1 for n > 0. The probabilities differ by at most n/2⁶⁴.
std::uint64_t one_of(std::uint64_t n, std::uint64_t draw) noexcept;

}  // namespace tendon::injector

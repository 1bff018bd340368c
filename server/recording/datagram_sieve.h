// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace tendon {

/// Chooses the datagrams that are recorded, so that nobody can fill the disk, or the way to it, with datagrams.
///
/// * Strangers, senders that belong to no guest, are recorded as a sample: the first `strangers_per_s` of each second.
///   Anybody can send those. The handshake of an honest client is four datagrams.
/// * Guests are recorded whole, up to `bytes_per_s` in each second. The default is 10 times what an engine at 1 kHz and
///   an observer need.
///
/// The caller counts what is left out. A second begins with the first datagram after the last second.
///
/// Thread-safe: no. Realtime-safe: yes.
class DatagramSieve {
 public:
  struct Config {
    std::uint32_t strangers_per_s = 16;
    std::uint64_t bytes_per_s = 4'000'000;  ///< on the wire, strangers included
  };
  enum class Sender : std::uint8_t { kGuest, kStranger };
  enum class Verdict : std::uint8_t {
    kRecord,
    kStranger,    ///< left out: beyond the sample
    kOverBudget,  ///< left out: beyond `bytes_per_s`
  };

  explicit DatagramSieve(const Config& config) noexcept : config_(config) {}

  /// About a datagram of `size` bytes on the wire, from or to `sender`. `now` may stand still, but not go back.
  Verdict judge(LocalTime now, Sender sender, std::size_t size) noexcept;

 private:
  Config config_;
  LocalTime second_ends_ = LocalTime::min();
  std::uint32_t strangers_ = 0;  ///< recorded in this second
  std::uint64_t bytes_ = 0;      ///< likewise
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace tendon {

/// Selects the datagrams that are recorded, so that an attacker cannot fill the disk or the queue of the log thread.
///
/// * The first `unauthenticated_per_s` of each second that do not belong to a client. A handshake consists of four.
/// * Those of clients up to `bytes_per_s`, 10 times the rate of a 1 kHz engine and an observer.
///
/// The caller must count the other datagrams. A second starts with the first datagram after the previous second.
/// Thread-safe: no. Realtime-safe: yes.
class DatagramFilter {
 public:
  struct Config {
    std::uint32_t unauthenticated_per_s = 16;
    std::uint64_t bytes_per_s = 4'000'000;  ///< on the wire, including these
  };
  enum class Sender : std::uint8_t { kClient, kUnauthenticated };
  enum class Verdict : std::uint8_t {
    kRecord,
    kUnauthenticated,
    kOverBudget,
  };

  explicit DatagramFilter(const Config& config) noexcept : config_(config) {}

  /// `size` is in bytes on the wire. `now` must not decrease.
  Verdict judge(LocalTime now, Sender sender, std::size_t size) noexcept;

 private:
  Config config_;
  LocalTime second_ends_ = LocalTime::min();
  std::uint32_t unauthenticated_ = 0;  ///< recorded in this second
  std::uint64_t bytes_ = 0;
};

}  // namespace tendon

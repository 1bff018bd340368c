// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "core/base/time.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

/// The narrowest place of a route: one datagram after the other, each for (size + overhead) · 8/rate, behind a bounded
/// queue. Or at the opportunities of a Mahimahi trace, 1500 bytes at each.
///
/// Thread-safe: no.
class BottleneckQueue {
 public:
  /// `bottleneck` must exist. The opportunities begin at `start`.
  BottleneckQueue(Bottleneck bottleneck, LocalTime start);

  /// When a datagram that arrives now has passed; nothing when there is no room for it. `arrival` should not be earlier
  /// than that of the call before; if it is, that of the call before counts.
  std::optional<LocalTime> pass(LocalTime arrival, std::uint32_t size);

  /// The datagrams in the queue of `before` are ahead of those to come.
  void continue_from(BottleneckQueue&& before) noexcept;

 private:
  LocalTime sent_at_rate(LocalTime arrival, std::uint64_t bytes);
  LocalTime sent_at_opportunities(LocalTime arrival, std::uint64_t bytes);
  LocalTime opportunity(std::uint64_t index) const;

  Bottleneck bottleneck_;
  LocalTime start_;
  LocalTime last_arrival_;
  LocalTime free_;                 ///< when all of the queue has left
  std::uint64_t remainder_ = 0;    ///< of the division by the rate: what free_ is too early by, in units of 1 ns/rate
  std::uint64_t opportunity_ = 0;  ///< the one in use, counted from the start through all repetitions
  std::uint64_t bytes_left_;       ///< … of it
  std::deque<std::pair<LocalTime, std::uint64_t>> waiting_;  ///< when each will have left, and its bytes
  std::uint64_t bytes_waiting_ = 0;
};

}  // namespace tendon::injector

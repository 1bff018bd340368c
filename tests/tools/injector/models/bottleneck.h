// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "core/base/time.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

/// A bounded queue of a link that transmits one datagram at a time in (size + overhead) · 8/rate, or, with a Mahimahi
/// trace, sends 1500 bytes at each delivery opportunity. Thread-safe: no.
class BottleneckQueue {
 public:
  /// `bottleneck` must be enabled. The opportunities begin at `start`.
  BottleneckQueue(Bottleneck bottleneck, LocalTime start);

  /// Returns the end of transmission, or nullopt if the queue is full. An earlier `arrival` counts as the previous one.
  std::optional<LocalTime> pass(LocalTime arrival, std::uint32_t size);

  void continue_from(BottleneckQueue&& before) noexcept;

 private:
  LocalTime sent_at_rate(LocalTime arrival, std::uint64_t bytes);
  LocalTime sent_at_opportunities(LocalTime arrival, std::uint64_t bytes);
  LocalTime opportunity(std::uint64_t index) const;

  Bottleneck bottleneck_;
  LocalTime start_;
  LocalTime last_arrival_;
  LocalTime free_;                 ///< when the queue is empty
  std::uint64_t remainder_ = 0;    ///< remainder of the division by the rate, in units of 1 ns/rate, which free_ lacks
  std::uint64_t opportunity_ = 0;  ///< current one, counted from the start through all repetitions
  std::uint64_t bytes_left_;
  std::deque<std::pair<LocalTime, std::uint64_t>> waiting_;  ///< departure time and bytes of each datagram
  std::uint64_t bytes_waiting_ = 0;
};

}  // namespace tendon::injector

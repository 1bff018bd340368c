// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "protocol/messages.h"

namespace tendon::bridge {

/// Decides whether the requests of a program are still valid, in protocols without a heartbeat, in which a frozen
/// program looks like one that wants a constant force. A program that sends continuously, however, is known to have
/// stopped:
///
///     stale after 10 × the median interval of the last 8, 100 ms … 2 s, once three are known
///
/// Messages within 10 ms count as one, because a burst of settings at the start is not a stream. Before three intervals
/// are known, or if their median is above 2 s, requests are valid as long as the connection.
///
/// Thread-safe: no. Realtime-safe: yes.
class StreamFreshness {
 public:
  void heard(LocalTime now);
  void forget() { *this = {}; }
  LocalTime until() const;  ///< LocalTime::max() if requests are valid as long as the connection

 private:
  static constexpr std::size_t kGaps = 8;
  std::array<Duration, kGaps> gaps_{};
  std::size_t count_ = 0;
  LocalTime counted_{};  ///< start of the newest group of messages
  LocalTime newest_{};
  bool any_ = false;
};

}  // namespace tendon::bridge

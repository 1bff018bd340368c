// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <chrono>

#include "protocol/link.h"

namespace tendon {

/// A link for a thread that polls instead of sleeping. It saves the wake-up latency of a sleeping thread, about 10 to
/// 50 µs in each direction, and occupies one processor core.
///
///     while (now < due && !busy.look(now)) {}
///     due = turn(now);                            // receives from `busy`
///
/// look() takes the datagram from the link and receive() returns it. If the look just before found nothing, the
/// datagram is assumed to be the only one, and the next receive() returns 0 without a system call, so that the answer
/// leaves sooner.
///
/// Thread-safe: no. Realtime-safe: as the wrapped link.
class BusyLink : public Link {
 public:
  /// `link` must outlive this object and must have a clock (Link::present). Nothing else may receive from it.
  explicit BusyLink(Link& link) : link_(link) {}

  /// Returns true if a datagram can be received. Pass the time of the previous look, or a later one, as `now`; it is
  /// set to the present time, read after this look. `now` does not change while a datagram from an earlier look is
  /// waiting.
  bool look(LocalTime& now);

  void send(const Address& to, std::span<const std::byte> datagram) override { link_.send(to, datagram); }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override;
  LocalTime present(LocalTime now) const override { return link_.present(now); }
  /// Returns the time of the look that took the datagram, if a look took it.
  LocalTime arrived(LocalTime now) const override { return by_look_ ? std::max(now, looked_) : link_.arrived(now); }

 private:
  /// Longest time from the start of a look that found nothing to the end of the next one for which the datagram is
  /// assumed to be the only one. After a longer time the thread was preempted and more datagrams may have arrived.
  static constexpr Duration kAtOnce = std::chrono::microseconds(20);

  Link& link_;
  Address from_;
  /// datagram taken by look(); the extra byte keeps an oversized one oversized
  std::array<std::byte, kMaxDatagram + 1> ahead_;
  std::size_t size_ = 0;  ///< its size; 0 if there is none
  bool alone_ = false;    ///< no other datagram is expected behind it
  bool by_look_ = false;  ///< the last received datagram was taken by look()
  LocalTime looked_{};    ///< time after the look that found a datagram
  LocalTime nothing_{};   ///< time before the last look that found nothing
};

}  // namespace tendon

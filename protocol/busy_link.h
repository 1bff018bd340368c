// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <chrono>

#include "protocol/link.h"

namespace tendon {

/// A link for threads that poll to avoid a wake-up latency of about 10 to 50 µs per direction. Polling occupies a core.
///
///     while (now < due && !busy.look(now)) {}
///     due = turn(now);                            // receives from `busy`
///
/// If the previous look() was empty, the next datagram is assumed to be alone: after it, receive() returns 0 without a
/// system call, which would delay the answer. Thread-safe: no. Realtime-safe: as the wrapped link.
class BusyLink : public Link {
 public:
  /// `link` must outlive this object, must have a clock (Link::present), and must not be used for receiving elsewhere.
  explicit BusyLink(Link& link) : link_(link) {}

  /// Returns true if a datagram can be received. Sets `now`, which must be the time of the previous look or later, to
  /// the present time unless a datagram was already waiting.
  bool look(LocalTime& now);

  void send(const Address& to, std::span<const std::byte> datagram) override { link_.send(to, datagram); }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override;
  LocalTime present(LocalTime now) const override { return link_.present(now); }
  /// If the datagram was taken by look(), this is the time of that call.
  LocalTime arrived(LocalTime now) const override { return by_look_ ? std::max(now, looked_) : link_.arrived(now); }
  LocalTime reached(LocalTime now) const override { return link_.reached(now); }

 private:
  /// If an empty look took longer, the thread was preempted, and more than one datagram may have arrived.
  static constexpr Duration kAtOnce = std::chrono::microseconds(20);

  Link& link_;
  Address from_;
  std::array<std::byte, kMaxDatagram + 1> ahead_;  ///< the extra byte marks datagrams that are too large
  std::size_t size_ = 0;
  bool alone_ = false;
  bool by_look_ = false;
  LocalTime looked_{};
  LocalTime nothing_{};  ///< start of the last empty look
};

}  // namespace tendon

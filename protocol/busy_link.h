// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <chrono>

#include "protocol/link.h"

namespace tendon {

/// A link whose owner never sleeps: it looks again and again whether a datagram has come. What a sleeping thread pays
/// for being woken, some 10 to 50 µs of each way, is saved; the price is a whole processor.
///
///     while (now < due && !busy.look(now)) {}
///     due = turn(now);                            // receives from `busy`
///
/// The look takes the datagram, and receive() hands it out. One that came right after a look that found nothing is
/// alone, and receive() says so without asking the link once more: that question would cost a system call before the
/// answer leaves.
///
/// Thread-safe: no. Realtime-safe: as the link is.
class BusyLink : public Link {
 public:
  /// `link` must outlive this object, and is received from through it only. It has a clock (Link::present).
  explicit BusyLink(Link& link) : link_(link) {}

  /// Whether a datagram is there to be received. `now`, at first the time of the look before or a later one, becomes the
  /// present time, read after this look. It stays as it is while what an earlier look took is there.
  bool look(LocalTime& now);

  void send(const Address& to, std::span<const std::byte> datagram) override { link_.send(to, datagram); }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override;
  LocalTime present(LocalTime now) const override { return link_.present(now); }
  /// After a datagram that the look took: the time of that look.
  LocalTime arrived(LocalTime now) const override { return by_look_ ? std::max(now, looked_) : link_.arrived(now); }

 private:
  /// From before a look that found nothing to after the one that found a datagram. Beyond that the thread was held up,
  /// and more may have come.
  static constexpr Duration kAtOnce = std::chrono::microseconds(20);

  Link& link_;
  Address from_;
  std::array<std::byte, kMaxDatagram + 1> ahead_;  ///< what the look took; one that is too large stays too large
  std::size_t size_ = 0;                           ///< of it; 0: nothing
  bool alone_ = false;                             ///< nothing was behind it
  bool by_look_ = false;                           ///< the last one that was received is what the look took
  LocalTime looked_{};                             ///< after the look that found something
  LocalTime nothing_{};                            ///< before the last look that found nothing
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/base/time.h"

namespace tendon {

/// The largest datagram, in bytes: below every common path MTU, so none is fragmented.
inline constexpr std::size_t kMaxDatagram = 1200;

/// Where a datagram comes from or goes to: a 16-byte IPv6 (or IPv4-mapped) address and a UDP port.
/// The protocol only compares addresses and feeds their bytes to the cookie.
struct Address {
  std::array<std::uint8_t, 16> ip{};
  std::uint16_t port = 0;
  auto operator<=>(const Address&) const = default;
};

/// "127.0.0.1:47100" or "[::1]:47100": what parse_address() reads.
std::string to_string(const Address& address);

/// The address that "HOST:PORT" names. HOST is a numeric IPv4 address, a numeric IPv6 address in
/// brackets, or `localhost` (127.0.0.1); there is no name lookup, so nothing here waits. PORT is
/// 0…65535. Throws std::invalid_argument with `text` and the expected format.
Address parse_address(std::string_view text);

/// The first bytes of an IPv4-mapped address, ::ffff:a.b.c.d (RFC 4291, 2.5.5.2).
inline constexpr std::array<std::uint8_t, 12> kMappedIpv4 = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};

/// True for an IPv4-mapped address.
bool is_ipv4(const Address& address) noexcept;

/// True for 127.0.0.0/8 and ::1: datagrams to it never leave this machine.
bool is_loopback(const Address& address) noexcept;

/// Where datagrams leave and arrive, unreliably: a UDP socket, or in tests a simulated network.
///
/// Thread-safe: no.
class Link {
 public:
  virtual ~Link() = default;

  /// Sends one datagram, or loses it without telling, as UDP does.
  virtual void send(const Address& to, std::span<const std::byte> datagram) = 0;

  /// Copies the next datagram that has arrived into `buffer` and returns its size; 0 when there is none. Never waits.
  /// A datagram larger than the buffer is cut, and its full size returned, so that the caller can tell.
  virtual std::size_t receive(Address& from, std::span<std::byte> buffer) = 0;

  /// The present time, never before `now`: a turn reads it when it may have become later than it believes. When a turn
  /// is preempted after it has read `now`, it may find datagrams that arrived later. With `now` as their time of arrival
  /// their round trip would look too short, and ClockOffsetEstimator trusts the shortest round trips most. An engine
  /// that a turn calls may take its time, too. A link without a clock returns `now`.
  virtual LocalTime present(LocalTime now) const { return now; }

  /// A time by which the datagram that receive() gave last had certainly come, never before `now`. It is the present
  /// time, unless the link knows an earlier one: that saves a reading of the clock.
  virtual LocalTime arrived(LocalTime now) const { return present(now); }
};

}  // namespace tendon

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

/// No datagram is larger than this: below every common path MTU, so it is never fragmented.
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
/// 0…65535. Anything else throws std::invalid_argument: `expected HOST:PORT like 127.0.0.1:47100, got "…"`.
Address parse_address(std::string_view text);

/// True for an IPv4-mapped address.
bool is_ipv4(const Address& address) noexcept;

/// True for 127.0.0.0/8 and ::1: datagrams to it never leave this machine.
bool is_loopback(const Address& address) noexcept;

/// The edge of the world towards other machines: unreliable datagrams out and in. The real one is a
/// UDP socket; in tests it is a simulated network.
///
/// Thread-safe: no.
class Link {
 public:
  virtual ~Link() = default;

  /// Sends one datagram, or loses it: like UDP, nobody is told.
  virtual void send(const Address& to, std::span<const std::byte> datagram) = 0;

  /// The next datagram that has arrived, copied into `buffer`; 0 when there is none, never waits.
  /// A datagram larger than the buffer is cut and its full size returned, so that the caller sees
  /// that it was too large.
  virtual std::size_t receive(Address& from, std::span<std::byte> buffer) = 0;

  /// A time, not before `now`, by which the datagram that receive() has just returned was certainly here. A turn that
  /// loses its processor after it has been told the time finds datagrams younger than that; taken for as old, their
  /// round trip and one of its ways would look short by as much, and of round trips the shortest is believed most
  /// (ClockOffsetEstimator). A link without a clock says `now`.
  virtual LocalTime received_by(LocalTime now) const { return now; }
};

}  // namespace tendon

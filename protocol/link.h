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

/// Largest datagram in bytes. It is below every common path MTU, so that datagrams are not fragmented.
inline constexpr std::size_t kMaxDatagram = 1200;

/// An IPv6 or IPv4-mapped address and a UDP port. The protocol only compares addresses and uses their bytes for the
/// cookie.
struct Address {
  std::array<std::uint8_t, 16> ip{};
  std::uint16_t port = 0;
  auto operator<=>(const Address&) const = default;
};

/// Returns "127.0.0.1:47100" or "[::1]:47100". The inverse of parse_address().
std::string to_string(const Address& address);

/// Parses "HOST:PORT". HOST is a numeric IPv4 address, a numeric IPv6 address in brackets, or `localhost` (127.0.0.1).
/// There is no name lookup, so the function never blocks. PORT is 0…65535. Throws std::invalid_argument with `text` and
/// the expected format.
Address parse_address(std::string_view text);

/// Prefix of an IPv4-mapped address, ::ffff:a.b.c.d (RFC 4291, 2.5.5.2).
inline constexpr std::array<std::uint8_t, 12> kMappedIpv4 = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};

bool is_ipv4(const Address& address) noexcept;

/// Returns true for 127.0.0.0/8 and ::1. Datagrams to these addresses never leave the machine.
bool is_loopback(const Address& address) noexcept;

/// An unreliable datagram transport: a UDP socket, or a simulated network in tests.
///
/// Thread-safe: no.
class Link {
 public:
  virtual ~Link() = default;

  /// Sends one datagram. Errors are not reported: the datagram is lost, as in UDP.
  virtual void send(const Address& to, std::span<const std::byte> datagram) = 0;

  /// Copies the next received datagram into `buffer` and returns its size, or 0 if there is none. Never blocks. A
  /// datagram that is larger than the buffer is truncated and its full size is returned.
  virtual std::size_t receive(Address& from, std::span<std::byte> buffer) = 0;

  /// Returns the present time, never before `now`. A link without a clock returns `now`.
  ///
  /// A thread can be preempted after it has read `now`, and an engine called in the turn can take long. Datagrams found
  /// afterwards may have arrived later than `now`. If `now` were used as their arrival time, their round trips would
  /// look too short, and ClockOffsetEstimator trusts the shortest round trips most.
  virtual LocalTime present(LocalTime now) const { return now; }

  /// Returns a time by which the last received datagram had certainly arrived, never before `now`. This is the present
  /// time, unless the link knows an earlier one, which saves a clock reading.
  virtual LocalTime arrived(LocalTime now) const { return present(now); }
};

}  // namespace tendon

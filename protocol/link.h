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

inline constexpr std::size_t kMaxDatagram = 1200;  ///< below all common path MTUs, so that datagrams are not fragmented

/// An IPv6 or IPv4-mapped address and a UDP port.
struct Address {
  std::array<std::uint8_t, 16> ip{};
  std::uint16_t port = 0;
  auto operator<=>(const Address&) const = default;
};

std::string to_string(const Address& address);

/// Parses "127.0.0.1:47100", "[::1]:47100" or "localhost:47100" (127.0.0.1). Never blocks, because names are not
/// resolved. Throws std::invalid_argument with `text` and the expected format.
Address parse_address(std::string_view text);

/// Prefix of an IPv4-mapped address, ::ffff:a.b.c.d (RFC 4291, 2.5.5.2).
inline constexpr std::array<std::uint8_t, 12> kMappedIpv4 = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};

bool is_ipv4(const Address& address) noexcept;

bool is_loopback(const Address& address) noexcept;

/// An unreliable datagram transport: a UDP socket, or a simulated network used in tests. Thread-safe: no.
class Link {
 public:
  virtual ~Link() = default;

  /// May lose the datagram. Errors are not reported.
  virtual void send(const Address& to, std::span<const std::byte> datagram) = 0;

  /// Copies the next datagram and returns its full size, even if truncated, or 0 if there is none. Never blocks.
  virtual std::size_t receive(Address& from, std::span<std::byte> buffer) = 0;

  /// Returns the present time, at least `now`. If a link has no clock, it returns `now`.
  ///
  /// A thread can be preempted after reading `now`, or delayed by an engine. Datagrams received afterwards may have
  /// arrived after `now`. Their round trips would be too short, and ClockOffsetEstimator uses the shortest.
  virtual LocalTime present(LocalTime now) const { return now; }

  /// Like present(), for the arrival of the last datagram. A link that knows this saves reading the clock.
  virtual LocalTime arrived(LocalTime now) const { return present(now); }

  /// Returns the time at which the last datagram has reached this machine, at most `now`. If the link does not know this
  /// time, it returns `now`. Use this only to measure delays and clocks. The age of a force must not depend on it.
  virtual LocalTime reached(LocalTime now) const { return now; }
};

}  // namespace tendon

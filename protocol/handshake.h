// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "core/time.h"
#include "protocol/codec.h"
#include "protocol/link.h"
#include "protocol/messages.h"

namespace tendon {

/// The client's half of the handshake: says Hello until a Retry brings a cookie, says Hello with the
/// cookie until it is answered. It never gives up; its owner may. Sans-I/O.
///
/// A datagram that is malformed, or does not carry this attempt's `random`, is ignored.
class ClientHandshake {
 public:
  struct Config {
    Hello hello;
    ClientRandom random{};  ///< chosen by the caller; ties Retry and answer to this attempt
    /// 10 Hz: a lost Hello costs a person no noticeable wait, a dead server 12 kB/s.
    Duration resend = std::chrono::milliseconds(100);
  };
  struct Accepted {
    std::uint32_t connection_id;
    Welcome welcome;
  };
  using Outcome = std::variant<Accepted, Refused>;

  ClientHandshake(const Config& config, LocalTime now);

  void receive(LocalTime now, std::span<const std::byte> datagram);
  void tick(LocalTime now);
  /// Writes the Hello when it is due and returns its size; 0 = nothing to send now.
  std::size_t next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  /// Set once the server has answered; the handshake is then over.
  const std::optional<Outcome>& outcome() const noexcept { return outcome_; }
  /// When `tick` is due next; not in the future when a Hello waits to be sent.
  LocalTime next_tick() const noexcept { return next_tick_; }

 private:
  Config config_;
  std::optional<Cookie> cookie_;
  std::optional<Outcome> outcome_;
  bool due_ = true;
  LocalTime next_tick_;
};

/// The server's half: answers a Hello without a valid cookie by a Retry, keeping no state and never
/// sending more bytes than it got, so that a spoofed source can neither fill memory nor be flooded.
///
///     key n  = HMAC-SHA-512-256(secret, "tendon-cookie-key" ‖ n as 8 bytes LE),  n = ⌊now / key_lifetime⌋
///     cookie = HMAC-SHA-512-256(key n, "tendon-cookie" ‖ ip[16] ‖ port as 2 bytes LE ‖ client random)[0..16)
///
/// Cookies of key n and n − 1 are valid, so one lives between one and two key lifetimes and no key has to
/// be remembered. Silent on everything malformed. Sans-I/O, no randomness of its own.
class Doorman {
 public:
  struct Config {
    std::array<std::byte, 32> secret{};  ///< random at start; keys are derived from it and the time
    std::uint32_t version_min = kProtocolVersion;
    std::uint32_t version_max = kProtocolVersion;
    /// Longer than any client takes to come back with its cookie, short enough that a stolen one is of little use.
    Duration key_lifetime = std::chrono::seconds(120);
  };
  /// A Hello whose sender has proved to own its address.
  struct Guest {
    Hello hello;
    ClientRandom random;    ///< the same random from the same address is the same attempt, resent: answer it alike
    std::uint32_t version;  ///< the highest both speak; 0 = none in common: refuse with our range
  };
  struct Reply {
    std::size_t size = 0;  ///< bytes of `answer` to send back; 0 = stay silent
    std::optional<Guest> guest;
  };

  /// Throws std::invalid_argument when `key_lifetime` is not positive or the version range is empty, and
  /// std::runtime_error when libsodium cannot start.
  explicit Doorman(const Config& config);

  /// Takes a datagram of type Hello. Writes a Retry into `answer`, or returns the guest.
  Reply receive(LocalTime now, const Address& from, std::span<const std::byte> datagram,
                std::span<std::byte, kMaxDatagram> answer);

  /// The bytes of yes and no. Both are shorter than a Hello.
  static std::size_t welcome(std::uint32_t connection_id, const ClientRandom& random, const Welcome& welcome,
                             std::span<std::byte, kMaxDatagram> buffer);
  static std::size_t refuse(const ClientRandom& random, const Refused& refused,
                            std::span<std::byte, kMaxDatagram> buffer);

  /// Datagrams that were no good Hello.
  std::uint64_t malformed() const noexcept { return malformed_; }

 private:
  Cookie cookie(std::int64_t key_number, const Address& from, const ClientRandom& random) const noexcept;

  Config config_;
  std::uint64_t malformed_ = 0;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "core/base/time.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/secrets/client_key.h"
#include "protocol/secrets/crypto.h"
#include "protocol/secrets/hello_limit.h"
#include "protocol/secrets/noise.h"
#include "protocol/secrets/seal.h"
#include "protocol/secrets/suites.h"
#include "protocol/wire/handshake_codec.h"

namespace tendon {

/// The client's half of the handshake, without I/O. It repeats its Hello until a Retry provides a cookie, then repeats
/// it with the cookie until an Answer arrives. It never times out. It ignores datagrams that are malformed, not
/// authentic, of another suite, or without this attempt's `random`.
class ClientHandshake {
 public:
  struct Config {
    Hello hello;
    ClientRandom random{};  ///< cryptographically random, new for each attempt
    /// If set, the handshake is sealed, and an answer cannot make the client fall back to suite 0.
    struct Secret {
      Key key;
      Key ephemeral;  ///< cryptographically random, new for each attempt
    };
    std::optional<Secret> secret{};
    /// Allowed in a sealed session. Suite 2 is offered as kFeatureAesGcm. Other answers are Refused with kUnsupported.
    Suites suites = suites_of_this_machine();
    Duration resend = std::chrono::milliseconds(100);  ///< delay after a loss; an unreachable server receives 12 kB/s
  };
  struct Accepted {
    std::uint32_t connection_id;
    Welcome welcome;
    std::optional<SessionKeys> keys;  ///< set in suites 1 and 2
  };
  using Outcome = std::variant<Accepted, Refused>;

  /// Throws std::invalid_argument if the Hello is too large for a datagram (too many claims with long names), or if
  /// this processor does not support one of the suites.
  ClientHandshake(const Config& config, LocalTime now);

  void receive(LocalTime now, std::span<const std::byte> datagram);
  void tick(LocalTime now);
  /// Writes the Hello and returns its size, or returns 0 if it is not due.
  std::size_t next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  const std::optional<Outcome>& outcome() const noexcept { return outcome_; }  ///< set when the server has answered
  LocalTime next_tick() const noexcept { return next_tick_; }  ///< when to call `tick`; at once if a Hello is due

 private:
  void settle(const AnswerDatagram& datagram);

  std::uint32_t version_min_;
  std::uint32_t version_max_;
  ClientRandom random_;
  Duration resend_;
  Suites suites_;
  std::optional<NoiseInitiator> noise_;
  std::vector<std::byte> body_;  ///< the same for every cookie
  std::optional<Cookie> cookie_;
  std::optional<Outcome> outcome_;
  bool due_ = true;
  LocalTime next_tick_;
};

/// The server's half of the handshake, without I/O. If a Hello has no valid cookie, it sends a Retry and stores no
/// state. It never sends more bytes than it has received, so spoofed Hellos cannot exhaust the memory or flood anyone.
///
///     key n  = HMAC-SHA-256(secret, "tendon-cookie-key" ‖ n as 8 bytes LE),  n = ⌊now / key_lifetime⌋
///     cookie = HMAC-SHA-256(key n, "tendon-cookie" ‖ ip[16] ‖ port as 2 bytes LE ‖ client random)[0..16)
///
/// Cookies of the keys n and n − 1 are valid, so a cookie can be used for one to two key lifetimes and keys are not
/// stored. The rate limit and the client's key are checked only if the cookie is valid. All failures are silent.
class ServerHandshake {
 public:
  struct Config {
    /// Random bytes drawn at startup, from which all cookie keys and ephemeral keys are derived. Must be erased after
    /// construction, because it can be used to decrypt later handshakes.
    Bytes32 secret{};
    std::vector<ClientKey> keys{};  ///< accepted in suites 1 and 2
    /// The allowed suites. A session uses the first of kSealedSuites that is also supported by the client.
    Suites suites = suites_of_this_machine();
    std::uint32_t version_min = kProtocolVersion;
    std::uint32_t version_max = kProtocolVersion;
    /// Long enough for any client to return its cookie, but too short for a stolen cookie to be useful.
    Duration key_lifetime = std::chrono::seconds(120);
    /// Instances with one secret accept each other's cookies. Different numbers give them different ephemeral keys.
    std::uint32_t number = 0;
  };
  /// A Hello whose sender has proved that it owns its address and, in suites 1 and 2, its key.
  struct Client {
    Hello hello;
    ClientRandom random;                  ///< the same if the Hello was resent
    std::uint32_t version;                ///< highest common version; 0: must be refused
    std::optional<Suite> suite{};         ///< for Data; empty: must be refused
    const ClientKey* key = nullptr;       ///< null in suite 0
    std::optional<NoiseResponder> noise;  ///< set with a key
  };
  struct Reply {
    std::size_t size = 0;  ///< of `answer`; 0: do not reply
    std::optional<Client> client;
  };
  struct Answered {
    std::size_t size = 0;             ///< 0: do not reply
    std::optional<SessionKeys> keys;  ///< only for clients with a key
  };
  struct Stats {
    std::uint64_t retries = 0;  ///< no valid cookie: a Retry was sent
    std::uint64_t malformed = 0;
    std::uint64_t plain = 0;  ///< suite 0 from another host
    std::uint64_t limited = 0;
    std::uint64_t unknown_key = 0;
    std::uint64_t forged = 0;

    Stats& operator+=(const Stats& more) noexcept;
  };

  /// Throws std::invalid_argument if `key_lifetime` is not positive, the version range is empty, two clients have the
  /// same key, or this processor does not support one of the suites. Throws std::runtime_error if libsodium fails.
  explicit ServerHandshake(const Config& config);
  // A Client points into `keys_`.
  ServerHandshake(const ServerHandshake&) = delete;
  ServerHandshake& operator=(const ServerHandshake&) = delete;

  /// Handles a Hello. Writes a Retry into `answer` or returns a client.
  Reply receive(LocalTime now, const Address& from, std::span<const std::byte> datagram,
                std::span<std::byte, kMaxDatagram> answer);

  /// Writes an Answer, always shorter than a Hello. With a key, each call uses new session keys, so the bytes must be
  /// kept for a resent Hello. welcome() requires a `suite` and adds kFeatureAesGcm in suite 2.
  Answered welcome(const Client& client, std::uint32_t connection_id, const Welcome& welcome,
                   std::span<std::byte, kMaxDatagram> buffer);
  Answered refuse(const Client& client, const Refused& refused, std::span<std::byte, kMaxDatagram> buffer);

  const Stats& stats() const noexcept { return stats_; }

 private:
  Cookie cookie(std::int64_t key_number, const Address& from, const ClientRandom& random) const noexcept;
  bool read(const HelloDatagram& datagram, Client& client);
  std::optional<Suite> suite_for(const Client& client) const noexcept;
  Answered answer(const Client& client, std::uint32_t connection_id, const Answer& body,
                  std::span<std::byte, kMaxDatagram> buffer);

  std::uint32_t version_min_;
  std::uint32_t version_max_;
  Suites suites_;
  Duration key_lifetime_;
  Key cookie_secret_;
  Ratchet ephemerals_;
  HelloLimit limit_;
  std::map<KeyId, ClientKey> keys_;
  Stats stats_;
};

}  // namespace tendon

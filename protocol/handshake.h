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

/// The client's half of the handshake: repeats its Hello until a Retry brings a cookie, then repeats it with the cookie
/// until an Answer comes. It never gives up by itself; its owner may. Sans-I/O.
///
/// It ignores every datagram that is malformed, of another suite, not authentic, or without this attempt's `random`.
class ClientHandshake {
 public:
  struct Config {
    Hello hello;
    ClientRandom random{};  ///< from a cryptographic source, new for each attempt
    /// When set, the handshake is sealed: no answer can make the client fall back to suite 0.
    struct Secret {
      Key key;        ///< ClientKey::key
      Key ephemeral;  ///< from a cryptographic source, new for each attempt
    };
    std::optional<Secret> secret{};
    /// With a secret: the suites that the session may be sealed by. The Hello offers suite 2, by kFeatureAesGcm, where
    /// it is among them; a server that chooses none of them has refused us (kUnsupported).
    Suites suites = suites_of_this_machine();
    /// A lost Hello delays the client by 0.1 s, which nobody notices; a dead server is sent 12 kB/s.
    Duration resend = std::chrono::milliseconds(100);
  };
  struct Accepted {
    std::uint32_t connection_id;
    Welcome welcome;
    std::optional<SessionKeys> keys;  ///< in suites 1 and 2
  };
  using Outcome = std::variant<Accepted, Refused>;

  /// Throws std::invalid_argument when the Hello does not fit into a datagram (too many claims with long names), or
  /// this processor cannot speak one of the suites.
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
  void settle(const AnswerDatagram& datagram);

  std::uint32_t version_min_;
  std::uint32_t version_max_;
  ClientRandom random_;
  Duration resend_;
  Suites suites_;
  std::optional<NoiseInitiator> noise_;  ///< with a secret
  std::vector<std::byte> body_;          ///< of the Hello: written once, the same for every cookie
  std::optional<Cookie> cookie_;
  std::optional<Outcome> outcome_;
  bool due_ = true;
  LocalTime next_tick_;
};

/// The server's half: answers a Hello without a valid cookie by a Retry. It keeps no state for it and never sends more
/// bytes than it received, so spoofed Hellos neither fill our memory nor flood the address they were spoofed from.
///
///     key n  = HMAC-SHA-256(secret, "tendon-cookie-key" ‖ n as 8 bytes LE),  n = ⌊now / key_lifetime⌋
///     cookie = HMAC-SHA-256(key n, "tendon-cookie" ‖ ip[16] ‖ port as 2 bytes LE ‖ client random)[0..16)
///
/// Cookies of key n and n − 1 are valid, so a cookie lives between one and two key lifetimes, and no key has to be
/// remembered. Only after a valid cookie is a Hello counted against its source, and only then is a client's key tried.
/// Every failure is silent. Sans-I/O; all randomness comes from Config::secret.
class Doorman {
 public:
  struct Config {
    /// Drawn at start. Cookie keys are derived from it and the time, ephemeral keys by a Ratchet. Wipe it after the
    /// construction: with it, later handshakes could be opened.
    Bytes32 secret{};
    /// The clients that may enter with a key.
    std::vector<ClientKey> keys{};
    /// The suites that their sessions may be sealed by; of those that a client has too, the first of kSealedSuites.
    Suites suites = suites_of_this_machine();
    std::uint32_t version_min = kProtocolVersion;
    std::uint32_t version_max = kProtocolVersion;
    /// Longer than any client takes to return with its cookie; short enough that a stolen cookie is of little use.
    Duration key_lifetime = std::chrono::seconds(120);
    /// Doormen of one server have one secret and different numbers: each takes the cookies of all, and no two draw the
    /// same ephemeral keys.
    std::uint32_t number = 0;
  };
  /// A Hello whose sender has proved to own its address and, in suite 1, its key.
  struct Guest {
    Hello hello;
    ClientRandom random;                  ///< the same random means a resent Hello: repeat the answer
    std::uint32_t version;                ///< the highest that both speak; 0 = none: refuse, with our range
    std::optional<Suite> suite{};         ///< of its Data; empty = none in common: refuse
    const ClientKey* key = nullptr;       ///< null in suite 0
    std::optional<NoiseResponder> noise;  ///< with a key
  };
  struct Reply {
    std::size_t size = 0;  ///< bytes of `answer` to send back; 0 = stay silent
    std::optional<Guest> guest;
  };
  struct Answered {
    std::size_t size = 0;             ///< of the Answer; 0 = stay silent
    std::optional<SessionKeys> keys;  ///< with a key, of a guest that is admitted
  };
  /// Hellos that did not lead to a Guest, by reason.
  struct Stats {
    std::uint64_t retries = 0;      ///< no cookie, or an invalid one: a Retry was sent
    std::uint64_t malformed = 0;    ///< not a well-formed Hello
    std::uint64_t plain = 0;        ///< suite 0 from another machine
    std::uint64_t limited = 0;      ///< too many from one source
    std::uint64_t unknown_key = 0;  ///< no client has a key with that id
    std::uint64_t forged = 0;       ///< not sealed with the key that it names

    Stats& operator+=(const Stats& more) noexcept;
  };

  /// Throws std::invalid_argument when `key_lifetime` is not positive, the version range is empty, two clients have one
  /// key, or this processor cannot speak one of the suites; and std::runtime_error when libsodium cannot start.
  explicit Doorman(const Config& config);
  // A Guest points at our keys.
  Doorman(const Doorman&) = delete;
  Doorman& operator=(const Doorman&) = delete;

  /// Takes a datagram of type Hello. Writes a Retry into `answer`, or returns the guest.
  Reply receive(LocalTime now, const Address& from, std::span<const std::byte> datagram,
                std::span<std::byte, kMaxDatagram> answer);

  /// Writes the Answer that admits the guest, or refuses it; both are shorter than a Hello. With a key each call draws
  /// new keys and so writes other bytes: keep them, for when the same Hello comes again. A Welcome into suite 2 says so
  /// by kFeatureAesGcm, which is added here. Only a guest with a `suite` may be welcomed.
  Answered welcome(const Guest& guest, std::uint32_t connection_id, const Welcome& welcome,
                   std::span<std::byte, kMaxDatagram> buffer);
  Answered refuse(const Guest& guest, const Refused& refused, std::span<std::byte, kMaxDatagram> buffer);

  const Stats& stats() const noexcept { return stats_; }

 private:
  Cookie cookie(std::int64_t key_number, const Address& from, const ClientRandom& random) const noexcept;
  bool read(const HelloDatagram& datagram, Guest& guest);
  std::optional<Suite> suite_for(const Guest& guest) const noexcept;
  Answered answer(const Guest& guest, std::uint32_t connection_id, const Answer& body,
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

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

/// The client's half of the handshake. It repeats its Hello until a Retry brings a cookie, then repeats it with the
/// cookie until an Answer arrives. It never gives up; its owner may. It does no I/O.
///
/// Datagrams that are malformed, of another suite, not authentic, or that lack this attempt's `random` are ignored.
class ClientHandshake {
 public:
  struct Config {
    Hello hello;
    ClientRandom random{};  ///< from a cryptographic source, new for each attempt
    /// If set, the handshake is sealed, and no answer can make the client fall back to suite 0.
    struct Secret {
      Key key;        ///< ClientKey::key
      Key ephemeral;  ///< from a cryptographic source, new for each attempt
    };
    std::optional<Secret> secret{};
    /// With a secret: the allowed cipher suites. If suite 2 is among them, the Hello offers it as kFeatureAesGcm. If
    /// the server chooses a suite that is not among them, the outcome is Refused with kUnsupported.
    Suites suites = suites_of_this_machine();
    /// A lost Hello delays the client by 0.1 s. A server that does not answer is sent 12 kB/s.
    Duration resend = std::chrono::milliseconds(100);
  };
  struct Accepted {
    std::uint32_t connection_id;
    Welcome welcome;
    std::optional<SessionKeys> keys;  ///< set in suites 1 and 2
  };
  using Outcome = std::variant<Accepted, Refused>;

  /// Throws std::invalid_argument if the Hello does not fit into a datagram (too many claims with long names), or if
  /// this processor does not support one of the suites.
  ClientHandshake(const Config& config, LocalTime now);

  void receive(LocalTime now, std::span<const std::byte> datagram);
  void tick(LocalTime now);
  /// Writes the Hello if it is due. Returns its size, or 0 if nothing is to be sent now.
  std::size_t next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  /// Set when the server has answered. The handshake is then complete.
  const std::optional<Outcome>& outcome() const noexcept { return outcome_; }
  /// When `tick` is due. Not in the future if a Hello is waiting to be sent.
  LocalTime next_tick() const noexcept { return next_tick_; }

 private:
  void settle(const AnswerDatagram& datagram);

  std::uint32_t version_min_;
  std::uint32_t version_max_;
  ClientRandom random_;
  Duration resend_;
  Suites suites_;
  std::optional<NoiseInitiator> noise_;  ///< set with a secret
  std::vector<std::byte> body_;          ///< body of the Hello, the same for every cookie
  std::optional<Cookie> cookie_;
  std::optional<Outcome> outcome_;
  bool due_ = true;
  LocalTime next_tick_;
};

/// The server's half of the handshake. It answers a Hello without a valid cookie with a Retry, keeps no state for it,
/// and never sends more bytes than it received. Spoofed Hellos therefore can neither exhaust memory nor flood a third
/// party.
///
///     key n  = HMAC-SHA-256(secret, "tendon-cookie-key" ‖ n as 8 bytes LE),  n = ⌊now / key_lifetime⌋
///     cookie = HMAC-SHA-256(key n, "tendon-cookie" ‖ ip[16] ‖ port as 2 bytes LE ‖ client random)[0..16)
///
/// Cookies of key n and of key n − 1 are valid, so a cookie is valid for one to two key lifetimes and no key is stored.
/// A Hello counts against the limit of its source, and a client's key is tried, only after the cookie was found valid.
/// All failures are silent. There is no I/O, and all randomness comes from Config::secret.
class Doorman {
 public:
  struct Config {
    /// Random bytes drawn at startup. Cookie keys are derived from the secret and the time, ephemeral keys by a
    /// Ratchet. Wipe it after construction: it would open all later handshakes.
    Bytes32 secret{};
    /// Keys of the clients that are admitted in suites 1 and 2.
    std::vector<ClientKey> keys{};
    /// Allowed cipher suites. The session uses the first of kSealedSuites that the client supports as well.
    Suites suites = suites_of_this_machine();
    std::uint32_t version_min = kProtocolVersion;
    std::uint32_t version_max = kProtocolVersion;
    /// Longer than any client needs to return its cookie, and short enough that a stolen cookie is of little use.
    Duration key_lifetime = std::chrono::seconds(120);
    /// Instances in one server share the secret and have different numbers. Each accepts the cookies of all others, and
    /// no two draw the same ephemeral keys.
    std::uint32_t number = 0;
  };
  /// A Hello whose sender has proved that it owns its address and, in suite 1, its key.
  struct Guest {
    Hello hello;
    ClientRandom random;                  ///< an equal random means that the Hello was resent: repeat the answer
    std::uint32_t version;                ///< highest version that both support; 0 = none: refuse, and send our range
    std::optional<Suite> suite{};         ///< suite of the Data datagrams; empty = none in common: refuse
    const ClientKey* key = nullptr;       ///< null in suite 0
    std::optional<NoiseResponder> noise;  ///< set with a key
  };
  struct Reply {
    std::size_t size = 0;  ///< number of bytes of `answer` to send back; 0 = send nothing
    std::optional<Guest> guest;
  };
  struct Answered {
    std::size_t size = 0;             ///< size of the Answer; 0 = send nothing
    std::optional<SessionKeys> keys;  ///< set if the guest has a key and is admitted
  };
  /// Counts the Hellos that did not lead to a Guest, by reason.
  struct Stats {
    std::uint64_t retries = 0;      ///< no valid cookie: a Retry was sent
    std::uint64_t malformed = 0;    ///< not a well-formed Hello
    std::uint64_t plain = 0;        ///< suite 0 from another host
    std::uint64_t limited = 0;      ///< too many from one source
    std::uint64_t unknown_key = 0;  ///< the key id belongs to no client
    std::uint64_t forged = 0;       ///< not sealed with the key that it names

    Stats& operator+=(const Stats& more) noexcept;
  };

  /// Throws std::invalid_argument if `key_lifetime` is not positive, the version range is empty, two clients have the
  /// same key, or this processor does not support one of the suites. Throws std::runtime_error if libsodium cannot be
  /// initialized.
  explicit Doorman(const Config& config);
  // A Guest points into `keys_`.
  Doorman(const Doorman&) = delete;
  Doorman& operator=(const Doorman&) = delete;

  /// Handles a datagram of type Hello. Writes a Retry into `answer` or returns a guest.
  Reply receive(LocalTime now, const Address& from, std::span<const std::byte> datagram,
                std::span<std::byte, kMaxDatagram> answer);

  /// Writes the Answer that admits or refuses the guest. Both are shorter than a Hello. With a key, every call draws
  /// new session keys and writes different bytes, so keep the bytes for when the same Hello is resent. A Welcome in
  /// suite 2 names kFeatureAesGcm, which is added here. The guest must have a `suite` to be welcomed.
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

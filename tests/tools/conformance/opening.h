// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>
#include <string_view>
#include <vector>

#include "protocol/secrets/crypto.h"
#include "protocol/secrets/noise.h"
#include "tests/tools/conformance/datagram.h"

// The handshake of WIRE.md: construction and validation of Hello and Answer.

namespace tendon::conformance {

struct Options {
  std::optional<Key> key{};  ///< suite 1 if set
  bool aes = false;          ///< with a key: offers and selects suite 2 for Data
  bool loopback = true;
  bool long_checks = false;           ///< also waits until the peer renews its key
  std::chrono::seconds key_age{600};  ///< maximum age at which the peer renews its key
  bool follower = false;  ///< device 0 of the server is a follower that matches the kit (server_coupling_checks.h)
  std::uint8_t suite() const noexcept { return key ? 1 : 0; }  ///< of the handshake
};

inline constexpr std::string_view kAesGcm = "aes-256-gcm";
template <class Words>
bool names_aes(const Words& words) {
  return std::ranges::count(words.features(), kAesGcm) > 0;
}

Bytes key_id(const Key& key);
Bytes prologue(const Key& key, const Sixteen& random);

/// A parsed Answer. In suite 1 with the resulting keys and the suite of the following Data.
struct Answered {
  Head head;
  Bytes datagram;
  pb::Answer body;
  std::uint8_t suite = 0;
  Key client_to_server{};
  Key server_to_client{};
};

class Attempt {
 public:
  /// All of its randomness is `random` and `ephemeral`.
  Attempt(const std::optional<Key>& key, Span hello, const Sixteen& random, const Key& ephemeral);
  Bytes hello(const Sixteen& cookie) const { return conformance::hello(suite_, random_, cookie, body_); }
  const Sixteen& random() const noexcept { return random_; }
  const Bytes& body() const noexcept { return body_; }
  std::optional<Answered> read(Span datagram) const;

 private:
  std::uint8_t suite_;
  Sixteen random_;
  Bytes body_;
  std::optional<NoiseInitiator> noise_;
};

struct Greeting {
  Bytes datagram;
  Sixteen random{};
  Sixteen cookie{};
  pb::Hello hello;
  std::optional<NoiseResponder> noise;  ///< in suite 1
};
/// Why a datagram is not a valid Hello of this suite: the violated check, the observation and the expectation.
struct Flaw {
  std::string_view check;
  std::string seen;
  std::string expected;
};
/// Parses a datagram of type 1 and appends its errors to `flaws`.
std::optional<Greeting> read_greeting(Span datagram, const Options& options, std::vector<Flaw>& flaws);

/// Sealed in suite 1 with a fresh ephemeral key.
Answered answer_to(const Greeting& greeting, std::uint32_t connection_id, const pb::Answer& body, const Key& ephemeral);

/// `aes`: selects suite 2 if it is offered.
pb::Answer welcome_to(const pb::Hello& hello, std::uint32_t version, bool aes = false);

}  // namespace tendon::conformance

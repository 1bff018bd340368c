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

// The handshake of WIRE.md, by hand: what a client and a server put into Hello and Answer.

namespace tendon::conformance {

/// How a peer is judged.
struct Options {
  std::optional<Key> key{};           ///< suite 1 when set
  bool aes = false;                   ///< with a key: suite 2 is offered, and chosen, so that Data are of it
  bool loopback = true;               ///< the peer is on this machine
  bool long_checks = false;           ///< includes the check that waits until the peer renews its key
  std::chrono::seconds key_age{600};  ///< the peer renews its key at this age at the latest
  bool follower = false;  ///< a server's device 0 is a follower that fits the kit (server_coupling_checks.h)
  std::uint8_t suite() const noexcept { return key ? 1 : 0; }  ///< of the handshake
};

/// The feature by which suite 2 is offered and chosen.
inline constexpr std::string_view kAesGcm = "aes-256-gcm";
template <class Words>
bool names_aes(const Words& words) {
  return std::ranges::count(words.features(), kAesGcm) > 0;
}

Bytes key_id(const Key& key);
Bytes prologue(const Key& key, const Sixteen& random);

/// An Answer that was read: of suite 1, with the keys it brings, and the suite of the Data that follow.
struct Answered {
  Head head;
  Bytes datagram;
  pb::Answer body;
  std::uint8_t suite = 0;
  Key client_to_server{};
  Key server_to_client{};
};

/// One attempt of a client: client random, ephemeral key, body.
class Attempt {
 public:
  /// Numbers from `random` are all the randomness there is.
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

/// A Hello that was read.
struct Greeting {
  Bytes datagram;
  Sixteen random{};
  Sixteen cookie{};
  pb::Hello hello;
  std::optional<NoiseResponder> noise;  ///< in suite 1
};
/// Why `datagram` is no correct Hello of this suite: the broken check, what was seen, what was expected.
struct Flaw {
  std::string_view check;
  std::string seen;
  std::string expected;
};
/// Reads a datagram of type 1; `flaws` gets what is wrong with it.
std::optional<Greeting> read_greeting(Span datagram, const Options& options, std::vector<Flaw>& flaws);

/// The bytes of an Answer to `greeting`, sealed in suite 1 with a fresh ephemeral key.
Answered answer_to(const Greeting& greeting, std::uint32_t connection_id, const pb::Answer& body, const Key& ephemeral);

/// `aes`: suite 2 is chosen where it is offered.
pb::Answer welcome_to(const pb::Hello& hello, std::uint32_t version, bool aes = false);

}  // namespace tendon::conformance

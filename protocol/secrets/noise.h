// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "protocol/secrets/crypto.h"

// The handshake of suites 1 and 2, Noise_NNpsk0_25519_ChaChaPoly_SHA256 (Noise rev. 34), without I/O or randomness:
//
//     -> psk, e
//     <- e, ee
//
// Both peers know the pre-shared key. Each contributes an ephemeral key, which must be used for one handshake only.

namespace tendon {

/// The result of a handshake, equal for both peers.
struct NoiseSplit {
  Key initiator_to_responder;
  Key responder_to_initiator;
  Bytes32 handshake_hash{};  ///< hash of both messages
};

/// The SymmetricState of the specification.
struct NoiseState {
  Bytes32 hash{};
  Key chaining_key;
  Key key;
};

/// Derives the keys of suite 2: HMAC-SHA-256(key, "tendon-suite-2" ‖ handshake hash) for each key. No key is therefore
/// used with two ciphers. The hash covers Hello and Answer, so two peers that saw different offers or choices derive
/// different keys.
NoiseSplit split_of_suite_2(const NoiseSplit& split) noexcept;

inline constexpr std::size_t kNoisePublicSize = 32;
/// Difference in size between a message and its payload, in bytes.
inline constexpr std::size_t kNoiseOverhead = kNoisePublicSize + crypto::kTagSize;

/// The client's half of the handshake.
class NoiseInitiator {
 public:
  /// Writes message 1. Each object writes one message only: a second payload under the same ephemeral key would reuse a
  /// nonce.
  NoiseInitiator(const Key& psk, const Key& ephemeral, std::span<const std::byte> prologue,
                 std::span<const std::byte> payload);

  const std::vector<std::byte>& message() const noexcept { return message_; }

  struct Answer {
    std::vector<std::byte> payload;
    NoiseSplit split;
  };
  /// Reads message 2. Returns nullopt if it is not authentic, after which another message may be read.
  std::optional<Answer> read(std::span<const std::byte> message) const;

 private:
  Key ephemeral_;
  NoiseState state_;
  std::vector<std::byte> message_;
};

/// The server's half of the handshake, after message 1 was read.
class NoiseResponder {
 public:
  /// Returns nullopt if message 1 was not written with this `psk` and `prologue`.
  static std::optional<NoiseResponder> read(const Key& psk, std::span<const std::byte> prologue,
                                            std::span<const std::byte> message);

  const std::vector<std::byte>& payload() const noexcept { return payload_; }

  struct Reply {
    std::vector<std::byte> message;
    NoiseSplit split;
  };
  /// Writes message 2. Returns nullopt if the peer's ephemeral key has low order. Use each `ephemeral` only once.
  std::optional<Reply> reply(const Key& ephemeral, std::span<const std::byte> payload) const;

 private:
  NoiseResponder() = default;

  NoiseState state_;
  Bytes32 peer_{};  ///< ephemeral public key of the peer
  std::vector<std::byte> payload_;
};

}  // namespace tendon

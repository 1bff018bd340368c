// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "protocol/secrets/crypto.h"

// Noise_NNpsk0_25519_ChaChaPoly_SHA256 (Noise rev. 34), the handshake of suite 1, as values:
//
//     -> psk, e
//     <- e, ee
//
// Both ends know the pre-shared key. Each brings an ephemeral key, drawn for this handshake and never used again.
// Sans-I/O, no randomness.

namespace tendon {

/// The result of a handshake, the same at both ends.
struct NoiseSplit {
  Key initiator_to_responder;
  Key responder_to_initiator;
  Bytes32 handshake_hash{};  ///< over both messages
};

/// The SymmetricState of the specification: all that was mixed so far.
struct NoiseState {
  Bytes32 hash{};
  Key chaining_key;
  Key key;
};

/// The keys of suite 2 from those of a handshake: each HMAC-SHA-256(key, "tendon-suite-2" ‖ handshake hash). So no key
/// serves two ciphers; and because the hash is over Hello and Answer, two ends that saw another offer or another choice
/// have no key in common.
NoiseSplit split_of_suite_2(const NoiseSplit& split) noexcept;

inline constexpr std::size_t kNoisePublicSize = 32;
/// A message is this many bytes longer than its payload.
inline constexpr std::size_t kNoiseOverhead = kNoisePublicSize + crypto::kTagSize;

/// The client's end.
class NoiseInitiator {
 public:
  /// Writes message 1. An object writes only one message: a second payload under the same ephemeral key would use a
  /// nonce twice.
  NoiseInitiator(const Key& psk, const Key& ephemeral, std::span<const std::byte> prologue,
                 std::span<const std::byte> payload);

  const std::vector<std::byte>& message() const noexcept { return message_; }

  struct Answer {
    std::vector<std::byte> payload;
    NoiseSplit split;
  };
  /// Reads message 2. Empty when it is not authentic; another message may still be read afterwards.
  std::optional<Answer> read(std::span<const std::byte> message) const;

 private:
  Key ephemeral_;
  NoiseState state_;
  std::vector<std::byte> message_;
};

/// The server's end, after message 1 has been read.
class NoiseResponder {
 public:
  /// Empty when message 1 was not written with this `psk` and `prologue`.
  static std::optional<NoiseResponder> read(const Key& psk, std::span<const std::byte> prologue,
                                            std::span<const std::byte> message);

  const std::vector<std::byte>& payload() const noexcept { return payload_; }

  struct Reply {
    std::vector<std::byte> message;
    NoiseSplit split;
  };
  /// Writes message 2. Empty when the peer's ephemeral key is of low order. Use each `ephemeral` only once.
  std::optional<Reply> reply(const Key& ephemeral, std::span<const std::byte> payload) const;

 private:
  NoiseResponder() = default;

  NoiseState state_;
  Bytes32 peer_{};  ///< its ephemeral public key
  std::vector<std::byte> payload_;
};

}  // namespace tendon

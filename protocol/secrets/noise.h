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
// Both ends know the pre-shared key; each brings an ephemeral key of its own, drawn for this handshake
// and never used again. Sans-I/O, no randomness.

namespace tendon {

/// What a handshake ends with, the same at both ends.
struct NoiseSplit {
  Key initiator_to_responder;
  Key responder_to_initiator;
  Bytes32 handshake_hash{};  ///< of all that was said
};

/// What both ends have mixed so far: the SymmetricState of the specification.
struct NoiseState {
  Bytes32 hash{};
  Key chaining_key;
  Key key;
};

inline constexpr std::size_t kNoisePublicSize = 32;
/// Bytes of a message beyond those of its payload.
inline constexpr std::size_t kNoiseOverhead = kNoisePublicSize + crypto::kTagSize;

/// The client's end.
class NoiseInitiator {
 public:
  /// Writes message 1. One object, one message: a second payload under this ephemeral key would use a
  /// nonce twice.
  NoiseInitiator(const Key& psk, const Key& ephemeral, std::span<const std::byte> prologue,
                 std::span<const std::byte> payload);

  const std::vector<std::byte>& message() const noexcept { return message_; }

  struct Answer {
    std::vector<std::byte> payload;
    NoiseSplit split;
  };
  /// Reads message 2. Empty when it is not authentic; a later one may be.
  std::optional<Answer> read(std::span<const std::byte> message) const;

 private:
  Key ephemeral_;
  NoiseState state_;
  std::vector<std::byte> message_;
};

/// The server's end: message 1, read.
class NoiseResponder {
 public:
  /// Empty when message 1 is not authentic, that is not written with this `psk` and `prologue`.
  static std::optional<NoiseResponder> read(const Key& psk, std::span<const std::byte> prologue,
                                            std::span<const std::byte> message);

  const std::vector<std::byte>& payload() const noexcept { return payload_; }

  struct Reply {
    std::vector<std::byte> message;
    NoiseSplit split;
  };
  /// Writes message 2. Empty when the peer's ephemeral key is of low order. Once per `ephemeral`.
  std::optional<Reply> reply(const Key& ephemeral, std::span<const std::byte> payload) const;

 private:
  NoiseResponder() = default;

  NoiseState state_;
  Bytes32 peer_{};  ///< its ephemeral public key
  std::vector<std::byte> payload_;
};

}  // namespace tendon

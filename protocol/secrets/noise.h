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
// Both peers know the pre-shared key, and both use a new ephemeral key for each handshake.

namespace tendon {

struct NoiseSplit {
  Key initiator_to_responder;
  Key responder_to_initiator;
  Bytes32 handshake_hash{};
};

/// SymmetricState in the specification.
struct NoiseState {
  Bytes32 hash{};
  Key chaining_key;
  Key key;
};

/// Returns HMAC-SHA-256(key, "tendon-suite-2" ‖ handshake hash) for each key, so that keys are never used with two
/// ciphers. The hash includes Hello and Answer, so peers that received different offers or choices do not share keys.
NoiseSplit split_of_suite_2(const NoiseSplit& split) noexcept;

inline constexpr std::size_t kNoisePublicSize = 32;
inline constexpr std::size_t kNoiseOverhead = kNoisePublicSize + crypto::kTagSize;

/// The client's half.
class NoiseInitiator {
 public:
  /// Writes message 1. A second payload must not be written, because it would use the same nonce.
  NoiseInitiator(const Key& psk, const Key& ephemeral, std::span<const std::byte> prologue,
                 std::span<const std::byte> payload);

  const std::vector<std::byte>& message() const noexcept { return message_; }

  struct Answer {
    std::vector<std::byte> payload;
    NoiseSplit split;
  };
  /// Reads message 2. Can be called again if this message was not authentic.
  std::optional<Answer> read(std::span<const std::byte> message) const;

 private:
  Key ephemeral_;
  NoiseState state_;
  std::vector<std::byte> message_;
};

/// The server's half, after reading message 1.
class NoiseResponder {
 public:
  /// Returns nullopt if message 1 was written using another `psk` or `prologue`.
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
  Bytes32 peer_{};
  std::vector<std::byte> payload_;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

// The few primitives that suite 1 is made of, as functions of bytes: SHA-256, HMAC-SHA-256 (RFC 4231),
// X25519 (RFC 7748) and ChaCha20-Poly1305 (RFC 8439). crypto.cc is the only file that knows libsodium.

namespace tendon {

using Bytes32 = std::array<std::byte, 32>;

/// 32 secret bytes. They are wiped when they go out of scope.
class Key {
 public:
  Key() = default;
  explicit Key(const Bytes32& bytes) noexcept : bytes_(bytes) {}
  Key(const Key&) = default;
  Key& operator=(const Key&) = default;
  ~Key();

  const Bytes32& bytes() const noexcept { return bytes_; }
  Bytes32& bytes() noexcept { return bytes_; }

 private:
  Bytes32 bytes_{};
};

namespace crypto {

/// What is hashed or authenticated, piece by piece, as if it were in one place.
using Pieces = std::initializer_list<std::span<const std::byte>>;

/// Chooses the fastest implementation for this machine. Called by whoever is constructed first; throws
/// std::runtime_error when libsodium cannot start.
void start();

Bytes32 sha256(Pieces message) noexcept;
Bytes32 hmac_sha256(std::span<const std::byte> key, Pieces message) noexcept;

Bytes32 x25519_public(const Key& secret) noexcept;
/// False when the point is of low order: the shared secret would be one that everybody knows.
bool x25519(const Key& secret, const Bytes32& point, Key& shared) noexcept;

inline constexpr std::size_t kTagSize = 16;

/// ChaCha20-Poly1305 with the nonce of Noise, 4 zeros and `number` as 8 bytes LE. `sealed` holds
/// kTagSize bytes more than `text`; the two may begin at the same place.
void seal(const Key& key, std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
          std::span<std::byte> sealed) noexcept;
/// False, and nothing of use in `text`, when `sealed` is not authentic. `text` holds kTagSize bytes less.
bool open(const Key& key, std::uint64_t number, std::span<const std::byte> associated,
          std::span<const std::byte> sealed, std::span<std::byte> text) noexcept;

/// REKEY(key) of Noise: the next key, from which this one cannot be found again.
Key renewed(const Key& key) noexcept;

/// In constant time: how much of a guess was right does not show. False when the sizes differ.
bool equal(std::span<const std::byte> a, std::span<const std::byte> b) noexcept;

/// SipHash-2-4: spreads what strangers choose over a table, in a way they cannot foresee.
std::uint64_t short_hash(const std::array<std::byte, 16>& key, std::span<const std::byte> message) noexcept;

}  // namespace crypto

/// Where a Ratchet begins: 32 bytes from the system, or a number, for simulated worlds and tests.
struct Seed {
  Seed() = default;
  Seed(std::uint64_t number) noexcept;  // NOLINT(google-explicit-constructor)
  explicit Seed(const Bytes32& random) noexcept : bytes(random) {}

  Bytes32 bytes{};
};

/// Secrets from one seed: each call gives 32 bytes and forgets how (fast key erasure: a block of
/// ChaCha20 is half the next state, half the output), so that whoever reads this memory later learns
/// none of the keys it gave before. It is as random as its seed.
class Ratchet {
 public:
  explicit Ratchet(const Seed& seed) noexcept : state_(seed.bytes) {}
  Key next() noexcept;

 private:
  Key state_;
};

}  // namespace tendon

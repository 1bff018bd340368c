// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

// Cryptographic primitives of suites 1 and 2: SHA-256, HMAC-SHA-256 (RFC 4231), X25519 (RFC 7748), ChaCha20-Poly1305
// (RFC 8439) and AES-256-GCM (NIST SP 800-38D). Only crypto.cc uses libsodium.

namespace tendon {

using Bytes32 = std::array<std::byte, 32>;

/// 32 secret bytes, which are erased by the destructor.
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

using Pieces = std::initializer_list<std::span<const std::byte>>;  ///< used as if concatenated

/// Initializes libsodium and its fastest implementation, once. Throws std::runtime_error on failure.
void start();

Bytes32 sha256(Pieces message) noexcept;
Bytes32 hmac_sha256(std::span<const std::byte> key, Pieces message) noexcept;

Bytes32 x25519_public(const Key& secret) noexcept;
/// Returns false if `point` has low order, because the shared secret would be public.
bool x25519(const Key& secret, const Bytes32& point, Key& shared) noexcept;

inline constexpr std::size_t kTagSize = 16;

/// Encrypts using ChaCha20-Poly1305 with the nonce of Noise: 4 zero bytes and `number` as 8 bytes LE. `sealed` must be
/// kTagSize bytes longer than `text`, and can start at the same address.
void seal(const Key& key, std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
          std::span<std::byte> sealed) noexcept;
/// The inverse of seal(). Returns false if `sealed` is not authentic, and leaves `text` unspecified.
bool open(const Key& key, std::uint64_t number, std::span<const std::byte> associated,
          std::span<const std::byte> sealed, std::span<std::byte> text) noexcept;

Key renewed(const Key& key) noexcept;  ///< REKEY(key) of Noise; the old key cannot be computed from it

/// Returns true if this processor supports AES-256-GCM (AES-NI, CLMUL). Initializes libsodium, which does not provide a
/// software implementation because it would be slow or vulnerable to timing attacks.
bool has_aes() noexcept;

/// AES-256-GCM with a precomputed key schedule. Requires has_aes().
class AesGcm {
 public:
  explicit AesGcm(const Key& key) noexcept;
  AesGcm(const AesGcm&) = default;
  AesGcm& operator=(const AesGcm&) = default;
  ~AesGcm();

  /// Uses the nonce that Noise defines for AESGCM: 4 zero bytes and `number` as 8 bytes **BE**.
  void seal(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
            std::span<std::byte> sealed) const noexcept;
  bool open(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> sealed,
            std::span<std::byte> text) const noexcept;
  Key renewed() const noexcept;

 private:
  alignas(16) std::array<std::byte, 512> schedule_;
};

/// Compares in constant time. Returns false if the sizes differ.
bool equal(std::span<const std::byte> a, std::span<const std::byte> b) noexcept;

/// SipHash-2-4. Untrusted parties cannot predict collisions if they do not know `key`.
std::uint64_t short_hash(const std::array<std::byte, 16>& key, std::span<const std::byte> message) noexcept;

}  // namespace crypto

/// 32 random bytes from the system, or a number used in simulations and tests.
struct Seed {
  Seed() = default;
  Seed(std::uint64_t number) noexcept;  // NOLINT(google-explicit-constructor)
  explicit Seed(const Bytes32& random) noexcept : bytes(random) {}

  Bytes32 bytes{};
};

/// Generates a sequence of secrets from a seed. Each call erases the previous state (fast key erasure: half a block of
/// ChaCha20 is the next state, the other half is the output), so that earlier keys cannot be recovered from memory.
class Ratchet {
 public:
  explicit Ratchet(const Seed& seed) noexcept : state_(seed.bytes) {}
  Key next() noexcept;

 private:
  Key state_;
};

}  // namespace tendon

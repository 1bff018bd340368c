// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

// The cryptographic primitives of suites 1 and 2: SHA-256, HMAC-SHA-256 (RFC 4231), X25519 (RFC 7748),
// ChaCha20-Poly1305 (RFC 8439) and AES-256-GCM (NIST SP 800-38D). Only crypto.cc uses libsodium.

namespace tendon {

using Bytes32 = std::array<std::byte, 32>;

/// 32 secret bytes that the destructor erases.
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

/// The parts of a message, hashed or authenticated as if they were concatenated.
using Pieces = std::initializer_list<std::span<const std::byte>>;

/// Initializes libsodium, which selects the fastest implementation for this machine. It may be called repeatedly, and
/// every constructor that needs it does so. Throws std::runtime_error if libsodium cannot be initialized.
void start();

Bytes32 sha256(Pieces message) noexcept;
Bytes32 hmac_sha256(std::span<const std::byte> key, Pieces message) noexcept;

Bytes32 x25519_public(const Key& secret) noexcept;
/// Returns false if `point` has low order, in which case the shared secret would be public.
bool x25519(const Key& secret, const Bytes32& point, Key& shared) noexcept;

inline constexpr std::size_t kTagSize = 16;

/// Encrypts with ChaCha20-Poly1305. The nonce is that of Noise: 4 zero bytes and `number` as 8 bytes LE. `sealed` is
/// kTagSize bytes longer than `text`; the two may begin at the same address.
void seal(const Key& key, std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
          std::span<std::byte> sealed) noexcept;
/// The inverse of seal(). `text` is kTagSize bytes shorter than `sealed`. Returns false if `sealed` is not authentic;
/// the contents of `text` are then unspecified.
bool open(const Key& key, std::uint64_t number, std::span<const std::byte> associated,
          std::span<const std::byte> sealed, std::span<std::byte> text) noexcept;

/// REKEY(key) of Noise: returns the next key, from which the present one cannot be computed.
Key renewed(const Key& key) noexcept;

/// Returns true if this processor has the instructions required for AES-256-GCM (AES-NI, CLMUL). libsodium has no
/// software implementation, because it would be slow or leak the key through timing. Initializes libsodium.
bool has_aes() noexcept;

/// AES-256-GCM with a precomputed key schedule. Construct it only if has_aes() is true.
class AesGcm {
 public:
  explicit AesGcm(const Key& key) noexcept;
  AesGcm(const AesGcm&) = default;
  AesGcm& operator=(const AesGcm&) = default;
  ~AesGcm();

  /// Like the functions above, but with the nonce that Noise defines for AESGCM: 4 zero bytes and `number` as 8 bytes
  /// **BE**.
  void seal(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
            std::span<std::byte> sealed) const noexcept;
  bool open(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> sealed,
            std::span<std::byte> text) const noexcept;
  Key renewed() const noexcept;

 private:
  alignas(16) std::array<std::byte, 512> schedule_;
};

/// Compares in constant time, so that the duration does not reveal how much of a guess is right. Returns false if the
/// sizes differ.
bool equal(std::span<const std::byte> a, std::span<const std::byte> b) noexcept;

/// SipHash-2-4, for hash tables with untrusted keys: collisions cannot be predicted without `key`.
std::uint64_t short_hash(const std::array<std::byte, 16>& key, std::span<const std::byte> message) noexcept;

}  // namespace crypto

/// The initial state of a Ratchet: 32 random bytes from the system, or a number in simulations and tests.
struct Seed {
  Seed() = default;
  Seed(std::uint64_t number) noexcept;  // NOLINT(google-explicit-constructor)
  explicit Seed(const Bytes32& random) noexcept : bytes(random) {}

  Bytes32 bytes{};
};

/// Generates a sequence of secrets from a seed. Each call returns 32 bytes and erases the state that produced them
/// (fast key erasure: half a block of ChaCha20 is the next state, the other half the output). Anyone who reads this
/// memory later cannot recover earlier keys.
class Ratchet {
 public:
  explicit Ratchet(const Seed& seed) noexcept : state_(seed.bytes) {}
  Key next() noexcept;

 private:
  Key state_;
};

}  // namespace tendon

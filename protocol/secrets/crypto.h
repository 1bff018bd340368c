// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

// The few primitives of suites 1 and 2, as functions of bytes: SHA-256, HMAC-SHA-256 (RFC 4231), X25519 (RFC 7748),
// ChaCha20-Poly1305 (RFC 8439) and AES-256-GCM (NIST SP 800-38D). crypto.cc is the only file that knows libsodium.

namespace tendon {

using Bytes32 = std::array<std::byte, 32>;

/// 32 secret bytes, wiped by the destructor.
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

/// The pieces of a message, in order; hashed or authenticated as if they were one.
using Pieces = std::initializer_list<std::span<const std::byte>>;

/// Starts libsodium, which chooses the fastest implementation for this machine. May be called again; every constructor
/// that needs it does. Throws std::runtime_error when libsodium cannot start.
void start();

Bytes32 sha256(Pieces message) noexcept;
Bytes32 hmac_sha256(std::span<const std::byte> key, Pieces message) noexcept;

Bytes32 x25519_public(const Key& secret) noexcept;
/// False when the point is of low order: everybody would know the shared secret.
bool x25519(const Key& secret, const Bytes32& point, Key& shared) noexcept;

inline constexpr std::size_t kTagSize = 16;

/// ChaCha20-Poly1305 with the nonce of Noise: 4 zeros and `number` as 8 bytes LE. `sealed` is kTagSize bytes longer
/// than `text`; the two may begin at the same address.
void seal(const Key& key, std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
          std::span<std::byte> sealed) noexcept;
/// The inverse of seal(); `text` is kTagSize bytes shorter than `sealed`. False when `sealed` is not authentic: `text`
/// then holds nothing of use.
bool open(const Key& key, std::uint64_t number, std::span<const std::byte> associated,
          std::span<const std::byte> sealed, std::span<std::byte> text) noexcept;

/// REKEY(key) of Noise: the next key. The present one cannot be computed from it.
Key renewed(const Key& key) noexcept;

/// Whether this processor has the instructions that AES-256-GCM takes here (AES-NI, CLMUL). In software AES is slow, or
/// its time tells of the key, so libsodium has none. Starts libsodium.
bool has_aes() noexcept;

/// AES-256-GCM under one key, whose schedule is computed once. Not to be made where has_aes() is false.
class AesGcm {
 public:
  explicit AesGcm(const Key& key) noexcept;
  AesGcm(const AesGcm&) = default;
  AesGcm& operator=(const AesGcm&) = default;
  ~AesGcm();

  /// As the functions above, with the nonce that Noise gives to AESGCM: 4 zeros and `number` as 8 bytes **BE**.
  void seal(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
            std::span<std::byte> sealed) const noexcept;
  bool open(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> sealed,
            std::span<std::byte> text) const noexcept;
  Key renewed() const noexcept;

 private:
  alignas(16) std::array<std::byte, 512> schedule_;
};

/// Compares in constant time, so the time taken does not show how much of a guess was right. False when the sizes
/// differ.
bool equal(std::span<const std::byte> a, std::span<const std::byte> b) noexcept;

/// SipHash-2-4: spreads bytes that strangers choose over a table, in a way they cannot predict without `key`.
std::uint64_t short_hash(const std::array<std::byte, 16>& key, std::span<const std::byte> message) noexcept;

}  // namespace crypto

/// The initial state of a Ratchet: 32 random bytes from the system, or a number in simulated worlds and tests.
struct Seed {
  Seed() = default;
  Seed(std::uint64_t number) noexcept;  // NOLINT(google-explicit-constructor)
  explicit Seed(const Bytes32& random) noexcept : bytes(random) {}

  Bytes32 bytes{};
};

/// A sequence of secrets from one seed, as random as that seed. Each call returns 32 bytes and erases the state they
/// came from (fast key erasure: half a block of ChaCha20 is the next state, half is the output), so that reading this
/// memory later reveals none of the earlier keys.
class Ratchet {
 public:
  explicit Ratchet(const Seed& seed) noexcept : state_(seed.bytes) {}
  Key next() noexcept;

 private:
  Key state_;
};

}  // namespace tendon

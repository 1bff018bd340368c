// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/crypto.h"

#include <sodium.h>

#include <algorithm>
#include <stdexcept>

#include "core/base/bytes.h"
#include "protocol/secrets/blake2b.h"

namespace tendon {
namespace {

const unsigned char* in(std::span<const std::byte> bytes) noexcept {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}
unsigned char* out(std::span<std::byte> bytes) noexcept { return reinterpret_cast<unsigned char*>(bytes.data()); }

using Nonce = std::array<unsigned char, crypto_aead_chacha20poly1305_IETF_NPUBBYTES>;

Nonce nonce(std::uint64_t number) noexcept {
  Nonce nonce{};
  put_little_endian(number, reinterpret_cast<std::byte*>(nonce.data() + 4));
  return nonce;
}

/// In Noise, the number is big-endian for AESGCM.
Nonce nonce_of_aes(std::uint64_t number) noexcept {
  Nonce nonce{};
  for (std::size_t i = 0; i < sizeof number; ++i) nonce[4 + i] = static_cast<unsigned char>(number >> (56 - 8 * i));
  return nonce;
}

/// REKEY of Noise: encrypts 32 zero bytes using the number 2⁶⁴ − 1, which is never used for datagrams.
template <class Seal>
Key renewed_by(const Seal& seal) noexcept {
  constexpr Bytes32 kZeros{};
  std::array<std::byte, sizeof(Bytes32) + crypto::kTagSize> sealed;
  seal(~std::uint64_t{0}, kZeros, sealed);
  Key next;
  std::copy_n(sealed.begin(), sizeof(Bytes32), next.bytes().begin());
  sodium_memzero(sealed.data(), sealed.size());
  return next;
}

const crypto_aead_aes256gcm_state* schedule_of(const std::array<std::byte, 512>& bytes) noexcept {
  return reinterpret_cast<const crypto_aead_aes256gcm_state*>(bytes.data());
}

static_assert(sizeof(crypto_aead_aes256gcm_state) == 512 && alignof(crypto_aead_aes256gcm_state) <= 16);
static_assert(crypto_aead_aes256gcm_NPUBBYTES == sizeof(Nonce) && crypto_aead_aes256gcm_ABYTES == crypto::kTagSize);
static_assert(crypto_aead_aes256gcm_KEYBYTES == sizeof(Bytes32));
static_assert(crypto_hash_sha256_BYTES == sizeof(Bytes32) && crypto_auth_hmacsha256_BYTES == sizeof(Bytes32));
static_assert(crypto_generichash_blake2b_BYTES_MIN <= 16 && crypto_generichash_blake2b_BYTES_MAX >= sizeof(Bytes32));
static_assert(crypto_scalarmult_BYTES == sizeof(Bytes32) && crypto_scalarmult_SCALARBYTES == sizeof(Bytes32));
static_assert(crypto_aead_chacha20poly1305_IETF_KEYBYTES == sizeof(Bytes32));
static_assert(crypto_aead_chacha20poly1305_IETF_ABYTES == crypto::kTagSize);
static_assert(crypto_shorthash_KEYBYTES == 16 && crypto_shorthash_BYTES == sizeof(std::uint64_t));
static_assert(crypto_stream_chacha20_ietf_KEYBYTES == sizeof(Bytes32));

}  // namespace

Key::~Key() { sodium_memzero(bytes_.data(), bytes_.size()); }

namespace crypto {

void start() {
  if (sodium_init() < 0) throw std::runtime_error("cannot initialize libsodium");
}

Bytes32 sha256(Pieces message) noexcept {
  Bytes32 digest;
  crypto_hash_sha256_state state;
  crypto_hash_sha256_init(&state);
  for (const auto& piece : message) crypto_hash_sha256_update(&state, in(piece), piece.size());
  crypto_hash_sha256_final(&state, out(digest));
  return digest;
}

Bytes32 hmac_sha256(std::span<const std::byte> key, Pieces message) noexcept {
  Bytes32 tag;
  crypto_auth_hmacsha256_state state;
  crypto_auth_hmacsha256_init(&state, in(key), key.size());
  for (const auto& piece : message) crypto_auth_hmacsha256_update(&state, in(piece), piece.size());
  crypto_auth_hmacsha256_final(&state, out(tag));
  sodium_memzero(&state, sizeof state);
  return tag;
}

std::array<std::byte, 16> blake2b_128(std::span<const std::byte> message) noexcept {
  std::array<std::byte, 16> digest;
  crypto_generichash_blake2b(out(digest), digest.size(), in(message), message.size(), nullptr, 0);
  return digest;
}

Bytes32 blake2b_256(std::span<const std::byte> message) noexcept {
  Bytes32 digest;
  crypto_generichash_blake2b(out(digest), digest.size(), in(message), message.size(), nullptr, 0);
  return digest;
}

Bytes32 x25519_public(const Key& secret) noexcept {
  Bytes32 point;
  crypto_scalarmult_base(out(point), in(secret.bytes()));
  return point;
}

bool x25519(const Key& secret, const Bytes32& point, Key& shared) noexcept {
  return crypto_scalarmult(out(shared.bytes()), in(secret.bytes()), in(point)) == 0;
}

void seal(const Key& key, std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
          std::span<std::byte> sealed) noexcept {
  crypto_aead_chacha20poly1305_ietf_encrypt(out(sealed), nullptr, in(text), text.size(), in(associated),
                                            associated.size(), nullptr, nonce(number).data(), in(key.bytes()));
}

bool open(const Key& key, std::uint64_t number, std::span<const std::byte> associated,
          std::span<const std::byte> sealed, std::span<std::byte> text) noexcept {
  return crypto_aead_chacha20poly1305_ietf_decrypt(out(text), nullptr, nullptr, in(sealed), sealed.size(),
                                                   in(associated), associated.size(), nonce(number).data(),
                                                   in(key.bytes())) == 0;
}

Key renewed(const Key& key) noexcept {
  return renewed_by([&](std::uint64_t number, const Bytes32& zeros, std::span<std::byte> sealed) {
    seal(key, number, {}, zeros, sealed);
  });
}

bool has_aes() noexcept { return sodium_init() >= 0 && crypto_aead_aes256gcm_is_available() == 1; }

AesGcm::AesGcm(const Key& key) noexcept {
  crypto_aead_aes256gcm_beforenm(reinterpret_cast<crypto_aead_aes256gcm_state*>(schedule_.data()), in(key.bytes()));
}

AesGcm::~AesGcm() { sodium_memzero(schedule_.data(), schedule_.size()); }

void AesGcm::seal(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
                  std::span<std::byte> sealed) const noexcept {
  crypto_aead_aes256gcm_encrypt_afternm(out(sealed), nullptr, in(text), text.size(), in(associated), associated.size(),
                                        nullptr, nonce_of_aes(number).data(), schedule_of(schedule_));
}

bool AesGcm::open(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> sealed,
                  std::span<std::byte> text) const noexcept {
  return crypto_aead_aes256gcm_decrypt_afternm(out(text), nullptr, nullptr, in(sealed), sealed.size(), in(associated),
                                               associated.size(), nonce_of_aes(number).data(),
                                               schedule_of(schedule_)) == 0;
}

Key AesGcm::renewed() const noexcept {
  return renewed_by([this](std::uint64_t number, const Bytes32& zeros, std::span<std::byte> sealed) {
    seal(number, {}, zeros, sealed);
  });
}

bool equal(std::span<const std::byte> a, std::span<const std::byte> b) noexcept {
  return a.size() == b.size() && sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::uint64_t short_hash(const std::array<std::byte, 16>& key, std::span<const std::byte> message) noexcept {
  std::array<std::byte, sizeof(std::uint64_t)> hash;
  crypto_shorthash(out(hash), in(message), message.size(), in(key));
  return get_little_endian<std::uint64_t>(hash.data());
}

}  // namespace crypto

Seed::Seed(std::uint64_t number) noexcept { put_little_endian(number, bytes.data()); }

Key Ratchet::next() noexcept {
  std::array<std::byte, 2 * sizeof(Bytes32)> block;
  const Nonce zeros{};  // each key is used for one block only
  crypto_stream_chacha20_ietf(out(block), block.size(), zeros.data(), in(state_.bytes()));
  Key given;
  std::copy_n(block.begin(), sizeof(Bytes32), state_.bytes().begin());
  std::copy_n(block.begin() + sizeof(Bytes32), sizeof(Bytes32), given.bytes().begin());
  sodium_memzero(block.data(), block.size());
  return given;
}

}  // namespace tendon

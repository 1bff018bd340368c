// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/noise.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace tendon {
namespace {

constexpr std::string_view kName = "Noise_NNpsk0_25519_ChaChaPoly_SHA256";
constexpr std::string_view kSuite2 = "tendon-suite-2";

using Bytes = std::span<const std::byte>;

/// HKDF of Noise: each output is an HMAC-SHA-256 of the previous output and a counter byte.
template <std::size_t Count>
std::array<Key, Count> hkdf(const Key& chaining_key, Bytes material) noexcept {
  const Key secret(crypto::hmac_sha256(chaining_key.bytes(), {material}));
  std::array<Key, Count> keys;
  for (std::size_t i = 0; i < Count; ++i) {
    const std::array number = {static_cast<std::byte>(i + 1)};
    const Bytes before = i == 0 ? Bytes() : Bytes(keys[i - 1].bytes());
    keys[i].bytes() = crypto::hmac_sha256(secret.bytes(), {before, number});
  }
  return keys;
}

void mix_hash(NoiseState& state, Bytes data) noexcept { state.hash = crypto::sha256({state.hash, data}); }

void mix_key(NoiseState& state, Bytes material) noexcept {
  const auto keys = hkdf<2>(state.chaining_key, material);
  state.chaining_key = keys[0];
  state.key = keys[1];
}

void mix_key_and_hash(NoiseState& state, const Key& material) noexcept {
  const auto keys = hkdf<3>(state.chaining_key, material.bytes());
  state.chaining_key = keys[0];
  mix_hash(state, keys[1].bytes());
  state.key = keys[2];
}

/// Mixes the protocol name, the prologue and the token `psk`.
NoiseState begin(const Key& psk, Bytes prologue) noexcept {
  NoiseState state;
  state.hash = crypto::sha256({std::as_bytes(std::span(kName))});
  state.chaining_key = Key(state.hash);
  mix_hash(state, prologue);
  mix_key_and_hash(state, psk);
  return state;
}

/// Token `e`. In psk handshakes, the public key is also mixed into the chaining key.
void mix_ephemeral(NoiseState& state, const Bytes32& public_key) noexcept {
  mix_hash(state, public_key);
  mix_key(state, public_key);
}

/// Token `ee`.
bool mix_shared(NoiseState& state, const Key& ephemeral, const Bytes32& peer) noexcept {
  Key shared;
  if (!crypto::x25519(ephemeral, peer, shared)) return false;
  mix_key(state, shared.bytes());
  return true;
}

/// The nonce is always 0, because each key is used for a single payload.
std::vector<std::byte> write(NoiseState& state, const Bytes32& public_key, Bytes payload) {
  std::vector<std::byte> message(kNoiseOverhead + payload.size());
  const auto sealed = std::span(message).subspan(kNoisePublicSize);
  std::copy(public_key.begin(), public_key.end(), message.begin());
  crypto::seal(state.key, 0, state.hash, payload, sealed);
  mix_hash(state, sealed);
  return message;
}

std::optional<std::vector<std::byte>> read_payload(NoiseState& state, Bytes sealed) {
  std::vector<std::byte> payload(sealed.size() - crypto::kTagSize);
  if (!crypto::open(state.key, 0, state.hash, sealed, payload)) return std::nullopt;
  mix_hash(state, sealed);
  return payload;
}

Bytes32 public_key_of(Bytes message) noexcept {
  Bytes32 public_key;
  std::copy_n(message.begin(), public_key.size(), public_key.begin());
  return public_key;
}

NoiseSplit split(const NoiseState& state) noexcept {
  const auto keys = hkdf<2>(state.chaining_key, {});
  return {.initiator_to_responder = keys[0], .responder_to_initiator = keys[1], .handshake_hash = state.hash};
}

}  // namespace

NoiseSplit split_of_suite_2(const NoiseSplit& split) noexcept {
  const auto of_suite_2 = [&](const Key& key) {
    return Key(crypto::hmac_sha256(key.bytes(), {std::as_bytes(std::span(kSuite2)), split.handshake_hash}));
  };
  return {.initiator_to_responder = of_suite_2(split.initiator_to_responder),
          .responder_to_initiator = of_suite_2(split.responder_to_initiator),
          .handshake_hash = split.handshake_hash};
}

NoiseInitiator::NoiseInitiator(const Key& psk, const Key& ephemeral, Bytes prologue, Bytes payload)
    : ephemeral_(ephemeral), state_(begin(psk, prologue)) {
  const Bytes32 public_key = crypto::x25519_public(ephemeral);
  mix_ephemeral(state_, public_key);
  message_ = write(state_, public_key, payload);
}

std::optional<NoiseInitiator::Answer> NoiseInitiator::read(Bytes message) const {
  if (message.size() < kNoiseOverhead) return std::nullopt;
  NoiseState state = state_;
  const Bytes32 peer = public_key_of(message);
  mix_ephemeral(state, peer);
  if (!mix_shared(state, ephemeral_, peer)) return std::nullopt;
  auto payload = read_payload(state, message.subspan(kNoisePublicSize));
  if (!payload) return std::nullopt;
  return Answer{.payload = std::move(*payload), .split = split(state)};
}

std::optional<NoiseResponder> NoiseResponder::read(const Key& psk, Bytes prologue, Bytes message) {
  if (message.size() < kNoiseOverhead) return std::nullopt;
  NoiseResponder responder;
  responder.state_ = begin(psk, prologue);
  responder.peer_ = public_key_of(message);
  mix_ephemeral(responder.state_, responder.peer_);
  auto payload = read_payload(responder.state_, message.subspan(kNoisePublicSize));
  if (!payload) return std::nullopt;
  responder.payload_ = std::move(*payload);
  return responder;
}

std::optional<NoiseResponder::Reply> NoiseResponder::reply(const Key& ephemeral, Bytes payload) const {
  NoiseState state = state_;
  const Bytes32 public_key = crypto::x25519_public(ephemeral);
  mix_ephemeral(state, public_key);
  if (!mix_shared(state, ephemeral, peer_)) return std::nullopt;
  auto message = write(state, public_key, payload);
  return Reply{.message = std::move(message), .split = split(state)};
}

}  // namespace tendon

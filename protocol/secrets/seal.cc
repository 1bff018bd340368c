// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/seal.h"

namespace tendon {

SealingKey::SealingKey(Suite suite, const Key& key) noexcept : key_(key) {
  if (suite == Suite::kAesGcm) aes_.emplace(key);
}

void SealingKey::seal(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
                      std::span<std::byte> sealed) const noexcept {
  aes_ ? aes_->seal(number, associated, text, sealed) : crypto::seal(key_, number, associated, text, sealed);
}

bool SealingKey::open(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> sealed,
                      std::span<std::byte> text) const noexcept {
  return aes_ ? aes_->open(number, associated, sealed, text) : crypto::open(key_, number, associated, sealed, text);
}

SealingKey SealingKey::renewed() const noexcept {
  return aes_ ? SealingKey(Suite::kAesGcm, aes_->renewed()) : SealingKey(Suite::kNoise, crypto::renewed(key_));
}

Sealer::Sealer(const SealingKey& key, const Rekey& rekey, LocalTime opened) noexcept
    : rekey_(rekey), key_(key), since_(opened) {}

std::uint8_t Sealer::next_epoch(LocalTime now) noexcept {
  if (sealed_ >= rekey_.datagrams || now - since_ >= rekey_.age) {
    key_ = key_.renewed();
    ++epoch_;
    sealed_ = 0;
    since_ = now;
  }
  return epoch_;
}

std::size_t Sealer::seal(const Header& header, std::span<std::byte> buffer, std::size_t size) noexcept {
  const auto body = buffer.subspan(kHeaderSize, size - kHeaderSize);
  const auto sealed = buffer.subspan(kHeaderSize, body.size() + crypto::kTagSize);
  key_.seal(header.packet_number, buffer.first(kHeaderSize), body, sealed);
  ++sealed_;
  return size + crypto::kTagSize;
}

Opener::Opener(const SealingKey& key, const Rekey& rekey) noexcept
    : rekey_(rekey), present_(key), next_(key.renewed()) {}

Opener::Verdict Opener::open(LocalTime now, const Header& header, std::span<const std::byte> datagram,
                             std::span<std::byte> body) noexcept {
  if (datagram.size() < kHeaderSize + crypto::kTagSize) return Verdict::kForged;
  if (previous_ && now - moved_on_ >= rekey_.overlap) previous_.reset();

  const auto ahead = static_cast<std::uint8_t>(header.epoch - epoch_);
  const SealingKey* const key = ahead == 0                   ? &present_
                                : ahead == 1                 ? &next_
                                : ahead == 0xFF && previous_ ? &*previous_
                                                             : nullptr;
  if (key == nullptr) return Verdict::kOldKey;
  const auto associated = datagram.first(kHeaderSize);
  const auto sealed = datagram.subspan(kHeaderSize);
  if (!key->open(header.packet_number, associated, sealed, body.first(sealed.size() - crypto::kTagSize))) {
    return Verdict::kForged;
  }
  if (ahead == 1) {
    ++epoch_;
    previous_ = present_;
    present_ = next_;
    next_ = next_.renewed();
    moved_on_ = now;
  }
  return Verdict::kOpened;
}

}  // namespace tendon

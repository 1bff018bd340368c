// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/base/time.h"
#include "protocol/secrets/crypto.h"
#include "protocol/wire/header.h"

namespace tendon {

struct SessionKeys {
  Key send;
  Key receive;
  Suite suite = Suite::kNoise;
};

/// When to renew keys. The receiver follows the epoch in the header.
struct Rekey {
  /// At most kMaxDatagramsOfKey. 17 min at 1 kHz, because a compromised key should only reveal a few minutes.
  std::uint64_t datagrams = std::uint64_t{1} << 20;
  Duration age = std::chrono::minutes(10);
  Duration overlap = std::chrono::seconds(2);  ///< how long the previous key is accepted
};

/// The key of a direction and an epoch, with precomputed data. Suite 2 requires crypto::has_aes().
class SealingKey {
 public:
  SealingKey(Suite suite, const Key& key) noexcept;

  void seal(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
            std::span<std::byte> sealed) const noexcept;
  bool open(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> sealed,
            std::span<std::byte> text) const noexcept;
  SealingKey renewed() const noexcept;

 private:
  Key key_;
  std::optional<crypto::AesGcm> aes_;
};

class Sealer {
 public:
  Sealer(const SealingKey& key, const Rekey& rekey, LocalTime opened) noexcept;

  /// Returns the epoch of the next datagram after renewing the key if necessary.
  std::uint8_t next_epoch(LocalTime now) noexcept;

  /// Encrypts the bytes after the header in place. Returns `size` + crypto::kTagSize. Call once for each packet number.
  std::size_t seal(const Header& header, std::span<std::byte> buffer, std::size_t size) noexcept;

 private:
  Rekey rekey_;
  SealingKey key_;
  std::uint8_t epoch_ = 0;
  std::uint64_t sealed_ = 0;  ///< using the current key
  LocalTime since_;
};

class Opener {
 public:
  Opener(const SealingKey& key, const Rekey& rekey) noexcept;

  enum class Verdict : std::uint8_t {
    kOpened,
    kForged,  ///< not authentic, or damaged in transit
    kOldKey,  ///< key expired or not yet known
  };
  /// Decrypts the bytes after the header into `body`, which must be large enough. If the datagram belongs to the next
  /// epoch and is authentic, this becomes the current epoch.
  Verdict open(LocalTime now, const Header& header, std::span<const std::byte> datagram,
               std::span<std::byte> body) noexcept;

 private:
  Rekey rekey_;
  std::uint8_t epoch_ = 0;
  std::optional<SealingKey> previous_;
  SealingKey present_;
  SealingKey next_;
  LocalTime moved_on_{};
};

}  // namespace tendon

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

/// The keys of one sealed conversation: those with which this end sends and receives, and the suite that they are for.
struct SessionKeys {
  Key send;
  Key receive;
  Suite suite = Suite::kNoise;
};

/// When keys are renewed. The sender decides; the receiver follows the epoch in the header.
struct Rekey {
  /// A key is renewed after this many datagrams, 17 min at 1 kHz; at most limits::kMaxDatagramsOfKey. Both ciphers
  /// would bear more; but a key that is read from memory now opens minutes of the conversation, not a day.
  std::uint64_t datagrams = std::uint64_t{1} << 20;
  Duration age = std::chrono::minutes(10);
  /// How long the previous key is still accepted: longer than any useful datagram is on its way.
  Duration overlap = std::chrono::seconds(2);
};

/// The key of one direction in one epoch, with what its suite computes from it once. Suite 2 takes a processor that
/// can (crypto::has_aes).
class SealingKey {
 public:
  SealingKey(Suite suite, const Key& key) noexcept;

  /// As crypto::seal and crypto::open, by the suite's cipher.
  void seal(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
            std::span<std::byte> sealed) const noexcept;
  bool open(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> sealed,
            std::span<std::byte> text) const noexcept;
  /// The key of the next epoch.
  SealingKey renewed() const noexcept;

 private:
  Key key_;
  std::optional<crypto::AesGcm> aes_;  ///< in suite 2
};

/// Seals the datagrams of one direction.
class Sealer {
 public:
  Sealer(const SealingKey& key, const Rekey& rekey, LocalTime opened) noexcept;

  /// The epoch for the next datagram. Renews the key first when that is due.
  std::uint8_t next_epoch(LocalTime now) noexcept;

  /// Seals the bytes after the header in place and returns the new size of the datagram, `size` + crypto::kTagSize,
  /// which `buffer` must hold. Call once for each packet number.
  std::size_t seal(const Header& header, std::span<std::byte> buffer, std::size_t size) noexcept;

 private:
  Rekey rekey_;
  SealingKey key_;
  std::uint8_t epoch_ = 0;
  std::uint64_t sealed_ = 0;  ///< datagrams, with the present key
  LocalTime since_;           ///< start of the present key
};

/// Opens the datagrams of the other direction.
class Opener {
 public:
  Opener(const SealingKey& key, const Rekey& rekey) noexcept;

  enum class Verdict : std::uint8_t {
    kOpened,
    kForged,  ///< not sealed with the key of its epoch: forged, or damaged on the way
    kOldKey,  ///< its epoch's key is not held any more, or not yet
  };
  /// Opens the bytes after the header into `body`, which must hold as many. A datagram of the next epoch that opens
  /// makes that epoch the present one.
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

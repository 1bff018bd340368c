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

/// The keys of one sealed conversation and their cipher suite.
struct SessionKeys {
  Key send;
  Key receive;
  Suite suite = Suite::kNoise;
};

/// When keys are renewed. The sender decides, and the receiver follows the epoch in the header.
struct Rekey {
  /// Datagrams sealed with one key, 17 min at 1 kHz; at most limits::kMaxDatagramsOfKey. Both ciphers would permit
  /// more, but a key that is read from memory should reveal minutes of the conversation and not a day.
  std::uint64_t datagrams = std::uint64_t{1} << 20;
  Duration age = std::chrono::minutes(10);
  /// How long the previous key is accepted. Useful datagrams do not arrive later than this.
  Duration overlap = std::chrono::seconds(2);
};

/// The key of one direction in one epoch, with the data that its suite precomputes from it. Suite 2 requires
/// crypto::has_aes().
class SealingKey {
 public:
  SealingKey(Suite suite, const Key& key) noexcept;

  /// See crypto::seal and crypto::open. The cipher depends on the suite.
  void seal(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> text,
            std::span<std::byte> sealed) const noexcept;
  bool open(std::uint64_t number, std::span<const std::byte> associated, std::span<const std::byte> sealed,
            std::span<std::byte> text) const noexcept;
  /// Returns the key of the next epoch.
  SealingKey renewed() const noexcept;

 private:
  Key key_;
  std::optional<crypto::AesGcm> aes_;  ///< set in suite 2
};

/// Seals the datagrams of the sending direction.
class Sealer {
 public:
  Sealer(const SealingKey& key, const Rekey& rekey, LocalTime opened) noexcept;

  /// Returns the epoch of the next datagram. Renews the key first if it is due.
  std::uint8_t next_epoch(LocalTime now) noexcept;

  /// Seals the bytes after the header in place and returns the new size of the datagram, `size` + crypto::kTagSize, for
  /// which `buffer` must have room. Call it once for each packet number.
  std::size_t seal(const Header& header, std::span<std::byte> buffer, std::size_t size) noexcept;

 private:
  Rekey rekey_;
  SealingKey key_;
  std::uint8_t epoch_ = 0;
  std::uint64_t sealed_ = 0;  ///< number of datagrams sealed with the present key
  LocalTime since_;           ///< time from which the present key was used
};

/// Opens the datagrams of the receiving direction.
class Opener {
 public:
  Opener(const SealingKey& key, const Rekey& rekey) noexcept;

  enum class Verdict : std::uint8_t {
    kOpened,
    kForged,  ///< authentication failed: forged, or damaged in transit
    kOldKey,  ///< the key of its epoch has expired or is not known yet
  };
  /// Decrypts the bytes after the header into `body`, which must have room for them. If a datagram of the next epoch is
  /// authentic, that epoch becomes the present one.
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

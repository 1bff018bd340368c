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

/// The keys of one conversation of suite 1, from where we stand.
struct SessionKeys {
  Key send;
  Key receive;
};

/// When keys are renewed. The sender decides; the receiver follows the epoch in the header.
struct Rekey {
  /// Far below what ChaCha20-Poly1305 bears (2⁶⁰ and more at our sizes), often enough that a key that is
  /// read from memory opens minutes, not a day: 17 min at 1 kHz.
  std::uint64_t datagrams = std::uint64_t{1} << 20;
  Duration age = std::chrono::minutes(10);
  /// How long the key before is still good: longer than any datagram that is of use is under way.
  Duration overlap = std::chrono::seconds(2);
};

/// Seals the datagrams of one direction.
class Sealer {
 public:
  Sealer(const Key& key, const Rekey& rekey, LocalTime opened) noexcept;

  /// The epoch of the datagram that is about to be written: renews the key when it is time.
  std::uint8_t next_epoch(LocalTime now) noexcept;

  /// Seals what follows the header, in place, and returns the new size of the datagram: crypto::kTagSize
  /// more. `buffer` must hold that. Once per packet number.
  std::size_t seal(const Header& header, std::span<std::byte> buffer, std::size_t size) noexcept;

 private:
  Rekey rekey_;
  Key key_;
  std::uint8_t epoch_ = 0;
  std::uint64_t sealed_ = 0;  ///< with this key
  LocalTime since_;           ///< this key is used
};

/// Opens the datagrams of the other direction.
class Opener {
 public:
  Opener(const Key& key, const Rekey& rekey) noexcept;

  enum class Verdict : std::uint8_t {
    kOpened,
    kForged,  ///< not sealed with the key of its epoch: forged, or damaged under way
    kOldKey,  ///< of an epoch whose key we do not hold: over, or far ahead
  };
  /// Opens what follows the header into `body`, which must hold as many bytes. A datagram of the next
  /// epoch that opens makes that the present one.
  Verdict open(LocalTime now, const Header& header, std::span<const std::byte> datagram,
               std::span<std::byte> body) noexcept;

 private:
  Rekey rekey_;
  std::uint8_t epoch_ = 0;
  std::optional<Key> previous_;
  Key present_;
  Key next_;
  LocalTime moved_on_{};
};

}  // namespace tendon

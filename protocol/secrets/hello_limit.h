// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <span>

#include "core/base/time.h"
#include "protocol/link.h"
#include "protocol/secrets/crypto.h"

namespace tendon {

/// Limits the handshakes of each source to `kPerSecond` on average and `kBurst` at once. A source is an IPv4 address or
/// an IPv6 /64 prefix, since a host usually controls all of its /64.
///
/// Sources share a table of kBuckets buckets, using a hash that they cannot predict. Only used for verified addresses,
/// so that spoofed sources cannot use up the limit of a genuine one.
class HelloLimit {
 public:
  static constexpr int kPerSecond = 20;  ///< two clients repeating their Hello at 10 Hz
  static constexpr int kBurst = 40;      ///< a laboratory behind a NAT after a power failure
  static constexpr std::size_t kBuckets = 1024;

  explicit HelloLimit(const std::array<std::byte, 16>& hash_key) noexcept : hash_key_(hash_key) {
    buckets_.fill(LocalTime::min());
  }

  /// Returns false if the source exceeds its limit.
  bool admit(LocalTime now, const Address& from) noexcept {
    // Generic cell rate algorithm, which stores the time at which a bucket will be empty.
    constexpr Duration kEvery = std::chrono::nanoseconds(std::chrono::seconds(1)) / kPerSecond;
    LocalTime& empty_at = buckets_[bucket(from)];
    const LocalTime begin = std::max(empty_at, now);
    if (begin - now > (kBurst - 1) * kEvery) return false;
    empty_at = begin + kEvery;
    return true;
  }

 private:
  std::size_t bucket(const Address& from) const noexcept {
    const auto source = std::as_bytes(std::span(from.ip)).first(is_ipv4(from) ? 16 : 8);
    return crypto::short_hash(hash_key_, source) % kBuckets;
  }

  std::array<std::byte, 16> hash_key_;
  std::array<LocalTime, kBuckets> buckets_;
};

}  // namespace tendon

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

/// Limits the rate of handshakes for each source to `kPerSecond` on average with bursts of `kBurst`. A source is an
/// IPv4 address or the /64 prefix of an IPv6 address, because hosts usually control a whole /64.
///
/// The table has a fixed size: sources share kBuckets buckets, by a hash that others cannot predict. It is used only
/// after a cookie has verified the address, so spoofed sources cannot use up the limit of a real one.
class HelloLimit {
 public:
  static constexpr int kPerSecond = 20;  ///< two clients that repeat their Hello at 10 Hz
  static constexpr int kBurst = 40;      ///< a laboratory behind one address after a power cut
  static constexpr std::size_t kBuckets = 1024;

  explicit HelloLimit(const std::array<std::byte, 16>& hash_key) noexcept : hash_key_(hash_key) {
    buckets_.fill(LocalTime::min());
  }

  /// Returns true if the source is within its limit, and counts the handshake.
  bool admit(LocalTime now, const Address& from) noexcept {
    // Generic cell rate algorithm. A bucket stores the time at which it will be empty.
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

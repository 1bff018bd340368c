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

/// How many handshakes a source may ask for: `kPerSecond` in the long run, `kBurst` at once. A source is
/// an IPv4 address or the /64 of an IPv6 one, because whoever has one address there has all of them.
///
/// The table never grows: sources share kBuckets buckets, by a hash that nobody outside can foresee. It
/// is asked only once a cookie has proved the address, so that spoofed sources cannot use up the share
/// of a real one.
class HelloLimit {
 public:
  static constexpr int kPerSecond = 20;  ///< two clients at the handshake's 10 Hz
  static constexpr int kBurst = 40;      ///< a laboratory behind one address, after a power cut
  static constexpr std::size_t kBuckets = 1024;

  explicit HelloLimit(const std::array<std::byte, 16>& hash_key) noexcept : hash_key_(hash_key) {
    buckets_.fill(LocalTime::min());
  }

  /// True, and counted, when the source is within its limit.
  bool admit(LocalTime now, const Address& from) noexcept {
    // Generic cell rate algorithm: a bucket is the time at which it would be empty again.
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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>

#include "core/base/time.h"

namespace tendon::simulation {

/// What one end must make of each datagram of suite 1 that comes to it, as SESSION.md says it: a reference with a set
/// of numbers in place of the ring of bits, and without keys. Who refuses a genuine datagram, or believes one twice,
/// has another count.
///
/// Thread-safe: no.
class Receipts {
 public:
  /// `overlap`: how long the key before is good for.
  explicit Receipts(Duration overlap) : overlap_(overlap) {}

  /// A datagram that is not whole cannot be authentic.
  void see(LocalTime now, std::span<const std::byte> datagram, bool whole);

  /// That must be accepted (LinkStats::datagrams_received) in the conversation of that id, one of the newest.
  std::uint64_t accepted(std::uint32_t connection) const;
  /// Of the newest conversation; 0 = none.
  std::uint32_t newest() const noexcept { return conversations_.empty() ? 0 : conversations_.rbegin()->first; }
  /// Times that a new epoch has begun, over all conversations.
  std::uint64_t new_keys() const noexcept { return new_keys_; }

 private:
  static constexpr std::uint64_t kRemembered = 1984;  ///< SESSION.md: "packet numbers remembered"
  static constexpr std::size_t kConversations = 4;    ///< connection ids count up

  struct Conversation {
    std::uint64_t accepted = 0;
    std::set<std::uint64_t> numbers;  ///< accepted, as far back as they are remembered
    std::uint8_t epoch = 0;
    bool previous = false;  ///< the key before is still good
    LocalTime moved_on{};
  };

  Duration overlap_;
  std::map<std::uint32_t, Conversation> conversations_;
  std::uint64_t new_keys_ = 0;
};

}  // namespace tendon::simulation

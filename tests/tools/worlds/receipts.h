// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>

#include "core/base/time.h"

namespace tendon::simulation {

/// Reference model of replay protection in suite 1 (SESSION.md): counts the datagrams that one end must accept, with a
/// set of packet numbers instead of a bit ring, and without keys. Thread-safe: no.
class Receipts {
 public:
  /// `overlap` is the time for which the previous key remains valid.
  explicit Receipts(Duration overlap) : overlap_(overlap) {}

  /// A datagram with `whole` = false cannot be authentic.
  void see(LocalTime now, std::span<const std::byte> datagram, bool whole);

  /// LinkStats::datagrams_received of this connection, which must be among the newest.
  std::uint64_t accepted(std::uint32_t connection) const;
  /// The newest connection; 0 = none.
  std::uint32_t newest() const noexcept { return conversations_.empty() ? 0 : conversations_.rbegin()->first; }
  std::uint64_t new_keys() const noexcept { return new_keys_; }

 private:
  static constexpr std::uint64_t kRemembered = 1984;  ///< SESSION.md: "packet numbers remembered"
  static constexpr std::size_t kConversations = 4;    ///< connection ids count up

  struct Conversation {
    std::uint64_t accepted = 0;
    std::set<std::uint64_t> numbers;  ///< packet numbers accepted and still remembered
    std::uint8_t epoch = 0;
    bool previous = false;  ///< the previous key is still valid
    LocalTime moved_on{};
  };

  Duration overlap_;
  std::map<std::uint32_t, Conversation> conversations_;
  std::uint64_t new_keys_ = 0;
};

}  // namespace tendon::simulation

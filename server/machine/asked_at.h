// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>

#include "protocol/link.h"

namespace tendon {

/// Remembers which local address each peer has sent its newest datagram to. A socket that is bound to all addresses has
/// to answer from this address. Otherwise, the kernel chooses the source address from the route, and the peer drops the
/// answer because it comes from an unknown address.
///
/// The table has a fixed size. Two peers can have the same entry, but a peer cannot predict which one. If the entry of a
/// peer was overwritten, the kernel chooses the address until the next datagram from this peer arrives.
///
/// Thread-safe: yes.
class AskedAt {
 public:
  using Ip = decltype(Address::ip);

  AskedAt();
  void put(const Address& peer, const Ip& local) noexcept;
  std::optional<Ip> find(const Address& peer) const noexcept;

 private:
  struct Entry {
    Address peer;
    Ip local{};
  };
  std::size_t place_of(const Address& peer) const noexcept;

  std::uint64_t salt_ = 0;
  mutable std::mutex mutex_;
  std::array<Entry, 4096> entries_{};
};

}  // namespace tendon

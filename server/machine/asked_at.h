// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>

#include "protocol/link.h"

namespace tendon {

/// Stores the local address to which each peer has sent its newest datagram. A socket that is bound to all addresses
/// has to reply from this address. Otherwise, the kernel chooses another one, and the peer drops the reply.
///
/// The size of the table is fixed. A collision overwrites the older entry until the next datagram arrives. The hash is
/// salted, so a peer cannot predict collisions. Thread-safe: yes.
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

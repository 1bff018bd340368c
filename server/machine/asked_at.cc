// SPDX-License-Identifier: Apache-2.0
#include "server/machine/asked_at.h"

#include <bit>
#include <cstring>
#include <span>

#include "server/machine/randomness.h"

namespace tendon {

AskedAt::AskedAt() { fill_random(std::as_writable_bytes(std::span(&salt_, 1))); }

std::size_t AskedAt::place_of(const Address& peer) const noexcept {
  constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15U;  // golden ratio, for Fibonacci hashing
  std::array<std::uint64_t, 2> ip;
  std::memcpy(ip.data(), peer.ip.data(), sizeof ip);
  std::uint64_t mixed = salt_;
  for (const std::uint64_t word : {ip[0], ip[1], std::uint64_t{peer.port}}) {
    mixed = (mixed ^ word) * kOdd;
    mixed ^= mixed >> 32;
  }
  static_assert(std::has_single_bit(std::tuple_size_v<decltype(entries_)>));
  return mixed % entries_.size();
}

void AskedAt::put(const Address& peer, const Ip& local) noexcept {
  Entry& entry = entries_[place_of(peer)];
  const std::lock_guard lock(mutex_);
  entry = {peer, local};
}

std::optional<AskedAt::Ip> AskedAt::find(const Address& peer) const noexcept {
  const Entry& entry = entries_[place_of(peer)];
  const std::lock_guard lock(mutex_);
  return entry.peer == peer ? std::optional(entry.local) : std::nullopt;
}

}  // namespace tendon

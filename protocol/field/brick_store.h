// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/field/manifest.h"

namespace tendon {

/// Stores bricks by hash. Equal bricks of several clients are stored once, but a client can only read its own bricks.
/// Otherwise, a client could guess the hash of a brick and learn if another client has uploaded it.
///
/// * If an owner has more than `owner_bytes`, its least recently used brick is removed.
/// * If the store is full, the same is done for the owner with the most bricks. Owners with less than bytes/owners are
///   not affected.
///
/// The constructor allocates all memory: `bytes` for the bricks, and at most (40 + 8 · owners)/1024 of this for the
/// index. Thread-safe: no.
class BrickStore {
 public:
  using Owner = std::uint32_t;  ///< the number of a client's key, which stays the same if the client is restarted

  struct Config {
    std::size_t bytes = 8'000'000;
    std::size_t owner_bytes = 4'000'000;
    Owner owners = 16;
    std::array<std::byte, 16> key{};  ///< random key of the hash table
  };

  /// Throws std::invalid_argument if there is no owner, or if one of the sizes has no room for a brick.
  explicit BrickStore(const Config& config);

  using Hash = std::span<const std::byte, sizeof(BrickHash)>;

  /// Returns null if the owner does not have the brick. Valid until the next `put`.
  const BrickBytes* find(Owner owner, Hash hash) const noexcept;
  /// Marks the brick as used. Returns false if the owner does not have it.
  bool use(Owner owner, Hash hash) noexcept;
  /// Adds a brick. The caller must verify the hash.
  void put(Owner owner, Hash hash, std::span<const std::byte, limits::kBrickBytes> bytes) noexcept;

  std::size_t bricks() const noexcept { return slots_.size() - free_; }
  std::size_t held(Owner owner) const noexcept { return held_[owner]; }
  std::size_t quota() const noexcept { return quota_; }  ///< bricks of an owner
  Owner owners() const noexcept { return static_cast<Owner>(held_.size()); }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  struct Slot {
    BrickHash hash{};
    std::uint32_t next = kNone;  ///< the next slot of the list
    std::uint32_t owners = 0;    ///< 0: the slot is free
  };

  std::uint32_t& head_of(Hash hash) noexcept { return heads_[place_of(hash)]; }
  std::size_t place_of(Hash hash) const noexcept;
  std::uint32_t slot_of(Hash hash) const noexcept;
  std::uint64_t& used(std::uint32_t slot, Owner owner) noexcept { return used_[slot * held_.size() + owner]; }
  std::uint64_t used(std::uint32_t slot, Owner owner) const noexcept { return used_[slot * held_.size() + owner]; }
  void drop_oldest(Owner owner) noexcept;

  std::array<std::byte, 16> key_;
  std::size_t quota_;
  std::vector<BrickBytes> bytes_;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> heads_;  ///< a power of two
  std::vector<std::uint64_t> used_;   ///< for each slot and owner, the value of uses_ at the last use, or 0
  std::vector<std::size_t> held_;     ///< bricks of each owner
  std::uint32_t first_free_ = 0;
  std::size_t free_;
  std::uint64_t uses_ = 0;
};

}  // namespace tendon

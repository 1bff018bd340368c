// SPDX-License-Identifier: Apache-2.0
#include "protocol/field/brick_store.h"

#include <algorithm>
#include <bit>

#include "core/base/expect.h"
#include "protocol/secrets/crypto.h"

namespace tendon {

BrickStore::BrickStore(const Config& config)
    : key_(config.key), quota_(config.owner_bytes / limits::kBrickBytes), free_(config.bytes / limits::kBrickBytes) {
  expect(free_ > 0 && free_ < kNone, "bytes", static_cast<double>(config.bytes), "1024 or more, and below 2^42");
  expect(quota_ > 0, "owner_bytes", static_cast<double>(config.owner_bytes), "1024 or more");
  expect(config.owners > 0, "owners", config.owners, "1 or more");
  bytes_.resize(free_);
  slots_.resize(free_);
  heads_.assign(std::bit_ceil(2 * free_), kNone);
  used_.resize(free_ * config.owners);
  held_.resize(config.owners);
  for (std::uint32_t i = 0; i + 1 < free_; ++i) slots_[i].next = i + 1;
}

std::size_t BrickStore::place_of(Hash hash) const noexcept {
  return crypto::short_hash(key_, hash) & (heads_.size() - 1);
}

std::uint32_t BrickStore::slot_of(Hash hash) const noexcept {
  std::uint32_t slot = heads_[place_of(hash)];
  while (slot != kNone && !std::ranges::equal(slots_[slot].hash, hash)) slot = slots_[slot].next;
  return slot;
}

const BrickBytes* BrickStore::find(Owner owner, Hash hash) const noexcept {
  const std::uint32_t slot = slot_of(hash);
  return slot != kNone && used(slot, owner) > 0 ? &bytes_[slot] : nullptr;
}

bool BrickStore::use(Owner owner, Hash hash) noexcept {
  const std::uint32_t slot = slot_of(hash);
  if (slot == kNone || used(slot, owner) == 0) return false;
  used(slot, owner) = ++uses_;
  return true;
}

void BrickStore::put(Owner owner, Hash hash, std::span<const std::byte, limits::kBrickBytes> bytes) noexcept {
  if (use(owner, hash)) return;
  if (held_[owner] >= quota_) drop_oldest(owner);
  std::uint32_t slot = slot_of(hash);
  if (slot == kNone) {
    while (free_ == 0) drop_oldest(static_cast<Owner>(std::ranges::max_element(held_) - held_.begin()));
    slot = first_free_;
    first_free_ = slots_[slot].next;
    --free_;
    std::uint32_t& head = head_of(hash);
    std::ranges::copy(hash, slots_[slot].hash.begin());
    slots_[slot].next = head;
    head = slot;
    std::ranges::copy(bytes, bytes_[slot].begin());
  }
  ++slots_[slot].owners;
  ++held_[owner];
  used(slot, owner) = ++uses_;
}

void BrickStore::drop_oldest(Owner owner) noexcept {
  std::uint32_t oldest = kNone;
  for (std::uint32_t slot = 0; slot < slots_.size(); ++slot) {
    if (used(slot, owner) == 0) continue;
    if (oldest == kNone || used(slot, owner) < used(oldest, owner)) oldest = slot;
  }
  used(oldest, owner) = 0;
  --held_[owner];
  if (--slots_[oldest].owners > 0) return;
  std::uint32_t* link = &head_of(slots_[oldest].hash);
  while (*link != oldest) link = &slots_[*link].next;
  *link = slots_[oldest].next;
  slots_[oldest].next = first_free_;
  first_free_ = oldest;
  ++free_;
}

}  // namespace tendon

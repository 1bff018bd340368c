// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/receipts.h"

#include "protocol/wire/header.h"

namespace tendon::simulation {

void Receipts::see(LocalTime now, std::span<const std::byte> datagram, bool whole) {
  const auto header = decode_header(datagram);
  if (!whole || !header || header->type != DatagramType::kData) return;
  if (header->connection_id + kConversations <= newest()) return;
  Conversation& conversation = conversations_[header->connection_id];
  if (conversations_.size() > kConversations) conversations_.erase(conversations_.begin());

  auto& numbers = conversation.numbers;
  const std::uint64_t number = header->packet_number;
  const bool newest = numbers.empty() || number > *numbers.rbegin();
  if (!newest && (*numbers.rbegin() - number >= kRemembered || numbers.contains(number))) return;

  const auto ahead = static_cast<std::uint8_t>(header->epoch - conversation.epoch);
  if (conversation.previous && now - conversation.moved_on >= overlap_) conversation.previous = false;
  if (ahead > 1 && !(ahead == 0xFF && conversation.previous)) return;
  if (ahead == 1) {
    conversation.epoch = header->epoch;
    conversation.previous = true;
    conversation.moved_on = now;
    ++new_keys_;
  }
  ++conversation.accepted;
  numbers.insert(number);
  while (*numbers.rbegin() - *numbers.begin() >= kRemembered) numbers.erase(numbers.begin());
}

std::uint64_t Receipts::accepted(std::uint32_t connection) const {
  const auto found = conversations_.find(connection);
  return found == conversations_.end() ? 0 : found->second.accepted;
}

}  // namespace tendon::simulation

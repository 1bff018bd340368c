// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/bridge_gate.h"

#include <utility>

#include "protocol/wire/header.h"

namespace tendon::dash {

bool BridgeGate::passes(LocalTime now, std::span<const std::byte> message, bool binary) {
  const auto header = binary ? decode_header(message) : std::nullopt;
  if (!header) {
    ++counts_.malformed;
  } else if (header->suite == Suite::kPlain && !local_) {
    ++counts_.plain;
  } else if (!rate_.take(now)) {
    ++counts_.too_fast;
  } else {
    ++counts_.to_server;
    return true;
  }
  return false;
}

void BridgeGate::offer(std::span<const std::byte> datagram) {
  if (waiting_bytes_ + datagram.size() > config_.max_waiting) {
    ++counts_.too_slow;
    return;
  }
  waiting_.emplace_back(datagram.begin(), datagram.end());
  waiting_bytes_ += datagram.size();
}

std::optional<std::vector<std::byte>> BridgeGate::next() {
  if (waiting_.empty()) return std::nullopt;
  std::vector<std::byte> datagram = std::move(waiting_.front());
  waiting_.pop_front();
  waiting_bytes_ -= datagram.size();
  ++counts_.to_page;
  return datagram;
}

}  // namespace tendon::dash

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <span>
#include <utility>
#include <vector>

#include "protocol/link.h"

namespace tendon {

using Bytes = std::vector<std::byte>;
inline Bytes bytes(std::size_t size, int first) {
  Bytes result(size);
  for (std::size_t i = 0; i < size; ++i) result[i] = static_cast<std::byte>(first + static_cast<int>(i));
  return result;
}

struct Datagram {
  Address from;
  Address to;
  Bytes bytes;
};

using Wire = std::deque<Datagram>;

class End : public Link {
 public:
  End(Wire& wire, const Address& address) : self(address), wire_(wire) {}
  void send(const Address& to, std::span<const std::byte> datagram) override {
    wire_.push_back({self, to, {datagram.begin(), datagram.end()}});
    sent += datagram.size();
  }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override {
    if (inbox.empty()) return 0;
    const Datagram datagram = std::move(inbox.front());
    inbox.pop_front();
    from = datagram.from;
    std::copy_n(datagram.bytes.begin(), std::min(buffer.size(), datagram.bytes.size()), buffer.begin());
    return datagram.bytes.size();
  }
  LocalTime present(LocalTime now) const override { return std::max(now, taken); }
  LocalTime reached(LocalTime now) const override { return now - waited; }

  Address self;
  LocalTime taken{};  ///< receive time, if later than the time of the turn
  Duration waited{};  ///< time between the arrival of a datagram and receive()
  std::deque<Datagram> inbox;
  std::size_t sent = 0;

 private:
  Wire& wire_;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/toy/wire.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace tendon::conformance {

using std::chrono::milliseconds;
using std::chrono::seconds;

void ToyWire::send(int port, Span datagram) {
  to_peer_.push_back({now_ + milliseconds(1), port, {datagram.begin(), datagram.end()}});
}

void ToyWire::step() {
  now_ += milliseconds(1);
  std::vector<Letter> later;
  for (Letter& letter : std::exchange(to_peer_, {})) {
    if (letter.at <= now_) {
      peer_.receive(now_, letter.port, letter.datagram);
    } else {
      later.push_back(std::move(letter));
    }
  }
  to_peer_ = std::move(later);
  peer_.tick(now_);
  for (auto& [port, datagram] : peer_.take()) to_us_[port].push_back({now_, std::move(datagram)});
}

std::optional<Wire::Arrival> ToyWire::receive(int port, LocalTime deadline) {
  auto& arrived = to_us_[port];
  while (arrived.empty()) {
    if (now_ >= deadline) return std::nullopt;
    step();
  }
  Arrival first = std::move(arrived.front());
  arrived.erase(arrived.begin());
  return first;
}

std::uint64_t ToyWire::random() {
  // splitmix64
  std::uint64_t z = (state_ += 0x9E3779B97F4A7C15U);
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31U);
}

}  // namespace tendon::conformance

// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/stage/relay.h"

#include <poll.h>

#include <array>

namespace tendon::e2e {
namespace {

constexpr int kWaitMs = 10;  // also the maximum delay of a stop

}  // namespace

Relay::Relay(const Address& server)
    : server_(server),
      front_(parse_address("127.0.0.1:0")),
      back_(parse_address("127.0.0.1:0")),
      thread_([this] { run(); }) {}

Relay::~Relay() {
  stop_ = true;
  thread_.join();
}

Address Relay::address() const {
  const std::scoped_lock lock(mutex_);
  return front_.local_address();
}

Address Relay::clients_address() const {
  const std::scoped_lock lock(mutex_);
  return back_.local_address();
}

std::vector<Datagram> Relay::said() const {
  const std::scoped_lock lock(mutex_);
  return said_;
}

void Relay::forge(std::span<const std::byte> datagram) {
  const std::scoped_lock lock(mutex_);
  back_.send(server_, datagram);
}

void Relay::cut_next(int count) {
  const std::scoped_lock lock(mutex_);
  cut_ += count;
}

void Relay::run() {
  std::array<pollfd, 2> fds = {pollfd{front_.fd(), POLLIN, 0}, pollfd{back_.fd(), POLLIN, 0}};
  while (!stop_) {
    ::poll(fds.data(), fds.size(), kWaitMs);
    hand_on();
  }
}

void Relay::hand_on() {
  const std::scoped_lock lock(mutex_);
  std::array<std::byte, kMaxDatagram> buffer;
  Address from;
  while (std::size_t size = front_.receive(from, buffer)) {
    client_ = from;
    if (cut_ > 0) {
      --cut_;
      back_.send(server_, std::span(buffer).first(--size));
      continue;
    }
    said_.emplace_back(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
    back_.send(server_, said_.back());
  }
  while (const std::size_t size = back_.receive(from, buffer)) {
    if (client_) front_.send(*client_, std::span(buffer).first(size));
  }
}

}  // namespace tendon::e2e

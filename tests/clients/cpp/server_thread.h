// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <thread>

#include "server/machine/udp_link.h"
#include "tests/clients/cpp/a_and_z.h"

namespace tendon::a_and_z {

/// Z on a real socket and its own thread. It sends states at 1 kHz.
class ServerThread {
 public:
  explicit ServerThread(const Address& listen = parse_address("127.0.0.1:0")) : link_(listen) {}
  ~ServerThread() { end(); }
  ServerThread(const ServerThread&) = delete;
  ServerThread& operator=(const ServerThread&) = delete;

  Address address() const { return link_.local_address(); }
  /// Calls `change` with the server and the present time while the thread waits.
  void with(auto change) {
    const std::lock_guard lock(mutex_);
    change(z_, link_.present({}));
  }
  /// Stops the thread and returns the number of received forces.
  std::uint64_t forces() {
    end();
    return z_.forces.size();
  }

 private:
  void run() {
    while (!stop_) {
      const LocalTime next = turn();
      link_.wait(std::min<Duration>(next - link_.present({}), std::chrono::milliseconds(10)));
    }
  }
  LocalTime turn() {
    const std::lock_guard lock(mutex_);
    return z_.turn(link_.present({}));
  }
  void end() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }

  UdpLink link_;
  std::mutex mutex_;
  Server z_{link_, std::uint8_t{1}};
  std::atomic<bool> stop_{false};
  std::thread thread_{[this] { run(); }};
};

}  // namespace tendon::a_and_z

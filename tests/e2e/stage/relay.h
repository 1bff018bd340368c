// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "protocol/link.h"
#include "server/machine/udp_link.h"

namespace tendon::e2e {

using Datagram = std::vector<std::byte>;

/// A man in the middle. It stores the datagrams that a client sends to the server, and can be used to forge others.
/// Thread-safe: yes. It has its own thread.
class Relay {
 public:
  explicit Relay(const Address& server);
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  Address address() const;
  Address clients_address() const;

  std::vector<Datagram> said() const;

  void forge(std::span<const std::byte> datagram);
  /// Removes the last byte of the next `count` datagrams that the client sends.
  void cut_next(int count);

 private:
  void run();
  void hand_on();

  const Address server_;
  mutable std::mutex mutex_;  ///< protects the members below
  UdpLink front_;
  UdpLink back_;
  std::optional<Address> client_;
  std::vector<Datagram> said_;
  int cut_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace tendon::e2e

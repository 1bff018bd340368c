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

/// A man in the middle between one client and the server: forwards both ways, keeps the client's datagrams, and can
/// send more in the client's name.
///
/// Thread-safe: yes. It has a thread of its own.
class Relay {
 public:
  explicit Relay(const Address& server);
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  /// Where the client finds it.
  Address address() const;
  /// Where the server believes the client to be.
  Address clients_address() const;

  /// The client's datagrams so far that reached the server uncut.
  std::vector<Datagram> said() const;

  /// Sends to the server in the client's name.
  void forge(std::span<const std::byte> datagram);
  /// The client's next `count` datagrams lose their last byte.
  void cut_next(int count);

 private:
  void run();
  void hand_on();

  const Address server_;
  mutable std::mutex mutex_;  ///< of all that follows
  UdpLink front_;
  UdpLink back_;
  std::optional<Address> client_;
  std::vector<Datagram> said_;
  int cut_ = 0;
  std::atomic<bool> stop_{false};  // needs no lock
  std::thread thread_;
};

}  // namespace tendon::e2e

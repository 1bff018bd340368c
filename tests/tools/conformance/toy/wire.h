// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "tests/tools/conformance/toy/peer.h"

namespace tendon::conformance {

/// Virtual time with a one-way delay of 1 ms.
class ToyWire : public Wire {
 public:
  explicit ToyWire(ToyPeer& peer, bool peer_is_server) : peer_(peer), peer_is_server_(peer_is_server) {}
  LocalTime now() override { return now_; }
  int open_port() override { return peer_is_server_ ? ports_++ : 0; }
  void send(int port, Span datagram) override;
  std::optional<Arrival> receive(int port, LocalTime deadline) override;
  std::uint64_t random() override;

 private:
  struct Letter {
    LocalTime at;
    int port;
    Bytes datagram;
  };
  void step();

  ToyPeer& peer_;
  bool peer_is_server_;
  int ports_ = 0;
  LocalTime now_{std::chrono::seconds(1)};
  std::vector<Letter> to_peer_;
  std::map<int, std::vector<Arrival>> to_us_;
  std::uint64_t state_ = 42;
};

}  // namespace tendon::conformance

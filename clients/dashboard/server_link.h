// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>

#include "clients/cpp/udp_transport.h"
#include "protocol/link.h"

namespace tendon::dash {

/// A UDP socket connected to the server. Sending to another address reconnects it to that address. Thread-safe: no.
class ServerLink : public Link {
 public:
  /// Throws std::runtime_error if the socket cannot be created or connected.
  explicit ServerLink(const Address& server) : transport_(std::make_unique<UdpTransport>(server)) {}

  void send(const Address& to, std::span<const std::byte> datagram) override {
    try {
      if (to != server()) {
        transport_ = std::make_unique<UdpTransport>(to);
        ++changes_;
      }
    } catch (const std::runtime_error&) {
      return;  // the datagram is lost
    }
    transport_->send(to, datagram);
  }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override { return transport_->receive(from, buffer); }
  LocalTime present(LocalTime now) const override { return transport_->present(now); }
  LocalTime arrived(LocalTime now) const override { return transport_->arrived(now); }
  LocalTime reached(LocalTime now) const override { return transport_->reached(now); }

  const Address& server() const noexcept { return transport_->server(); }
  int descriptor() const noexcept { return transport_->descriptor(); }  ///< see UdpTransport::descriptor
  std::uint64_t changes() const noexcept { return changes_; }           ///< how often the descriptor has changed

 private:
  std::unique_ptr<UdpTransport> transport_;
  std::uint64_t changes_ = 0;
};

}  // namespace tendon::dash

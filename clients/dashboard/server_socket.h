// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <utility>

#include "clients/dashboard/web_server.h"
#include "protocol/link.h"

namespace tendon::dash {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;
using Bytes = std::span<const std::byte>;

inline asio::ip::address ip_of(const Address& address) {
  const asio::ip::address_v6 v6(address.ip);
  if (v6.is_v4_mapped()) return asio::ip::make_address_v4(asio::ip::v4_mapped, v6);
  return v6;
}

template <class Endpoint>
Address address_of(const Endpoint& endpoint) {
  const asio::ip::address ip = endpoint.address();
  const auto v6 = ip.is_v4() ? asio::ip::make_address_v6(asio::ip::v4_mapped, ip.to_v4()) : ip.to_v6();
  return {v6.to_bytes(), endpoint.port()};
}

/// A UDP socket connected to the server. Sending to another address reconnects it to that address. Thread-safe: no.
class ServerSocket : public Link {
 public:
  /// Throws std::runtime_error if the socket cannot be created or connected.
  ServerSocket(asio::io_context& context, const Address& server, WebServer::Clock clock)
      : clock_(clock), context_(context), socket_(context) {
    const error_code error = connect(server);
    if (error) throw std::runtime_error("cannot reach " + to_string(server) + ": " + error.message());
  }

  void send(const Address& to, Bytes datagram) override {
    error_code lost;
    if (to != server_) lost = connect(to);
    if (!lost) socket_.send(asio::buffer(datagram.data(), datagram.size()), 0, lost);
  }
  void send(Bytes datagram) { send(server_, datagram); }

  std::size_t receive(Address& from, std::span<std::byte> buffer) override {
    from = server_;
    // Skip empty datagrams and errors (ICMP "port unreachable").
    for (int i = 0; i < kMaxSkips; ++i) {
      error_code error;
      // MSG_TRUNC: returns the size of the datagram even if the buffer is smaller.
      const std::size_t size = socket_.receive(asio::buffer(buffer.data(), buffer.size()), MSG_TRUNC, error);
      if (!error && size > 0) return size;
      if (error == asio::error::would_block) return 0;
    }
    return 0;
  }

  LocalTime present(LocalTime now) const override { return std::max(now, clock_()); }

  template <class Handler>
  void when_readable(Handler handler) {
    socket_.async_wait(udp::socket::wait_read, std::move(handler));
  }

  const Address& server() const noexcept { return server_; }

 private:
  error_code connect(const Address& server) {  // leaves the socket unchanged on failure
    error_code error;
    udp::socket connected(context_);
    connected.connect(udp::endpoint(ip_of(server), server.port), error);
    if (!error) connected.non_blocking(true, error);
    if (error) return error;
    socket_ = std::move(connected);
    server_ = server;
    return error;
  }

  static constexpr int kMaxSkips = 64;

  Address server_;
  WebServer::Clock clock_;
  asio::io_context& context_;
  udp::socket socket_;
};

}  // namespace tendon::dash

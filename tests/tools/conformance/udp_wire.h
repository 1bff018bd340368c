// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "protocol/link.h"
#include "server/machine/udp_link.h"
#include "tests/tools/conformance/wire.h"

namespace tendon::conformance {

/// The real wire. All ports are emptied whenever one is listened to, so that none overflows.
///
/// Thread-safe: no.
class UdpWire : public Wire {
 public:
  /// Towards the server at `peer`.
  static UdpWire to_server(const Address& peer);
  /// Where a client will come: the one port there is, open at once.
  static UdpWire for_client(const Address& listen);

  LocalTime now() override;
  /// Throws std::runtime_error when the system refuses.
  int open_port() override;
  void send(int port, Span datagram) override;
  std::optional<Arrival> receive(int port, LocalTime deadline) override;
  std::uint64_t random() override;

  Address local_address() const { return ports_.at(0).link->local_address(); }

 private:
  struct Port {
    std::unique_ptr<UdpLink> link;
    std::deque<Arrival> arrived;
  };
  UdpWire(const Address& peer, bool is_server) : peer_(peer), peer_is_server_(is_server) {}
  void add(const Address& local);
  void drain();

  Address peer_;
  bool peer_is_server_;
  std::vector<Port> ports_;
};

/// A client program. It is gone when this object is.
class GuestProgram : public Guest {
 public:
  /// `command` is looked up in PATH. What it says goes to `log`, a file, or nowhere.
  GuestProgram(std::vector<std::string> command, std::string log);
  ~GuestProgram() override { kill(); }
  GuestProgram(const GuestProgram&) = delete;
  GuestProgram& operator=(const GuestProgram&) = delete;

  /// Throws std::system_error when it cannot be started.
  void start() override;
  void ask_to_end() override;
  void kill() override;
  bool running() override;

 private:
  std::vector<std::string> command_;
  std::string log_;
  int pid_ = 0;
};

}  // namespace tendon::conformance

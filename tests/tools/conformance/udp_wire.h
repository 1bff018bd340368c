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

/// Sends and receives datagrams over UDP. To avoid an overflow, receive() reads the datagrams of all ports.
///
/// Thread-safe: no.
class UdpWire : public Wire {
 public:
  static UdpWire to_server(const Address& peer);
  static UdpWire for_client(const Address& listen);

  LocalTime now() override;
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

/// A client program, which is killed with this object.
class GuestProgram : public Guest {
 public:
  /// `command` is looked up in PATH. Its output goes to the file `log`, or is discarded if `log` is empty.
  GuestProgram(std::vector<std::string> command, std::string log);
  ~GuestProgram() override { kill(); }
  GuestProgram(const GuestProgram&) = delete;
  GuestProgram& operator=(const GuestProgram&) = delete;

  /// Throws std::system_error if the program cannot be started.
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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocol/link.h"
#include "tests/tools/conformance/udp_wire.h"
#include "tests/tools/conformance/worker_checks.h"

namespace tendon::conformance {

/// Accepts only the first connection. Does not use WorkerProcess (clients/cpp/worker/worker_process.h), because a proxy
/// never sends half a record, nor ends a stream while its program lives. Thread-safe: no.
class WorkerProgram : public WorkerWire {
 public:
  /// `command` is looked up in PATH. Its output goes to the file `log`, or is discarded if `log` is empty. `listen`:
  /// the TCP address; port 0 selects a free port.
  WorkerProgram(std::vector<std::string> command, std::string log, const Address& listen);
  ~WorkerProgram() override;
  WorkerProgram(const WorkerProgram&) = delete;
  WorkerProgram& operator=(const WorkerProgram&) = delete;

  LocalTime now() override;
  /// Throws std::system_error if the socket cannot be opened or the program cannot be started.
  void start(Road road, const std::string& secret) override;
  std::optional<Heard> receive(LocalTime deadline) override;
  void send(Span bytes) override;
  void end_stream() override;
  bool ends(LocalTime deadline) override;
  void kill() override;
  std::uint64_t random() override;

 private:
  std::string listen(Road road);
  bool accept_one();

  GuestProgram program_;
  Address tcp_;
  std::string folder_;  ///< path of the Unix socket, or empty
  int listener_ = -1;
  int stream_ = -1;
};

}  // namespace tendon::conformance

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocol/link.h"
#include "tests/tools/conformance/udp_wire.h"
#include "tests/tools/conformance/worker_checks.h"

namespace tendon::conformance {

/// The real one: the worker's program, and the socket that it connects to. Only the first connection counts.
///
/// It is no Crew (clients/cpp/worker/crew.h), because a front never sends half a record, nor ends a stream and lets the
/// program live.
///
/// Thread-safe: no.
class WorkerProgram : public WorkerWire {
 public:
  /// `command` is looked up in PATH. What it says goes to `log`, a file, or nowhere. `listen`: where to wait for it over
  /// TCP; port 0: any.
  WorkerProgram(std::vector<std::string> command, std::string log, const Address& listen);
  ~WorkerProgram() override;
  WorkerProgram(const WorkerProgram&) = delete;
  WorkerProgram& operator=(const WorkerProgram&) = delete;

  LocalTime now() override;
  /// Throws std::system_error when the system has no such socket, or the program cannot be started.
  void start(Road road, const std::string& secret) override;
  std::optional<Heard> receive(LocalTime deadline) override;
  void send(Span bytes) override;
  void end_stream() override;
  bool ends(LocalTime deadline) override;
  void kill() override;
  std::uint64_t random() override;

 private:
  /// Listens, and says where: what the program is told.
  std::string listen(Road road);
  bool accept_one();

  GuestProgram program_;
  Address tcp_;
  std::string folder_;  ///< of the Unix socket; empty: there is none
  int listener_ = -1;
  int stream_ = -1;
};

}  // namespace tendon::conformance

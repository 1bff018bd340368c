// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "tests/tools/conformance/datagram.h"
#include "tests/tools/conformance/report.h"

namespace tendon::conformance {

/// A worker under test (clients/cpp/worker/stream.h): its program, the proxy's end of its stream, and the clock. Uses
/// processes and sockets, or a toy in this process with virtual time.
class WorkerWire {
 public:
  enum class Road : std::uint8_t { kUnix = 1, kTcp = 2 };
  struct Heard {
    Bytes bytes{};
    std::string ended{};  ///< the reason for the end of the stream, or empty
  };

  virtual ~WorkerWire() = default;
  virtual LocalTime now() = 0;
  virtual void start(Road road, const std::string& secret) = 0;
  /// Returns data from the program, waiting until `deadline`.
  virtual std::optional<Heard> receive(LocalTime deadline) = 0;
  virtual void send(Span bytes) = 0;
  virtual void end_stream() = 0;
  /// Waits until `deadline` for the program to exit. Returns true if it has.
  virtual bool ends(LocalTime deadline) = 0;
  virtual void kill() = 0;
  virtual std::uint64_t random() = 0;
};

/// Acts as the proxy of the worker at `wire`, over a Unix socket and then over TCP, and judges it with
/// Report(Side::kWorker).
void judge_worker(WorkerWire& wire, Report& report);

}  // namespace tendon::conformance

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "tests/tools/conformance/datagram.h"
#include "tests/tools/conformance/report.h"

namespace tendon::conformance {

/// A worker under test (clients/cpp/worker/stream.h): its program, the front's end of its stream, and the kit's clock.
/// Processes and sockets, or a toy in this process and virtual time.
class WorkerWire {
 public:
  enum class Road : std::uint8_t { kUnix = 1, kTcp = 2 };
  struct Heard {
    Bytes bytes{};
    std::string ended{};  ///< why nothing comes any more; empty: it may
  };

  virtual ~WorkerWire() = default;
  virtual LocalTime now() = 0;
  /// Starts the program. It is told where to open its stream, and the secret. The one before is gone.
  virtual void start(Road road, const std::string& secret) = 0;
  /// What comes from the program; waits until `deadline` for it.
  virtual std::optional<Heard> receive(LocalTime deadline) = 0;
  virtual void send(Span bytes) = 0;
  virtual void end_stream() = 0;
  /// Waits until `deadline` for the end of the program; whether it has ended.
  virtual bool ends(LocalTime deadline) = 0;
  /// Ends the program.
  virtual void kill() = 0;
  /// All that is random.
  virtual std::uint64_t random() = 0;
};

/// Is the front of the worker at `wire`, over a Unix socket and then over TCP, and judges it: Report(Side::kWorker).
void judge_worker(WorkerWire& wire, Report& report);

}  // namespace tendon::conformance

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "tests/tools/conformance/datagram.h"
#include "tests/tools/conformance/report.h"

namespace tendon::conformance {

/// The program under test (clients/cpp/worker/stream.h), the proxy's end of its stream, and the clock; or a toy in
/// virtual time.
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
  virtual std::optional<Heard> receive(LocalTime deadline) = 0;
  virtual void send(Span bytes) = 0;
  virtual void end_stream() = 0;
  virtual bool ends(LocalTime deadline) = 0;
  virtual void kill() = 0;
  virtual std::uint64_t random() = 0;
};

/// Acts as the worker's proxy over a Unix socket and then over TCP, and judges it with Report(Side::kWorker).
void judge_worker(WorkerWire& wire, Report& report);

}  // namespace tendon::conformance

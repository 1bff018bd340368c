// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "clients/cpp/force_client.h"
#include "clients/cpp/worker/stream.h"

namespace tendon::worker {

/// The worker's end of the stream to its proxy (stream.h). An MPI program uses it on one rank, which broadcasts the
/// record; every rank decodes the state from it (Codec). Thread-safe: no. Realtime-safe: no (system calls).
class WorkerStream {
 public:
  /// Connects to the address in the environment and opens the stream, which reports that the worker is ready. Throws
  /// std::runtime_error "TENDON_WORKER_ADDRESS: …" if the variable is missing or nothing listens there.
  WorkerStream();
  ~WorkerStream();
  WorkerStream(const WorkerStream&) = delete;
  WorkerStream& operator=(const WorkerStream&) = delete;

  /// Blocks until the next record, which contains a state. Returns empty when the proxy has closed the stream.
  std::optional<Record> next();
  bool send(const Record& answer);  ///< of Codec::answer; false if the stream is closed

 private:
  int socket_ = -1;
  RecordReader reader_;
};

/// Answers each state with `engine` until the proxy closes the stream. This is all that the `main` of a worker needs.
/// Exceptions of `engine` propagate; the proxy then starts a new worker. Throws std::runtime_error as WorkerStream
/// does, and if a record is not a state.
void work(const Physics& engine);

}  // namespace tendon::worker

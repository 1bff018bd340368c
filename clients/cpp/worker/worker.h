// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "clients/cpp/force_client.h"
#include "clients/cpp/worker/stream.h"

namespace tendon::worker {

/// A worker's end of the stream to the front that has started it (stream.h). A program on many ranks has one, on the
/// rank that reads and writes; it shares the record out, and every rank reads the state from it (Codec).
///
/// Thread-safe: no. Realtime-safe: no (system calls).
class WorkerStream {
 public:
  /// Connects to where the environment says, and opens the stream: the program is ready to answer. Throws
  /// std::runtime_error when the environment has no address, "TENDON_WORKER_ADDRESS: …", or nobody listens there.
  WorkerStream();
  ~WorkerStream();
  WorkerStream(const WorkerStream&) = delete;
  WorkerStream& operator=(const WorkerStream&) = delete;

  /// Waits for the next record, which has a state; empty when the front has ended the stream.
  std::optional<Record> next();
  /// Sends an answer (Codec::answer). False when the stream has ended.
  bool send(const Record& answer);

 private:
  int socket_ = -1;
  RecordReader reader_;
};

/// Answers every state by `engine`, until the front ends the stream: all that a worker's `main` needs. Exceptions of
/// `engine` pass through; the front then starts the next worker. Throws std::runtime_error as WorkerStream does, and
/// when what comes is no state.
void work(const Physics& engine);

}  // namespace tendon::worker

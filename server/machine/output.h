// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

namespace tendon {

/// Lets a program print without waiting for the reader of its output. Otherwise the program blocks if nobody reads the
/// pipe, or if the user has pressed Ctrl-S in the terminal.
///
/// While an object exists, the text for std::cout and std::cerr is added to a queue, and a thread writes the queue. The
/// text is added when a line is complete or the stream is flushed. The queue holds up to kQueueBytes for each stream. If
/// it is full, new lines are dropped until half of it has been written. The number of dropped lines is then written:
/// "312 lines were dropped: nobody read them", or {"event":"dropped","lines":312} if the last line was a JSON object.
///
/// The destructor waits until the queue is empty, or until nothing has been written for kPatience_s. If an object
/// already exists, another object has no effect. The constructor throws std::runtime_error if the thread cannot be
/// started.
///
/// Thread-safe: any thread may print. Only one thread may print while an object is created or destroyed.
/// Realtime-safe: no.
class UnblockedOutput {
 public:
  static constexpr std::size_t kQueueBytes = 256 * 1024;
  static constexpr double kPatience_s = 0.2;

  UnblockedOutput();
  ~UnblockedOutput();
  UnblockedOutput(const UnblockedOutput&) = delete;
  UnblockedOutput& operator=(const UnblockedOutput&) = delete;

  /// Waits like the destructor.
  void flush();

 private:
  class Redirection;
  std::unique_ptr<Redirection> redirection_;  ///< null if another object exists
};

}  // namespace tendon

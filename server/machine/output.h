// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

namespace tendon {

/// Allows a program to print even if nobody reads from the pipe, or if the user has pressed Ctrl-S in the terminal.
///
/// While an object of this class exists, a separate thread writes the output of std::cout and std::cerr. It is added to
/// a queue if a line is complete or if the stream is flushed. If the queue of a stream is full, new lines are dropped
/// until half of it has been written. Then, the number of dropped lines is written as "312 lines were dropped: nobody
/// read them", or as {"event":"dropped","lines":312} if the last line was a JSON object.
///
/// The destructor waits until the queue is empty, or until nothing has been written for kPatience_s. A second object of
/// this class has no effect. The constructor throws std::runtime_error if the thread cannot be started.
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

  void flush();

 private:
  class Redirection;
  std::unique_ptr<Redirection> redirection_;
};

}  // namespace tendon

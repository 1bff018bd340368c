// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "clients/cpp/worker/stream.h"

namespace tendon::worker {

/// Launches the worker program and owns the stream to it. There is one worker at a time; all ranks of `mpirun` are one.
/// The stream is a Unix socket in a directory that only this user can access, or, with Config::listen, TCP without
/// Nagle's algorithm. The program receives the address and a secret in its environment (stream.h). Each launch has a
/// new secret, which opens the stream once. TCP is not encrypted: use it only in the network of a cluster.
///
/// All processes started by the program are killed with it, including those that left its process group, as the ranks
/// of Open MPI do: this process adopts orphans (PR_SET_CHILD_SUBREAPER) and kills all its descendants. If this process
/// dies, the kernel kills the program, and workers end with their stream. Processes on other machines are ended by
/// their launcher. Only one object per process, because it kills all other children of the process as well.
///
/// Thread-safe: no. Realtime-safe: no.
class WorkerProcess {
 public:
  struct Config {
    std::string command;   ///< for /bin/sh; its stdout is redirected to stderr
    std::string listen{};  ///< "HOST:PORT" for TCP; port 0: any free port
  };

  explicit WorkerProcess(const Config& config);  ///< throws std::system_error or std::runtime_error if it cannot listen
  ~WorkerProcess();                              ///< kills the running program
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  /// Starts the program. `secret` must consist of kSecretDigits hexadecimal digits. Throws std::system_error.
  void launch(const std::string& secret);
  void kill();  ///< sends SIGKILL and closes the stream; remaining processes are killed again in each turn
  void send(const Record& record);  ///< ends the stream if the worker does not read

  struct Opened {};
  struct Ended {
    std::string why;
  };
  using Event = std::variant<Opened, Record, Ended>;
  std::optional<Event> next();      ///< call until it returns empty; there is one Ended event for each program
  int descriptor() const noexcept;  ///< for poll(); readable if next() has an event

  const std::string& address() const noexcept { return address_; }  ///< "unix:PATH" or "tcp:HOST:PORT"

 private:
  struct Files;
  void accept_one();
  void read_stream();
  void reap();
  void fail(const std::string& why);

  Config config_;
  std::string address_;
  std::string secret_;
  std::unique_ptr<Files> files_;
  RecordReader reader_;
  std::vector<Event> events_;
  bool ended_ = false;
  bool ending_ = false;  ///< processes of earlier programs still exist
};

}  // namespace tendon::worker

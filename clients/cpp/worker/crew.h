// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "clients/cpp/worker/stream.h"

namespace tendon::worker {

/// The worker's program and the stream to it. One worker at a time: `mpirun` with all its ranks counts as one.
///
/// The stream is a Unix socket in a folder that only this user can enter, or, with Config::listen, TCP without delay.
/// The program learns the address and a secret by its environment (stream.h). Each launch has a new secret, and one
/// program may open the stream once with it. TCP is in the clear: for a network where only the cluster listens.
///
/// Everything that the program starts is ended with it, even what has left its process group, as Open MPI's ranks do:
/// this process adopts orphans (PR_SET_CHILD_SUBREAPER) and kills all its descendants. When this process dies, the
/// kernel kills the program that it started, and a worker ends with its stream. What runs on other machines ends with
/// its launcher there. One in a process: any other child of this process is ended, too.
///
/// Thread-safe: no. Realtime-safe: no.
class Crew {
 public:
  struct Config {
    std::string command;   ///< for /bin/sh; its standard output goes to this one's standard error
    std::string listen{};  ///< "HOST:PORT" for TCP; port 0: any
  };

  /// Throws std::system_error or std::runtime_error when the address cannot be had.
  explicit Crew(const Config& config);
  /// Ends what is there.
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  /// Starts the program; `secret` is kSecretDigits hexadecimal digits. Throws std::system_error.
  void launch(const std::string& secret);
  /// SIGKILL, and the end of the stream. Processes that are not gone at once are killed again with each turn.
  void kill();
  /// Sends a record. A worker that does not read it is one whose stream has ended.
  void send(const Record& record);

  struct Opened {};
  struct Ended {
    std::string why;
  };
  using Event = std::variant<Opened, Record, Ended>;
  /// The next thing that has happened; call it until it is empty. Of each program, one Ended.
  std::optional<Event> next();
  /// For poll(): readable when next() has something.
  int descriptor() const noexcept;

  /// What the program is told: "unix:PATH" or "tcp:HOST:PORT".
  const std::string& address() const noexcept { return address_; }

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
  bool ended_ = false;   ///< it has been said of the present program
  bool ending_ = false;  ///< processes of earlier programs are left
};

}  // namespace tendon::worker

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tendon::sweep {

/// A program that is run to its end.
struct Child {
  std::vector<std::string> command;        ///< the program's file, then its arguments
  std::vector<std::string> environment{};  ///< NAME=value, beside this process'
};

struct ChildEnd {
  int status = 0;        ///< exit status; 128 + n when signal n ended it, as shells count
  std::string output{};  ///< what it wrote to standard output
  std::string errors{};  ///< the last 4 kB of standard error

  /// "exit status 3", "signal 9".
  std::string text() const;
};

/// Runs it, and waits. Its standard input is empty. Throws std::system_error when it cannot be started. Thread-safe: yes.
ChildEnd run(const Child& child);

/// … with this process' standard output and error. Returns the status.
int run_aloud(const Child& child);

}  // namespace tendon::sweep

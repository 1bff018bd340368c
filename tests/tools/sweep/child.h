// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tendon::sweep {

struct Child {
  std::vector<std::string> command;        ///< program file, then arguments
  std::vector<std::string> environment{};  ///< NAME=value, added to the environment of this process
};

struct ChildEnd {
  int status = 0;  ///< exit status; 128 + n after signal n
  std::string output{};
  std::string errors{};  ///< last 4 kB of standard error

  /// "exit status 3", "signal 9".
  std::string text() const;
};

/// With an empty standard input, until the child exits. Throws std::system_error if it cannot be started. Thread-safe:
/// yes.
ChildEnd run(const Child& child);

/// Runs the child with this process's standard output and error. Returns its exit status.
int run_aloud(const Child& child);

}  // namespace tendon::sweep

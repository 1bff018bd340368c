// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/run.h"

namespace tendon {

/// The command line of all clients (--server, --rate-hz, --duration-s, --json, --help …) and the options of a program.
class CommandLine {
 public:
  /// `purpose` is the first line of --help. `options` contains the defaults and receives the values. All references
  /// passed to this object must outlive parse().
  CommandLine(std::string purpose, Options& options);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// Adds a required positional argument: "SCENE".
  void add_argument(const std::string& name, std::string& value, const std::string& meaning);
  /// Adds a required positional argument with a fixed set of values.
  void add_argument(const std::string& name, std::string& value, const std::vector<std::string>& choices,
                    const std::string& meaning);
  /// Adds a finite number ≥ `least`: "--stiffness-n-per-m".
  void add(const std::string& name, double& value, const std::string& meaning, double least = 0);
  /// Adds a text: "--launch COMMAND", where `type` is "COMMAND".
  void add(const std::string& name, std::string& value, const std::string& type, const std::string& meaning);
  void add(const std::string& name, bool& value, const std::string& meaning);  ///< adds a flag: "--local-model"

  /// Returns nullopt if the program should continue, otherwise its exit code: 0 after --help, 2 after a usage error
  /// (printed to stderr), and the result of list_servers() after `--server dns-sd:`.
  std::optional<int> parse(int argc, const char* const* argv);

 private:
  struct Parser;  // keeps CLI11 out of this header
  std::unique_ptr<Parser> parser_;
};

}  // namespace tendon

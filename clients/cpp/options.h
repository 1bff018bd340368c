// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/run.h"

namespace tendon {

/// The command line that all guests share (--server, --rate-hz, --duration-s, --json, --help …), with the options that
/// a program adds.
class CommandLine {
 public:
  /// `purpose` heads the --help; `options` holds the defaults and receives what is given. The options
  /// and values named here must outlive parse().
  CommandLine(std::string purpose, Options& options);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// A required argument without a name before it: "SCENE".
  void add_argument(const std::string& name, std::string& value, const std::string& meaning);
  /// The same, one of `choices`.
  void add_argument(const std::string& name, std::string& value, const std::vector<std::string>& choices,
                    const std::string& meaning);
  /// A finite number ≥ `least`: "--stiffness-n-per-m".
  void add(const std::string& name, double& value, const std::string& meaning, double least = 0);
  /// A text: "--launch COMMAND", where `type` is "COMMAND".
  void add(const std::string& name, std::string& value, const std::string& type, const std::string& meaning);
  /// A switch: "--local-model".
  void add(const std::string& name, bool& value, const std::string& meaning);

  /// Empty: go on. Otherwise the exit code to leave with: 0 after --help, 2 after a wrong usage, which has
  /// been explained on stderr; that of list_servers() after `--server dns-sd:`.
  std::optional<int> parse(int argc, const char* const* argv);

 private:
  struct Parser;  // keeps CLI11 out of this header
  std::unique_ptr<Parser> parser_;
};

}  // namespace tendon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdio>
#include <optional>
#include <string_view>
#include <vector>

namespace tendon {

/// Describes the command line of a simple test program that does not use CLI11.
struct PlainUsage {
  const char* help;
  std::size_t most_arguments = 0;
  std::vector<std::string_view> options{};
};

/// Handles --help and --version, and rejects unknown options and extra arguments. nullopt: run the program.
inline std::optional<int> answer(const PlainUsage& usage, int argc, char** argv) {
  std::size_t arguments = 0;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--help" || word == "-h") {
      std::fputs(usage.help, stdout);
      return 0;
    }
    if (word == "--version") {
      std::puts(TENDON_VERSION);
      return 0;
    }
    bool known = false;
    for (const std::string_view option : usage.options) known = known || word.starts_with(option);
    if (!word.starts_with('-') && !word.empty()) known = ++arguments <= usage.most_arguments;
    if (word.empty() || known) continue;
    std::fprintf(stderr, "unexpected argument: %s\n\n%s", argv[i], usage.help);
    return 2;
  }
  return std::nullopt;
}

}  // namespace tendon

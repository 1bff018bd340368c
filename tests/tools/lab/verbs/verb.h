// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace tendon::lab {

/// A verb registers itself at namespace scope:
///
///     const Verb kNetem("netem", "What is left of …", [](CLI::App& verb, int& exit) { … });
///
/// `add` is called once, to add the options and the callback. The callback writes to standard output and may set `exit`
/// to 1 for a negative result; it throws std::invalid_argument for wrong usage (exit 2) and other exceptions for
/// failures (exit 1). Options must outlive the program's run, so they are static in `add`.
class Verb {
 public:
  using Add = void (*)(CLI::App& verb, int& exit);

  Verb(std::string name, std::string what, Add add);

  std::string name;
  std::string what;  ///< one line for --help
  Add add;
};

std::vector<Verb> verbs();

/// Returns the command that repeats a run: the verb and its options in the order of --help, without those that only
/// select the output, the shard or the number of threads.
std::string command_of(const CLI::App& verb);

/// Returns "a|b|c" for a catalogue whose rows have a `name`.
template <class Catalogue>
std::string names_of(const Catalogue& catalogue) {
  std::string names;
  for (const auto& row : catalogue) names += (names.empty() ? "" : "|") + std::string(row.name);
  return names;
}

}  // namespace tendon::lab

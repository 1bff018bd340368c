// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace tendon::lab {

/// A verb of tendon-lab. Its file defines one at namespace scope, and with that it is on the command line:
///
///     const Verb kNetem("netem", "What is left of …", [](CLI::App& verb, int& exit) { … });
///
/// `add` gives `verb` its options and its callback. The callback runs the verb and writes to standard output. It may
/// set `exit` to 1 when the verb ran and failed; it throws std::invalid_argument for wrong usage (exit 2) and anything
/// else for a failure (exit 1). Options live until the program ends: `add` is called once, so they are static in it.
class Verb {
 public:
  using Add = void (*)(CLI::App& verb, int& exit);

  Verb(std::string name, std::string what, Add add);

  std::string name;
  std::string what;  ///< one line for --help
  Add add;
};

/// All verbs, by name.
std::vector<Verb> verbs();

/// "a|b|c", of a catalogue whose rows have a `name`.
template <class Catalogue>
std::string names_of(const Catalogue& catalogue) {
  std::string names;
  for (const auto& row : catalogue) names += (names.empty() ? "" : "|") + std::string(row.name);
  return names;
}

}  // namespace tendon::lab

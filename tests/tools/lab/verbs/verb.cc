// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/verbs/verb.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace tendon::lab {
namespace {

/// A function-local static, because verbs register before main() in unspecified order.
std::vector<Verb>& known() {
  static std::vector<Verb> known;
  return known;
}

/// In single quotes if a shell would change it.
std::string for_a_shell(const std::string& word) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./,:@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

}  // namespace

Verb::Verb(std::string its_name, std::string its_what, Add its_add)
    : name(std::move(its_name)), what(std::move(its_what)), add(its_add) {
  known().push_back(*this);
}

std::vector<Verb> verbs() {
  std::vector<Verb> all = known();
  std::ranges::sort(all, {}, &Verb::name);
  return all;
}

std::string command_of(const CLI::App& verb) {
  constexpr std::array kOutput = {"--out", "--json",  "--units", "--from", "--jobs",
                                  "--csv", "--write", "--plot",  "--help"};
  std::string command = "tendon-lab " + verb.get_name();
  for (const CLI::Option* const option : verb.get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || std::ranges::find(kOutput, name) != kOutput.end()) continue;
    if (option->get_expected_max() == 0) {  // a flag
      command += ' ' + name;
      continue;
    }
    const bool is_list = option->get_delimiter() != '\0';
    std::string list;
    for (const std::string& value : option->results()) {
      if (is_list) {
        list += (list.empty() ? "" : std::string(1, option->get_delimiter())) + value;
      } else {
        command += (option->get_positional() ? " " : ' ' + name + ' ') + for_a_shell(value);
      }
    }
    if (is_list) command += ' ' + name + ' ' + for_a_shell(list);
  }
  return command;
}

}  // namespace tendon::lab

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

/// Shared by the command lines of all programs.
namespace tendon::usage {

/// Must be called before subcommands are added, because they inherit the formatter. Then --help shows
/// `--rate-hz NUMBER [100]` instead of CLI11's `--rate-hz FLOAT:FLOAT in [0 - 10000]=100`.
void dress(CLI::App& app);

/// Parses a command line. All programs call this function instead of CLI::App::parse, which reads an empty text as the
/// number 0, for example when a script passes a variable that is not set, and -1 as the largest unsigned number. Throws
/// CLI::ParseError.
void parse(CLI::App& app, int argc, const char* const* argv);

/// Returns the error message. It suggests the closest option or command, and points out a decimal comma.
std::string problem(const CLI::App& app, const CLI::ParseError& error);

/// Returns 0 after printing the help or version to stdout; or 2 after the program's name and the error to stderr.
int exit_code(const CLI::App& app, const CLI::ParseError& error);

/// The error for a text that is none of these words, `expected pose or twist, got "wrist"`; suggests a close word.
std::string refusal(const std::vector<std::string>& words, const std::string& text);

/// Accepts only these words. The help shows them as `a|b`.
CLI::Validator one_of(const std::vector<std::string>& words);

/// Like the function above, but maps each word to an enumerator, which is stored in the option.
template <class Value>
CLI::Validator one_of(const std::map<std::string, Value>& values) {
  std::vector<std::string> words;
  for (const auto& [word, value] : values) words.push_back(word);
  return CLI::Validator(
      [values, words](std::string& text) -> std::string {
        const auto found = values.find(text);
        if (found == values.end()) return refusal(words, text);
        text = std::to_string(static_cast<std::underlying_type_t<Value>>(found->second));
        return {};
      },
      one_of(words).get_description());
}

/// Accepts the texts for which `check` does not throw. The message of its std::exception is the error.
CLI::Validator accepted_by(std::function<void(const std::string&)> check);

}  // namespace tendon::usage

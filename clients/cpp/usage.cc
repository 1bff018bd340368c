// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/usage.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <iostream>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/nearest_word.h"

namespace tendon::usage {
namespace {

/// Formats the help without CLI11's notation for ranges, sets, defaults and counts.
class Help : public CLI::Formatter {
 public:
  Help() {
    label("FLOAT", "NUMBER");
    label("INT", "N");
    label("UINT", "N");
  }

  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text;
    if (option->get_type_size() != 0) {
      const std::string type = type_of(*option);
      if (!type.empty()) text += ' ' + type;
      if (!option->get_default_str().empty()) text += " [" + option->get_default_str() + ']';
      if (takes_several(*option)) text += " ...";
      if (option->get_required() && !option->get_positional()) text += " (required)";
    }
    if (!option->get_envname().empty()) text += " (or " + option->get_envname() + " in the environment)";
    return text;
  }

  std::string make_option_usage(const CLI::Option* option) const override {
    const std::string name = make_option_name(option, true) + (takes_several(*option) ? "..." : "");
    return option->get_required() ? name : '[' + name + ']';
  }

 private:
  /// Returns false for a fixed number of values, because the type already names each of them: "X,Y,Z".
  static bool takes_several(const CLI::Option& option) {
    return option.get_items_expected_max() > 1 && option.get_items_expected_min() != option.get_items_expected_max();
  }

  /// CLI11 adds the descriptions of the validators to the type: "TEXT:{on,off}" or "FLOAT:FLOAT in [0 - 1]".
  std::string type_of(const CLI::Option& option) const {
    std::string type = option.get_type_name();
    if (const std::size_t set = type.find(":{"); set != std::string::npos) {
      std::string words;
      for (const char c : type.substr(set + 2, type.find('}', set) - set - 2)) {
        if (c != ' ') words += c == ',' ? '|' : c;
      }
      return words;
    }
    if (option.get_positional()) return {};  // the name of the argument is enough
    for (const char* const check : {":FLOAT in [", ":INT in [", ":UINT in [", ":POSITIVE", ":NONNEGATIVE", ":FILE"}) {
      type.resize(std::min(type.find(check), type.size()));
    }
    return get_label(type);
  }
};

const CLI::App* chosen_in(const CLI::App& app) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  return chosen.empty() ? nullptr : chosen.front();
}

std::string unknown_option(const CLI::App& app, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  std::string known;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& one : option->get_lnames()) known += (known.empty() ? "--" : ", --") + one;
  }
  return "unknown option " + name + did_you_mean(name, known);
}

std::string unexpected_word(const CLI::App& app, const std::string& word) {
  std::string commands;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    commands += (commands.empty() ? "" : ", ") + command->get_name();
  }
  if (commands.empty()) return "unexpected argument \"" + word + '"';
  const std::string meant = did_you_mean(word, commands);
  return "unknown command \"" + word + '"' + (meant.empty() ? "; expected one of " + commands : meant);
}

/// Refuses empty texts, and negative counts, which CLI11 would read as the largest unsigned numbers.
void refuse_odd_values(CLI::App& app) {
  for (CLI::Option* const option : app.get_options()) {
    if (option->get_items_expected_max() == 0) continue;  // a flag
    std::string type = option->get_type_name();
    type.resize(std::min(type.find(':'), type.size()));
    const bool counts = type == "UINT" || type == "N";
    option->check([counts](const std::string& text) -> std::string {
      if (text.empty()) return "expected a value, got an empty text";
      return counts && text.front() == '-' ? "expected a whole number from 0, got " + text : "";
    });
  }
  for (CLI::App* const command : app.get_subcommands([](CLI::App*) { return true; })) refuse_odd_values(*command);
}

std::string list_of(const std::vector<std::string>& words) {
  std::string list;
  for (const std::string& word : words) list += (list.empty() ? "" : ", ") + word;
  return list;
}

}  // namespace

void dress(CLI::App& app) {
  app.formatter_fn([](const CLI::App* of, std::string name, CLI::AppFormatMode mode) {
    static const Help help;
    return help.make_help(of, std::move(name), mode);
  });
}

void parse(CLI::App& app, int argc, const char* const* argv) {
  refuse_odd_values(app);
  app.parse(argc, argv);
}

std::string problem(const CLI::App& app, const CLI::ParseError& error) {
  for (const CLI::App* command = &app; command != nullptr; command = chosen_in(*command)) {
    const std::vector<std::string> left = command->remaining();
    if (left.empty() || command->get_allow_extras()) continue;
    const std::string& word = left.front();
    return word.size() > 1 && word.front() == '-' ? unknown_option(*command, word) : unexpected_word(*command, word);
  }
  return error.what() + std::string(decimal_point_hint(error.what()));
}

int exit_code(const CLI::App& app, const CLI::ParseError& error) {
  constexpr int kWrongUsage = 2;
  if (error.get_exit_code() == 0) return app.exit(error);
  std::cerr << app.get_name() << ": " << problem(app, error) << " (see --help)\n";
  return kWrongUsage;
}

std::string refusal(const std::vector<std::string>& words, const std::string& text) {
  const std::string list = list_of(words);
  return "expected " + (words.size() == 2 ? words.front() + " or " + words.back() : list) + ", got \"" + text + '"' +
         did_you_mean(text, list);
}

CLI::Validator one_of(const std::vector<std::string>& words) {
  return CLI::Validator(
      [words](const std::string& text) {
        return std::find(words.begin(), words.end(), text) != words.end() ? std::string() : refusal(words, text);
      },
      '{' + list_of(words) + '}');
}

CLI::Validator accepted_by(std::function<void(const std::string&)> check) {
  return CLI::Validator(
      [check = std::move(check)](const std::string& text) -> std::string {
        try {
          check(text);
          return {};
        } catch (const std::exception& error) {
          return error.what();
        }
      },
      "");
}

}  // namespace tendon::usage

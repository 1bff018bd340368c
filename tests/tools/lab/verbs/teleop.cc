// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>

#include "core/control/preset.h"
#include "tests/support/part_options.h"
#include "tests/tools/lab/experiments/teleop.h"
#include "tests/tools/lab/experiments/teleop_matrix.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::teleop_verb {
namespace {

std::optional<Preset> preset_named(const std::string& name) {
  if (name == "none") return std::nullopt;
  std::string names = "none";
  for (const PresetInfo& known : presets()) {
    if (known.name == name) return known.preset;
    names += ", " + std::string(known.name);
  }
  throw std::invalid_argument("--preset: \"" + name + "\" is unknown, expected one of " + names);
}

void add(CLI::App& verb, int& /*exit*/) {
  static TeleopOptions options;
  static bool matrix = false;
  static std::string preset = "feel";
  verb.add_option("--hands", options.hands, "Number of hands for each method and round trip")->capture_default_str();
  verb.add_option("--seed", options.seed, "Seed of the first hand and its network")->capture_default_str();
  verb.add_option("--out", options.out,
                  "Write teleop.csv and a figure to this folder, as SVG and PNG (requires gnuplot)")
      ->type_name("DIR");
  add_part_options(
      verb, options.part,
      "0 to 48 * HANDS - 1, the trials: each hand at each round trip of each method. With --matrix: the rows");
  CLI::Option* const json =
      verb.add_flag("--json", options.json, "Print JSON on stdout, one object per line, instead of the table");
  CLI::Option* const rows = verb.add_flag(
      "--matrix", matrix,
      "Print each method for pairs of devices, with and without encoder counts, over named networks, as CSV");
  rows->excludes(json)->excludes(verb.get_option("--out"))->excludes(verb.get_option("--hands"));
  verb.add_option("--preset", preset, "With --matrix: preset of both limiters; none: aol+ without parts")
      ->capture_default_str()
      ->type_name("NAME")
      ->needs(rows);
  verb.footer(
      "\n"
      "Example\n"
      "  tendon-lab teleop --hands 21 --out figures     takes three minutes\n"
      "  tendon-lab teleop --matrix >matrix.csv               takes three minutes\n\n"
      "The same seed gives the same figures.\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([&verb] {
    options.command = command_of(verb);
    if (!matrix) return teleop(options, std::cout);
    teleop_matrix({.seed = options.seed, .preset = preset_named(preset), .part = options.part}, std::cout);
  });
}

const Verb kVerb("teleop", "Compare the force from a remote wall for each coupling method, over the round trip", add);

}  // namespace
}  // namespace tendon::lab::teleop_verb

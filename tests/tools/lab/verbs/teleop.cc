// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/support/part_options.h"
#include "tests/tools/lab/experiments/teleop.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::teleop_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static TeleopOptions options;
  verb.add_option("--hands", options.hands, "Number of hands for each method and round trip")->capture_default_str();
  verb.add_option("--seed", options.seed, "Seed of the first hand and its network")->capture_default_str();
  verb.add_option("--out", options.out, "Draw the figure in this folder, as SVG and PNG (requires gnuplot)")
      ->type_name("DIR");
  add_part_options(verb, options.part, "0 to 48 * HANDS - 1, the trials: each hand at each round trip of each method");
  verb.add_flag("--json", options.json, "Print JSON on stdout, one object per line, instead of the table");
  verb.footer(
      "\n"
      "Example\n"
      "  tendon-lab teleop --hands 21 --out figures     takes three minutes\n\n"
      "The same seed gives the same figures.\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([] { teleop(options, std::cout); });
}

const Verb kVerb("teleop", "Compare the force from a remote wall for each coupling method, over the round trip", add);

}  // namespace
}  // namespace tendon::lab::teleop_verb

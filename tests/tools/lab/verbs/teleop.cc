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
  verb.add_option("--hands", options.hands, "drawn for each method and round trip")->capture_default_str();
  verb.add_option("--seed", options.seed, "of the first hand and its network")->capture_default_str();
  verb.add_option("--out", options.out, "draw the figure there, SVG and PNG (needs gnuplot)")->type_name("DIR");
  add_part_options(verb, options.part, "0 to 48 * HANDS - 1, the trials: each hand at each round trip of each method");
  verb.add_flag("--json", options.json, "one JSON object for each line instead of the table");
  verb.footer(
      "\nExample\n  tendon-lab teleop --hands 21 --out figures     three minutes\n"
      "\nThe same seed gives the same figures. Exit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb.callback([] { teleop(options, std::cout); });
}

const Verb kVerb("teleop", "How a wall behind a network is felt by each method of coupling, over the round trip", add);

}  // namespace
}  // namespace tendon::lab::teleop_verb

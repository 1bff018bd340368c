// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/experiments/cost.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::cost_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static CostOptions options;
  verb.add_option("--batches", options.batches, "measured for each line; the median counts")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb.add_option("--out", options.out, "draw the figure there, SVG and PNG (needs gnuplot)")->type_name("DIR");
  verb.add_flag("--json", options.json, "one JSON object for each line instead of the table");
  verb.footer(
      "\nExample\n  tendon-lab cost --out figures\n"
      "\nTimes are those of this machine, now. Exit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb.callback([] { cost(options, std::cout); });
}

const Verb kVerb("cost", "What accuracy costs in time inside the loop", add);

}  // namespace
}  // namespace tendon::lab::cost_verb

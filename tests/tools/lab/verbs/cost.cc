// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/experiments/cost.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::cost_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static CostOptions options;
  verb.add_option("--batches", options.batches, "Number of batches per line; the median is used")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb.add_option("--out", options.out, "Write cost.csv and a figure to this folder, as SVG and PNG (requires gnuplot)")
      ->type_name("DIR");
  verb.add_flag("--json", options.json, "Print JSON on stdout, one object per line, instead of the table");
  verb.footer(
      "\n"
      "Example\n"
      "  tendon-lab cost --out figures\n\n"
      "Times are measured on this machine.\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([&verb] {
    options.command = command_of(verb);
    cost(options, std::cout);
  });
}

const Verb kVerb("cost", "Measure the accuracy of laws and estimators over the time of one step", add);

}  // namespace
}  // namespace tendon::lab::cost_verb

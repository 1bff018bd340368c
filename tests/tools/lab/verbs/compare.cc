// SPDX-License-Identifier: Apache-2.0
// tendon-lab compare: its command line.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/experiments/compare.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static CompareOptions options;
  verb.add_option("--every", options.every, "take every so-manieth situation of the grid")->capture_default_str();
  verb.add_option("--seed", options.seed, "of the network; the same for all laws")->capture_default_str();
  verb.add_option("--out", options.out, "write compare.csv and a figure there, SVG and PNG (needs gnuplot)")
      ->type_name("DIR");
  verb.add_flag("--json", options.json, "one JSON object for each cell instead of the table");
  verb.footer(
      "\nExample: all of it, some minutes\n  tendon-lab compare --out comparison\n"
      "\nExit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb.callback([] {
    options.progress = isatty(STDERR_FILENO) != 0;
    compare(options, std::cout);
  });
}

const Verb kVerb("compare", "Runs every stability controller in every situation: which one to use", add);

}  // namespace
}  // namespace tendon::lab

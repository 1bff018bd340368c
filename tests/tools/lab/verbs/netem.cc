// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/experiments/netem.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::netem_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static NetemOptions options;
  verb.add_option("--count", options.count, "datagrams for each line")->capture_default_str();
  verb.add_option("--seed", options.seed, "of both")->capture_default_str();
  verb.add_option("--out", options.out, "draw the figure there, SVG and PNG (needs gnuplot)")->type_name("DIR");
  verb.add_flag("--json", options.json, "one JSON object for each line instead of the table");
  verb.footer(
      "\nExample\n  tendon-lab netem --out figures\n"
      "\nExit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb.callback([] { netem(options, std::cout); });
}

const Verb kVerb("netem", "What is left of loss and delay asked for with a correlation: tc-netem beside tendon-inject",
                 add);

}  // namespace
}  // namespace tendon::lab::netem_verb

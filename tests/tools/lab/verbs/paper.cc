// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/support/part_options.h"
#include "tests/tools/lab/experiments/paper.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::paper_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static PaperOptions options;
  verb.add_option("--out", options.out, "draw a figure of each experiment there, SVG and PNG (needs gnuplot)")
      ->type_name("DIR");
  add_part_options(verb, options.part, "0 to 30, the rows of the table");
  verb.add_flag("--json", options.json, "one JSON object for each experiment and law instead of the table");
  verb.footer(
      "\nExample: table and figures\n  tendon-lab paper --out figures\n"
      "\nNothing in it is random.\nExit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb.callback([] { paper(options, std::cout); });
}

const Verb kVerb("paper", "The experiments of Lee & Lee 2009 without control, with AOL and with AOL+", add);

}  // namespace
}  // namespace tendon::lab::paper_verb

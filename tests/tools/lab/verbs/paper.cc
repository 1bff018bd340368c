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
  verb.add_option("--out", options.out,
                  "Write paper.csv and a figure of each experiment to this folder, as SVG and PNG (requires gnuplot)")
      ->type_name("DIR");
  add_part_options(verb, options.part, "0 to 30, the rows of the table");
  verb.add_flag("--json", options.json,
                "Print JSON on stdout, one object per experiment and law, instead of the table");
  verb.footer(
      "\n"
      "Example: print the table and draw the figures\n"
      "  tendon-lab paper --out figures\n\n"
      "The result does not depend on random numbers.\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([&verb] {
    options.command = command_of(verb);
    paper(options, std::cout);
  });
}

const Verb kVerb("paper", "Run the experiments of Lee & Lee 2009 without control, with AOL and with AOL+", add);

}  // namespace
}  // namespace tendon::lab::paper_verb

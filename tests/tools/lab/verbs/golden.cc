// SPDX-License-Identifier: Apache-2.0
// tendon-lab golden: its command line.
#include "tests/tools/lab/golden/golden.h"

#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab {
namespace {

void add(CLI::App& verb, int& exit) {
  static GoldenOptions options;
  verb.add_option("FOLDER", options.folder, "the folder of laws.csv")->capture_default_str();
  verb.add_flag("--write", options.write, "write the table anew, after a change that is meant");
  verb.footer(
      "\nExamples\n"
      "  tendon-lab golden            which figures of which law has my change moved?\n"
      "  tendon-lab golden --write    take them as they are now\n"
      "\nNothing in it is random, and no figure depends on the processor or the C library.\n"
      "Exit: 0 all figures are the same bit for bit, or were written; 1 some differ (they are listed), or the table\n"
      "cannot be read or written; 2 wrong usage.");
  verb.callback([&exit] {
    if (!golden(options, std::cout)) exit = 1;
  });
}

const Verb kVerb("golden", "Compares what every law does with the committed table, bit for bit", add);

}  // namespace
}  // namespace tendon::lab

// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/golden/golden.h"

#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::golden_verb {
namespace {

void add(CLI::App& verb, int& exit) {
  static GoldenOptions options;
  verb.add_option("FOLDER", options.folder, "the folder of laws.csv and cost.csv")->capture_default_str();
  verb.add_flag("--cost", options.cost, "cost.csv instead of laws.csv: instructions in one step; takes valgrind");
  verb.add_flag("--write", options.write, "write the table anew, after a change that is meant");
  verb.footer(
      "\nExamples\n"
      "  tendon-lab golden            which figures of which law has my change moved?\n"
      "  tendon-lab golden --write    take them as they are now\n"
      "  tendon-lab golden --cost     which law has become dearer, or cheaper, by more than 2 %?\n"
      "\nNothing in it is random, and no figure depends on the processor or the C library.\n"
      "Instructions do depend on the compiler: cost.csv is compared with a build of the same one only.\n"
      "Exit: 0 all figures are the same, or were written; 1 some differ (they are listed), or the table cannot be\n"
      "read, written or compared; 2 wrong usage.");
  verb.callback([&exit] {
    options.law_cost = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "law-cost";
    if (!golden(options, std::cout)) exit = 1;
  });
}

const Verb kVerb("golden", "Compares what every law does with the committed table, bit for bit", add);

}  // namespace
}  // namespace tendon::lab::golden_verb

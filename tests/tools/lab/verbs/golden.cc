// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/golden/golden.h"

#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::golden_verb {
namespace {

void add(CLI::App& verb, int& exit) {
  static GoldenOptions options;
  verb.add_option("FOLDER", options.folder, "Folder of laws.csv and cost.csv")->capture_default_str();
  verb.add_flag("--cost", options.cost,
                "Use cost.csv instead of laws.csv: instructions in one step (requires valgrind)");
  verb.add_flag("--write", options.write, "Write the table again, after an intended change");
  verb.footer(
      "\n"
      "Examples\n"
      "  tendon-lab golden            print the values of each law that differ from the table\n"
      "  tendon-lab golden --write    write the current values to the table\n"
      "  tendon-lab golden --cost     print the laws whose cost differs by more than 2 %\n\n"
      "The result does not depend on random numbers, the processor or the C library.\n"
      "Instructions depend on the compiler: cost.csv is only compared with a build of the same compiler.\n"
      "Exit: 0 success: all values are identical, or were written; 1 failed: some differ (and are printed), or the\n"
      "table cannot be read, written or compared; 2 wrong usage.");
  verb.callback([&exit] {
    options.law_cost = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "law-cost";
    if (!golden(options, std::cout)) exit = 1;
  });
}

const Verb kVerb("golden", "Compare the results of all laws with the committed table, bit by bit", add);

}  // namespace
}  // namespace tendon::lab::golden_verb

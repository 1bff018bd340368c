// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>
#include <stdexcept>

#include "tests/support/part_options.h"
#include "tests/tools/lab/experiments/compare.h"
#include "tests/tools/lab/experiments/compare_kinds.h"
#include "tests/tools/lab/experiments/situations.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::compare_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static CompareOptions options;
  static CompareKindsOptions drawn;
  std::string names = "all";
  for (const SituationKind& kind : situation_kinds()) names += ", " + std::string(kind.name);
  verb.add_option("--kinds", drawn.kinds, "Use situations drawn from seeds instead of the grid: " + names)
      ->delimiter(',')
      ->type_name("KIND,…");
  verb.add_option("--count", drawn.count, "With --kinds: number of situations of each kind")->capture_default_str();
  verb.add_option("--laws", drawn.laws, "With --kinds: laws and presets. Default: those that guarantee passivity")
      ->delimiter(',')
      ->type_name("NAME,…");
  verb.add_flag("--held-out", drawn.held_out, "With --kinds: use seeds on which no law was tuned");
  verb.add_option("--every", options.every, "Use every Nth situation of the grid")->capture_default_str();
  verb.add_option("--seed", options.seed, "Seed of the network; the same for all laws")->capture_default_str();
  add_part_options(verb, options.part, "0 to 2303, the situations of the grid (with --every, the used ones)");
  verb.add_option("--out", options.out,
                  "Write compare.csv and a figure to this folder, as SVG and PNG (requires gnuplot)")
      ->type_name("DIR");
  verb.add_flag("--json", options.json, "Print JSON on stdout, one object per cell, instead of the table");
  verb.footer(
      "\n"
      "Example: run everything, which takes some minutes\n"
      "  tendon-lab compare --out comparison\n"
      "Example: compare situations outside of the grid, on seeds on which no law was tuned\n"
      "  tendon-lab compare --kinds all --held-out --count 100\n\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([&verb] {
    options.command = drawn.command = command_of(verb);
    if (drawn.kinds.empty()) return compare(options, std::cout);
    if (options.part.units || options.part.from)
      throw std::invalid_argument("--kinds: cannot be used with --units or --from, which only support the grid");
    drawn.seed = options.seed;
    drawn.out = options.out;
    drawn.json = options.json;
    drawn.progress = options.part.progress;
    compare_kinds(drawn, std::cout);
  });
}

const Verb kVerb("compare", "Compare all stability controllers in all situations, and recommend one", add);

}  // namespace
}  // namespace tendon::lab::compare_verb

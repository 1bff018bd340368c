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
  verb.add_option("--kinds", drawn.kinds, "instead of the grid, situations that are drawn from seeds: " + names)
      ->delimiter(',')
      ->type_name("KIND,…");
  verb.add_option("--count", drawn.count, "with --kinds: situations of each kind")->capture_default_str();
  verb.add_option("--laws", drawn.laws, "with --kinds: laws and presets; left out: those that promise to be passive")
      ->delimiter(',')
      ->type_name("NAME,…");
  verb.add_flag("--held-out", drawn.held_out, "with --kinds: seeds on which no law was tuned");
  verb.add_option("--every", options.every, "take every Nth situation of the grid")->capture_default_str();
  verb.add_option("--seed", options.seed, "of the network; the same for all laws")->capture_default_str();
  add_part_options(verb, options.part, "0 to 2303, the situations of the grid (with --every, those that are taken)");
  verb.add_option("--out", options.out, "write compare.csv and a figure there, SVG and PNG (needs gnuplot)")
      ->type_name("DIR");
  verb.add_flag("--json", options.json, "one JSON object for each cell instead of the table");
  verb.footer(
      "\nExample: all of it, some minutes\n  tendon-lab compare --out comparison\n"
      "Example: what the grid does not have, on seeds that no law was tuned on\n"
      "  tendon-lab compare --kinds all --held-out --count 100\n"
      "\nExit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb.callback([] {
    if (drawn.kinds.empty()) return compare(options, std::cout);
    if (options.part.units || options.part.from) throw std::invalid_argument("--kinds: cannot be swept; the grid can");
    drawn.seed = options.seed;
    drawn.out = options.out;
    drawn.json = options.json;
    drawn.progress = options.part.progress;
    compare_kinds(drawn, std::cout);
  });
}

const Verb kVerb("compare", "Runs every stability controller in every situation: which one to use", add);

}  // namespace
}  // namespace tendon::lab::compare_verb

// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/experiments/floor.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::floor_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static FloorOptions options;
  verb.add_option("--out", options.out, "write floor.csv there")->type_name("DIR");
  verb.add_flag("--json", options.json, "one JSON object for each floor instead of the table");
  verb.footer(
      "\nExample: what no law can be better than\n  tendon-lab floor\n"
      "\nExit: 0 done; 1 cannot write; 2 wrong usage.");
  verb.callback([] { floors(options, std::cout); });
}

const Verb kVerb("floor", "The least force error that any passive law can have, by a convex programme", add);

}  // namespace
}  // namespace tendon::lab::floor_verb

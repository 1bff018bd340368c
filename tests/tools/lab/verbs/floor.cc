// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/experiments/floor.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::floor_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static FloorOptions options;
  verb.add_option("--out", options.out, "Write floor.csv to this folder")->type_name("DIR");
  verb.add_flag("--json", options.json, "Print JSON on stdout, one object per floor, instead of the table");
  verb.footer("\nExample\n  tendon-lab floor\n\nExit: 0 success; 1 failed; 2 wrong usage.");
  verb.callback([&verb] {
    options.command = command_of(verb);
    floors(options, std::cout);
  });
}

const Verb kVerb("floor", "Compute the least force error of any passive law, by convex optimization", add);

}  // namespace
}  // namespace tendon::lab::floor_verb

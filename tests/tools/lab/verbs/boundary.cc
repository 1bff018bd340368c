// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/support/part_options.h"
#include "tests/tools/lab/experiments/boundary.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::boundary_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static BoundaryOptions options;
  verb.add_option("--mass", options.mass, "of the device, kg")->capture_default_str();
  verb.add_option("--b", options.viscous, "viscous friction of the device, N s/m")->capture_default_str();
  verb.add_option("--out", options.out, "draw the figure there, SVG and PNG (needs gnuplot)")->type_name("DIR");
  add_part_options(verb, options.part, "0 to 17, the rows of the table");
  verb.add_flag("--json", options.json, "one JSON object for each point instead of the table");
  verb.footer(
      "\nExample\n  tendon-lab boundary --b 0.26 --out figures\n"
      "\nNothing in it is random.\nExit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb.callback([] { boundary(options, std::cout); });
}

const Verb kVerb("boundary", "How stiff a spring may be over delay and rate: simulated, and as theory says", add);

}  // namespace
}  // namespace tendon::lab::boundary_verb

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
  verb.add_option("--mass", options.mass, "Mass of the device, kg")->capture_default_str();
  verb.add_option("--b", options.viscous, "Viscous friction of the device, N s/m")->capture_default_str();
  verb.add_option("--out", options.out,
                  "Write boundary.csv and a figure to this folder, as SVG and PNG (requires gnuplot)")
      ->type_name("DIR");
  add_part_options(verb, options.part, "0 to 17, the rows of the table");
  verb.add_flag("--json", options.json, "Print JSON on stdout, one object per point, instead of the table");
  verb.footer(
      "\n"
      "Example\n"
      "  tendon-lab boundary --b 0.26 --out figures\n\n"
      "The result does not depend on random numbers.\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([&verb] {
    options.command = command_of(verb);
    boundary(options, std::cout);
  });
}

const Verb kVerb("boundary", "Find the stiffest stable spring over delay and rate, in simulation and theory", add);

}  // namespace
}  // namespace tendon::lab::boundary_verb

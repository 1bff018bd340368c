// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/field.h"

#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::field_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static FieldOptions options;
  verb.add_option("--n", options.hands, "Number of hands")->capture_default_str();
  verb.add_option("--seed", options.seed, "Seed of the first hand and its network")->capture_default_str();
  verb.add_option("--scenes", options.scenes, names_of(field_scenes()) + ". Default: all")
      ->type_name("NAME,...")
      ->delimiter(',');
  CLI::Option* const rtt =
      verb.add_option("--rtt-ms", options.round_trips_ms, "Constant round trips; 5 % of the answers are lost")
          ->type_name("MS,...")
          ->delimiter(',')
          ->capture_default_str();
  verb.add_option("--networks", options.networks, "Networks of tendon-inject instead: " + injector::names_of_profiles())
      ->type_name("NAME,...")
      ->delimiter(',')
      ->excludes(rtt);
  verb.add_option("--count-um", options.count_um, "Counts of the encoders, µm; 0: exact")->capture_default_str();
  verb.add_flag("--far", options.far, "Only draw the forces on the sphere and in the slot, at 200 and 600 ms");
  verb.add_option("--out", options.out,
                  "Write field.csv and a figure to this folder, as SVG and PNG (requires gnuplot)")
      ->type_name("DIR");
  verb.add_flag("--json", options.json, "Print JSON on stdout, one object per line, instead of the table");
  verb.footer(
      "\n"
      "Example\n"
      "  tendon-lab field --seed 101 --n 5 --out figures\n\n"
      "The same seed gives the same figures.\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([&verb] {
    options.command = command_of(verb);
    field_experiment(options, std::cout);
  });
}

const Verb kVerb("field", "Compare a remote object as forces, as a plane and as a field, over the round trip", add);

}  // namespace
}  // namespace tendon::lab::field_verb

// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/tools/lab/experiments/netem.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::netem_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static NetemOptions options;
  verb.add_option("--count", options.count, "Datagrams for each line")->capture_default_str();
  verb.add_option("--seed", options.seed, "Seed of both")->capture_default_str();
  verb.add_option("--out", options.out,
                  "Write netem.csv and a figure to this folder, as SVG and PNG (requires gnuplot)")
      ->type_name("DIR");
  verb.add_flag("--json", options.json, "Print JSON on stdout, one object per line, instead of the table");
  verb.footer(
      "\n"
      "Example\n"
      "  tendon-lab netem --out figures\n\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([&verb] {
    options.command = command_of(verb);
    netem(options, std::cout);
  });
}

const Verb kVerb("netem", "Compare correlated losses and delays of tc-netem and tendon-inject with the requested ones",
                 add);

}  // namespace
}  // namespace tendon::lab::netem_verb

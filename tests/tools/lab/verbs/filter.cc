// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/filter.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>
#include <vector>

#include "server/scene/scene.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::filter_verb {
namespace {

struct FilterArguments {
  FilterLaw law;
  bool json = false;
};

void add(CLI::App& verb, int& exit) {
  static FilterArguments arguments;
  FilterLaw& law = arguments.law;
  verb.add_option("--law", law.name, names_of(laws()))->type_name("NAME")->capture_default_str();
  verb.add_option("--b", law.viscous, "Lower bound of the viscous friction of the device, N s/m")->required();
  verb.add_option("--fc", law.coulomb, "Lower bound of its Coulomb friction, N")->required();
  verb.add_option("--period-us", law.period_us, "Longest time for which a force is held, µs")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb.add_option("--set", law.settings,
                  "Set a key of the scene: limiter.clamp_n=8, limiter.robust_ledger.encoder_step_um=30, "
                  "limiter.knee.start=0.8 (see tendond --scene-help for all)")
      ->type_name("TABLE.KEY=VALUE")
      ->allow_extra_args(false);
  verb.add_flag("--json", arguments.json, "Print JSON on stdout, one object per row, instead of CSV");
  verb.footer(
      "\n"
      "Input: t_s,x_m,wanted_n or t_s,x_m,y_m,z_m,wanted_x_n,wanted_y_n,wanted_z_n; forces on the hand.\n"
      "Output: the same and applied_n,permitted_n,energy_j,reason.\n\n"
      "Examples\n"
      "  tendon-lab filter --law aol --b 0.26 --fc 0.005 --period-us 1000 < in.csv > out.csv\n"
      "  tendon-lab filter --b 0.26 --fc 0.005 --set limiter.knee.start=0.8 < in.csv > out.csv\n\n"
      "The result does not depend on random numbers.\n"
      "Exit: 0 success; 1 failed, because of a wrong row (which is reported, and not written); 2 wrong usage.");
  verb.callback([&exit] {
    const FilterOptions options{.limiter = limiter_of(arguments.law), .json = arguments.json};
    std::ios::sync_with_stdio(false);
    std::cin.tie(nullptr);  // filter() flushes when no input is waiting, not for every row
    if (filter(options, std::cin, std::cout, std::cerr) > 0) exit = 1;
  });
}

const Verb kVerb("filter", "Run a stability controller on your own recording, from stdin to stdout", add);

}  // namespace
}  // namespace tendon::lab::filter_verb

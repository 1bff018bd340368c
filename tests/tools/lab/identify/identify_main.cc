// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "clients/cpp/usage.h"
#include "server/build_info.h"
#include "tests/support/part_options.h"
#include "tests/support/run_tool.h"
#include "tests/tools/lab/identify/identify.h"

namespace tendon::lab {
namespace {

int main(int argc, char** argv) {
  CLI::App app("Viscous and Coulomb friction of a haptic device, as lower bounds for the limiter.", "tendon-identify");
  usage::dress(app);
  app.footer(
      "\nA run: one axis free, the others held, gravity compensated, nobody touches the handle; the force rises from 0 "
      "at\n"
      "a constant rate until the handle has run through its workspace. Do 3 slopes, 5 times each, in both directions, "
      "at\n"
      "5 poses of each axis. One CSV file each, with a header line and the columns t_s, x_m, force_n (force on the "
      "hand).\n"
      "With --of rotation it is a torque that rises and a turn about one axis: t_s, angle_rad, torque_nm; with --of\n"
      "gripper the travel of the fingers and the force on them: t_s, x_m, force_n.\n"
      "\nExample: without hardware\n"
      "  tendon-identify --simulate-friction 0.005,0.05\n"
      "  tendon-identify --of rotation --simulate-friction 0.0005,0.001\n"
      "Example: recorded runs\n"
      "  tendon-identify forth.csv back.csv --axis x --axis x --mass 0.075 --encoder-step 3e-5\n"
      "\nExit: 0 done; 1 a file is bad or a run cannot be used; 2 wrong usage.");

  app.set_version_flag("--version", version_text());
  IdentifyOptions options;
  std::vector<std::string> files;
  std::string profile;
  std::vector<double> friction;
  std::map<std::string, Freedom> freedoms;
  for (const FreedomInfo& each : kFreedoms) freedoms.emplace(each.name, each.freedom);
  double mass = 0;
  double encoder_step = 0;
  app.add_option("--of", options.freedom, "what the runs move")->transform(usage::one_of(freedoms));
  app.add_option("RUN", files, "runs, one file each")->type_name("FILE.csv");
  app.add_option("--axis", options.places, "axis and pose of a run; once for each file, in order")
      ->type_name("TEXT")
      ->allow_extra_args(false);
  CLI::Option* const mass_option =
      app.add_option("--mass", mass, "handle and mechanism, kg, or its inertia, kg·m²; left out: fitted")
          ->type_name("M");
  CLI::Option* const step_option =
      app.add_option("--encoder-step", encoder_step, "one count, m or rad; left out: 3e-5 m, 1e-4 rad")
          ->type_name("STEP");
  app.add_option("--simulate", profile, "simulate a device instead: phantom-premium, touch, falcon")
      ->type_name("PROFILE");
  app.add_option("--simulate-friction", friction,
                 "simulate 75 g with b (N·s/m) and f_c (N) instead, or 1e-4 kg·m² with N·m·s/rad and N·m")
      ->type_name("B,FC")
      ->delimiter(',')
      ->expected(2);
  app.add_option("--seed", options.seed, "of the simulation's noise")->type_name("N");
  add_part_options(app, options.part, "the runs, in their order from 0 on: the files, or 30 that are simulated");
  app.add_flag("--json", options.json, "one JSON object for each run and a last one for the result");

  return run_tool(app, argc, argv, [&] {
    options.files.assign(files.begin(), files.end());
    if (!profile.empty()) options.profile = profile;
    if (!friction.empty()) options.simulated_friction = Friction{.coulomb = friction[1], .viscous = friction[0]};
    if (*mass_option) options.mass = mass;
    if (*step_option) options.encoder_step = encoder_step;
    identify(options, std::cout);
    return 0;
  });
}

}  // namespace
}  // namespace tendon::lab

int main(int argc, char** argv) { return tendon::lab::main(argc, argv); }

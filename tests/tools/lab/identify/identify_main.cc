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
  CLI::App app("Identify the viscous and Coulomb friction of a haptic device, as lower bounds for the limiter.",
               "tendon-identify");
  usage::dress(app);
  app.footer(
      "\n"
      "In a run, one axis is free and the others are fixed, gravity is compensated, and nobody touches the handle. The "
      "force\n"
      "increases from 0 at a constant rate until the handle has crossed its workspace. Record 3 rates, 5 times each, "
      "in both\n"
      "directions, at 5 poses of each axis. Save each run as a CSV file with a header line and the columns t_s, x_m, "
      "force_n\n"
      "(force on the hand). With --of rotation, the torque increases and the handle rotates about one axis: t_s, "
      "angle_rad,\n"
      "torque_nm. With --of gripper, x_m is the travel of the fingers and force_n the force on them.\n\n"
      "Example: without hardware\n"
      "  tendon-identify --simulate-friction 0.005,0.05\n"
      "  tendon-identify --of rotation --simulate-friction 0.0005,0.001\n"
      "Example: recorded runs\n"
      "  tendon-identify forth.csv back.csv --axis x --axis x --mass 0.075 --encoder-step 3e-5\n\n"
      "Exit: 0 success; 1 failed, because a file or a run cannot be used; 2 wrong usage.");

  app.set_version_flag("--version", version_text());
  IdentifyOptions options;
  std::vector<std::string> files;
  std::string profile;
  std::vector<double> friction;
  std::map<std::string, Freedom> freedoms;
  for (const FreedomInfo& each : kFreedoms) freedoms.emplace(each.name, each.freedom);
  double mass = 0;
  double encoder_step = 0;
  app.add_option("--of", options.freedom, "Freedom of the runs")->transform(usage::one_of(freedoms));
  app.add_option("RUN", files, "Runs, one file each")->type_name("FILE.csv");
  app.add_option("--axis", options.places, "Axis and pose of a run; once for each file, in order")
      ->type_name("TEXT")
      ->allow_extra_args(false);
  CLI::Option* const mass_option =
      app.add_option("--mass", mass, "Mass of the handle and mechanism, kg, or their inertia, kg·m². Default: fitted")
          ->type_name("M");
  CLI::Option* const step_option =
      app.add_option("--encoder-step", encoder_step, "Step of the encoder, m or rad. Default: 3e-5 m, 1e-4 rad")
          ->type_name("STEP");
  app.add_option("--simulate", profile, "Simulate a device instead: phantom-premium, touch, falcon")
      ->type_name("PROFILE");
  app.add_option("--simulate-friction", friction,
                 "Simulate 75 g with b (N·s/m) and f_c (N) instead, or 1e-4 kg·m² with N·m·s/rad and N·m")
      ->type_name("B,FC")
      ->delimiter(',')
      ->expected(2);
  app.add_option("--seed", options.seed, "Seed of the simulated noise")->type_name("N");
  add_part_options(app, options.part, "the runs, in order from 0: the files, or 30 simulated runs");
  app.add_flag("--json", options.json, "Print JSON on stdout, one object per run and one for the result");

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

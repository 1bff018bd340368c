// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "clients/cpp/usage.h"
#include "core/control/limiter.h"
#include "server/build_info.h"
#include "tests/support/run_tool.h"
#include "tests/tools/replay/merge.h"
#include "tests/tools/replay/repair.h"
#include "tests/tools/replay/replay.h"

int main(int argc, char** argv) {
  std::string names;
  for (const tendon::LawInfo& law : tendon::laws()) names += (names.empty() ? "" : "|") + std::string(law.name);

  tendon::replay::Options options;
  std::string recording;
  std::vector<std::string> parts;
  std::string law;
  std::string files;
  std::string device;
  std::string csv;
  std::string picture;
  std::string follower;
  std::string into;
  std::string mended;
  CLI::App app(
      "Replay a recording through the control law, to verify the recorded forces, or with another law or other "
      "settings.",
      "tendon-replay");
  tendon::usage::dress(app);
  app.set_version_flag("--version", tendon::version_text());
  app.add_option("RECORDING", recording, "Recording of tendond or of its flight recorder")
      ->type_name("FILE.mcap")
      ->required();
  app.add_option("PART", parts, "Following parts, in order: run-2.mcap run-3.mcap")->type_name("FILE.mcap");
  app.add_option("--law", law, "Use another limiter, with the friction bounds of the scene: " + names)
      ->type_name("NAME");
  app.add_option(
         "--set", options.settings,
         "Set a key of the scene: limiter.kind=aol, force.max_force_n=2. Without a value: remove the key or table")
      ->type_name("TABLE.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--files", files, "Folder of the files in the scene")->type_name("DIR")->default_val(".");
  app.add_option("--device", device, "Only this device of the recording")->type_name("NAME");
  app.add_flag("--field", options.fields, "Also render the recorded fields again, and verify their forces");
  app.add_option("--csv", csv, "Write a row for each step to this file")->type_name("FILE.csv");
  app.add_option("--out", picture, "Draw both runs side by side (requires gnuplot)")->type_name("FILE.svg|FILE.png");
  auto* const merged = app.add_option("--merge", follower,
                                      "Merge the RECORDING of a leader with this recording of its follower, in the "
                                      "time of the leader, with a proven bound of the clocks")
                           ->type_name("FILE.mcap");
  auto* const one = app.add_option("--into", into, "Output file of --merge")->type_name("FILE.mcap");
  merged->needs(one);
  one->needs(merged);
  auto* const repaired =
      app.add_option("--repair", mended, "Copy the valid part of a damaged or truncated RECORDING to this file")
          ->type_name("FILE.mcap")
          ->excludes(merged);
  for (const char* const other : {"PART", "--law", "--set", "--device", "--field", "--csv", "--out"}) {
    merged->excludes(app.get_option(other));
    repaired->excludes(app.get_option(other));
  }
  app.add_flag("--json", options.json, "Print JSON on stdout, one object per line, instead of the table");
  app.footer(
      "\n"
      "Examples\n"
      "  tendon-replay run.mcap                          verify the recorded forces\n"
      "  tendon-replay run.mcap run-2.mcap               verify a recording with several parts\n"
      "  tendon-replay run.mcap --law aol --out both.png  compare the recorded forces with those of another law\n"
      "  tendon-replay leader.mcap --merge follower.mcap --into pair.mcap    merge both ends of a coupling\n"
      "  tendon-replay run.mcap --repair whole.mcap      copy the valid part of a damaged recording\n\n"
      "Exit: 0 success; 1 failed, or a step differs (and is printed); 2 wrong usage.");

  return tendon::run_tool(app, argc, argv, [&] {
    if (!follower.empty()) {
      tendon::replay::merge({.leader = recording, .follower = follower, .out = into, .json = options.json}, std::cout);
      return 0;
    }
    if (!mended.empty()) {
      tendon::replay::repair({.recording = recording, .out = mended, .json = options.json}, std::cout);
      return 0;
    }
    options.recording = recording;
    options.more_parts.assign(parts.begin(), parts.end());
    options.files = files;
    if (!law.empty()) options.law = law;
    if (!device.empty()) options.device = device;
    if (!csv.empty()) options.csv = csv;
    if (!picture.empty()) options.picture = picture;
    options.progress = isatty(STDERR_FILENO) != 0;
    constexpr int kDiffers = 1;
    return tendon::replay::replay(options, std::cout) ? 0 : kDiffers;
  });
}

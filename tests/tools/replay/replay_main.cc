// SPDX-License-Identifier: Apache-2.0
// tendon-replay: runs a recording through the control law again.
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
      "A recording through the control law again: bit for bit as it was recorded, or with another law or other "
      "settings.",
      "tendon-replay");
  tendon::usage::dress(app);
  app.set_version_flag("--version", tendon::version_text());
  app.add_option("RECORDING", recording, "a recording of tendond, or what its flight recorder left")
      ->type_name("FILE.mcap")
      ->required();
  app.add_option("PART", parts, "the parts that follow it, in order: run-2.mcap run-3.mcap")->type_name("FILE.mcap");
  app.add_option("--law", law, "another limiter, with the scene's friction bounds: " + names)->type_name("NAME");
  app.add_option("--set", options.settings,
                 "another value in the scene: limiter.kind=aol, force.max_force_n=2; without a "
                 "value the key or table is taken out")
      ->type_name("TABLE.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--files", files, "folder of the files that the scene names")->type_name("DIR")->default_val(".");
  app.add_option("--device", device, "of a recording of several devices, this one only")->type_name("NAME");
  app.add_option("--csv", csv, "write a row for each step there")->type_name("FILE.csv");
  app.add_option("--out", picture, "draw both runs side by side (needs gnuplot)")->type_name("FILE.svg|FILE.png");
  auto* const merged = app.add_option("--merge", follower,
                                      "RECORDING is a leader's, and this its follower's: write both into one, in the "
                                      "leader's time, with a proved bound of the clocks")
                           ->type_name("FILE.mcap");
  auto* const one = app.add_option("--into", into, "the file that --merge writes")->type_name("FILE.mcap");
  merged->needs(one);
  one->needs(merged);
  auto* const repaired =
      app.add_option("--repair", mended, "copy the valid part of a damaged or truncated RECORDING to this file")
          ->type_name("FILE.mcap")
          ->excludes(merged);
  for (const char* const other : {"PART", "--law", "--set", "--device", "--csv", "--out"}) {
    merged->excludes(app.get_option(other));
    repaired->excludes(app.get_option(other));
  }
  app.add_flag("--json", options.json, "JSON objects on stdout, a line each, instead of the table");
  app.footer(
      "\nExamples\n"
      "  tendon-replay run.mcap                          is what was recorded what the law decides?\n"
      "  tendon-replay run.mcap run-2.mcap               … of a long run, which has parts\n"
      "  tendon-replay run.mcap --law aol --out both.png  what would the law of 2009 have permitted?\n"
      "  tendon-replay leader.mcap --merge follower.mcap --into pair.mcap    both ends of a coupling in one clock\n"
      "  tendon-replay run.mcap --repair whole.mcap      copy the valid part of a damaged recording\n"
      "\nExit: 0 done; 1 a step differs (it is named), or a file cannot be read or written; 2 wrong usage.");

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

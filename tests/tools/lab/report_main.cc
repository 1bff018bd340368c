// SPDX-License-Identifier: Apache-2.0
// tendon-report: compares recorded runs. A separate program, so that deploy/demo need not build the lab.
#include <CLI/CLI.hpp>
#include <iostream>
#include <string>
#include <vector>

#include "clients/cpp/usage.h"
#include "server/build_info.h"
#include "tests/support/run_tool.h"
#include "tests/tools/lab/recordings/pair_report.h"
#include "tests/tools/lab/recordings/report.h"

int main(int argc, char** argv) {
  tendon::lab::ReportOptions options;
  std::vector<std::string> recordings;
  std::string picture;
  bool pairs = false;
  CLI::App app("Summarize recorded runs as a table and a picture.", "tendon-report");
  tendon::usage::dress(app);
  app.set_version_flag("--version", tendon::version_text());
  app.add_option("RECORDING", recordings, "Recordings of tendond. The table has a column for each device")
      ->type_name("FILE.mcap")
      ->required();
  app.add_option("--out", picture, "Draw the runs side by side (requires gnuplot)")->type_name("FILE.svg|FILE.png");
  app.add_option("--label", options.labels, "Name of a run; once for each recording, in order")
      ->type_name("TEXT")
      ->allow_extra_args(false);
  app.add_option("--device", options.devices, "Only this device; can be repeated")
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_flag("--pairs", pairs, "Each recording is of two coupled ends, from `tendon-replay --merge`");
  app.add_flag("--json", options.json,
               "Print JSON on stdout, one object per device of each recording, instead of the table");
  app.add_flag("--check", options.check, "Fail if the ledger of a device, or of a pair, fell below -1 nJ");
  app.footer(
      "\n"
      "Example: the same motion without and with the limiter\n"
      "  tendon-report off.mcap on.mcap --label \"limiter off\" --label \"limiter on\" --out runs.svg\n\n"
      "Exit: 0 success; 1 failed, because a recording cannot be read, or gnuplot or --check failed; 2 wrong usage.");

  return tendon::run_tool(app, argc, argv, [&] {
    options.recordings.assign(recordings.begin(), recordings.end());
    if (!picture.empty()) options.picture = picture;
    pairs ? tendon::lab::report_pairs(options, std::cout) : tendon::lab::report(options, std::cout);
    return 0;
  });
}

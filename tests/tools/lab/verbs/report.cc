// SPDX-License-Identifier: Apache-2.0
// tendon-lab report: its command line.
#include <CLI/CLI.hpp>
#include <iostream>
#include <string>
#include <vector>

#include "tests/tools/lab/recordings/report.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab {
namespace {

struct ReportArguments {
  ReportOptions options;
  std::vector<std::string> recordings;
  std::string picture;
};

void add(CLI::App& verb, int& /*exit*/) {
  static ReportArguments arguments;
  verb.add_option("RECORDING", arguments.recordings, "recordings of tendond, one column each")
      ->type_name("FILE.mcap")
      ->required()
      ->check(CLI::ExistingFile.description(""));
  verb.add_option("--out", arguments.picture, "draw the runs side by side (needs gnuplot)")
      ->type_name("FILE.svg|FILE.png");
  verb.add_option("--label", arguments.options.labels, "what a run is called; once for each recording, in order")
      ->type_name("TEXT")
      ->allow_extra_args(false);
  verb.add_flag("--json", arguments.options.json, "one JSON object for each recording on stdout instead of the table");
  verb.footer(
      "\nExample: the same motion without and with the limiter\n"
      "  tendon-lab report off.mcap on.mcap --label \"limiter off\" --label \"limiter on\" --out runs.svg\n"
      "\nExit: 0 done; 1 a recording is corrupt or gnuplot failed; 2 wrong usage.");
  verb.callback([] {
    ReportOptions& options = arguments.options;
    options.recordings.assign(arguments.recordings.begin(), arguments.recordings.end());
    if (!arguments.picture.empty()) options.picture = arguments.picture;
    report(options, std::cout);
  });
}

const Verb kVerb("report", "Sums up recorded runs as a table and a picture", add);

}  // namespace
}  // namespace tendon::lab

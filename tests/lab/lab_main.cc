// SPDX-License-Identifier: Apache-2.0
// tendon-lab: experiments with recorded runs. Here is its command line; each verb is a function of its own.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/lab/report.h"

namespace tendon::lab {
namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;

int complain(const std::exception& error, int code) {
  std::cerr << "tendon-lab: " << error.what() << (code == kWrongUsage ? " (see --help)\n" : "\n");
  return code;
}

int main(int argc, char** argv) {
  CLI::App app("Experiments with Tendon.", "tendon-lab");
  app.require_subcommand(1);
  app.footer(
      "\nExample: the same motion without and with the limiter, as a table and a picture\n"
      "  tendon-lab report off.mcap on.mcap --out runs.png\n"
      "\ntendon-lab VERB --help tells more.\n\nExit: 0 done; 1 failed; 2 wrong usage.");

  ReportOptions options;
  std::vector<std::string> recordings;
  std::string picture;
  CLI::App* const report_verb = app.add_subcommand("report", "What recorded runs come down to: a table and a picture");
  report_verb->add_option("RECORDING", recordings, "recordings of tendond, one column each")
      ->type_name("FILE.mcap")
      ->required()
      ->check(CLI::ExistingFile.description(""));
  report_verb->add_option("--out", picture, "draw the runs side by side (needs gnuplot)")
      ->type_name("FILE.svg|FILE.png");
  report_verb->add_option("--label", options.labels, "what a run is called; once for each recording, in order")
      ->type_name("TEXT")
      ->allow_extra_args(false);
  report_verb->add_flag("--json", options.json, "one JSON object for each recording on stdout instead of the table");
  report_verb->footer(
      "\nExample: the same motion without and with the limiter\n"
      "  tendon-lab report off.mcap on.mcap --label \"limiter off\" --label \"limiter on\" --out runs.svg\n"
      "\nExit: 0 done; 1 a recording is corrupt or gnuplot failed; 2 wrong usage.");

  try {
    app.parse(argc, argv);
    options.recordings.assign(recordings.begin(), recordings.end());
    if (!picture.empty()) options.picture = picture;
    report(options, std::cout);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return complain(error, kWrongUsage);
  } catch (const std::invalid_argument& error) {
    return complain(error, kWrongUsage);
  } catch (const std::exception& error) {
    return complain(error, kFailed);
  }
  return kDone;
}

}  // namespace
}  // namespace tendon::lab

int main(int argc, char** argv) { return tendon::lab::main(argc, argv); }

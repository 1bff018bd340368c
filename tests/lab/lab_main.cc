// SPDX-License-Identifier: Apache-2.0
// tendon-lab: experiments with recorded and simulated runs. Here is its command line; each verb is a function of its
// own.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/lab/boundary.h"
#include "tests/lab/compare.h"
#include "tests/lab/cost.h"
#include "tests/lab/filter.h"
#include "tests/lab/netem.h"
#include "tests/lab/paper.h"
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

struct ReportArguments {
  ReportOptions options;
  std::vector<std::string> recordings;
  std::string picture;
};

void add_report(CLI::App& app, ReportArguments& arguments) {
  CLI::App* const verb = app.add_subcommand("report", "What recorded runs come down to: a table and a picture");
  verb->add_option("RECORDING", arguments.recordings, "recordings of tendond, one column each")
      ->type_name("FILE.mcap")
      ->required()
      ->check(CLI::ExistingFile.description(""));
  verb->add_option("--out", arguments.picture, "draw the runs side by side (needs gnuplot)")
      ->type_name("FILE.svg|FILE.png");
  verb->add_option("--label", arguments.options.labels, "what a run is called; once for each recording, in order")
      ->type_name("TEXT")
      ->allow_extra_args(false);
  verb->add_flag("--json", arguments.options.json, "one JSON object for each recording on stdout instead of the table");
  verb->footer(
      "\nExample: the same motion without and with the limiter\n"
      "  tendon-lab report off.mcap on.mcap --label \"limiter off\" --label \"limiter on\" --out runs.svg\n"
      "\nExit: 0 done; 1 a recording is corrupt or gnuplot failed; 2 wrong usage.");
  verb->callback([&arguments] {
    ReportOptions& options = arguments.options;
    options.recordings.assign(arguments.recordings.begin(), arguments.recordings.end());
    if (!arguments.picture.empty()) options.picture = arguments.picture;
    report(options, std::cout);
  });
}

void add_paper(CLI::App& app, PaperOptions& options) {
  CLI::App* const verb =
      app.add_subcommand("paper", "The experiments of Lee & Lee 2009 without control, with AOL and with AOL+");
  verb->add_option("--out", options.out, "draw a figure of each experiment there, SVG and PNG (needs gnuplot)")
      ->type_name("DIR");
  verb->add_flag("--json", options.json, "one JSON object for each experiment and law instead of the table");
  verb->footer(
      "\nExample: table and figures\n  tendon-lab paper --out figures\n"
      "\nNothing in it is random.\nExit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb->callback([&options] { paper(options, std::cout); });
}

struct FilterArguments {
  FilterOptions options;
  std::string law = "aol+";
  double period_us = 1000;
  double delay_ms = 0;
  bool energy_cap = false;
  bool knee = false;
  double encoder_um = 0;
  int latency_reserve = 0;
  double acceleration = 0;
  double shaping = 0.3;
};

void add_filter(CLI::App& app, FilterArguments& arguments, int& exit) {
  std::string names;
  for (const LawInfo& law : laws()) names += (names.empty() ? "" : "|") + std::string(law.name);
  CLI::App* const verb = app.add_subcommand("filter", "Any stability controller on a recording of your own, on a pipe");
  verb->add_option("--law", arguments.law, names)->type_name("NAME")->capture_default_str();
  verb->add_option("--b", arguments.options.limiter.friction.viscous, "lower bound of viscous friction, N s/m")
      ->required();
  verb->add_option("--fc", arguments.options.limiter.friction.coulomb, "lower bound of Coulomb friction, N")
      ->required();
  verb->add_option("--period-us", arguments.period_us, "the longest that a force is held, microseconds")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_option("--max-force", arguments.options.limiter.max_force, "of the law clamp, N");
  verb->add_option("--stiffness", arguments.options.limiter.environment_stiffness,
                   "of the environment, N/m, for laws that have to know it");
  verb->add_option("--delay-ms", arguments.delay_ms, "of the environment, for laws that have to know it");
  verb->add_flag("--energy-cap", arguments.energy_cap, "part of aol+: forget what free motion has earned");
  verb->add_flag("--knee", arguments.knee, "part of aol+: compress forces near the bound instead of clipping them");
  verb->add_option("--encoder-um", arguments.encoder_um,
                   "part of aol+: robust ledger for counts of so many micrometres");
  verb->add_option("--latency-reserve", arguments.latency_reserve,
                   "part of aol+: hold back the friction of so many intervals")
      ->check(CLI::PositiveNumber);
  verb->add_option("--acceleration", arguments.acceleration,
                   "part of aol+: the hand never accelerates by more than this, m/s^2");
  verb->add_option("--shaping-b", arguments.shaping, "… and the bound is kept below that of this friction, N s/m")
      ->capture_default_str();
  verb->add_flag("--json", arguments.options.json, "one JSON object for each row instead of CSV");
  verb->footer(
      "\nIn: t_s,x_m,wanted_n or t_s,x_m,y_m,z_m,wanted_x_n,wanted_y_n,wanted_z_n; forces on the hand.\n"
      "Out: the same and applied_n,permitted_n,energy_j,reason.\n"
      "\nExample\n  tendon-lab filter --law aol --b 0.26 --fc 0.005 --period-us 1000 < in.csv > out.csv\n"
      "\nNothing in it is random.\nExit: 0 done; 1 a row was bad (its line is named, nothing is written for it); 2 "
      "wrong "
      "usage.");
  verb->callback([&arguments, names, &exit] {
    LimiterConfig& limiter = arguments.options.limiter;
    const auto law = law_named(arguments.law);
    if (!law) throw std::invalid_argument("--law " + arguments.law + ": expected " + names);
    limiter.law = *law;
    limiter.longest_hold = from_seconds(arguments.period_us * 1e-6);
    limiter.environment_delay = from_seconds(arguments.delay_ms * 1e-3);
    if (arguments.energy_cap) limiter.parts.energy_cap.emplace();
    if (arguments.knee) limiter.parts.knee.emplace();
    if (arguments.encoder_um > 0) limiter.parts.robust_ledger.emplace().encoder_step = {arguments.encoder_um * 1e-6};
    if (arguments.latency_reserve > 0) limiter.parts.latency_reserve.emplace().holds = arguments.latency_reserve;
    if (arguments.acceleration > 0) {
      auto& bounded = limiter.parts.bounded_acceleration.emplace();
      bounded.most = {arguments.acceleration};
      bounded.shaping_viscous = {arguments.shaping};
    }
    std::ios::sync_with_stdio(false);
    std::cin.tie(nullptr);  // filter() flushes when nothing waits to be read, not for every row
    if (filter(arguments.options, std::cin, std::cout, std::cerr) > 0) exit = kFailed;
  });
}

void add_compare(CLI::App& app, CompareOptions& options) {
  CLI::App* const verb =
      app.add_subcommand("compare", "Every stability controller in every situation: which one to use");
  verb->add_option("--every", options.every, "take every so-manieth situation of the grid")->capture_default_str();
  verb->add_option("--seed", options.seed, "of the network; the same for all laws")->capture_default_str();
  verb->add_option("--out", options.out, "write compare.csv and a figure there, SVG and PNG (needs gnuplot)")
      ->type_name("DIR");
  verb->add_flag("--json", options.json, "one JSON object for each cell instead of the table");
  verb->footer(
      "\nExample: all of it, some minutes\n  tendon-lab compare --out comparison\n"
      "\nExit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb->callback([&options] {
    options.progress = isatty(STDERR_FILENO) != 0;
    compare(options, std::cout);
  });
}

void add_boundary(CLI::App& app, BoundaryOptions& options) {
  CLI::App* const verb =
      app.add_subcommand("boundary", "How stiff a spring may be over delay and rate: simulated, and as theory says");
  verb->add_option("--mass", options.mass, "of the device, kg")->capture_default_str();
  verb->add_option("--b", options.viscous, "viscous friction of the device, N s/m")->capture_default_str();
  verb->add_option("--out", options.out, "draw the figure there, SVG and PNG (needs gnuplot)")->type_name("DIR");
  verb->add_flag("--json", options.json, "one JSON object for each point instead of the table");
  verb->footer(
      "\nExample\n  tendon-lab boundary --b 0.26 --out figures\n"
      "\nNothing in it is random.\nExit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb->callback([&options] { boundary(options, std::cout); });
}

void add_cost(CLI::App& app, CostOptions& options) {
  CLI::App* const verb = app.add_subcommand("cost", "What accuracy costs in time inside the loop");
  verb->add_option("--batches", options.batches, "measured for each line; the median counts")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_option("--out", options.out, "draw the figure there, SVG and PNG (needs gnuplot)")->type_name("DIR");
  verb->add_flag("--json", options.json, "one JSON object for each line instead of the table");
  verb->footer(
      "\nExample\n  tendon-lab cost --out figures\n"
      "\nTimes are those of this machine, now. Exit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb->callback([&options] { cost(options, std::cout); });
}

void add_netem(CLI::App& app, NetemOptions& options) {
  CLI::App* const verb = app.add_subcommand(
      "netem", "What is left of loss and delay that are asked for with a correlation: tc-netem, and here");
  verb->add_option("--count", options.count, "datagrams for each line")->capture_default_str();
  verb->add_option("--seed", options.seed, "of both")->capture_default_str();
  verb->add_option("--out", options.out, "draw the figure there, SVG and PNG (needs gnuplot)")->type_name("DIR");
  verb->add_flag("--json", options.json, "one JSON object for each line instead of the table");
  verb->footer(
      "\nExample\n  tendon-lab netem --out figures\n"
      "\nExit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb->callback([&options] { netem(options, std::cout); });
}

int main(int argc, char** argv) {
  CLI::App app("Experiments with Tendon.", "tendon-lab");
  app.require_subcommand(1);
  app.footer(
      "\nExample: the same motion without and with the limiter, as a table and a picture\n"
      "  tendon-lab report off.mcap on.mcap --out runs.png\n"
      "\ntendon-lab VERB --help tells more.\n\nExit: 0 done; 1 failed; 2 wrong usage.");
  int exit = kDone;
  ReportArguments report_arguments;
  PaperOptions paper_options;
  FilterArguments filter_arguments;
  CompareOptions compare_options;
  BoundaryOptions boundary_options;
  CostOptions cost_options;
  NetemOptions netem_options;
  add_report(app, report_arguments);
  add_paper(app, paper_options);
  add_filter(app, filter_arguments, exit);
  add_compare(app, compare_options);
  add_boundary(app, boundary_options);
  add_cost(app, cost_options);
  add_netem(app, netem_options);

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return complain(error, kWrongUsage);
  } catch (const std::invalid_argument& error) {
    return complain(error, kWrongUsage);
  } catch (const std::exception& error) {
    return complain(error, kFailed);
  }
  return exit;
}

}  // namespace
}  // namespace tendon::lab

int main(int argc, char** argv) { return tendon::lab::main(argc, argv); }

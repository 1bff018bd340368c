// SPDX-License-Identifier: Apache-2.0
// tendon-lab: experiments with recorded and simulated runs. Here is its command line; each verb is a function of its
// own.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

#include "server/build_info.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/lab/experiments/accuracy.h"
#include "tests/tools/lab/experiments/boundary.h"
#include "tests/tools/lab/experiments/compare.h"
#include "tests/tools/lab/experiments/cost.h"
#include "tests/tools/lab/experiments/netem.h"
#include "tests/tools/lab/experiments/paper.h"
#include "tests/tools/lab/recordings/filter.h"
#include "tests/tools/lab/recordings/report.h"

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

struct AccuracyArguments {
  AccuracyOptions options;
  std::vector<std::string> models;
  std::vector<std::string> elements;
  std::string block_mm = "100x100x50";
  double young_pa = 10000;
  double poisson = 0.45;
  double patch_radius_mm = 20;
  std::vector<double> patch_centre_mm = {0, 0};
  std::vector<double> loads_n = {0.3, 1};
  std::string network;
  std::uint64_t seed = 1;
};

/// "100x100x50", mm → m.
softbody::Vec3 lengths(const std::string& text) {
  softbody::Vec3 size;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    double mm = 0;
    const auto [next, error] = std::from_chars(at, end, mm);
    const bool last = axis == 2;
    if (error != std::errc() || (last ? next != end : next == end || *next != 'x')) {
      throw std::invalid_argument("--block-mm " + text + ": expected three lengths, as in 100x100x50");
    }
    size[axis] = 1e-3 * mm;
    at = next + (last ? 0 : 1);
  }
  return size;
}

/// What the catalogue calls `names`; `find` is its look-up, `all` every name.
template <class Find>
auto named(const std::vector<std::string>& names, Find find, const std::string& all) {
  std::vector<std::remove_cvref_t<decltype(*find(std::string_view()))>> found;
  for (const std::string& name : names) {
    const auto one = find(name);
    if (!one) throw std::invalid_argument(name + ": expected " + all);
    found.push_back(*one);
  }
  return found;
}

void add_accuracy(CLI::App& app, AccuracyArguments& arguments) {
  AccuracyOptions& options = arguments.options;
  std::string models;
  for (const auto& model : softbody::models()) models += (models.empty() ? "" : "|") + std::string(model.name);
  std::string elements;
  for (const auto& element : softbody::elements())
    elements += (elements.empty() ? "" : "|") + std::string(element.name);
  CLI::App* const verb = app.add_subcommand("accuracy", "What the accuracy of a soft body costs in time");
  verb->add_option("--block-mm", arguments.block_mm, "lengths of a block that is clamped below")
      ->type_name("XxYxZ")
      ->capture_default_str();
  verb->add_option("--young-pa", arguments.young_pa, "its Young's modulus")->capture_default_str();
  verb->add_option("--poisson", arguments.poisson, "its Poisson's ratio, 0 to below 0.5")->capture_default_str();
  verb->add_option("--patch-radius-mm", arguments.patch_radius_mm, "of what presses on its top")->capture_default_str();
  verb->add_option("--patch-center-mm", arguments.patch_centre_mm, "… and its place, from the middle of the top")
      ->type_name("X,Y")
      ->delimiter(',')
      ->expected(2)
      ->capture_default_str();
  verb->add_option("--loads-n", arguments.loads_n, "a gentle press and a hard one")
      ->type_name("N,N")
      ->delimiter(',')
      ->expected(2)
      ->capture_default_str();
  verb->add_option("--n", options.resolutions, "cells along x, coarse to fine")
      ->type_name("N,...")
      ->delimiter(',')
      ->capture_default_str();
  verb->add_option("--models", arguments.models, models + "; left out: all")->type_name("NAME,...")->delimiter(',');
  verb->add_option("--elements", arguments.elements, elements + "; left out: all")
      ->type_name("NAME,...")
      ->delimiter(',');
  verb->add_option("--slowest-ms", options.slowest_ms, "a model is refined no further than this for an update")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_option("--longest-setup-s", options.longest_setup_s,
                   "… and this for its set-up; left out: 30, with a budget 5")
      ->check(CLI::PositiveNumber);
  verb->add_option("--longest-point-s", options.longest_point_s, "… and this to measure it, all in all")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_option("--network", arguments.network,
                   "what is left at the hand behind it: " + injector::names_of_profiles())
      ->type_name("NAME|LINE");
  verb->add_option("--seed", arguments.seed, "of the network")->capture_default_str();
  verb->add_option("--budget-ms", options.budget_ms,
                   "only say what is best at the hand in so long an update, "
                   "of what is not there for comparison")
      ->check(CLI::PositiveNumber);
  verb->add_option("--truth-cells", options.truth.cells, "of the mesh of the truth, to the patch's radius")
      ->check(CLI::Range(2.0, 8.0))
      ->capture_default_str();
  verb->add_option("--out", options.out, "write accuracy.csv and a figure there, SVG and PNG (needs gnuplot)")
      ->type_name("DIR");
  verb->add_flag("--json", options.json, "one JSON object for each model and mesh instead of the table");
  verb->footer(
      "\nExample: which element, quickly\n"
      "  tendon-lab accuracy --models condensed --n 4,8,16 --longest-setup-s 5\n"
      "all of it, in half an hour or more\n  tendon-lab accuracy --network wifi-good --out figures\n"
      "what to take\n  tendon-lab accuracy --budget-ms 5 --network wifi-good --json\n"
      "\nTimes are those of this machine, now. Exit: 0 done; 1 cannot write, or gnuplot failed; 2 wrong usage.");
  verb->callback([&arguments, &options, models, elements] {
    options.models = named(arguments.models, softbody::model_named, models);
    options.elements = named(arguments.elements, softbody::element_named, elements);
    options.block = {.size = lengths(arguments.block_mm),
                     .material = {.young = arguments.young_pa, .poisson = arguments.poisson},
                     .patch_radius = 1e-3 * arguments.patch_radius_mm,
                     .patch_centre = {1e-3 * arguments.patch_centre_mm.at(0), 1e-3 * arguments.patch_centre_mm.at(1)},
                     .loads = {arguments.loads_n.at(0), arguments.loads_n.at(1)}};
    if (!arguments.network.empty()) options.network = {.name = arguments.network, .seed = arguments.seed};
    if (options.budget_ms) options.slowest_ms = *options.budget_ms;
    options.progress = isatty(STDERR_FILENO) != 0;
    accuracy(options, std::cout);
  });
}

void add_bench(CLI::App& app, bench::BenchOptions& options) {
  std::string names;
  for (const bench::Section& section : bench::sections())
    names += (names.empty() ? "" : "|") + std::string(section.name);
  CLI::App* const verb = app.add_subcommand("bench", "What things cost, each beside the machine's own floor");
  verb->add_option("--only", options.only, names + "; any number of times")->type_name("NAME")->allow_extra_args(false);
  verb->add_option(
          "--fifo", options.priority,
          "real-time priority of what is measured, on a machine with other work; it takes both cores from that")
      ->type_name("PRIORITY")
      ->check(CLI::Range(1, 60));
  verb->add_option("--seed", options.seed, "of worlds, keys and networks")->capture_default_str();
  verb->add_option("--write", options.write, "write the table as a page in Markdown, too")->type_name("FILE.md");
  verb->add_flag("--quick", options.quick, "only that it runs: seconds, and the figures mean nothing");
  verb->add_flag("--json", options.json, "one JSON object for each line of the table, and one for its circumstances");
  verb->footer(
      "\nExample: all of it, some minutes, with its page\n"
      "  tendon-lab bench --fifo 50 --write tests/tools/bench/RESULTS.md\n"
      "one part\n  tendon-lab bench --only steps --json\n"
      "\nTimes are those of this machine, now. Exit: 0 measured, whatever the figures; 1 it could not be; 2 wrong "
      "usage.");
  verb->callback([&options] {
    options.progress = isatty(STDERR_FILENO) != 0;
    bench::bench(options, std::cout);
  });
}

int main(int argc, char** argv) {
  CLI::App app("Experiments with Tendon.", "tendon-lab");
  app.set_version_flag("--version", version_text());
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
  AccuracyArguments accuracy_arguments;
  bench::BenchOptions bench_options;
  add_report(app, report_arguments);
  add_paper(app, paper_options);
  add_filter(app, filter_arguments, exit);
  add_compare(app, compare_options);
  add_boundary(app, boundary_options);
  add_cost(app, cost_options);
  add_netem(app, netem_options);
  add_accuracy(app, accuracy_arguments);
  add_bench(app, bench_options);

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

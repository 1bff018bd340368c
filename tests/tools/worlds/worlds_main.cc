// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <ctime>
#include <exception>
#include <fstream>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "clients/cpp/usage.h"
#include "server/build_info.h"
#include "server/scene/scene.h"
#include "tests/support/json_line.h"
#include "tests/tools/worlds/day.h"
#include "tests/tools/worlds/runner.h"
#include "tests/tools/worlds/shrink_world.h"

namespace tendon::simulation {
namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;

struct RunArguments {
  RunOptions options;
  std::optional<std::uint64_t> seed;
  std::optional<double> for_s;
  std::string seeds_file;
  std::string units;
  std::string from;
  bool verbose = false;
};

int run(RunArguments& arguments) {
  RunOptions& options = arguments.options;
  if (arguments.seed) return run_one(*arguments.seed, arguments.verbose, std::cout) ? kDone : kFailed;
  if (!arguments.units.empty()) {
    explore_units(parse_units(arguments.units), options.jobs, std::cout);
    if (!std::cout.flush()) throw std::runtime_error("cannot write: is the disk full?");
    return kDone;
  }
  if (!arguments.from.empty()) {
    std::ifstream lines(arguments.from);
    return judge(lines, std::cout) ? kDone : kFailed;
  }
  if (!arguments.seeds_file.empty()) options.seeds = read_seeds(arguments.seeds_file);
  const auto began = std::chrono::steady_clock::now();
  options.elapsed = [began] { return std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now() - began); };
  if (arguments.for_s) options.budget = from_seconds(*arguments.for_s);
  options.progress = isatty(STDERR_FILENO) != 0;
  return explore(options, std::cout, std::cerr) ? kDone : kFailed;
}

void add_run(CLI::App& app, RunArguments& arguments) {
  CLI::App* const verb = app.add_subcommand("run", "Run worlds, one for each seed, until one violates a guarantee");
  auto* const count =
      verb->add_option("--count", arguments.options.count, "worlds")->type_name("N")->capture_default_str();
  verb->add_option("--for-s", arguments.for_s, "Run for this time, s, instead of --count")
      ->type_name("S")
      ->check(CLI::PositiveNumber)
      ->excludes(count);
  verb->add_option("--first-seed", arguments.options.first_seed,
                   "Seed of the first world; the others use the following seeds")
      ->type_name("K")
      ->capture_default_str();
  verb->add_option("--jobs", arguments.options.jobs, "threads")
      ->type_name("J")
      ->check(CLI::Range(1U, 1024U))
      ->default_str("one for each core");
  verb->add_option("--seeds", arguments.seeds_file, "Seeds to run first: a number at the start of each line")
      ->type_name("FILE");
  auto* const seed = verb->add_option("--seed", arguments.seed, "Only run this world")->type_name("N");
  verb->add_option("--units", arguments.units, "Run all of these seeds, as a shard of a sweep, and print JSON")
      ->type_name("FIRST:COUNT")
      ->excludes(seed, count);
  verb->add_option("--from", arguments.from,
                   "Run nothing, but print the result of the shards of a sweep (see tendon-sweep merge)")
      ->type_name("FILE")
      ->excludes(seed, count);
  verb->add_flag("--verbose", arguments.verbose, "Describe the world and the events")->needs(seed);
  verb->add_flag("--json", arguments.options.json,
                 "Print JSON on stdout, one object per world with a violation, and one at the end");
  verb->footer(
      "\n"
      "Example: run for ten minutes, then one world with details\n"
      "  tendon-worlds run --for-s 600\n"
      "  tendon-worlds run --seed 1234 --verbose\n\n"
      "Exit: 0 success, without a violation, or with --units; 1 failed, or a violation; 2 wrong usage.");
}

struct ShrinkArguments {
  std::uint64_t seed = 0;
  std::string out;
};

void add_shrink(CLI::App& app, ShrinkArguments& arguments) {
  CLI::App* const verb =
      app.add_subcommand("shrink", "Reduce the network events of a world with a violation to the relevant datagrams");
  verb->add_option("--seed", arguments.seed, "Seed of the world")->type_name("N")->required();
  verb->add_option("--out", arguments.out, "Output file, a sparse trace for `replay` and tests")
      ->type_name("FILE")
      ->required();
  verb->footer(
      "\n"
      "Example:\n"
      "  tendon-worlds shrink --seed 1234 --out world-1234.csv\n\n"
      "Exit: 0 success; 1 failed, because the world has no violation, or not because of the network; 2 wrong usage.");
}

struct DayArguments {
  DayConfig config;
  double hours = 25;
  bool json = false;
};

int day(const DayArguments& arguments) {
  DayConfig config = arguments.config;
  config.length = from_seconds(arguments.hours * 3600);
  // Keeps the time between key changes equal for all loop rates.
  config.rekey.datagrams = config.rekey.datagrams * config.loop_hz / DayConfig{}.loop_hz;
  const DayReport report = run_day(config);
  const std::vector<std::pair<const char*, std::variant<std::uint64_t, double>>> figures = {
      {"seed", config.seed},
      {"hours", arguments.hours},
      {"loop_hz", std::uint64_t{config.loop_hz}},
      {"troubles", report.troubles},
      {"byes", report.byes},
      {"deaths", report.deaths},
      {"takeovers", report.takeovers},
      {"sessions", report.sessions},
      {"expired", report.expired},
      {"longest_session_s", seconds(report.longest_session)},
      {"rekeys", report.rekeys},
      {"changes_of_address", report.roamed},
      {"haptic_steps", report.steps},
      {"forces", report.forces},
      {"datagrams_sent", report.network.sent},
      {"datagrams_lost", report.network.lost},
      {"copies", report.network.copies},
      {"forged", report.forged},
      {"requests", report.requests},
      {"carried_out", report.carried_out},
      {"slowest_recovery_s", seconds(report.slowest_recovery)},
      {"clock_error_us", seconds(report.clock_error) * 1e6},
      {"clock_bound_us", seconds(report.clock_bound) * 1e6},
      {"heap_first_half_bytes", std::uint64_t{report.heap_first_half}},
      {"heap_second_half_bytes", std::uint64_t{report.heap_second_half}},
      {"cpu_s", static_cast<double>(std::clock()) / CLOCKS_PER_SEC},
  };
  JsonLine line;
  for (const auto& [name, value] : figures) {
    std::visit([&, key = name](auto number) { line.add(key, number); }, value);
    if (!arguments.json) std::visit([key = name](auto number) { std::cout << key << ' ' << number << '\n'; }, value);
  }
  if (arguments.json) std::cout << line.add("broken", report.broken).str() << '\n';
  if (report.broken && !arguments.json) std::cout << "violation at " << *report.broken << '\n';
  return report.broken ? kFailed : kDone;
}

void add_day(CLI::App& app, DayArguments& arguments) {
  CLI::App* const verb = app.add_subcommand("day", "Run a day in suite 1, in which every session must stay usable");
  verb->add_option("--seed", arguments.config.seed, "Seed of the network, disconnections and keys")
      ->type_name("N")
      ->capture_default_str();
  verb->add_option("--hours", arguments.hours, "Virtual hours; a session has a maximum age of 24")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_option("--loop-hz", arguments.config.loop_hz, "Haptic steps, states and forces per second")
      ->check(CLI::Range(100U, 4000U))
      ->capture_default_str();
  verb->add_flag("--json", arguments.json, "Print one JSON object on stdout, instead of text");
  verb->footer(
      "\n"
      "Example: run a virtual hour, which takes seconds\n"
      "  tendon-worlds day --seed 7 --hours 1\n\n"
      "Exit: 0 success, without a violation; 1 failed, or a violation; 2 wrong usage.");
}

/// For one release, the former verb names its successor.
void add_replay(CLI::App& app) {
  CLI::App* const verb = app.add_subcommand("replay", "")->group("")->allow_extras();
  verb->callback([] {
    throw std::invalid_argument(
        "replay is now a network of tendon-lab sweep: tendon-lab sweep SCENE.toml --network trace:FILE --law LAW,…");
  });
}

int main_of(int argc, char** argv) {
  CLI::App app("Simulate the whole server, its clients, the network, the device and the hand, from one seed",
               "tendon-worlds");
  usage::dress(app);
  app.set_version_flag("--version", version_text());
  app.require_subcommand(1);
  app.footer(
      "\n"
      "Example: run worlds for ten minutes\n"
      "  tendon-worlds run --for-s 600\n\n"
      "Use tendon-worlds COMMAND --help for more.\n\n"
      "Exit: 0 success, without a violation; 1 failed, or a violation; 2 wrong usage.");
  RunArguments run_arguments;
  run_arguments.options.jobs = std::max(1U, std::thread::hardware_concurrency());
  ShrinkArguments shrink_arguments;
  add_run(app, run_arguments);
  add_shrink(app, shrink_arguments);
  DayArguments day_arguments;
  add_day(app, day_arguments);
  add_replay(app);
  try {
    usage::parse(app, argc, argv);
    if (app.got_subcommand("run")) return run(run_arguments);
    if (app.got_subcommand("day")) return day(day_arguments);
    return shrink_world(shrink_arguments.seed, shrink_arguments.out, std::cout) ? kDone : kFailed;
  } catch (const CLI::ParseError& error) {
    return usage::exit_code(app, error);
  } catch (const std::invalid_argument& error) {
    std::cerr << "tendon-worlds: " << error.what() << " (see --help)\n";
    return kWrongUsage;
  } catch (const std::exception& error) {
    std::cerr << "tendon-worlds: " << error.what() << '\n';
    return kFailed;
  }
}

}  // namespace
}  // namespace tendon::simulation

int main(int argc, char** argv) { return tendon::simulation::main_of(argc, argv); }

// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>
#include <stdexcept>

#include "clients/cpp/usage.h"
#include "tests/support/part_options.h"
#include "tests/tools/lab/grid/grid.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::sweep_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static GridOptions options;
  static std::string plot;
  verb.add_option("scene", options.scene, "Scene file with one simulated device and the motion of its hand")
      ->type_name("FILE")
      ->required();
  verb.add_option("--network", options.networks,
                  "Profiles or names of networks (tendon-inject --help), with ranges A:B:STEP and lists {A,B}, or "
                  "trace:FILE for a recorded network")
      ->type_name("PROFILE,…")
      ->required();
  verb.add_option("--stiffness", options.stiffness, "Stiffness of the walls, N/m")
      ->type_name("K,…")
      ->capture_default_str();
  verb.add_option("--law", options.laws, "Laws without parts, presets of aol+, or `scene` for the limiter of the scene")
      ->type_name("LAW,…")
      ->capture_default_str();
  verb.add_option("--rate-hz", options.rates, "Rates of the engine, Hz")->type_name("RATE,…")->capture_default_str();
  verb.add_option("--seeds", options.seeds, "Number of seeds")->capture_default_str();
  verb.add_option("--first-seed", options.first_seed, "First seed; the others follow")->capture_default_str();
  verb.add_option("--for-s", options.length_s, "Simulated time of a cell, s; default: 4 s, or the length of the trace");
  verb.add_option("--quiet-mps", options.thresholds.vibration, "Maximum vibration of a quiet cell, m/s rms")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  verb.add_option("--passive-j", options.thresholds.given_out, "Maximum energy that a passive cell gives out, J")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  CLI::Option* const out =
      verb.add_option("--out", options.out, "Write cells.csv and the figure to this folder")->type_name("DIR");
  verb.add_option("--plot", plot, "Draw the stiffest quiet and passive wall over the round trip (requires gnuplot)")
      ->check(usage::one_of(std::vector<std::string>{"zwidth"}))
      ->needs(out);
  verb.add_option("--jobs", options.jobs, "Number of threads")->capture_default_str()->check(CLI::Range(1U, 1024U));
  verb.add_flag("--dry-run", options.dry_run, "Only print the number of cells and an estimate of the time");
  verb.add_flag("--json", options.json, "Print JSON on stdout, one object per cell, instead of the table")
      ->excludes(out);
  add_part_options(verb, options.part, "the cells, from 0, in the order of the table");
  verb.footer(
      "\n"
      "Each cell simulates the whole server for some seconds of virtual time, with an engine that renders a wall at x "
      "= "
      "0.\n"
      "The columns of cells.csv are described in tests/tools/lab/EXPERIMENTS.md.\n\n"
      "Example\n"
      "  tendon-lab sweep deploy/scenes/demo.toml --network 'delay=0:50:10ms loss={0,2}%' \\\n"
      "    --stiffness 250,500,1000,2000 --law none,aol,feel --seeds 3 --jobs 2 --plot zwidth --out figure\n\n"
      "The same command gives the same bytes. After an interruption, it continues.\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([] {
    options.zwidth = !plot.empty();
    run_grid(options, std::cout);
  });
}

const Verb kVerb("sweep", "Run a scene for each network, wall, law and seed, and draw its Z-width over delay", add);

}  // namespace
}  // namespace tendon::lab::sweep_verb

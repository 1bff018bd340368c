// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

#include "tests/tools/injector/profile/named_profiles.h"

#include "core/base/nearest_word.h"
#include "tests/support/part_options.h"
#include "tests/tools/lab/experiments/accuracy.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::accuracy_verb {
namespace {

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

/// Parses "100x100x50" in mm; returns m.
softbody::Vec3 lengths(const std::string& text) {
  softbody::Vec3 size;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    double mm = 0;
    const auto [next, error] = std::from_chars(at, end, mm);
    const bool last = axis == 2;
    if (error != std::errc() || (last ? next != end : next == end || *next != 'x')) {
      throw std::invalid_argument("--block-mm " + text + ": expected three lengths, for example 100x100x50");
    }
    size[axis] = 1e-3 * mm;
    at = next + (last ? 0 : 1);
  }
  return size;
}

/// Looks up each of `names` with `find`; `all` lists the valid names for the error message.
template <class Find>
auto named(const std::vector<std::string>& names, Find find, const std::string& all) {
  std::vector<std::remove_cvref_t<decltype(*find(std::string_view()))>> found;
  for (const std::string& name : names) {
    const auto one = find(name);
    if (!one) throw std::invalid_argument(name + ": expected " + all + did_you_mean(name, all));
    found.push_back(*one);
  }
  return found;
}

void add(CLI::App& verb, int& /*exit*/) {
  static AccuracyArguments arguments;
  AccuracyOptions& options = arguments.options;
  const std::string models = names_of_models();
  const std::string elements = names_of(softbody::elements());
  verb.add_option("--block-mm", arguments.block_mm, "Size of a block with a fixed bottom, mm")
      ->type_name("XxYxZ")
      ->capture_default_str();
  verb.add_option("--young-pa", arguments.young_pa, "Young's modulus, Pa")->capture_default_str();
  verb.add_option("--poisson", arguments.poisson, "Poisson's ratio, from 0 to below 0.5")->capture_default_str();
  verb.add_option("--patch-radius-mm", arguments.patch_radius_mm, "Radius of the patch on its top, mm")
      ->capture_default_str();
  verb.add_option("--patch-center-mm", arguments.patch_centre_mm,
                  "Position of the patch, mm, relative to the center of the top")
      ->type_name("X,Y")
      ->delimiter(',')
      ->expected(2)
      ->capture_default_str();
  verb.add_option("--loads-n", arguments.loads_n, "A small and a large force on the patch, N")
      ->type_name("N,N")
      ->delimiter(',')
      ->expected(2)
      ->capture_default_str();
  verb.add_option("--n", options.resolutions, "Numbers of cells along x, ascending")
      ->type_name("N,...")
      ->delimiter(',')
      ->capture_default_str();
  verb.add_option("--models", arguments.models, models + ". Default: all")->type_name("NAME,...")->delimiter(',');
  verb.add_option("--elements", arguments.elements, elements + ". Default: all")->type_name("NAME,...")->delimiter(',');
  verb.add_option("--worker", options.worker, "Command of a worker that also answers for the linear block")
      ->type_name("COMMAND");
  verb.add_flag("--learned", options.learned,
                "Also use bodies of the model near with learned shapes, and with a table of answers");
  CLI::Option* const slowest =
      verb.add_option("--slowest-ms", options.slowest_ms, "Refine a model up to this time of an update, ms")
          ->check(CLI::PositiveNumber)
          ->capture_default_str();
  CLI::Option* const setup = verb.add_option("--longest-setup-s", options.longest_setup_s,
                                             "… and up to this set-up time, s. Default: 30, with --budget-ms 5")
                                 ->check(CLI::PositiveNumber);
  CLI::Option* const point =
      verb.add_option("--longest-point-s", options.longest_point_s, "… and up to this time for its measurement, s")
          ->check(CLI::PositiveNumber)
          ->capture_default_str();
  verb.add_option("--network", arguments.network,
                  "Also measure the error at the hand with this network: " + injector::names_of_profiles())
      ->type_name("NAME|LINE");
  verb.add_option("--seed", arguments.seed, "Seed of the network")->capture_default_str();
  verb.add_option("--budget-ms", options.budget_ms,
                  "Only print the most accurate model at the hand with updates of this time, ms, without the models "
                  "for comparison")
      ->check(CLI::PositiveNumber);
  verb.add_option("--truth-cells", options.truth.cells, "Cells of the reference mesh per radius of the patch")
      ->check(CLI::Range(2.0, 8.0))
      ->capture_default_str();
  verb.add_flag("--errors-only", options.errors_only,
                "Measure no times, only errors and sizes, which are identical in each run, of all meshes")
      ->excludes(slowest, setup, point);
  add_part_options(verb, options.part,
                   "the meshes, from 0: each n of each element of each model; implies --errors-only");
  verb.add_option("--out", options.out,
                  "Write accuracy.csv and a figure to this folder, as SVG and PNG (requires gnuplot)")
      ->type_name("DIR");
  verb.add_flag("--json", options.json, "Print JSON on stdout, one object per model and mesh, instead of the table");
  verb.footer(
      "\n"
      "Example: compare elements, fast\n"
      "  tendon-lab accuracy --models condensed --n 4,8,16 --longest-setup-s 5\n"
      "Example: run everything, which takes half an hour or more\n"
      "  tendon-lab accuracy --network wifi-good --out figures\n"
      "Example: find the best model\n"
      "  tendon-lab accuracy --budget-ms 5 --network wifi-good --json\n\n"
      "Example: compare a body on two ranks with the same body in this process\n"
      "  tendon-lab accuracy --models linear --elements hex27-sri --worker \"mpirun -n 2 tendon-fem-worker\"\n\n"
      "Example: compare learned answers with the model that they replace\n"
      "  tendon-lab accuracy --models near --elements hex8-sri --n 6,8 --learned\n\n"
      "Example: compute the errors of the finest meshes on many machines\n"
      "  tendon-sweep plan a --units 0:24 --per-shard 1 -- tendon-lab accuracy --models condensed --n 8,12,16,20\n\n"
      "Times are measured on this machine.\n"
      "Exit: 0 success; 1 failed, because of gnuplot or the files; 2 wrong usage.");
  verb.callback([&verb, models, elements, slowest, setup, point] {
    options.command = command_of(verb);
    if ((options.part.units || options.part.from) && (*slowest || *setup || *point)) {
      throw std::invalid_argument(
          "--units, --from: cannot be used with a time limit, because they do not measure times");
    }
    options.models = named(arguments.models, any_model_named, models);
    options.elements = named(arguments.elements, softbody::element_named, elements);
    options.block = {.size = lengths(arguments.block_mm),
                     .material = {.young = arguments.young_pa, .poisson = arguments.poisson},
                     .patch_radius = 1e-3 * arguments.patch_radius_mm,
                     .patch_centre = {1e-3 * arguments.patch_centre_mm.at(0), 1e-3 * arguments.patch_centre_mm.at(1)},
                     .loads = {arguments.loads_n.at(0), arguments.loads_n.at(1)}};
    if (!arguments.network.empty()) options.network = {.name = arguments.network, .seed = arguments.seed};
    if (options.budget_ms) options.slowest_ms = *options.budget_ms;
    accuracy(options, std::cout);
  });
}

const Verb kVerb("accuracy", "Measure the accuracy of soft bodies over the time of an update", add);

}  // namespace
}  // namespace tendon::lab::accuracy_verb

// SPDX-License-Identifier: Apache-2.0
// tendon-bench-fem: duration and reported error of a worker's answers.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "clients/cpp/usage.h"
#include "clients/softbody/scene.h"
#include "server/build_info.h"
#include "tests/clients/softbody/mpi/live_worker.h"

using namespace tendon;

namespace {

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

int measure(const std::string& scene_file, const std::string& command, int answers, int patience_s) {
  using Clock = std::chrono::steady_clock;
  const auto since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  const softbody::Scene scene = softbody::read_scene(scene_file);
  const auto start = Clock::now();
  softbody::LiveWorker worker(command, patience_s);
  const double ready_s = since(start);
  const Vec3 into = -scene.towards_hand;
  const Mat3 frame = softbody::to_device(scene);
  const double first_s = [&] {
    const auto asked = Clock::now();
    worker.answer(Vec3(scene.at + 0.001 * into));
    return since(asked);
  }();
  const Touch middle = worker.answer(Vec3(scene.at + 0.001 * into));
  std::vector<double> times;
  std::vector<double> errors;
  for (int i = 0; i < answers; ++i) {  // the patch moves by 1 mm per answer on a circle of 4 mm radius
    const double angle = 2 * std::numbers::pi * i / 25;
    const Vec3 aside = frame * Vec3(0.004 * std::cos(angle), 0.004 * std::sin(angle), 0);
    const auto asked = Clock::now();
    const Touch touch = worker.answer(Vec3(scene.at + 0.001 * into + aside));
    times.push_back(since(asked));
    errors.push_back(touch.error.value_or(0) / touch.force.norm());
  }
  const nlohmann::ordered_json json = {
      {"scene", scene_file},
      {"command", command},
      {"answers", answers},
      {"ready_s", ready_s},
      {"first_answer_s", first_s},
      {"stiffness_n_per_m", into.dot(*middle.stiffness * into)},
      {"answer_s", {{"median", median(times)}, {"largest", std::ranges::max(times)}}},
      {"error_sent", {{"median", median(errors)}, {"largest", std::ranges::max(errors)}}}};
  std::cout << json.dump(2) << '\n';
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Asks a worker for answers about a scene, and prints how long they took", "tendon-bench-fem");
  tendon::usage::dress(app);
  app.set_version_flag("--version", tendon::version_text());
  std::string scene;
  std::string command;
  int answers = 100;
  int patience_s = 600;
  app.add_option("SCENE", scene, "Scene file")->required();
  app.add_option("COMMAND", command, "The worker, without the scene")->required();
  app.add_option("--answers", answers, "How many")->capture_default_str()->check(CLI::Range(1, 1'000'000));
  app.add_option("--patience-s", patience_s, "For the worker to be ready, and for an answer")->capture_default_str();
  app.footer(
      "\nExample:\n  tendon-bench-fem b1.toml \"mpirun -n 2 tendon-fem-worker --way multigrid\"\n\nPrints one JSON "
      "object.\n"
      "Exit: 0 success; 1 the worker failed; 2 wrong usage.");
  try {
    usage::parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return tendon::usage::exit_code(app, error);
  }
  try {
    return measure(scene, command + " " + scene, answers, patience_s);
  } catch (const std::exception& error) {
    std::cerr << "tendon-bench-fem: " << error.what() << '\n';
    return 1;
  }
}

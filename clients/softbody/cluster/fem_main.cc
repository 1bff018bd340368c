// SPDX-License-Identifier: Apache-2.0
// tendon-fem: a soft body that is solved by MPI workers. The program itself does not use MPI.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <exception>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "clients/cpp/machine.h"
#include "clients/cpp/options.h"
#include "clients/cpp/usage.h"
#include "clients/cpp/worker/proxy_engine.h"
#include "clients/softbody/cluster/estimate.h"
#include "clients/softbody/placed_body.h"
#include "server/machine/output.h"

using namespace tendon;

namespace {

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

Duration from_milliseconds(double ms) { return from_seconds(ms / 1000); }

std::string shell_word(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

std::string own_worker() {
  std::error_code error;
  const auto beside = std::filesystem::read_symlink("/proc/self/exe", error).replace_filename("tendon-fem-worker");
  return !error && std::filesystem::exists(beside) ? shell_word(beside.string()) : "tendon-fem-worker";
}

softbody::PlacedBody from_table(const std::string& scene_file, const std::string& table_file) {
  softbody::Scene scene = softbody::read_scene(scene_file);
  scene.body.model = softbody::CondensedConfig{.table_file = table_file};
  return softbody::PlacedBody(scene);
}

nlohmann::ordered_json to_json(const worker::ProxyScheduler::Stats& stats) {
  return {{"launches", stats.launches}, {"asked", stats.asked},       {"answers", stats.answers},
          {"unknown", stats.unknown},   {"late", stats.late},         {"refused", stats.refused},
          {"fallback", stats.fallback}, {"given_up", stats.given_up}, {"median_ms", milliseconds(stats.median)}};
}

int serve(int argc, char** argv) {
  Options options{.client = {.name = "tendon-fem serve"}};
  std::string scene;
  std::string launch;
  std::string program;
  std::string fallback;
  worker::ProxyEngine::Config config;
  double deadline_ms = 0;
  double dead_ms = 0;
  double start_s = seconds(config.scheduler.start);
  CommandLine line(
      "Compute the forces in worker processes, which are restarted if they fail. The session with the server is not "
      "interrupted.",
      options);
  line.add_argument("SCENE", scene, "Scene file for the worker");
  line.add("--launch", launch, "COMMAND",
           "Command that starts the worker, such as \"mpirun -n 64\" or \"srun\". Default: start it directly");
  line.add("--worker", program, "COMMAND", "Program of the worker. Default: tendon-fem-worker");
  line.add("--fallback", fallback, "FILE",
           "Table from tendon-fem condense, which is used while no worker is available");
  line.add("--listen", config.process.listen, "HOST:PORT",
           "Address for workers on other machines (TCP, not encrypted). Default: a Unix socket");
  line.add("--deadline-ms", deadline_ms,
           "Maximum age of an answer, ms; later answers are not sent. 0: three times the median with a force, at least "
           "50 ms");
  line.add("--dead-ms", dead_ms,
           "Time without an answer after which a worker is restarted, ms. 0: ten times this median, at least 500 ms; "
           "10 s at the start");
  line.add("--start-s", start_s, "Maximum start time of a worker, s; after that, it is restarted", 0.1);
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  config.name = "tendon-fem";
  config.process.command =
      launch + (launch.empty() ? "" : " ") + (program.empty() ? own_worker() : program) + " " + shell_word(scene);
  config.scheduler.deadline = from_milliseconds(deadline_ms);
  config.scheduler.dead = from_milliseconds(dead_ms);
  config.scheduler.start = from_seconds(start_s);
  std::optional<softbody::PlacedBody> table;
  if (!fallback.empty()) {
    table.emplace(from_table(scene, fallback));
    config.scheduler.fallback = [&](const DeviceState& hand) { return table->answer(hand); };
  }
  const UnblockedOutput output;
  worker::ProxyEngine engine(config, read_clock(), std::cerr);
  const int code = run(options, engine);
  const worker::ProxyScheduler::Stats stats = engine.stats();
  if (options.json) {
    std::cout << nlohmann::ordered_json{{"workers", to_json(stats)}} << std::endl;
  } else {
    std::cerr << "tendon-fem: " << stats.launches << " workers, " << stats.asked << " states, " << stats.answers
              << " answers in time (median with a force " << milliseconds(stats.median) << " ms), " << stats.late
              << " late, " << stats.refused << " refused, " << stats.fallback << " from the fallback\n";
  }
  return code;
}

struct Arguments {
  std::string scene;
  std::string table;
  std::string launch;
  std::string way = "chosen";
  std::vector<int> ranks = {1, 16, 64, 256, 1024};
  bool json = false;
};

/// Replaces this process by the worker that computes the table.
int condense(const Arguments& arguments) {
  const std::string command = "exec " + arguments.launch + " " + own_worker() + " condense --way " +
                              shell_word(arguments.way) + (arguments.json ? " --json " : " ") +
                              shell_word(arguments.scene) + " " + shell_word(arguments.table);
  ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
  throw std::runtime_error("cannot start /bin/sh");
}

int explain(const Arguments& arguments) {
  int under_patch = 0;
  const softbody::BodyConfig body = softbody::read_scene(arguments.scene).body;
  softbody::warn(std::cerr, "tendon-fem", body);
  const auto size = softbody::Body::size_of(body, under_patch);
  const softbody::Estimate estimate = softbody::estimate(size, under_patch, arguments.ranks);
  std::cout << (arguments.json ? softbody::in_json(estimate) : softbody::in_words(estimate));
  return 0;
}

int run_command(int argc, char** argv) {
  CLI::App app(
      "Simulate a soft body on several machines. `tendon-fem serve SCENE` computes the forces in worker "
      "processes\n(`tendon-fem serve --help`); the other commands prepare it.",
      "tendon-fem");
  usage::dress(app);
  app.require_subcommand(1);
  app.set_version_flag("--version", TENDON_VERSION);
  Arguments arguments;
  app.add_subcommand("serve", "Compute the forces in worker processes, which are restarted if they fail");
  CLI::App* const condenses = app.add_subcommand("condense", "Create the table of a scene on several machines");
  CLI::App* const explains = app.add_subcommand(
      "explain", "Print the size of the body, the predicted time of each method, and a recommendation");
  for (CLI::App* const verb : {condenses, explains}) {
    verb->add_option("SCENE", arguments.scene, "Scene file")->required();
    verb->add_flag("--json", arguments.json, "Print one JSON object on stdout");
  }
  condenses->add_option("FILE", arguments.table, "File of the table, which is set in [model] table of a scene")
      ->required();
  condenses
      ->add_option("--launch", arguments.launch, "Command that starts the worker, such as \"mpirun -n 64\" or \"srun\"")
      ->type_name("COMMAND");
  condenses->add_option("--way", arguments.way, "Solver for the body")
      ->capture_default_str()
      ->check(usage::one_of({"chosen", "factor", "multigrid"}));
  explains->add_option("--ranks", arguments.ranks, "Numbers of ranks for the prediction")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::Range(1, 1'000'000));
  condenses->footer("\nExample:\n  tendon-fem condense liver.toml liver.table --launch \"mpirun -n 64\"");
  explains->footer("\nExample:\n  tendon-fem explain liver.toml --ranks 1,64,1024");
  app.footer(
      "\n"
      "Example:\n"
      "  tendon-fem serve liver.toml --launch \"mpirun -n 64\" --server haptics.lab:47100 --key fem.key\n\n"
      "Exit: 0 success; 1 failed; 2 wrong usage.");
  try {
    usage::parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return usage::exit_code(app, error);
  }
  return condenses->parsed() ? condense(arguments) : explain(arguments);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    // `serve` has the command line of all clients.
    if (argc > 1 && std::string_view(argv[1]) == "serve") return serve(argc - 1, argv + 1);
    return run_command(argc, argv);
  } catch (const SceneError& error) {
    std::cerr << "tendon-fem: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "tendon-fem: " << error.what() << '\n';
    return 1;
  }
}

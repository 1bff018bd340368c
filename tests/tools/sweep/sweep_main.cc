// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <thread>

#include "clients/cpp/usage.h"
#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/support/run_tool.h"
#include "tests/tools/sweep/bisect.h"
#include "tests/tools/sweep/child.h"
#include "tests/tools/sweep/shards.h"
#include "tests/tools/sweep/submit.h"

namespace tendon::sweep {
namespace {

struct Arguments {
  std::filesystem::path folder;
  std::string units;
  std::uint64_t per_shard = 0;
  std::string arithmetic = "portable";
  std::vector<std::string> command;
  std::optional<std::uint64_t> shard, task, of;
  bool bisect = false;
  unsigned jobs = std::max(1U, std::thread::hardware_concurrency());
  std::string to;
  bool go = false;
  SlurmOptions slurm;
  KubernetesOptions kubernetes;
  bool missing = false;
  bool json = false;
};

std::filesystem::path self() { return std::filesystem::canonical("/proc/self/exe"); }

/// Looks up `program` as given, in the folder of this program, then in PATH.
std::filesystem::path found(const std::string& program) {
  if (program.find('/') != std::string::npos) return std::filesystem::canonical(program);
  if (const auto beside = self().parent_path() / program; access(beside.c_str(), X_OK) == 0) return beside;
  const char* const path = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): one thread
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const auto file = std::filesystem::path(folder) / program;
    if (access(file.c_str(), X_OK) == 0) return std::filesystem::canonical(file);
  }
  throw std::runtime_error(program + ": found neither in the folder of tendon-sweep nor in PATH");
}

int plan(const Arguments& arguments) {
  Plan plan{.program = found(arguments.command.at(0)),
            .sha256 = {},
            .arguments = {arguments.command.begin() + 1, arguments.command.end()},
            .units = parse_units(arguments.units),
            .per_shard = arguments.per_shard,
            .arithmetic = arithmetic_of(arguments.arithmetic)};
  plan.sha256 = sha256_of(plan.program);
  plan.fingerprint = fingerprint_of(plan.arithmetic, self());
  write_plan(arguments.folder, plan);
  std::cout << plan.shards() << " shards of " << plan.per_shard
            << " units: " << (arguments.folder / "plan.json").string() << "\nhere:     tendon-sweep here "
            << arguments.folder.string() << "\non Slurm: tendon-sweep submit " << arguments.folder.string()
            << " --to slurm\n";
  return 0;
}

int run(const Arguments& arguments) {
  const Plan plan = read_plan(arguments.folder);
  expect_as_planned(plan, self());
  if (arguments.shard) {
    plan.shard(*arguments.shard);
    if (arguments.bisect) return bisect(arguments.folder, plan, *arguments.shard, std::cout) ? 0 : 1;
    return run_shard(arguments.folder, plan, *arguments.shard, std::cout) ? 0 : 1;
  }
  if (!arguments.task || !arguments.of || *arguments.of == 0 || *arguments.task >= *arguments.of) {
    throw std::invalid_argument("run: expected --shard N, or --task I --of T with I below T");
  }
  std::vector<std::uint64_t> shards;
  for (std::uint64_t shard = *arguments.task; shard < plan.shards(); shard += *arguments.of) shards.push_back(shard);
  return run_shards(arguments.folder, plan, shards, 1, false, std::cout) ? 0 : 1;
}

int here(const Arguments& arguments) {
  const Plan plan = read_plan(arguments.folder);
  expect_as_planned(plan, self());
  const bool done = run_shards(arguments.folder, plan, status_of(arguments.folder, plan).missing, arguments.jobs,
                               isatty(STDERR_FILENO) != 0, std::cout);
  return done ? 0 : 1;
}

int submit(const Arguments& arguments) {
  const Plan plan = read_plan(arguments.folder);
  if (status_of(arguments.folder, plan).missing.empty()) {
    std::cout << "no shards are missing; run tendon-sweep merge " << arguments.folder.string() << "\n";
    return 0;
  }
  if (arguments.to == "kubernetes") {
    std::cout << kubernetes_job(arguments.folder, plan, arguments.kubernetes);
    return 0;
  }
  const std::filesystem::path file = arguments.folder / "job.sbatch";
  const std::string job = slurm_job(arguments.folder, plan, self(), arguments.slurm);
  std::filesystem::create_directories(arguments.folder / "slurm");
  std::ofstream(file) << job;
  if (arguments.go) return run_aloud({.command = {"sbatch", file.string()}});
  std::cout << "sbatch " << file.string() << "\n";
  return 0;
}

int status(const Arguments& arguments) {
  const Plan plan = read_plan(arguments.folder);
  const Status now = status_of(arguments.folder, plan);
  if (arguments.missing) {
    if (!now.missing.empty()) std::cout << ranges(now.missing) << "\n";
    return 0;
  }
  if (arguments.json) {
    std::cout << JsonLine()
                     .add("shards", now.shards)
                     .add("done", now.done)
                     .add("missing", ranges(now.missing))
                     .add("failed", ranges(now.failed))
                     .add("differing", ranges(now.differing))
                     .str()
              << "\n";
    return 0;
  }
  std::cout << now.done << " of " << now.shards << " shards are done\n";
  if (!now.missing.empty()) std::cout << "missing: " << ranges(now.missing) << "\n";
  for (const std::uint64_t shard : now.failed) {
    std::cout << "shard " << shard << " failed: " << std::ifstream(failure_file(arguments.folder, shard)).rdbuf();
  }
  for (const std::uint64_t shard : now.differing) {
    std::cout << "shard " << shard << " has two results that differ: " << result_file(arguments.folder, shard).string()
              << " and .differs\n";
  }
  return 0;
}

int arithmetic() {
  const Fingerprint print = fingerprint();
  std::cout
      << JsonLine().add("c_library", print.c_library).add("functions", print.functions).add("blas", print.blas).str()
      << "\n";
  return 0;
}

CLI::App* add_verb(CLI::App& app, Arguments& arguments, const std::string& name, const std::string& what) {
  CLI::App* const verb = app.add_subcommand(name, what);
  verb->add_option("FOLDER", arguments.folder, "Folder of the sweep, accessible from all nodes")->required();
  return verb;
}

int main_of(int argc, char** argv) {
  CLI::App app("Run a long computation in shards, on this machine, with Slurm or with Kubernetes, with one result",
               "tendon-sweep");
  usage::dress(app);
  app.set_version_flag("--version", version_text());
  app.require_subcommand(1);
  app.footer(
      "\n"
      "Example: run 20 000 worlds on this machine\n"
      "  tendon-sweep plan w --units 1:20000 --per-shard 500 -- tendon-worlds run\n"
      "  tendon-sweep here w\n"
      "  tendon-sweep merge w\n\n"
      "Exit: 0 success; 1 failed, or with merge, a guarantee was violated; 2 wrong usage.");
  Arguments arguments;

  CLI::App* const plan_verb = add_verb(app, arguments, "plan", "Define what to run, and in which shards");
  plan_verb->add_option("--units", arguments.units, "Units of the program: seeds, situations, …")
      ->type_name("FIRST:COUNT")
      ->required();
  plan_verb->add_option("--per-shard", arguments.per_shard, "Units per shard; a shard should take 1 to 10 minutes")
      ->type_name("N")
      ->check(CLI::PositiveNumber)
      ->required();
  plan_verb
      ->add_option("--arithmetic", arguments.arithmetic,
                   "portable: identical results on all x86-64 nodes; native: for nodes of one type")
      ->check(usage::one_of({"portable", "native"}))
      ->capture_default_str();
  plan_verb
      ->add_option("COMMAND", arguments.command, "After --: a program that supports --units, and its other arguments")
      ->required();
  plan_verb->footer("\nExample:\n  tendon-sweep plan w --units 1:1000000 --per-shard 5000 -- tendon-worlds run\n");

  CLI::App* const run_verb = add_verb(app, arguments, "run", "Run one shard, or every Tth");
  CLI::Option* const shard =
      run_verb->add_option("--shard", arguments.shard, "Run this shard, even if it is done")->type_name("N");
  run_verb
      ->add_flag(
          "--bisect", arguments.bisect,
          "Find the units in which the two results of a shard differ, and whether the program or a node is the cause")
      ->needs(shard);
  run_verb->add_option("--task", arguments.task, "With --of: run shards I, I+T, I+2T …, except those that are done")
      ->type_name("I");
  run_verb->add_option("--of", arguments.of, "Total number of tasks")->type_name("T");
  run_verb->footer("\nExample:\n  tendon-sweep run w --shard 17\n  tendon-sweep run w --shard 17 --bisect\n");

  CLI::App* const here_verb = add_verb(app, arguments, "here", "Run all missing shards on this machine");
  here_verb->add_option("--jobs", arguments.jobs, "Number of simultaneous shards")
      ->type_name("J")
      ->check(CLI::Range(1U, 1024U))
      ->default_str("one for each core");
  here_verb->footer("\nExample:\n  tendon-sweep here w --jobs 2\n");

  CLI::App* const submit_verb = add_verb(
      app, arguments, "submit", "Write a job that runs the missing shards on a cluster, and print its command");
  submit_verb->add_option("--to", arguments.to, "where")->check(usage::one_of({"slurm", "kubernetes"}))->required();
  submit_verb->add_flag("--go", arguments.go, "slurm: also submit the job");
  submit_verb->add_option("--partition", arguments.slurm.partition, "slurm: partition")->type_name("NAME");
  submit_verb->add_option("--time", arguments.slurm.time, "slurm: time limit of a task")
      ->type_name("HH:MM:SS")
      ->capture_default_str();
  submit_verb
      ->add_option("--max-array", arguments.slurm.most, "slurm: maximum number of tasks in an array (MaxArraySize - 1)")
      ->type_name("N")
      ->capture_default_str();
  submit_verb->add_option("--image", arguments.kubernetes.image, "kubernetes: image with the program and tendon-sweep")
      ->type_name("IMAGE");
  submit_verb->add_option("--volume", arguments.kubernetes.volume, "kubernetes: volume claim with FOLDER")
      ->type_name("CLAIM");
  submit_verb->add_option("--parallel", arguments.kubernetes.parallel, "kubernetes: number of simultaneous pods")
      ->type_name("N")
      ->capture_default_str();
  submit_verb->footer(
      "\n"
      "Example: submit a job, and repeat this after failures for the missing shards\n"
      "  tendon-sweep submit w --to slurm --go\n"
      "  tendon-sweep submit w --to kubernetes --image REGISTRY/tendon:TAG --volume sweep | kubectl apply -f -\n");

  CLI::App* const status_verb = add_verb(app, arguments, "status", "Print which shards are done, missing or failed");
  status_verb->add_flag("--missing", arguments.missing,
                        "Only print missing shards, in the format of Slurm's --array: 0-3,17");
  status_verb->add_flag("--json", arguments.json, "Print one JSON object on stdout");
  status_verb->footer("\nExample:\n  tendon-sweep status w\n");

  CLI::App* const merge_verb = add_verb(
      app, arguments, "merge", "Merge the shards to the result that one process would have printed for all units");
  merge_verb->footer("\nExample:\n  tendon-sweep merge w\n");

  CLI::App* const arithmetic_verb = app.add_subcommand(
      "arithmetic", "Print the properties on which the results of this node depend: C library, functions, BLAS");
  arithmetic_verb->footer("\nExample:\n  tendon-sweep arithmetic\n");

  return run_tool(app, argc, argv, [&] {
    if (app.got_subcommand(plan_verb)) return plan(arguments);
    if (app.got_subcommand(run_verb)) return run(arguments);
    if (app.got_subcommand(here_verb)) return here(arguments);
    if (app.got_subcommand(submit_verb)) return submit(arguments);
    if (app.got_subcommand(status_verb)) return status(arguments);
    if (app.got_subcommand(merge_verb)) return merge(arguments.folder, read_plan(arguments.folder), std::cout);
    return arithmetic();
  });
}

}  // namespace
}  // namespace tendon::sweep

int main(int argc, char** argv) { return tendon::sweep::main_of(argc, argv); }

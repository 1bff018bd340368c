// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/sweep/shards.h"

#include <atomic>
#include <exception>
#include <fstream>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "tests/tools/sweep/child.h"

namespace tendon::sweep {
namespace {

Child program_of(const Plan& plan, const std::vector<std::string>& more) {
  Child child{.command = {plan.program.string()}, .environment = environment_of(plan.arithmetic)};
  child.command.insert(child.command.end(), plan.arguments.begin(), plan.arguments.end());
  child.command.insert(child.command.end(), more.begin(), more.end());
  return child;
}

std::string_view body_of(std::string_view result) {
  result.remove_suffix(1);
  const auto last = result.rfind('\n');
  return last == std::string_view::npos ? std::string_view() : result.substr(0, last + 1);
}

ChildEnd run_units(const Plan& plan, const Units& units, std::string& why) {
  ChildEnd end = run(program_of(plan, {"--units", text_of(units), "--json"}));
  why = end.status == 0 ? "" : end.text();
  if (why.empty()) {
    try {
      end_of(end.output, units);
    } catch (const std::invalid_argument& error) {
      why = error.what();
    }
  }
  return end;
}

bool has_from(const Plan& plan) {
  const ChildEnd help = run(program_of(plan, {"--help"}));
  return help.output.find("--from") != std::string::npos;
}

}  // namespace

Fingerprint fingerprint_of(Arithmetic arithmetic, const std::filesystem::path& self) {
  const ChildEnd end = run({.command = {self.string(), "arithmetic"}, .environment = environment_of(arithmetic)});
  if (end.status != 0) {
    throw std::runtime_error(self.string() + " arithmetic: " + end.text() + ": " + end.errors);
  }
  const auto json = nlohmann::json::parse(end.output);
  return {.c_library = json.at("c_library"), .functions = json.at("functions"), .blas = json.at("blas")};
}

void expect_as_planned(const Plan& plan, const std::filesystem::path& self) {
  if (const std::string here = sha256_of(plan.program); here != plan.sha256) {
    throw std::runtime_error(plan.program.string() + " is not the program of the plan: SHA-256 " + here +
                             ", expected " + plan.sha256 + "; create a new plan in another folder");
  }
  const Fingerprint here = fingerprint_of(plan.arithmetic, self);
  if (here == plan.fingerprint) return;
  const auto text = [](const Fingerprint& print) {
    return print.c_library + ", functions " + print.functions.substr(0, 8) + ", BLAS " + print.blas;
  };
  throw std::runtime_error(
      "the arithmetic of this node differs from the plan (" + text(here) + "; the plan: " + text(plan.fingerprint) +
      "): " +
      (plan.arithmetic == Arithmetic::kNative
           ? "use --arithmetic portable in the plan for nodes of different types"
           : "its C library or OpenBLAS has a different version; use nodes with the same packages"));
}

std::string text_of(const Units& units) { return std::to_string(units.first) + ":" + std::to_string(units.count); }

std::string output_of(const Plan& plan, const Units& units) {
  std::string why;
  ChildEnd end = run_units(plan, units, why);
  if (!why.empty()) throw std::runtime_error("units " + text_of(units) + ": " + why + "\n" + end.errors);
  return std::move(end.output);
}

bool run_shard(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard, std::ostream& out) {
  const Units units = plan.shard(shard);
  std::string why;
  const ChildEnd end = run_units(plan, units, why);
  const std::string name = "shard " + std::to_string(shard) + ", units " + text_of(units) + ": ";
  if (!why.empty()) {
    std::filesystem::create_directories(folder / "failed");
    std::ofstream(failure_file(folder, shard)) << why << "\n" << end.errors;
    out << name << why << "; failed\n";
    return false;
  }
  switch (keep_result(folder, shard, end.output)) {
    case Kept::kNew:
      out << name << "done\n";
      return true;
    case Kept::kSame:
      out << name << "already done, with the same result\n";
      return true;
    case Kept::kOther:
      break;
  }
  out << name << "already done, with a different result; both are kept\n";
  return false;
}

bool run_shards(const std::filesystem::path& folder, const Plan& plan, const std::vector<std::uint64_t>& shards,
                unsigned jobs, bool progress, std::ostream& out) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> all{true};
  std::mutex mutex;
  std::size_t finished = 0;
  std::exception_ptr failed;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < shards.size(); i = next++) {
        std::ostringstream said;
        const bool there = std::filesystem::exists(result_file(folder, shards[i]));
        if (!there && !run_shard(folder, plan, shards[i], said)) all = false;
        const std::scoped_lock lock(mutex);
        out << said.str() << std::flush;
        if (progress) std::cerr << '\r' << ++finished << " of " << shards.size() << " shards" << std::flush;
      }
    } catch (...) {
      const std::scoped_lock lock(mutex);
      failed = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 1; i < jobs; ++i) threads.emplace_back(work);
    work();
  }
  if (progress) std::cerr << '\n';
  if (failed) std::rethrow_exception(failed);
  return all;
}

int merge(const std::filesystem::path& folder, const Plan& plan, std::ostream& out) {
  const Status status = status_of(folder, plan);
  if (!status.missing.empty()) {
    throw std::runtime_error(std::to_string(status.missing.size()) + " of " + std::to_string(status.shards) +
                             " shards are missing: " + ranges(status.missing));
  }
  for (const std::uint64_t shard : status.differing) {
    const Units units = plan.shard(shard);
    const std::string where = difference(*result_of(folder, plan, shard), *other_result_of(folder, plan, shard), units);
    throw std::runtime_error("shard " + std::to_string(shard) + ", units " + text_of(units) +
                             ", has two results that differ in " + where + ": tendon-sweep run " + folder.string() +
                             " --shard " + std::to_string(shard) + " --bisect examines them");
  }
  std::string lines;
  std::optional<ShardEnd> whole;
  for (std::uint64_t shard = 0; shard < status.shards; ++shard) {
    const std::string result = *result_of(folder, plan, shard);
    lines += body_of(result);
    const ShardEnd end = end_of(result, plan.shard(shard));
    if (whole) {
      whole->add(end);
    } else {
      whole = end;
    }
  }
  if (whole->units != plan.units) throw std::runtime_error("the shards do not have all units of the plan");
  lines += whole->line() + "\n";
  const std::filesystem::path merged = folder / "merged.jsonl";
  if (keep(merged, lines) == Kept::kOther) {
    throw std::runtime_error(merged.string() + ": the file exists, and differs from the result of the shards");
  }
  if (!has_from(plan)) {
    out << whole->line() << "\n" << merged.string() << ": all lines\n" << std::flush;
    return 0;
  }
  out << std::flush;
  return run_aloud(program_of(plan, {"--from", merged.string()}));
}

}  // namespace tendon::sweep

// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/usage.h"
#include "server/build_info.h"
#include "server/machine/clock.h"
#include "server/machine/realtime.h"
#include "tests/e2e/stage/falcon_stage.h"

namespace {

using namespace tendon;
using namespace std::chrono_literals;
using e2e::FalconStage;

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Returns the latency (µs) of a thread that only sleeps and has the same scheduling as the haptic thread.
class Floor {
 public:
  Floor()
      : thread_([this] {
          enter_realtime(kHapticPriority);
          for (LocalTime due = clock::now() + 1ms; !stop_; due = std::max(due + 1ms, clock::now())) {
            clock::sleep_until(due);
            late_us_.push_back(seconds(clock::now() - due) * 1e6);
          }
        }) {}
  ~Floor() { finish(); }
  Floor(const Floor&) = delete;
  Floor& operator=(const Floor&) = delete;

  std::vector<double>& finish() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return late_us_;
  }

 private:
  std::atomic<bool> stop_{false};
  std::vector<double> late_us_;
  std::thread thread_;
};

/// Prints JSON {"name":value,…}, or one line of text for each value.
class Report {
 public:
  explicit Report(const std::string& event) : event_(event) {}
  template <class Value>
  void add(const std::string& name, const Value& value, const std::string& meaning) {
    std::ostringstream text;
    text << value;
    json_ << ",\"" << name << "\":" << text.str();
    words_ << "  " << std::string(10 - std::min<std::size_t>(10, text.str().size()), ' ') << text.str() << "  "
           << meaning << '\n';
  }
  void print(bool json) const {
    if (json) {
      std::cout << "{\"event\":\"" << event_ << "\"" << json_.str() << "}" << std::endl;
    } else {
      std::cout << event_ << '\n' << words_.str() << std::flush;
    }
  }

 private:
  std::string event_;
  std::ostringstream json_;
  std::ostringstream words_;
};

/// Moves the hand into the wall, then to another depth, and then out of the wall.
void use(FalconStage& stage, double duration_s) {
  for (const LocalTime end = clock::now() + from_seconds(duration_s); clock::now() < end;) {
    stage.arm();
    for (int i = 0; i < 5; ++i) {
      stage.go_to(0.005, 0.02);
      stage.go_to(0.001, 0.02);
    }
  }
}

void add_steps(Report& report, const std::vector<StepRecord>& steps, Duration period) {
  std::vector<double> late_us;
  std::uint64_t missed = 0;
  std::uint64_t unseen = 0;
  std::uint64_t overruns = 0;
  std::uint64_t let_go = 0;
  std::uint64_t blind = 0;
  std::uint64_t longest_blind = 0;
  double least_energy = 0;
  const StepRecord* before = nullptr;
  for (const StepRecord& step : steps) {
    const bool seen = !step.reasons.has(Reason::kUnseen);
    if (before == nullptr && !seen) continue;
    late_us.push_back(seconds(step.hand.at - step.scheduled) * 1e6);
    least_energy = std::min(least_energy, step.energy);
    unseen += seen ? 0 : 1;
    blind = seen ? 0 : blind + 1;
    longest_blind = std::max(longest_blind, blind);
    overruns += step.reasons.has(Reason::kOverrun) ? 1 : 0;
    if (before != nullptr) {
      missed +=
          static_cast<std::uint64_t>(std::max<std::int64_t>((step.scheduled - before->scheduled) / period - 1, 0));
      if (!seen && before->applied.norm() > 0.5 && step.applied.norm() == 0) ++let_go;
    }
    before = &step;
  }
  report.add("steps", late_us.size(), "haptic steps since it was homed");
  report.add("missed", missed, "periods left out, because the thread woke a whole one late or more");
  report.add("late_p50_us", quantile(late_us, 0.5), "from when a step was due to when it began");
  report.add("late_p99_us", quantile(late_us, 0.99), "");
  report.add("unseen", unseen, "steps without a new position: the reply was late");
  report.add("longest_unseen", longest_blind, "… the most of them in a row");
  report.add("let_go", let_go, "… that cost the force of the step");
  report.add("overruns", overruns, "intervals of more than two periods");
  report.add("least_energy_j", least_energy, "of the limiter's account");
}

bool run(double duration_s, bool json) {
  FalconStage stage({.record = true});
  Floor floor;
  use(stage, duration_s);
  std::vector<double>& floor_us = floor.finish();
  const std::string end = stage.server().stop();

  Report report("run");
  report.add("duration_s", duration_s, "s");
  add_steps(report, e2e::read_recording(stage.recording()).steps, stage.scene().loop.period);
  report.add("floor_p50_us", quantile(floor_us, 0.5), "late is a thread of the same priority that only sleeps");
  report.add("floor_p99_us", quantile(floor_us, 0.99), "");
  const FalconStage::Felt felt = stage.felt();
  const auto rounds = static_cast<double>(std::max<std::uint64_t>(felt.rounds, 1));
  report.add("wall_share", felt.share / rounds,
             "mean of (force of the motors) / (force of the wall), deeper than 2 mm");
  report.add("wall_without_force", static_cast<double>(felt.nothing) / rounds,
             "share of the time there without torque");
  const auto faults = e2e::count_in(end.substr(end.find("\"safety\"")), "faults");
  report.add("faults", faults, "of the safety layer");
  report.add("last_fault", '"' + e2e::text_in(end, "last_fault") + '"', "");
  report.add("device_gap_ms", seconds(stage.falcon().seen().longest_gap) * 1e3,
             "the model of the device stood still for, at most");
  report.print(json);
  return felt.share > 0 && e2e::number_in(end, "force_n") == 0;
}

bool kill_often(int kills, bool json) {
  std::vector<double> ms;
  std::vector<double> dead_ms;
  int left_on = 0;
  for (int i = 0; i < kills; ++i) {
    FalconStage stage({});
    stage.arm_and_press();
    const FalconStage::Killed killed = stage.kill_server();
    left_on += killed.pushes ? 1 : 0;
    ms.push_back(killed.pushed_for_ms);
    dead_ms.push_back(killed.dead_ms);
  }
  Report report("kills");
  report.add("kills", kills, "times SIGKILL while the motors push");
  report.add("left_on", left_on, "… after which they push on for ever");
  report.add("p50_ms", quantile(ms, 0.5), "from the signal to no torque");
  report.add("p90_ms", quantile(ms, 0.9), "");
  report.add("most_ms", quantile(ms, 1), "");
  report.add("dead_p50_ms", quantile(dead_ms, 0.5),
             "from the signal to the end of the process: before it, nobody can know");
  report.print(json);
  return left_on == 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Run tendond with a model of a Falcon through the real libusb, with the scene deploy/scenes/falcon.toml, "
      "encrypted\n"
      "sessions and virtual_wall as engine. Measure how late its steps are compared with a thread that only sleeps, "
      "the\n"
      "felt force, and how long a force lasts after the server is killed.\n\n"
      "Example:  falcon-server --duration-s 60 --kills 15 --json\n",
      "falcon-server");
  usage::dress(app);
  app.set_version_flag("--version", version_text());
  app.footer("\nExit: 0 success; 1 failed, or a value out of bounds; 2 wrong usage.");
  double duration_s = 60;
  int kills = 15;
  bool json = false;
  app.add_option("--duration-s", duration_s, "Time of the hand in the wall, s; 0: none")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_option("--kills", kills, "How often to kill the server during contact")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_flag("--json", json, "Print JSON on stdout, one object per line: run, kills");
  try {
    tendon::usage::parse(app, argc, argv);
  } catch (const CLI::ParseError& problem) {
    return usage::exit_code(app, problem);
  }
  try {
    bool good = duration_s == 0 || run(duration_s, json);
    good = (kills == 0 || kill_often(kills, json)) && good;
    return good ? 0 : 1;
  } catch (const std::exception& problem) {
    std::cerr << problem.what() << '\n';
    return 1;
  }
}

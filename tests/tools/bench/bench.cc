// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/bench.h"

#include <sched.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <system_error>

#include "server/machine/clock.h"
#include "tests/support/files.h"
#include "tests/tools/bench/chart.h"

namespace tendon::bench {

const std::vector<Section>& sections() {
  static const std::vector<Section> kSections = {
      {"steps", "One haptic step", measure_steps},
      {"datagrams", "One datagram", measure_datagrams},
      {"round-trip", "There and back", measure_round_trip},
      {"wake-ups", "How late a haptic thread wakes", measure_wake_ups},
      {"proxy", "tendon-inject", measure_proxy},
      {"worlds", "Simulated worlds", measure_worlds},
      {"devices", "Devices on one core", measure_devices},
      {"sessions", "Sessions of one server", measure_sessions},
      {"512", "512 devices in one process", measure_512},
  };
  return kSections;
}

void end_with_parent() { ::prctl(PR_SET_PDEATHSIG, SIGKILL); }

AtPriority::AtPriority(int priority) {
  if (priority == 0) return;
  ::prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  sched_param param{};
  param.sched_priority = priority;
  if (::sched_setscheduler(0, SCHED_FIFO, &param) != 0) {
    throw std::system_error(errno, std::generic_category(), "SCHED_FIFO " + std::to_string(priority));
  }
  raised_ = true;
}

AtPriority::~AtPriority() {
  if (!raised_) return;
  const sched_param param{};
  ::sched_setscheduler(0, SCHED_OTHER, &param);
}

void bench(const BenchOptions& options, std::ostream& out) {
  for (const std::string& name : options.only) {
    const auto& all = sections();
    if (std::none_of(all.begin(), all.end(), [&](const Section& section) { return section.name == name; })) {
      std::string names;
      for (const Section& section : all) names += (names.empty() ? "" : ", ") + std::string(section.name);
      throw std::invalid_argument("--only " + name + ": expected " + names);
    }
  }
  if (options.write) expect_replaceable(*options.write, {kPageBegins});
  const auto& only = options.only;
  if (options.plot && !only.empty() && std::find(only.begin(), only.end(), "512") == only.end()) {
    throw std::invalid_argument("--plot: requires the section 512, which --only excludes");
  }
  { const AtPriority may_we(options.priority); }  // fails now rather than an hour later

  Circumstances here = look_around();
  here.seed = options.seed;
  here.priority = options.priority;
  here.quick = options.quick;
  here.load_before = load();
  here.command = "tendon-lab bench";
  for (const std::string& name : options.only) here.command += " --only " + name;
  if (options.priority > 0) here.command += " --fifo " + std::to_string(options.priority);
  const LocalTime began = clock::now();
  if (!options.json) out << heading();

  std::size_t lines = 0;
  Run run(options, [&](const Row& row) {
    if (options.progress) std::cerr << "\r\033[K" << std::flush;
    out << (options.json ? to_json(row) + "\n" : to_text(row)) << std::flush;
    if (!out) throw std::runtime_error("cannot write to stdout: it is closed");
    ++lines;
  });
  for (const Section& section : sections()) {
    const bool wanted =
        options.only.empty() || std::find(options.only.begin(), options.only.end(), section.name) != options.only.end();
    if (!wanted) continue;
    run.section = section.title;
    if (!options.json) out << "\n" << section.title << "\n" << std::flush;
    if (options.progress) std::cerr << "measuring: " << section.title << " …" << std::flush;
    section.measure(run);
    if (options.progress) std::cerr << "\r\033[K" << std::flush;
  }
  here.load_after = load();
  here.seconds = seconds(clock::now() - began);
  out << (options.json ? to_json(here) + "\n" : "\n" + to_text(here)) << std::flush;
  if (!out) throw std::runtime_error("cannot write the table: is the disk full?");

  if (options.plot) {
    for (const auto& file : draw_devices(*options.plot, here, run.rows))
      std::cerr << "written: " << file.string() << "\n";
  }
  if (!options.write) return;
  std::ofstream page(*options.write);
  page << to_markdown(here, run.rows) << std::flush;
  if (!page) throw std::runtime_error("cannot write " + options.write->string());
}

}  // namespace tendon::bench

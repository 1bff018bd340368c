// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/bench.h"

#include <algorithm>
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "server/machine/clock.h"
#include "tests/support/files.h"
#include "tests/tools/bench/chart.h"
#include "tests/tools/bench/other_process.h"
#include "tests/tools/lab/pictures/csv.h"

namespace tendon::bench {

const std::vector<Section>& sections() {
  static const std::vector<Section> kSections = {
      {"steps", "One haptic step", measure_steps},
      {"datagrams", "One datagram", measure_datagrams},
      {"round-trip", "There and back", measure_round_trip},
      {"peers", "Tendon beside other libraries", measure_peers},
      {"wake-ups", "How late a haptic thread wakes", measure_wake_ups},
      {"proxy", "tendon-inject", measure_proxy},
      {"worlds", "Simulated worlds", measure_worlds},
      {"devices", "Devices on one core", measure_devices},
      {"sessions", "Sessions of one server", measure_sessions},
      {"512", "512 devices in one process", measure_512},
  };
  return kSections;
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
  here.command = options.command;
  const LocalTime began = clock::now();
  if (!options.json) out << heading();

  std::size_t lines = 0;
  Run run(options, [&](const Row& row) {
    if (options.progress) std::cerr << "\r\033[K" << std::flush;
    out << (options.json ? line_of(row).str() + "\n" : to_text(row)) << std::flush;
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
  if (options.csv) {
    lab::CsvTable table(options.command);
    for (const Row& row : run.rows) table.add(line_of(row).add("commit", here.commit));
    table.write(*options.csv);
  }
  if (!options.write) return;
  std::ofstream page(*options.write);
  page << to_markdown(here, run.rows) << std::flush;
  if (!page) throw std::runtime_error("cannot write " + options.write->string());
}

}  // namespace tendon::bench

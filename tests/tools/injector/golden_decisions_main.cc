// SPDX-License-Identifier: Apache-2.0
// Writes the decisions for profiles that together use every model. They are identical for every compiler, C library and
// machine: golden_decisions.sh compares their checksums with tests/golden/injector.sha256. A change invalidates every
// recorded run, because such a run stores only its seed.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/plain_usage.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/models/draws.h"
#include "tests/tools/injector/profile/named_profiles.h"

namespace tendon::injector {
namespace {

constexpr std::uint64_t kDatagrams = 4000;

std::vector<std::pair<std::string, std::string>> profiles() {
  std::vector<std::pair<std::string, std::string>> all = {
      {"constant", "base=5ms delay=20.000001ms"},
      {"uniform", "delay=uniform(15ms,25ms)"},
      {"normal", "delay=normal(20ms,8ms)"},
      {"exponential", "delay=exponential(5ms,8ms) order=free"},
      {"lognormal", "delay=lognormal(20ms,15ms)"},
      {"pareto", "delay=pareto(2ms,1.5) order=free"},
      {"gamma", "delay=gamma(20ms,5ms)"},
      {"gamma-below-one", "delay=gamma(5ms,20ms) order=free"},
      {"histogram", "delay=histogram(1ms:3,1.5ms:40.25,2ms:10,3ms:0,4ms:0,10ms:3.5,40ms:0.25)"},
      {"mixture", "delay=mixture(2ms,3:10ms,1:3ms,0.5:40ms)"},
      {"samples", "delay=samples(1ms:1,2ms:3.5,9ms:0,20ms:4)"},
      {"rho", "delay=gamma(20ms,9ms) rho=0.95"},
      {"memory", "delay=lognormal(20ms,9ms) memory=15ms"},
      {"random-loss", "loss=7%"},
      {"burst-loss", "loss=burst(5%,4)"},
      {"gilbert-loss", "loss=gilbert(1%,20%,80%,0.5%)"},
      {"four-state-loss", "loss=fourstate(1%,20%,10%,30%,0.5%)"},
      {"pattern-loss", "loss=pattern(0010000)"},
      {"drop-rules", "drop(byte=0,mask=0x0f,value=0x03,50%) drop(byte=1,value=0x41)"},
      {"regimes",
       "regime(clear,dwell=500ms) regime(busy,dwell=300ms,delay=gamma(9ms,5ms),loss=burst(20%,3)) "
       "regime(out,dwell=100ms,loss=100%) rho=0.5"},
      {"events",
       "base=10ms step(at=500ms,5ms) ramp(from=1s,to=2s,-7ms) spike(every=700ms,for=50ms,30ms) "
       "stall(every=1100ms,for=90ms) "
       "handover(every=900ms,for=30ms,6ms) outage(at=2500ms,for=200ms)"},
      {"random-outages", "outage(clear=300ms,for=gamma(50ms,40ms)) outage(clear=1s,for=uniform(0ms,20ms))"},
      {"copies", "delay=uniform(0ms,30ms) duplicate=10% replay(10%,64) flip=10% truncate=10% rebind(every=300ms)"},
      {"jump", "base=5ms delay=gamma(10ms,3ms) jump(10%,5)"},
      {"rate", "rate=3Mbit/s queue=20kB overhead=28 delay=5ms"},
      {"opportunities", "opportunities(1,1,2,5,9,9,9,13) queue=30packets"},
  };
  for (const NamedProfile& named : named_profiles()) all.emplace_back(named.name, named.name);
  return all;
}

void write_decisions(const std::filesystem::path& file, const std::string& line) {
  std::ofstream out(file);
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    Injector injector(resolve_profile(line, direction), 42, 3, direction);
    out << to_string(injector.profile()) << "\ntables " << injector.table_hash() << "\n";
    // Traffic: intervals of 0 to 2 ms, random payloads of 2 to 1200 bytes.
    const Draws traffic(1, 0, direction);
    LocalTime now(std::chrono::seconds(5));
    for (std::uint64_t i = 0; i < kDatagrams; ++i) {
      const std::uint64_t draw = traffic(Purpose::kDelay, i);
      now += Duration(one_of(2'000'000, draw));
      const std::array<std::byte, 2> bytes = {static_cast<std::byte>(draw & 255),
                                              static_cast<std::byte>(draw >> 8 & 255)};
      const auto size = static_cast<std::uint32_t>(2 + (draw >> 16) % 1199);
      const Decision d = injector.decide({.arrival = now, .size = size, .bytes = bytes});
      out << d.index << ' ' << (d.arrival.time_since_epoch()).count() << ' ' << to_string(d.verdict) << ' '
          << to_string(d.cause) << ' ' << d.release.time_since_epoch().count();
      if (d.duplicate) out << " duplicate " << d.duplicate->time_since_epoch().count();
      if (d.stale) out << " stale " << d.stale->back << ' ' << d.stale->release.time_since_epoch().count();
      if (d.flipped_bit) out << " flipped " << *d.flipped_bit;
      if (d.truncated_to) out << " cut " << *d.truncated_to;
      if (d.rebinds > 0) out << " rebinds " << d.rebinds;
      out << '\n';
    }
  }
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

int main(int argc, char** argv) {
  const PlainUsage usage{.help =
                             "Usage: golden_decisions FOLDER\n\n"
                             "Write the decisions of the injector to FOLDER, one file for each profile.\n\n"
                             "Example: golden_decisions decisions && (cd decisions && sha256sum *.txt)\n"
                             "Exit: 0 success; 1 cannot write; 2 wrong usage.\n",
                         .most_arguments = 1};
  if (const auto code = answer(usage, argc, argv)) return *code;
  if (argc != 2) {
    std::cerr << "golden_decisions: expected one argument: the folder for the files\n\n" << usage.help;
    return 2;
  }
  try {
    std::filesystem::create_directories(argv[1]);
    for (const auto& [name, line] : profiles()) write_decisions(std::filesystem::path(argv[1]) / (name + ".txt"), line);
  } catch (const std::exception& error) {
    std::cerr << "golden_decisions: " << error.what() << "\n";
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace tendon::injector

int main(int argc, char** argv) { return tendon::injector::main(argc, argv); }

// SPDX-License-Identifier: Apache-2.0
// Measures how many sessions and how many devices a server can handle before it is overloaded (fleet.h).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "protocol/limits.h"
#include "tests/tools/bench/bare_traffic.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/fleet.h"

namespace tendon::bench {
namespace {

constexpr double kInTime = 99.5;
constexpr double kMostCores = 0.6;  // server's cores

double us(Duration d) { return 1e6 * seconds(d); }
double percent(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

BareResult floor_of(const Fleet& fleet, const FleetResult& result) {
  BareTraffic bare;
  bare.sessions = result.sessions;
  bare.period = from_seconds(1.0 / fleet.state_hz);
  bare.length = fleet.length / 2;
  bare.priority = fleet.priority;
  // Uses the datagrams that the server owed, not those it sent, so that an overloaded server gets no cheaper baseline.
  const double rounds = result.seconds * fleet.state_hz * static_cast<double>(result.sessions);
  const auto per_round = [&](std::uint64_t datagrams, double kept) {
    return static_cast<std::size_t>(std::max(1.0, std::round(static_cast<double>(datagrams) / rounds / kept)));
  };
  const double kept = std::max(0.01, percent(result.states_received, result.states_owed) / 100);
  bare.out_per_round = per_round(result.out_datagrams, std::min(1.0, kept));
  bare.out_bytes = result.out_datagrams > 0 ? result.out_bytes / result.out_datagrams : 100;
  bare.in_per_round = std::max<std::size_t>(1, per_round(result.in_datagrams, 1));
  bare.in_bytes = result.in_datagrams > 0 ? result.in_bytes / result.in_datagrams : 100;
  return run_bare(bare);
}

Duration server_time(const FleetResult& result) { return result.haptic + result.network + result.log; }

/// Age of a state when the client's kernel receives it, compared with a datagram that is sent immediately.
Row row_of(const Fleet& fleet, const FleetResult& result, const BareResult& bare, std::string what) {
  const double period = us(from_seconds(1.0 / fleet.state_hz));
  Row row{.section = {},
          .what = std::move(what),
          .unit = "µs",
          .n = result.state_age.count(),
          .p50 = us(result.state_age.quantile(0.5)),
          .p99 = us(result.state_age.quantile(0.99)),
          .floor = "the same datagrams, bare",
          .floor_p50 = us(bare.age.quantile(0.5)),
          .floor_p99 = us(bare.age.quantile(0.99)),
          .note = {}};
  if (*row.floor_p50 > 0) row.ratio = row.p50 / *row.floor_p50;
  const auto per_device = [&](Duration spent) {
    return us(spent) / (1000 * result.seconds) / static_cast<double>(fleet.devices);
  };
  const auto of_cores = [&](Duration spent) { return seconds(spent) / result.seconds; };
  const auto bare_cores = [&](Duration spent) { return seconds(spent) / std::max(1e-9, bare.seconds); };
  const double in_time = percent(result.answered_in_time, result.steps_owed);
  char note[600];
  std::snprintf(
      note, sizeof note,
      "p99 is %.0f %% of a period; states received %.1f %% of those owed, forces taken %.1f %% of those sent; %.2f %% "
      "of "
      "the steps overrun; %.0f + %.0f datagrams/s of %.0f/%.0f bytes, lost %llu; processors: haptic %.2f (%.2f µs a "
      "device and ms), network %.2f (%.2f), rest %.2f, guests %.2f; bare %.2f, guests %.2f; force's whole loop %.1f ms "
      "(p50), %.1f ms (p99); listening after %.0f ms, %.0f MB resident",
      100 * row.p99 / period, percent(result.states_received, result.states_owed),
      percent(result.forces_taken, result.forces_sent), percent(result.overruns, result.steps),
      static_cast<double>(result.out_datagrams) / result.seconds,
      static_cast<double>(result.in_datagrams) / result.seconds,
      static_cast<double>(result.out_bytes) / std::max(1.0, static_cast<double>(result.out_datagrams)),
      static_cast<double>(result.in_bytes) / std::max(1.0, static_cast<double>(result.in_datagrams)),
      static_cast<unsigned long long>(result.lost), of_cores(result.haptic), per_device(result.haptic),
      of_cores(result.network), per_device(result.network), of_cores(result.log), of_cores(result.guests),
      bare_cores(bare.host), bare_cores(bare.guests), 1e3 * seconds(result.loop_age.quantile(0.5)),
      1e3 * seconds(result.loop_age.quantile(0.99)), 1e3 * seconds(result.started),
      static_cast<double>(result.resident) / 1e6);
  row.note = note;
  row.figures = {{"devices", static_cast<double>(fleet.devices)},
                 {"answered_in_time_percent", in_time},
                 {"haptic_us", per_device(result.haptic)},
                 {"network_us", per_device(result.network)},
                 {"floor_us", 1e6 * bare_cores(bare.host) / 1000 / static_cast<double>(fleet.devices)},
                 {"server_cores", of_cores(server_time(result))},
                 {"floor_cores", bare_cores(bare.host)}};
  return row;
}

bool keeps_up(const FleetResult& result) {
  return result.all_came && percent(result.states_received, result.states_owed) >= 99 &&
         percent(result.forces_taken, result.forces_sent) >= 99 && result.overruns * 100 <= result.steps;
}

void came(const FleetResult& result, const std::string& what) {
  if (!result.all_came) {
    throw std::runtime_error(what + ": only " + std::to_string(result.sessions) + " sessions were opened in 20 s");
  }
}

}  // namespace

void measure_sessions(Run& run) {
  for (const std::uint32_t state_hz : {100U, 1000U}) {
    std::vector<std::size_t> counts = {50, 100, 200, 400, 800};
    if (run.options.quick) counts = {3};
    for (const std::size_t count : counts) {
      Fleet fleet;
      fleet.devices = std::min<std::size_t>(limits::kMaxDevices, count);
      fleet.channels = std::min<std::size_t>(limits::kMaxChannels, (count + fleet.devices - 1) / fleet.devices);
      fleet.sessions = count;
      fleet.state_hz = state_hz;
      fleet.force_hz = 100;
      fleet.seed = run.options.seed;
      fleet.priority = run.options.priority;
      if (run.options.quick) fleet.settle = std::chrono::milliseconds(20);
      fleet.length = std::chrono::milliseconds(run.options.quick ? 60 : 4000);
      const std::string what = std::to_string(count) + " sessions, states at " + std::to_string(state_hz) + " Hz";
      const FleetResult result = run_fleet(fleet);
      came(result, what);
      Row row = row_of(fleet, result, floor_of(fleet, result), what + ": age of a state");
      if (result.controllers < result.sessions) {
        row.note = std::to_string(result.controllers) + " controllers, the others observers; " + row.note;
      }
      const double period = us(from_seconds(1.0 / state_hz));
      if (count == 200) {
        row.target = Row::Target{"200 live, p99 below one period", keeps_up(result) && row.p99 < period};
      }
      run.add(row);
      if (percent(result.states_received, result.states_owed) < 90 && count >= 200) break;  // overloaded
    }
  }
}

void measure_512(Run& run) {
  std::vector<std::size_t> counts = {16, 64, 128, 256, 384, 512, 640, 768, 896, 1024};
  if (run.options.quick) counts = {32};
  std::size_t knee = 0;
  for (const std::size_t count : counts) {
    Fleet fleet;
    fleet.devices = count;
    fleet.one_session_for_16 = true;
    fleet.seed = run.options.seed;
    fleet.priority = run.options.priority;
    if (run.options.quick) fleet.settle = std::chrono::milliseconds(20);
    fleet.length = std::chrono::milliseconds(run.options.quick ? 60 : 4000);
    const std::string what = std::to_string(count) + " devices, states and forces at 1 kHz, sealed";
    const FleetResult result = run_fleet(fleet);
    came(result, what);
    Row row = row_of(fleet, result, floor_of(fleet, result), what + ": age of a state");
    const double in_time = percent(result.answered_in_time, result.steps_owed);
    const double cores = seconds(server_time(result)) / result.seconds;
    if (in_time >= kInTime) knee = count;
    char strict[120];
    std::snprintf(strict, sizeof strict, "answered in the next step %.2f %%; server %.2f cores; ", in_time, cores);
    row.note = strict + row.note;
    if (count == 512) {
      row.target = Row::Target{"512 live: 99.5 % answered in the next step, by 0.6 cores",
                               in_time >= kInTime && cores <= kMostCores};
    }
    const bool broken = in_time < 90;
    if (broken || count == counts.back()) {
      row.note = "the most of which 99.5 % are answered in the next step: " + std::to_string(knee) + "; " + row.note;
    }
    run.add(row);
    if (broken) break;
  }
}

}  // namespace tendon::bench

// SPDX-License-Identifier: Apache-2.0
//
// Compares the round trip of Tendon with that of other libraries, over the loopback. Each round measures all of them, with
// new processes. The baseline is bare UDP in the same round. All clients and servers block until a message arrives.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "protocol/secrets/suites.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/measure.h"
#include "tests/tools/bench/other_process.h"
#include "tests/tools/bench/peers/bare_udp.h"
#include "tests/tools/bench/peers/echo_client.h"
#include "tests/tools/bench/round_trip.h"
#include "tests/tools/sweep/child.h"

namespace tendon::bench {
namespace {

/// This program is only built if its package is found.
struct Program {
  const char* what;
  std::vector<std::string> command;
  const char* needs;
};
const std::vector<Program>& programs() {
  static const std::vector<Program> kPrograms = {
      {"Cyclone DDS", {"bench_peer_cyclone"}, "cyclonedds-dev and cyclonedds-tools"},
      {"Fast DDS", {"bench_peer_fast_dds"}, "libfastrtps-dev"},
      {"ZeroMQ over ipc", {"bench_peer_zeromq", "ipc"}, "libzmq3-dev"},
      {"ZeroMQ over tcp", {"bench_peer_zeromq", "tcp"}, "libzmq3-dev"},
      {"gRPC", {"bench_peer_grpc"}, "libgrpc++-dev and protobuf-compiler-grpc"},
      {"VRPN", {"bench_peer_vrpn"}, "-DTENDON_VRPN=, the path of its source"}};
  return kPrograms;
}

struct Peer {
  std::string name;
  std::function<EchoTimes(const Load&, std::string& name)> measure;
  bool is_tendon = false;
  std::vector<double> us{};
  std::vector<double> medians{};  ///< one per round
  std::uint64_t lost = 0;
};

/// See peers/CMakeLists.txt.
std::filesystem::path folder_of_programs() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path() / "tests";
}

EchoTimes run_program(std::vector<std::string> command, const Load& load, std::string& name) {
  const auto us = [](Duration d) {
    return std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(d).count());
  };
  command.front() = folder_of_programs() / command.front();
  for (const std::string& argument : {std::to_string(load.requests), std::to_string(load.warm_up), us(load.period),
                                      us(load.reply_delay), std::to_string(load.priority)}) {
    command.push_back(argument);
  }
  const sweep::ChildEnd end = sweep::run({.command = command});
  if (end.status != 0) throw std::runtime_error(command.front() + ": " + end.text() + ": " + end.errors);
  std::istringstream out(end.output);
  EchoTimes times;
  std::getline(out, name);
  out >> times.lost;
  for (double time = 0; out >> time;) times.us.push_back(time);
  if (times.us.size() + times.lost != load.requests)
    throw std::runtime_error(command.front() + ": expected " + std::to_string(load.requests) + " times");
  return times;
}

std::vector<Peer> present_peers() {
  std::vector<Peer> peers;
  peers.push_back({"UDP, bare datagrams",
                   [](const Load& load, std::string&) { return measure_echo(load, serve_udp, udp_client); }});
  for (const Program& program : programs()) {
    if (!std::filesystem::exists(folder_of_programs() / program.command.front())) {
      std::cerr << "left out: " << program.what << ", because " << program.command.front() << " is not built (requires "
                << program.needs << "; build the target bench_peers)\n";
      continue;
    }
    peers.push_back({program.what, [&program](const Load& load, std::string& name) {
                       return run_program(program.command, load, name);
                     }});
  }
  std::vector<std::optional<Suite>> suites = {std::nullopt};
  for (const Suite suite : suites_of_this_machine()) suites.emplace_back(suite);
  for (const std::optional<Suite>& suite : suites) {
    peers.push_back({.name = suite ? "Tendon, sealed by " + names_of({*suite}) : "Tendon, plain",
                     .measure =
                         [suite](const Load& load, std::string&) {
                           const auto client = tendon_echo_client(suite, load.reply_delay, load.priority);
                           const AtPriority high(load.priority);
                           return measure_echo(load, *client);
                         },
                     .is_tendon = true});
  }
  return peers;
}

/// The median over the rounds of a peer's median, relative to that of `unit` in the same round.
double relative(const Peer& peer, const Peer& unit, double q = 0.5) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < peer.medians.size(); ++i) ratios.push_back(peer.medians[i] / unit.medians[i]);
  return quantile(ratios, q);
}

std::string text(const char* format, double a, double b) {
  std::array<char, 96> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, a, b);
  return buffer.data();
}

/// Names the peers that are faster than Tendon.
std::string losses_of(const Peer& tendon, const std::vector<Peer>& peers) {
  std::string slower;
  for (const Peer& peer : peers) {
    const double ratio = relative(tendon, peer);
    if (peer.is_tendon || ratio <= 1) continue;
    slower += (slower.empty() ? "; slower than " : ", ") + peer.name.substr(0, peer.name.find(',')) +
              text(" (%.2f)", ratio, 0);
  }
  return slower;
}

Row row_of(const Peer& peer, const Peer& udp, const std::vector<Peer>& peers, const std::string& load) {
  const std::vector<double>& times = peer.us;
  const double most = quantile(times, 1);
  const double p999 = quantile(times, 0.999);
  Row row{.section = {},
          .what = peer.name + load,
          .unit = "µs",
          .n = times.size(),
          .p50 = quantile(times, 0.5),
          .p99 = quantile(times, 0.99),
          .floor = "bare UDP in the same round",
          .floor_p50 = quantile(udp.us, 0.5),
          .floor_p99 = quantile(udp.us, 0.99),
          .ratio = relative(peer, udp),
          .note = text("99.9 %%: %.0f, most: %.0f", p999, most) +
                  text("; ratio of a round: %.2f to %.2f", relative(peer, udp, 0), relative(peer, udp, 1))};
  if (peer.lost > 0) row.note += "; lost: " + std::to_string(peer.lost);
  if (peer.is_tendon) row.note += losses_of(peer, peers);
  row.figures = {{"p999", p999},
                 {"most", most},
                 {"least_ratio", relative(peer, udp, 0)},
                 {"largest_ratio", relative(peer, udp, 1)},
                 {"lost", static_cast<double>(peer.lost)}};
  return row;
}

}  // namespace

void measure_peers(Run& run) {
  const bool quick = run.options.quick;
  const int rounds = quick ? 1 : 5;
  const std::vector<Peer> present = present_peers();
  for (const bool paced : {false, true}) {
    const Load load{.requests = quick   ? 20U
                                : paced ? 2000U
                                        : 10000U,
                    .warm_up = quick ? 1U : 200U,
                    .period = paced ? Duration(std::chrono::milliseconds(1)) : Duration::zero(),
                    .reply_delay = run.options.reply_delay,
                    .priority = run.options.priority};
    std::vector<Peer> peers = present;
    for (int round = 0; round < rounds; ++round) {
      for (Peer& peer : peers) {
        const EchoTimes times = peer.measure(load, peer.name);
        if (times.us.empty()) throw std::runtime_error(peer.name + ": all replies were lost");
        peer.medians.push_back(quantile(times.us, 0.5));
        peer.us.insert(peer.us.end(), times.us.begin(), times.us.end());
        peer.lost += times.lost;
      }
    }
    for (const Peer& peer : peers) {
      run.add(row_of(peer, peers.front(), peers, paced ? ", at 1 kHz" : ", without pauses"));
    }
  }
}

}  // namespace tendon::bench

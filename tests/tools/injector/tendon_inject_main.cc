// SPDX-License-Identifier: Apache-2.0
// tendon-inject: a reproducible bad network as a UDP proxy. Options are in command_line.cc.
#include <cerrno>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "server/machine/regular_file.h"
#include "tests/support/files.h"
#include "tests/support/json_line.h"
#include "tests/tools/injector/command_line.h"
#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/injector/proxy/control_socket.h"
#include "tests/tools/injector/proxy/status.h"

namespace tendon::injector {
namespace {

/// Replaces the file, if it is a trace.
std::ofstream opened_trace(const std::filesystem::path& file) {
  expect_replaceable(file, {kTraceBegins});
  std::ofstream stream(file, std::ios::binary);
  if (!stream) {
    throw std::runtime_error("cannot write " + file.string() + ": " + std::generic_category().message(errno));
  }
  return stream;
}

Tap read_tap(const std::filesystem::path& file) {
  std::ifstream from = open_regular_file(file);
  return {.name = file.string(), .capture = read_capture(from, file.string())};
}

Trace imported(const ImportTask& task) {
  if (task.format == "pcap") {
    if (task.server.empty()) return import_echoes(read_tap(task.from), task.options);
    TwoTaps taps = import_two_taps(read_tap(task.from), read_tap(task.server), task.taps);
    std::cerr << taps.summary;
    return std::move(taps.trace);
  }
  std::ifstream from = open_regular_file(task.from);
  const std::string name = task.from.string();
  return task.format == "ping"   ? import_ping(from, name, task.options)
         : task.format == "irtt" ? import_irtt(from, name, task.options)
         : task.format == "csv"  ? import_csv(from, name, task.options)
                                 : import_mahimahi_log(from, name, task.options);
}

struct Runner {
  int operator()(const HelpTask& task) const {
    std::cout << task.text;
    return 0;
  }

  int operator()(const ProfilesTask& task) const {
    for (const NamedProfile& profile : named_profiles()) {
      if (task.json) {
        std::cout << JsonLine()
                         .add("name", profile.name)
                         .add("what", profile.what)
                         .add("source", profile.source)
                         .add("up", profile.up)
                         .add("down", profile.down)
                         .str()
                  << "\n";
      } else {
        std::cout << profile.name << "\n    " << profile.what << "\n    source: " << profile.source
                  << "\n    up:   " << profile.up << "\n    down: " << profile.down << "\n";
      }
    }
    return 0;
  }

  int operator()(const ControlTask& task) const {
    const std::string answer = ask_control_socket(task.socket, task.line);
    const bool refused = answer.starts_with("error: ");
    (refused ? std::cerr : std::cout) << answer << "\n";
    return refused ? 1 : 0;
  }

  int operator()(const DryTask& task) const {
    const PreparedNetwork network = prepare(task.network);
    std::ofstream file;
    std::optional<TraceWriter> trace;
    if (!task.record.empty()) {
      file = opened_trace(task.record);
      trace.emplace(file, network.header());
    }
    if (!task.run.json) std::cout << "seed " << network.seed << "\n";
    const auto [up, down] = dry_run(network, task.run, std::cout, trace ? &*trace : nullptr);
    if (network.replay && task.run.json) {
      const auto played = [](double times) { return std::move(JsonLine().add("played", with_decimals(times, 2))); };
      std::cout << JsonLine().add("event", "end").add("up", played(up)).add("down", played(down)).str() << "\n";
    } else if (network.replay) {
      std::cout << "played " << played_text(up) << " times up, " << played_text(down) << " times down\n";
    }
    file.flush();
    if (!std::cout || (trace && !file)) throw std::runtime_error("cannot write all of the output");
    return 0;
  }

  int operator()(const ImportTask& task) const {
    const Trace trace = imported(task);
    std::ofstream to = opened_trace(task.to);
    write_trace(to, trace);
    if (!to.flush()) throw std::runtime_error("cannot write " + task.to.string() + ": is the disk full?");
    std::cerr << import_summary(trace);
    if (task.server.empty() && task.options.share == Share::kHalves)
      std::cerr << "each delay is half of a round trip\n";
    std::cerr << "tendon-inject: replay with --replay " << task.to.string() << " --by time\n";
    return 0;
  }

  int operator()(const ExportTask& task) const {
    write_delays(std::cout, read_trace(task.trace));
    if (!std::cout.flush()) throw std::runtime_error("cannot write all of the output");
    return 0;
  }

  int operator()(const SelftestTask& task) const { return selftest(task.options, std::cout) ? 0 : 1; }

  int operator()(const LiveTask& task) const { return live_run(prepare(task.network), task.run); }
};

int main(int argc, char** argv) {
  try {
    return std::visit(Runner{}, parse_command_line(argc, argv));
  } catch (const std::invalid_argument& error) {
    std::cerr << "tendon-inject: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "tendon-inject: " << error.what() << "\n";
    return 1;
  }
}

}  // namespace
}  // namespace tendon::injector

int main(int argc, char** argv) { return tendon::injector::main(argc, argv); }

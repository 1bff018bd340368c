// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "tests/tools/injector/proxy/dry_run.h"
#include "tests/tools/injector/proxy/live_run.h"
#include "tests/tools/injector/proxy/prepared_network.h"
#include "tests/tools/injector/selftest/selftest.h"
#include "tests/tools/injector/traces/import.h"
#include "tests/tools/injector/traces/import_capture.h"

namespace tendon::injector {

struct LiveTask {
  NetworkOptions network;
  LiveRun run;
};
struct DryTask {
  NetworkOptions network;
  DryRun run;
  std::filesystem::path record;
};
struct ProfilesTask {
  bool json = false;
};
struct ControlTask {
  std::filesystem::path socket;
  std::string line;
};
struct ImportTask {
  std::string format;  ///< ping, irtt, csv, mahimahi or pcap
  std::filesystem::path from;
  std::filesystem::path server;  ///< a second capture, at the server
  std::filesystem::path to;
  ImportOptions options;
  TapOptions taps;
};
struct ExportTask {
  std::filesystem::path trace;
};
struct SelftestTask {
  SelftestOptions options;
};
struct HelpTask {
  std::string text;
};
using Task = std::variant<LiveTask, DryTask, ProfilesTask, ControlTask, ImportTask, ExportTask, SelftestTask, HelpTask>;

/// Throws std::invalid_argument that names the option, its value and the expected format.
Task parse_command_line(int argc, const char* const* argv);

}  // namespace tendon::injector

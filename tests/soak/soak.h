// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"

namespace tendon::soak {

/// A stress test of the server in real time:
///
///     server       tendond with a simulated Falcon at 1 kHz
///     engine       virtual_wall through tendon-inject, killed by SIGKILL after 0.2 to 3 s and restarted
///     visitors     observers that connect, receive a state, send Bye and reconnect elsewhere, `reconnects` in all
///     watcher      a permanent observer that checks every state (Watching)
///     recording    a second tendond without clients that records to /dev/null
///     full disk    a third tendond that records to a tmpfs of 256 kB (skipped without the right to mount)
///     wall clock   set forward or back by up to a day every 7 s for all servers (stepped_clock.cc)
///     hogs         one busy process on each processor for a third of the run
///     log          truncated while the server writes to it, as by logrotate's copytruncate
///
/// Checks that memory, files and threads of the servers and the proxy are flat (VitalSigns), that no program ends
/// early, that the haptic loop latches no fault, and that every visitor receives a state.
struct Config {
  std::filesystem::path folder;
  Duration duration = std::chrono::hours(1);
  std::uint64_t reconnects = 1'000'000;
  std::uint64_t seed = 1;
};

struct ProgramReport {
  std::string name;
  double mb_first = 0;  ///< resident memory after a fifth of the run
  double mb_last = 0;   ///< resident memory at the end
  std::size_t files = 0;
  std::size_t threads = 0;
};

struct Report {
  std::vector<std::string> broken;
  double duration_s = 0;
  std::uint64_t steps = 0;
  std::uint64_t overruns = 0;  ///< number of intervals that exceed two periods
  double longest_interval_ms = 0;
  std::uint64_t engines_killed = 0;
  std::uint64_t forces = 0;
  std::uint64_t sessions = 0;
  std::uint64_t vain = 0;  ///< number of visitors without a state after 10 s
  std::uint64_t states_watched = 0;
  double longest_silence_ms = 0;  ///< longest interval between two states at the watcher
  std::uint64_t clock_steps = 0;
  std::uint64_t log_rotations = 0;
  std::uint64_t log_bytes = 0;
  bool disk_was_full = false;
  std::vector<ProgramReport> programs;
};

/// `progress`: elapsed share of the run, in [0, 1]. Throws std::runtime_error if a program does not start or if the
/// folder is not empty.
Report run(const Config& config, const std::function<void(double)>& progress);

/// {"event":"soak", …} with all fields of the report.
std::string to_json(const Config& config, const Report& report);
std::string to_text(const Report& report);

}  // namespace tendon::soak

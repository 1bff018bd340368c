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

/// A server that is treated roughly, in real time:
///
///     server       tendond as it is, on a simulated Falcon at 1 kHz
///     engine       virtual_wall through tendon-inject, killed by SIGKILL after 0.2 to 3 s and started again
///     visitors     observers that come, see a state, say Bye and come again from elsewhere, `reconnects` in all
///     watcher      an observer that stays and holds every state against the promises (Watching)
///     recording    a second tendond, alone, that records to /dev/null
///     full disk    a third tendond that records to a tmpfs of 256 kB, which is soon full (skipped without mount rights)
///     wall clock   of all servers, set forward or back by up to a day every 7 s (stepped_clock.cc)
///     hogs         one process on each processor that only burns time, for a third of the run
///     log          of the server, truncated while it writes, as logrotate's copytruncate does
///
/// Asserts: memory, files and threads of the servers and the proxy are flat (VitalSigns); no program ends before it is
/// told to; the haptic loop latches no fault; every visitor sees a state.
struct Config {
  std::filesystem::path folder;  ///< of what it writes; made, or empty
  Duration duration = std::chrono::hours(1);
  std::uint64_t reconnects = 1'000'000;
  std::uint64_t seed = 1;
};

/// The vital signs of one program that must stay flat.
struct ProgramReport {
  std::string name;
  double mb_first = 0;  ///< resident memory after a fifth of the time …
  double mb_last = 0;   ///< … and at the end
  std::size_t files = 0;
  std::size_t threads = 0;
};

struct Report {
  std::vector<std::string> broken;  ///< what was not as it should be, in words
  double duration_s = 0;
  std::uint64_t steps = 0;     ///< of the server
  std::uint64_t overruns = 0;  ///< intervals of more than two periods
  double longest_interval_ms = 0;
  std::uint64_t engines_killed = 0;
  std::uint64_t forces = 0;  ///< that came to the server
  std::uint64_t sessions = 0;
  std::uint64_t vain = 0;  ///< visitors that saw no state in 10 s
  std::uint64_t states_watched = 0;
  double longest_silence_ms = 0;  ///< between two states of the watcher
  std::uint64_t clock_steps = 0;
  std::uint64_t log_rotations = 0;
  std::uint64_t log_bytes = 0;  ///< written in all
  bool disk_was_full = false;
  std::vector<ProgramReport> programs;
};

/// `progress` is called now and then with the share of the time that is over, in [0, 1]. Throws std::runtime_error when
/// it cannot begin: a program does not start, or the folder is not empty.
Report run(const Config& config, const std::function<void(double)>& progress);

/// {"event":"soak", …}: every field of the report.
std::string to_json(const Config& config, const Report& report);
/// The same for people, a line each.
std::string to_text(const Report& report);

}  // namespace tendon::soak

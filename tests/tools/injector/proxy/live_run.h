// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "clients/cpp/server_name.h"
#include "core/base/time.h"
#include "protocol/link.h"
#include "tests/tools/injector/proxy/prepared_network.h"
#include "tests/tools/injector/proxy/status.h"

namespace tendon::injector {

/// The measured virtual machines wake a thread about 35 µs after its timer (p50), so most releases are on time. This
/// uses at most 10 % of a core for a haptic loop at 1 kHz.
inline constexpr Duration kSpin = std::chrono::microseconds(50);

struct LiveRun {
  Address listen;
  ServerName server = Address{};  ///< its addresses are tried in turn until the server answers
  std::optional<Duration> duration;
  std::size_t max_clients = 64;
  Duration max_release_error = kMaxReleaseError;
  Duration spin = kSpin;
  std::optional<int> realtime;
  std::filesystem::path record;   ///< empty: no trace
  std::filesystem::path control;  ///< empty: no socket
  bool json = false;
};

/// Runs until the duration has elapsed, the replayed trace has ended (AtEnd::kStop), SIGINT or SIGTERM. The driver has
/// its own thread; this thread does the work that must not delay it (terminal, reports, control socket, building
/// tables). Resolves the server's name once at the start. Returns the exit code, which is 1 for an INVALID run. Throws
/// std::invalid_argument before the start for unusable addresses and files, and std::runtime_error for a name without
/// an address and for failures during the run.
int live_run(const PreparedNetwork& network, const LiveRun& options);

}  // namespace tendon::injector

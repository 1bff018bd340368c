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

/// A timer wakes its thread some 35 µs late on the virtual machines that we measured (p50): awake a little before, the
/// proxy releases most datagrams when they are due. For a haptic loop, 1 kHz each way, that is at most a tenth of a
/// core.
inline constexpr Duration kSpin = std::chrono::microseconds(50);

/// The proxy between real programs.
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

/// Runs until its duration is over, or SIGINT or SIGTERM comes: the driver in a thread of its own, and here all that
/// must not delay it: terminal or reports, control socket, the making of tables. Returns the exit code: 1 for a run
/// that was INVALID. Looks the server's name up once, before it begins. Throws std::invalid_argument before it has
/// begun, for addresses and files that cannot be used, and std::runtime_error for a name that has no address and for
/// what went wrong on the way.
int live_run(const PreparedNetwork& network, const LiveRun& options);

}  // namespace tendon::injector

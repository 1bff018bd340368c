// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/tools/injector/profile/scenario.h"
#include "tests/tools/injector/proxy/proxy.h"
#include "tests/tools/injector/traces/trace.h"
#include "tests/tools/injector/traces/trace_player.h"

namespace tendon::injector {

/// Which network, as users say it: a profile for both directions or one for each, or a scenario, or a trace.
struct NetworkOptions {
  std::string profile = {};
  std::string up = {};
  std::string down = {};
  std::filesystem::path scenario = {};
  std::filesystem::path replay = {};
  TracePlayer::By replay_by = TracePlayer::By::kIndex;
  std::optional<std::uint64_t> seed = {};
};

/// The same with all files read and all tables built.
struct PreparedNetwork {
  std::uint64_t seed = 0;
  std::array<Injector, 2> networks;  ///< by Direction
  std::array<std::string, 2> text;   ///< the profiles as lines; what is replayed, when a trace is
  std::vector<Proxy::Step> timeline;
  std::unique_ptr<const Trace> replay;
  TracePlayer::By replay_by = TracePlayer::By::kIndex;

  /// For a trace of what is decided with it.
  TraceHeader header() const;
};

/// Throws std::invalid_argument naming the option or file, the value and what was expected. Without
/// a seed in the options or the scenario, one is picked.
PreparedNetwork prepare(const NetworkOptions& options);

/// A change as a script or a command asks for it, made ready.
Proxy::PreparedChange prepare(const Change& change, std::uint64_t seed);

}  // namespace tendon::injector

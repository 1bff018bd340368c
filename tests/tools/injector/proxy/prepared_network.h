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

/// The network as given by the user: a profile for both directions, one for each, a scenario, or a trace, to which a
/// profile can be added.
struct NetworkOptions {
  std::string profile = {};
  std::string up = {};
  std::string down = {};
  std::filesystem::path scenario = {};
  std::filesystem::path replay = {};
  TracePlayer::By replay_by = TracePlayer::By::kIndex;
  std::optional<TracePlayer::AtEnd> at_end = {};
  std::string add = {};  ///< profile that follows the trace, or empty
  std::optional<std::uint64_t> seed = {};
};

/// All files are read and all tables built.
struct PreparedNetwork {
  std::uint64_t seed = 0;
  std::array<Injector, 2> networks;  ///< by Direction
  std::array<std::string, 2> text;   ///< the profiles as lines of text, or a description of the replayed trace
  std::vector<Proxy::Step> timeline;
  std::unique_ptr<const Trace> replay;
  Playback playback = {};

  TraceHeader header() const;
};

/// Throws std::invalid_argument that names the option or file, the value and the expected format. Picks a seed if none
/// is given.
PreparedNetwork prepare(const NetworkOptions& options);

Proxy::PreparedChange prepare(const Change& change, std::uint64_t seed);

}  // namespace tendon::injector

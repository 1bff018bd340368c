// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "tests/tools/injector/proxy/status.h"

namespace tendon::injector {

/// What stays the same for the whole run.
struct Heading {
  std::string listen;
  std::string server;
  std::uint64_t seed = 0;
  std::array<std::string, 2> profiles;  ///< that it began with, by Direction
  Duration max_release_error{};
};

/// What a terminal shows while the proxy runs, as lines no wider than `columns`: per direction the rate, the one-way
/// delays, losses, copies, and how late the proxy itself was, all since `before`; the totals by cause; clients, the
/// scenario's step, and what the user has typed so far on the last line.
std::string terminal_view(const Heading& heading, const Status& now, const Status& before, const std::string& typed,
                          std::size_t columns);

/// The same for a log: one line.
std::string log_line(const Status& now, const Status& before);

/// The whole run in words, with its verdict.
std::string end_text(const Heading& heading, const Status& end);

}  // namespace tendon::injector

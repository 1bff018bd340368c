// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "tests/tools/injector/proxy/status.h"

namespace tendon::injector {

struct Heading {
  std::string listen;
  std::string server;
  std::uint64_t seed = 0;
  std::array<std::string, 2> profiles;  ///< the initial ones, by Direction
  Duration max_release_error{};
};

/// Lines no wider than `columns`: for each direction the rate, one-way delays, losses, copies and release errors since
/// `before`, then totals by cause, clients and the scenario's step. The last line is the user's incomplete input.
std::string terminal_view(const Heading& heading, const Status& now, const Status& before, const std::string& typed,
                          std::size_t columns);

std::string log_line(const Status& now, const Status& before);

std::string end_text(const Heading& heading, const Status& end);

}  // namespace tendon::injector

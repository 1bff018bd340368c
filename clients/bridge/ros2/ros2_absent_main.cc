// SPDX-License-Identifier: Apache-2.0
// tendon-bridge ros2 in a build without DDS.
#include <CLI/CLI.hpp>
#include <stdexcept>

#include "clients/bridge/subcommands.h"

namespace tendon::bridge {

void add_ros2(CLI::App& app, Chosen& chosen) {
  CLI::App& ros2 =
      *app.add_subcommand("ros2", "Not included in this build: it needs cyclonedds-dev and cyclonedds-tools");
  ros2.allow_extras();
  ros2.callback([&chosen] {
    chosen = []() -> int {
      throw std::runtime_error(
          "ros2 is not included in this build: the Debian packages cyclonedds-dev and cyclonedds-tools were missing");
    };
  });
}

}  // namespace tendon::bridge

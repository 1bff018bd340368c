// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "clients/bridge/bridge_host.h"

namespace CLI {
class App;
}

namespace tendon::bridge {

/// Runs the subcommand after parsing. Returns the exit code, which is 1 if it throws (the error is printed to stderr).
using Chosen = std::function<int()>;

/// Adds the options of all bridges: --server, --key, --device, --channel, --take-lease, --observe, --json. The client
/// name sent to the server is "tendon-bridge" followed by the name of the subcommand.
void add_common(CLI::App& app, BridgeConfig& config);

// Each adds a subcommand, defined in FOLDER/…_main.cc, which sets `chosen` when it is selected.
void add_chai3d(CLI::App& app, Chosen& chosen);
void add_igtl(CLI::App& app, Chosen& chosen);
void add_inverse(CLI::App& app, Chosen& chosen);
void add_ros2(CLI::App& app, Chosen& chosen);
void add_vrpn(CLI::App& app, Chosen& chosen);

}  // namespace tendon::bridge
